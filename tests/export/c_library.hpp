#pragma once

#include <dlfcn.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "support/temporary_folder.hpp"
#include "torsio/export/c99.hpp"

namespace torsio::test {

/// An exported program, compiled with every warning as an error and loaded together with a C file around it, which has
/// the size of the state as `around_state_bytes`.
class CLibrary {
 public:
  CLibrary(const TemporaryFolder& folder, const C99Program& program, const std::string& name,
           const std::string& around) {
    folder.file(name + ".h", program.header);
    const std::string source = folder.file(name + ".c", program.source);
    const std::string wrapper = folder.file("around.c", around);
    const std::string object = folder.path(name + ".o");
    const std::string library = folder.path(name + ".so");
    run(
        fmt::format("{} -std=c99 -O2 -pedantic -Wall -Wextra -Wconversion -Wdouble-promotion "
                    "-Werror -ffreestanding "
                    "-ffp-contract=off -fPIC -D{}_SELF_TEST -c {} -o {}",
                    TORSIO_CC, upper(name), source, object));
    run(fmt::format("{} -std=c99 -O2 -fPIC -shared -D{}_SELF_TEST -I{} {} {} -o {}", TORSIO_CC,
                    upper(name), folder.path("."), wrapper, object, library));
    missing_symbols_ = fmt::format("{} -u {}", TORSIO_NM, object);
    handle_ = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    EXPECT_NE(handle_, nullptr) << dlerror();
    EXPECT_EQ(*symbol<const std::uint32_t*>("around_state_bytes"), program.state_bytes);
  }
  ~CLibrary() {
    if (handle_ != nullptr) dlclose(handle_);
  }
  CLibrary(const CLibrary&) = delete;
  CLibrary& operator=(const CLibrary&) = delete;

  /// A function or a variable of the library.
  template <class T>
  [[nodiscard]] T symbol(const char* name) const {
    return reinterpret_cast<T>(dlsym(handle_, name));
  }
  /// A command that lists the symbols that the program does not have.
  [[nodiscard]] const std::string& missing_symbols() const noexcept { return missing_symbols_; }

 private:
  static std::string upper(std::string text) {
    for (char& letter : text)
      letter = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
    return text;
  }
  static void run(const std::string& command) {
    EXPECT_EQ(std::system(command.c_str()), 0)
        << command;  // NOLINT(concurrency-mt-unsafe,cert-env33-c)
  }

  void* handle_ = nullptr;
  std::string missing_symbols_;
};

}  // namespace torsio::test
