#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {

/// The time stamps of a log are not uniform; the advice gives the mapping line that corrects them.
class ClockError : public Error {
 public:
  using Error::Error;
};

/// What `Recording::is_unfinished` means, for warnings.
inline constexpr std::string_view kUnfinishedText =
    "the file was not closed: what follows its last whole record is missing";

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
/// @throws Error that lists what was tried if none exists, and for a variable that is set to something else than a folder.
[[nodiscard]] std::string data_folder(const Manifest& manifest);

/// Options of a user, in addition to the files.
struct LoadOptions {
  std::optional<std::string> mapping;  ///< file; replaces the mapping of a manifest
  std::string joint = {};              ///< which joint, if a mapping is for several
  /// `mapping_text`, for the logs that have no other mapping; empty: none.
  std::string default_mapping = {};
  std::string default_mapping_place = {};  ///< where it comes from, for messages
  /// All records are brought to this rate; it is also the clock of a log that has none.
  std::optional<double> rate_Hz;
  std::string target;  ///< empty: the manifest's, else torque_Nm
  /// The caller adds the target (`add_load_target`): the recordings need not have it.
  bool computes_target = false;
  /// Role where none is given: a CSV file of the first list, a manifest's file without role or
  /// split.
  Role role = Role::train;
  Progress progress = {};  ///< is called while a file is read
};

/// Loads a CSV file, plain or gzipped, or every file of a manifest (`.yaml`).
/// @throws Error or UsageError with place, expected, found and what to do.
[[nodiscard]] std::vector<Recording> load_recordings(const std::string& path,
                                                     const LoadOptions& options = {});

/// A dataset from files or manifests. A CSV file in `train_files` has the role of the options, a
/// manifest there brings its own roles and splits; in `test_files` all is test.
/// @throws Error as `load_recordings` and `Dataset::check`; UsageError if manifests disagree.
[[nodiscard]] Dataset load_dataset(const std::vector<std::string>& train_files,
                                   const std::vector<std::string>& test_files,
                                   const LoadOptions& options = {});

/// The recordings of files or manifests for a model that is given `channels` alone: other channels,
/// the target among them, may be missing, and so may the columns of a mapping that are read for
/// them. The sample rates may differ.
/// @throws Error as `load_recordings`.
[[nodiscard]] Dataset load_inputs(const std::vector<std::string>& files,
                                  const std::vector<std::string>& channels,
                                  const LoadOptions& options = {});

/// The dataset of a manifest that was not read from a file.
[[nodiscard]] Dataset load_manifest(const Manifest& manifest, const LoadOptions& options = {});

}  // namespace torsio
