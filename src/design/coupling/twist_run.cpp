#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "torsio/core/error.hpp"
#include "torsio/design/coupling/lobe.hpp"

namespace torsio::design {
namespace {

constexpr int kNotInstalled = 127;

/// A folder that is removed with everything in it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "torsio_ccx_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw Error({.place = name, .problem = "cannot make a temporary folder"});
    path_ = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

struct Exit {
  int code = 0;
  int signal = 0;
  bool out_of_time = false;
};

/// Only calls that are allowed between fork and exec.
[[noreturn]] void become_solver(const char* folder, char* const* arguments, rlim_t bytes) {
  const rlimit memory = {bytes, bytes};
  const int log = ::chdir(folder) == 0 ? ::open("log", O_WRONLY | O_CREAT | O_TRUNC, 0600) : -1;
  if (log < 0 || ::setrlimit(RLIMIT_AS, &memory) != 0) ::_exit(kNotInstalled - 1);
  ::dup2(log, STDOUT_FILENO);
  ::dup2(log, STDERR_FILENO);
  ::execvp(arguments[0], arguments);
  ::_exit(kNotInstalled);
}

Exit run(const std::filesystem::path& folder, const SolverLimits& limits,
         const std::stop_token& stop) {
  std::array<std::string, 6> words{
      "env", "OMP_NUM_THREADS=1", "OPENBLAS_NUM_THREADS=1", limits.program, "-i", "lobe"};
  std::array<char*, words.size() + 1> arguments{};
  std::ranges::transform(words, arguments.begin(), [](std::string& word) { return word.data(); });
  const std::string directory = folder.string();
  const pid_t child = ::fork();
  if (child < 0) throw Error({.place = limits.program, .problem = "cannot start a process"});
  if (child == 0)
    become_solver(directory.c_str(), arguments.data(),
                  static_cast<rlim_t>(limits.memory_MiB) << 20);
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(limits.time_s);
  Exit result;
  int status = 0;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    result.out_of_time = Clock::now() >= end;
    if (result.out_of_time || stop.stop_requested()) ::kill(child, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (WIFEXITED(status)) result.code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  return result;
}

/// Cause of a run that did not reach every twist, from its log and its end.
std::string cause(const Exit& exit, const std::string& log, const std::filesystem::path& folder,
                  const SolverLimits& limits) {
  std::error_code ignored;
  const auto has = [&](const char* words) { return log.find(words) != std::string::npos; };
  if (exit.out_of_time) return fmt::format("stopped at the limit of {} s", limits.time_s);
  if (std::filesystem::space(folder, ignored).available < (1U << 20)) return "the disk is full";
  if (has("nonpositive jacobian")) return "an element is inverted";
  if (has("increment size smaller") || has("too many cutbacks")) return "no convergence";
  if (const std::size_t at = log.find("*ERROR"); at != std::string::npos)
    return "the solver reports " + log.substr(at, log.find('\n', at) - at);
  if (exit.signal != 0) return fmt::format("the solver was killed by signal {}", exit.signal);
  return fmt::format("the solver ended with exit code {}", exit.code);
}

}  // namespace

TwistCurve twist_lobe(const LobeMesh& mesh, const Rubber& rubber,
                      const std::vector<double>& twists_deg, const SolverLimits& limits,
                      const std::stop_token& stop) {
  const TemporaryFolder folder;
  const std::filesystem::path input = folder.path() / "lobe.inp";
  std::ofstream file(input);
  file << twist_deck(mesh, rubber, twists_deg);
  file.close();
  if (!file)
    throw Error({.place = input.string(),
                 .problem = "cannot write the solver's input",
                 .advice = "free space on the disk, or set TMPDIR"});
  const Exit exit = run(folder.path(), limits, stop);
  if (stop.stop_requested()) throw Cancelled();
  if (exit.code == kNotInstalled)
    throw Error({.place = limits.program,
                 .problem = "the solver is not installed",
                 .advice = "install CalculiX: apt-get install calculix-ccx"});
  TwistCurve curve = read_twists(mesh, twists_deg, text_of(folder.path() / "lobe.dat"));
  if (!curve.stopped_by.empty())
    curve.stopped_by += "; " + cause(exit, text_of(folder.path() / "log"), folder.path(), limits);
  return curve;
}

}  // namespace torsio::design
