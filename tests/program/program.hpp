#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "support/temporary_folder.hpp"

namespace torsio::test {

inline constexpr int kWorkFailed = 1;
inline constexpr int kCallWasWrong = 2;

/// What one call of the program did.
struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

/// The built program, run through the shell in a folder of its own.
class Program : public testing::Test {
 protected:
  // Outcomes of studies that other calls kept must not be found.
  Program() { ::setenv("XDG_CACHE_HOME", folder_.path("cache").c_str(), 1); }

  /// `arguments` as they would be typed after "torsio".
  Outcome torsio(const std::string& arguments) {
    return shell(std::string(TORSIO_PROGRAM) + " " + arguments);
  }

  /// Any shell command; {torsio} is replaced by the program.
  Outcome shell(std::string command) {
    const std::string name = "{torsio}";
    if (const std::size_t at = command.find(name); at != std::string::npos)
      command.replace(at, name.size(), TORSIO_PROGRAM);
    const std::string line = "cd '" + folder_.path("") + "' && { " + command + "; } >'" +
                             folder_.path("out.txt") + "' 2>'" + folder_.path("err.txt") +
                             "' </dev/null";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents("out.txt"), contents("err.txt")};
  }

  [[nodiscard]] std::string contents(const std::string& file) const {
    std::ostringstream text;
    text << std::ifstream(folder_.path(file), std::ios::binary).rdbuf();
    return text.str();
  }

  TemporaryFolder folder_;
};

}  // namespace torsio::test
