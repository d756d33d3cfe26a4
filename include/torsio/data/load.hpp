#pragma once

#include <optional>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/data/manifest.hpp"

namespace torsio {

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
