#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/export/fmu.hpp"

namespace torsio {
namespace {

/// A folder that is removed with everything in it.
class CompileFolder {
 public:
  CompileFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "torsio_fmu_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      throw Error({.place = name,
                   .problem = "cannot make a temporary folder",
                   .advice = "Free space on the disk, or set TMPDIR."});
    path_ = name;
  }
  CompileFolder(const CompileFolder&) = delete;
  CompileFolder& operator=(const CompileFolder&) = delete;
  ~CompileFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

std::string bytes_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The command with further arguments. @returns what it printed
std::string output_of_compiler(const std::string& compiler,
                               const std::vector<std::string>& arguments,
                               const CompileFolder& folder) {
  std::istringstream split(compiler);
  std::vector<std::string> words{std::istream_iterator<std::string>(split), {}};
  if (words.empty())
    throw UsageError({.place = "the C compiler", .expected = "a command, such as cc", .found = ""});
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> raw;
  raw.reserve(words.size() + 1);
  for (std::string& word : words) raw.push_back(word.data());
  raw.push_back(nullptr);
  const std::string log = folder.file("log");
  posix_spawn_file_actions_t actions{};
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
  ::posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int failure = ::posix_spawnp(&child, raw.front(), &actions, nullptr, raw.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failure != 0)
    throw Error({.place = words.front(),
                 .problem = fmt::format("the C compiler cannot be run: {}",
                                        std::generic_category().message(failure)),
                 .advice = "Install one (Debian: gcc), name it in CC, or write the FMU without "
                           "--compile: its importer then has to compile the sources."});
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  std::string text = bytes_of(log);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw Error({.place = compiler, .problem = "the C compiler failed:\n" + text});
  return text;
}

/// The processor of an ELF library as FMI 3 names it, empty if it has no name for it. The compiler's -dumpmachine does not
/// depend on options such as -m32.
std::string processor_of(const std::string& library) {
  constexpr std::size_t kHeadBytes = 20;
  if (library.size() < kHeadBytes ||
      !library.starts_with("\x7f"
                           "ELF") ||
      library[5] != 1)
    return {};
  const bool is_64 = library[4] == 2;
  switch (static_cast<unsigned char>(library[18]) + 256 * static_cast<unsigned char>(library[19])) {
    case 3: return "x86";
    case 40: return "aarch32";
    case 62: return is_64 ? "x86_64" : "";
    case 183: return is_64 ? "aarch64" : "";
    case 243: return is_64 ? "riscv64" : "riscv32";
    default: return {};
  }
}

/// The folder of a library for Linux.
std::string platform_of(const std::string& processor, FmiVersion version) {
  if (version == FmiVersion::three && !processor.empty()) return processor + "-linux";
  if (processor == "x86_64") return "linux64";
  if (processor == "x86") return "linux32";
  throw Error({.place = "an FMU with a compiled library",
               .expected = version == FmiVersion::two
                               ? "a compiler for x86 or x86_64: FMI 2 has no folder for others"
                               : "a compiler for x86, x86_64, ARM or RISC-V",
               .found = processor.empty() ? "another processor" : processor,
               .advice = version == FmiVersion::two ? "Take --fmi 3, or leave out --compile."
                                                    : "Leave out --compile."});
}

}  // namespace

void compile_fmu(Fmu& fmu, const std::string& compiler) {
  const CompileFolder folder;
  std::string machine = output_of_compiler(compiler, {"-dumpmachine"}, folder);
  machine.erase(machine.find_last_not_of(" \r\n") + 1);
  if (machine.find("linux") == std::string::npos)
    throw Error({.place = "an FMU with a compiled library",
                 .expected = "a compiler for Linux",
                 .found = machine,
                 .advice = "Leave out --compile."});
  std::vector<std::string> arguments{"-std=c99",
                                     "-O2",
                                     "-ffp-contract=off",
                                     "-fPIC",
                                     "-shared",
                                     "-fvisibility=hidden",
                                     "-o",
                                     folder.file("library")};
  for (const FmuFile& file : fmu.files) {
    if (!file.path.starts_with("sources/")) continue;
    const std::string path = folder.file(file.path.substr(file.path.find('/') + 1));
    std::ofstream(path, std::ios::binary) << file.bytes;
    if (path.ends_with(".c")) arguments.push_back(path);
  }
  static_cast<void>(output_of_compiler(compiler, arguments, folder));
  const std::string library = bytes_of(folder.file("library"));
  fmu.platform = platform_of(processor_of(library), fmu.version);
  fmu.files.push_back({fmt::format("binaries/{}/{}.so", fmu.platform, fmu.name), library});
}

}  // namespace torsio
