#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "torsio/export/c99.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// Version of the Functional Mock-up Interface.
enum class FmiVersion : std::uint8_t { two, three };

struct FmuOptions {
  std::string name = "joint";  ///< model identifier, a C identifier
  FmiVersion version = FmiVersion::three;
  CReal real = CReal::twofold;  ///< type of the computation; the variables are doubles always
};

/// A file in an FMU.
struct FmuFile {
  std::string path;  ///< in the archive: "sources/joint.c"
  std::string bytes;
};

/// An estimator for the co-simulation of FMI: inputs of the model and zeros of channels in, value, error bar and fault
/// out. A tick takes a period of the model; a communication step is a whole number of them, with the inputs held.
struct Fmu {
  std::string name;
  FmiVersion version = FmiVersion::three;
  std::string token;  ///< GUID or instantiation token: a hash of what the FMU computes
  std::vector<FmuFile> files;
  /// Machine of the compiled library, such as "x86_64-linux"; empty: sources only.
  std::string platform = {};
};

/// Model description, sources and documentation. Equal models give equal bytes.
/// @param origin the model's file, for comments
/// @throws what `c99_program` throws; Error where an input has the name of an output.
[[nodiscard]] Fmu make_fmu(const ModelFile& model, const FmuOptions& options,
                           const std::string& origin);

/// Adds the library that most importers need, for the machine of the compiler (Linux).
/// @param compiler a command with its options: "cc", "aarch64-linux-gnu-gcc", "ccache gcc -m32"
/// @throws Error if the compiler cannot be run or fails, or for a machine that the version of FMI has no folder for.
void compile_fmu(Fmu& fmu, const std::string& compiler);

/// Writes the archive completely or not at all. @throws Error
void write_fmu(const std::filesystem::path& path, const Fmu& fmu);

}  // namespace torsio
