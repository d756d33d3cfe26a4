#pragma once

#include <fmt/format.h>

#include <span>
#include <string>
#include <vector>

#include "export/c_library.hpp"
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
                  const std::vector<std::string>& inputs, bool sets_zeros = true)
      : library_(folder, c99_program(model, options, "test.safetensors"), options.name,
                 wrapper(options, model, inputs, sets_zeros)) {
    step_ = library_.symbol<Step>("around_step");
    self_test_ = library_.symbol<SelfTest>("around_self_test");
  }

  /// @param raw in SI, or in counts
  Estimate step(std::span<const double> raw) {
    double value = 0.0;
    double std_dev = 0.0;
    const int fault = step_(raw.data(), &value, &std_dev);
    return {.value = value, .std_dev = std_dev, .fault = static_cast<Fault>(fault)};
  }
  [[nodiscard]] double self_test() const { return self_test_(); }
  /// A command that lists the symbols that the program does not have.
  [[nodiscard]] const std::string& missing_symbols() const noexcept {
    return library_.missing_symbols();
  }

 private:
  using Step = int (*)(const double*, double*, double*);
  using SelfTest = double (*)();

  static std::string wrapper(const C99Options& options, const ModelFile& model,
                             const std::vector<std::string>& inputs, bool sets_zeros) {
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
      if (sets_zeros)
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

  CLibrary library_;
  Step step_ = nullptr;
  SelfTest self_test_ = nullptr;
};

}  // namespace torsio::test
