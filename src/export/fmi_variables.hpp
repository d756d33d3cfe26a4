#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "torsio/export/fmu.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// The variables of an FMU in the order of their value references, and what its texts name: time, inputs, zeros, value,
/// std_dev, fault.
struct FmiVariables {
  std::vector<std::string> inputs;  ///< channels
  std::vector<std::string> zeros;   ///< channels that have a zero
  std::string target;               ///< name of the value
  double period_s = 0.0;

  [[nodiscard]] static std::size_t first_input() noexcept { return 1; }
  [[nodiscard]] std::size_t first_zero() const noexcept { return 1 + inputs.size(); }
  [[nodiscard]] std::size_t value() const noexcept { return first_zero() + zeros.size(); }
  [[nodiscard]] std::size_t std_dev() const noexcept { return value() + 1; }
  [[nodiscard]] std::size_t fault() const noexcept { return value() + 2; }
};

/// The C file around the program.
[[nodiscard]] std::string fmi_wrapper(const FmuOptions& options, const FmiVariables& variables,
                                      const std::string& token);
/// The parts of that file in which the two versions differ.
struct FmiParts {
  const char* types = "";
  const char* members = "";    ///< members of an instance for the callbacks
  const char* callbacks = "";  ///< `@fmi_log`, `@fmi_allocate`, `@fmi_release`
  const char* functions = "";
};
[[nodiscard]] FmiParts fmi2_parts() noexcept;
[[nodiscard]] FmiParts fmi3_parts() noexcept;

/// modelDescription.xml. @param token empty: not known yet
[[nodiscard]] std::string fmi_description(const ModelFile& model, const FmuOptions& options,
                                          const FmiVariables& variables, const std::string& origin,
                                          const std::string& token);
/// sources/buildDescription.xml of FMI 3.
[[nodiscard]] std::string fmi_build_description(const FmuOptions& options);
/// documentation/index.html.
[[nodiscard]] std::string fmi_documentation(const ModelFile& model, const FmuOptions& options,
                                            const FmiVariables& variables,
                                            const std::string& origin);

}  // namespace torsio
