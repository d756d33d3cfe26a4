#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/output.hpp"
#include "data/arrays/mat.hpp"
#include "report/json_text.hpp"
#include "torsio/core/version.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/report/text_table.hpp"
#include "verbs.hpp"

namespace {

std::string instruction_sets() {
#if defined(__x86_64__)
  // NOLINTBEGIN(readability-implicit-bool-conversion): int with GCC, bool with Clang
  std::string text = "SSE2";
  if (__builtin_cpu_supports("ssse3") != 0) text += ", SSSE3";
  if (__builtin_cpu_supports("sse4.2") != 0) text += ", SSE4.2";
  if (__builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0)
    text += ", AVX2 with FMA";
  if (__builtin_cpu_supports("avx512f") != 0) text += ", AVX-512";
  // NOLINTEND(readability-implicit-bool-conversion)
  return text;
#elif defined(__aarch64__)
  return "NEON";
#else
  return "unknown";
#endif
}

/// The limit of a process as text.
std::string limit_text(__rlimit_resource resource, double unit, const char* name) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0) return "unknown";
  if (limit.rlim_cur == RLIM_INFINITY) return "unlimited";
  return fmt::format("{:.4g} {}", static_cast<double>(limit.rlim_cur) / unit, name);
}

bool may_use_realtime_priority() {
  rlimit limit{};
  return ::geteuid() == 0 || (::getrlimit(RLIMIT_RTPRIO, &limit) == 0 && limit.rlim_cur > 0);
}

bool is_realtime_kernel() {
  std::ifstream file("/sys/kernel/realtime");
  int value = 0;
  return file >> value && value == 1;
}

std::string memory_text() {
  constexpr double kMebi = 1024.0 * 1024.0;
  const auto page = static_cast<double>(::sysconf(_SC_PAGESIZE));
  return fmt::format("{:.0f} MiB, of them {:.0f} MiB free",
                     page * static_cast<double>(::sysconf(_SC_PHYS_PAGES)) / kMebi,
                     page * static_cast<double>(::sysconf(_SC_AVPHYS_PAGES)) / kMebi);
}

/// The first of some programs in PATH; empty: none.
std::string program_in_path(std::initializer_list<const char*> names) {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): the environment is not written
  const char* const path = std::getenv("PATH");
  for (std::string rest = path == nullptr ? "" : path; !rest.empty();) {
    const std::size_t end = rest.find(':');
    for (const char* name : names)
      if (const std::filesystem::path file = std::filesystem::path(rest.substr(0, end)) / name;
          ::access(file.c_str(), X_OK) == 0)
        return file.string();
    rest = end == std::string::npos ? "" : rest.substr(end + 1);
  }
  return {};
}

std::string data_text() {
  // NOLINTNEXTLINE(concurrency-mt-unsafe): the environment is not written
  const char* const folder = std::getenv("TORSIO_DATA");
  if (folder == nullptr) return "TORSIO_DATA is not set: no public recordings";
  return std::filesystem::is_directory(folder) ? folder : fmt::format("{}: no such folder", folder);
}

struct Found {
  std::string what;
  std::string found;
  std::string advice;  ///< empty: none
};

std::vector<Found> inspect() {
  utsname system{};
  (void)::uname(&system);
  const std::string browser = program_in_path(
      {"chromium", "firefox", "firefox-esr", "google-chrome", "brave-browser", "xdg-open"});
  std::vector<Found> machine;
  machine.push_back({"torsio", torsio::kVersion, ""});
  machine.push_back({"model files", fmt::format("format {}", torsio::kModelFormatVersion), ""});
  machine.push_back(
      {"kernel", fmt::format("{} {} {}", system.sysname, system.release, system.machine),
       is_realtime_kernel() ? ""
                            : "without PREEMPT_RT: expect late cycles (docs/robot/realtime.md)"});
  machine.push_back(
      {"processor",
       fmt::format("{} threads; {}", std::thread::hardware_concurrency(), instruction_sets()), ""});
  machine.push_back({"memory", memory_text(), ""});
  machine.push_back({"real-time priority", may_use_realtime_priority() ? "allowed" : "not allowed",
                     may_use_realtime_priority() ? "" : "rtprio in /etc/security/limits.conf"});
  machine.push_back(
      {"locked memory", limit_text(RLIMIT_MEMLOCK, 1024.0 * 1024.0, "MiB"),
       ::geteuid() == 0 ? "" : "a loop needs about 64 MiB: memlock in /etc/security/limits.conf"});
  machine.push_back({"recordings", data_text(), ""});
  machine.push_back({"browser", browser.empty() ? "none in PATH" : browser,
                     browser.empty() ? "reports are files: open them on another machine" : ""});
  const bool has_matlab = torsio::has_mat_library();
  machine.push_back({"MATLAB files", has_matlab ? "read by libmatio" : "libmatio is not installed",
                     has_matlab ? "" : "to read them: apt-get install libmatio11"});
  const std::string solver = program_in_path({"ccx"});
  machine.push_back(
      {"CalculiX", solver.empty() ? "none in PATH" : solver,
       solver.empty()
           ? "for design coupling and reproduce 003-coupling: apt-get install calculix-ccx"
           : ""});
  return machine;
}

void run(const JsonOutput& json) {
  require_writable(json.destination);
  torsio::TextTable table;
  table.header({"what", "found", "advice"});
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const Found& each : inspect()) {
    table.row({each.what, each.found, each.advice});
    rows.push_back({{"what", each.what},
                    {"found", each.found},
                    {"advice", each.advice.empty() ? nlohmann::ordered_json(nullptr)
                                                   : nlohmann::ordered_json(each.advice)}});
  }
  if (json.wants_tables()) print(table.text());
  json.write(torsio::json_text(nlohmann::ordered_json{{"machine", std::move(rows)}}));
}

}  // namespace

void add_doctor(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("doctor",
                                      "what this machine has for torsio: processor, real-time "
                                      "permissions, memory, browser, other programs");
  verb->footer("Example: torsio doctor");
  auto json = std::make_shared<JsonOutput>();
  json->add(*verb, "the table");
  verb->callback([json] { run(*json); });
}
