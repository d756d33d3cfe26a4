#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {

/// How one record is cut into training and test; exactly one of the two ways is set.
struct SplitRule {
  std::size_t interleaved_blocks = 0;
  std::size_t test_every = 0;
  double contiguous = 0.0;  ///< share of the recording that is used for training
  double embargo_s = 0.0;
};

/// A mapping in the manifest, or in a separate file.
struct MappingChoice {
  std::string file;  ///< relative to the manifest; empty: `here`
  Mapping here;
};

struct ManifestFile {
  std::string file;
  std::string name;  ///< name of the recording; empty: from the file
  std::optional<Role> role;
  std::optional<SplitRule> split;
  std::optional<MappingChoice> mapping;
  std::optional<std::vector<ZeroRule>> zero;               ///< replaces the mapping's
  std::vector<std::pair<std::string, double>> conditions;  ///< in SI
};

/// A dataset as a YAML file: the logs, their roles and how they are read. See
/// docs/use/recordings.md.
struct Manifest {
  std::string file;
  std::string label;
  std::string target;
  double sample_rate_Hz = 0.0;  ///< 0: that of the logs
  std::vector<std::string> roots;
  std::optional<MappingChoice> mapping;
  std::optional<SplitRule> split;
  std::vector<std::pair<std::string, std::vector<std::string>>> input_sets;
  std::vector<ManifestFile> files;
};

/// @throws Error naming file, line, key, the known keys and the nearest one; Cancelled.
[[nodiscard]] Manifest read_manifest(const std::string& path, const Progress& progress = {});
[[nodiscard]] Manifest parse_manifest(std::string_view text, const std::string& name);

/// The folder of the manifest's files: the first of `roots` that exists, after `${VARIABLE}` is
/// replaced (a root whose variable is not set is skipped), else the manifest's folder.
/// @throws Error that lists what was tried if none exists.
[[nodiscard]] std::string data_folder(const Manifest& manifest);

}  // namespace torsio
