#pragma once

#include <dlfcn.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "support/temporary_folder.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/export/c99.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio::test {

/// A model as a C program, compiled with every warning as an error and loaded.
class ExportedProgram {
 public:
  /// @param inputs of the model; those of `options.counts` are given as counts
  ExportedProgram(const TemporaryFolder& folder, const ModelFile& model, const C99Options& options,
                  const std::vector<std::string>& inputs) {
    const C99Program program = c99_program(model, options, "test.safetensors");
    folder.file(options.name + ".h", program.header);
    const std::string source = folder.file(options.name + ".c", program.source);
    const std::string around = folder.file("around.c", wrapper(options, model, inputs));
    const std::string object = folder.path(options.name + ".o");
    const std::string library = folder.path(options.name + ".so");
    run(
        fmt::format("{} -std=c99 -O2 -pedantic -Wall -Wextra -Wconversion -Wdouble-promotion "
                    "-Werror -ffreestanding "
                    "-ffp-contract=off -fPIC -D{}_SELF_TEST -c {} -o {}",
                    TORSIO_CC, upper(options.name), source, object));
    run(fmt::format("{} -std=c99 -O2 -fPIC -shared -D{}_SELF_TEST -I{} {} {} -o {}", TORSIO_CC,
                    upper(options.name), folder.path("."), around, object, library));
    symbols_ = fmt::format("{} -u {}", TORSIO_NM, object);
    handle_ = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    EXPECT_NE(handle_, nullptr) << dlerror();
    step_ = reinterpret_cast<Step>(dlsym(handle_, "around_step"));
    self_test_ = reinterpret_cast<SelfTest>(dlsym(handle_, "around_self_test"));
    state_bytes_ = *static_cast<const std::uint32_t*>(dlsym(handle_, "around_state_bytes"));
    EXPECT_EQ(state_bytes_, program.state_bytes);
  }
  ~ExportedProgram() {
    if (handle_ != nullptr) dlclose(handle_);
  }
  ExportedProgram(const ExportedProgram&) = delete;
  ExportedProgram& operator=(const ExportedProgram&) = delete;

  /// @param raw in SI, or in counts
  Estimate step(std::span<const double> raw) {
    double value = 0.0;
    double std_dev = 0.0;
    const int fault = step_(raw.data(), &value, &std_dev);
    return {.value = value, .std_dev = std_dev, .fault = static_cast<Fault>(fault)};
  }
  [[nodiscard]] double self_test() const { return self_test_(); }
  /// A command that lists the symbols that the program does not have.
  [[nodiscard]] const std::string& missing_symbols() const noexcept { return symbols_; }

 private:
  using Step = int (*)(const double*, double*, double*);
  using SelfTest = double (*)();

  static std::string upper(std::string text) {
    for (char& letter : text)
      letter = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
    return text;
  }
  static void run(const std::string& command) {
    EXPECT_EQ(std::system(command.c_str()), 0)
        << command;  // NOLINT(concurrency-mt-unsafe,cert-env33-c)
  }
  static std::string wrapper(const C99Options& options, const ModelFile& model,
                             const std::vector<std::string>& inputs) {
    const std::string real = options.real == CReal::single ? "float" : "double";
    std::string arguments;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      bool is_counted = false;
      for (const CCounts& counts : options.counts)
        is_counted = is_counted || counts.channel == inputs[i];
      arguments += fmt::format(", ({})raw[{}]", is_counted ? "int32_t" : real, i);
    }
    std::string zeros;
    for (const std::string& channel : model.settings.zeroed_channels)
      zeros +=
          fmt::format("  if (!is_ready) {0}_set_zero_{1}(&state, 0);\n", options.name, channel);
    return fmt::format(R"c(#include "{0}.h"
static {0}_state state;
static int is_ready;
const uint32_t around_state_bytes = sizeof state;
int around_step(const double *raw, double *value, double *std_dev) {{
  {0}_estimate estimate;
{2}  is_ready = 1;
  estimate = {0}_step(&state{1});
  *value = estimate.value;
  *std_dev = estimate.std_dev;
  return estimate.fault;
}}
double around_self_test(void) {{ return {0}_self_test(); }}
)c",
                       options.name, arguments, zeros);
  }

  void* handle_ = nullptr;
  Step step_ = nullptr;
  SelfTest self_test_ = nullptr;
  std::uint32_t state_bytes_ = 0;
  std::string symbols_;
};

}  // namespace torsio::test
