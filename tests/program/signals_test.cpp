// One SIGINT or SIGTERM ends every verb, family and wait within two seconds, by that signal, and
// leaves neither a half-written nor a replaced file.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <ostream>
#include <thread>
#include <tuple>

#include "program/program.hpp"
#include "realtime/block_format.hpp"

namespace torsio::test {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr auto kMaxUntilTheEnd = milliseconds(2000);
constexpr auto kMaxUntilTheStart = std::chrono::seconds(60);  // with sanitizers on a busy machine

struct Job {
  std::string_view name;
  /// Arguments of the program; `pipe` has no writer, `held` has one that writes nothing.
  const char* arguments;
  milliseconds before_the_signal{300};  ///< since it catches signals
  const char* first = nullptr;          ///< a call that makes a file for it
};

std::ostream& operator<<(std::ostream& out, const Job& job) { return out << job.name; }

constexpr std::array kJobs{
    Job{"check_of_a_pipe", "check pipe"},
    Job{"check_of_a_silent_pipe", "check held"},
    Job{"check_of_a_manifest_pipe", "check pipe.yaml"},
    Job{"check_with_advice", "check long.csv --advise", milliseconds(1000),
        "simulate dfki-50 sweep --duration 2400s -o long.csv"},
    Job{"fit_with_a_mapping_pipe", "fit a.csv --model linear --mapping pipe -o out"},
    Job{"fit_with_a_silent_mapping", "fit a.csv --model linear --mapping held -o out"},
    Job{"simulate_with_a_fault_pipe", "simulate dfki-50 sweep --faults held -o out"},
    Job{"import_of_a_pipe", "import pipe --inputs a_rad --rate 100Hz -o out"},
    Job{"track_of_a_replayed_pipe", "track --reference replay --replay pipe --json out"},
    Job{"simulate_into_a_pipe", "simulate dfki-50 sweep --duration 1s -o pipe"},
    Job{"simulate_for_hours", "simulate dfki-50 sweep --duration 36000s -o out"},
    Job{"unpack_of_a_sparse_file", "unpack sparse.tsr -o out"},
    Job{"compare_of_all", "compare a.csv --test b.csv --models all --json out"},
    Job{"crossvalidate_of_all", "crossvalidate a.csv b.csv --models all --json out"},
    Job{"attribute",
        "attribute m.safetensors a.csv --windows 20000 --background 2000 --window 0.1s --json out",
        milliseconds(300), "fit a.csv --model polynomial -o m.safetensors"},
    Job{"adapt", "adapt m.safetensors a.csv --method rls --set forgetting=0.999 -o out",
        milliseconds(300),
        "fit a.csv --model mlp --set layers=3000 --set epochs=1 -o m.safetensors"},
    Job{"track_for_an_hour", "track --duration 3600s --json out"},
    Job{"reproduce", "reproduce 001-models --json out"},
    Job{"fit_of_arx", "fit a.csv --model arx --set input_lags=500 --set output_lags=500 -o out"},
    Job{"fit_of_parametric_gp",
        "fit a.csv --model parametric_gp --set inducing_points=4096 -o out"},
    Job{"fit_of_parametric_gp_variational",
        "fit a.csv --model parametric_gp_variational --set inducing_points=4096 -o out"},
    Job{"fit_of_narx_parametric_gp",
        "fit a.csv --model narx_parametric_gp --set inducing_points=4096 -o out"},
    Job{"fit_of_narx_parametric_gp_variational",
        "fit a.csv --model narx_parametric_gp_variational --set inducing_points=4096 -o out"},
    Job{"fit_of_dynamic_bouc_wen", "fit a.csv --model dynamic_bouc_wen --set substeps=1000 -o out"},
    Job{"fit_of_dgmm",
        "fit a.csv --model dgmm --set components=2000 --set novelty_distance=0.01 --set "
        "em_iterations=10000 -o out"},
    Job{"fit_of_narx_dgmm", "fit a.csv --model narx_dgmm --set em_iterations=10000 -o out"},
    Job{"fit_of_lstm", "fit a.csv --model lstm --set epochs=10000 -o out"},
    Job{"fit_of_gaussian_process", "fit a.csv --model gaussian_process -o out"},
    Job{"fit_of_narx_polynomial",
        "fit a.csv --model narx_polynomial --set degree=3 --set input_lags=10 --set output_lags=10 "
        "--set terms=100 -o out"},
};

struct Signal {
  int number;
  const char* name;
};
std::ostream& operator<<(std::ostream& out, const Signal& signal) { return out << signal.name; }
constexpr std::array kSignals{Signal{SIGINT, "SIGINT"}, Signal{SIGTERM, "SIGTERM"}};

/// A series-elastic joint with friction, driven by a chirp: 20 s at 1 kHz.
std::string recording(double phase_rad) {
  std::string text = "t_s,gear_angle_rad,joint_angle_rad,torque_Nm\n";
  for (int n = 0; n < 20000; ++n) {
    const double t_s = n * 1e-3;
    const double deflection_rad = 0.01 * std::sin(phase_rad + t_s * (1.0 + 0.4 * t_s));
    const double joint_rad = 0.3 * std::sin(0.5 * t_s + phase_rad);
    const double torque_Nm = 300.0 * deflection_rad + 0.2 * std::sin(37.0 * t_s) +
                             (std::cos(phase_rad + t_s * (1.0 + 0.4 * t_s)) > 0.0 ? 0.5 : -0.5);
    for (const double value : {t_s, joint_rad + deflection_rad, joint_rad, torque_Nm})
      text += std::to_string(value) + (value == torque_Nm ? "\n" : ",");
  }
  return text;
}

/// Two frames of a recorder that lie far apart: all rows between them are nan.
std::string sparse_recording() {
  constexpr std::int64_t kApart = 60'000'000;
  std::vector<std::byte> block;
  std::string file;
  const auto append = [&] {
    file.append(reinterpret_cast<const char*>(block.data()), block.size());
  };
  seal(RecordingHeader{.channels = {"torque_Nm"}, .period_s = 1e-3}, block);
  append();
  seal(FrameBlock{.ticks = {0, kApart}, .values = {1.0, 2.0}, .dropped = kApart - 1}, 1, block);
  append();
  return file;
}

class Interruption : public Program, public testing::WithParamInterface<std::tuple<Job, Signal>> {
 protected:
  void SetUp() override {
    folder_.file("a.csv", recording(0.0));
    folder_.file("b.csv", recording(1.0));
    folder_.file("sparse.tsr", sparse_recording());
    folder_.file("out", kPrecious);
    for (const char* name : {"pipe", "pipe.yaml", "held"})
      ASSERT_EQ(::mkfifo(folder_.path(name).c_str(), 0600), 0);
    held_ = ::open(folder_.path("held").c_str(), O_RDWR | O_CLOEXEC);
    ASSERT_GE(held_, 0);
  }
  void TearDown() override {
    if (held_ >= 0) ::close(held_);
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      ::waitpid(child_, nullptr, 0);
    }
  }

  void start(const std::string& arguments) {
    const std::string line = "cd '" + folder_.path("") + "' && exec " + TORSIO_PROGRAM + " " +
                             arguments + " >out.txt 2>err.txt </dev/null";
    child_ = ::fork();
    ASSERT_GE(child_, 0);
    if (child_ > 0) return;
    ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    ::_exit(127);
  }

  /// Whether the program has a handler for the signal: the shell before it has none.
  [[nodiscard]] bool catches(int signal) const {
    std::ifstream status("/proc/" + std::to_string(child_) + "/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("SigCgt:"))
        return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1U) != 0U;
    return false;
  }

  /// @returns whether it has ended within that time; its status is then `status_`.
  bool ends_within(Clock::duration most) {
    const auto end = Clock::now() + most;
    do {
      if (::waitpid(child_, &status_, WNOHANG) == child_) {
        child_ = 0;
        return true;
      }
      std::this_thread::sleep_for(milliseconds(5));
    } while (Clock::now() < end);
    return false;
  }

  static constexpr const char* kPrecious = "precious";
  ::pid_t child_ = 0;
  int status_ = 0;
  int held_ = -1;
};

TEST_P(Interruption, EndsTheProgramWithinTwoSeconds) {
  const auto& [job, signal] = GetParam();
  if (job.first != nullptr) {
    ASSERT_EQ(torsio(job.first).exit_code, 0) << contents("err.txt");
  }
  // A stopped fit of a network leaves its checkpoint.
  const auto files = [this] { return shell("ls -A --ignore='*.checkpoint'").out; };
  const std::string before = files();
  start(job.arguments);
  const auto latest = Clock::now() + kMaxUntilTheStart;
  while (!catches(signal.number) && Clock::now() < latest)
    ASSERT_FALSE(ends_within(milliseconds(0))) << contents("err.txt");
  ASSERT_FALSE(ends_within(job.before_the_signal))
      << "the job was over before the signal: " << contents("err.txt");

  ASSERT_EQ(::kill(child_, signal.number), 0);
  ASSERT_TRUE(ends_within(kMaxUntilTheEnd));
  EXPECT_TRUE(WIFSIGNALED(status_)) << "exit code " << WEXITSTATUS(status_);
  EXPECT_EQ(WTERMSIG(status_), signal.number);
  EXPECT_NE(contents("err.txt").find("stopped on request"), std::string::npos)
      << contents("err.txt");
  EXPECT_EQ(contents("out"), kPrecious);
  EXPECT_EQ(files(), before);
}

INSTANTIATE_TEST_SUITE_P(Jobs, Interruption,
                         testing::Combine(testing::ValuesIn(kJobs), testing::ValuesIn(kSignals)),
                         [](const auto& run) {
                           return std::string(std::get<0>(run.param).name) + "_" +
                                  std::get<1>(run.param).name;
                         });

}  // namespace
}  // namespace torsio::test
