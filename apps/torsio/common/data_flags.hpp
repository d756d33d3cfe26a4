#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/data/load.hpp"
#include "torsio/files/model_file.hpp"

/// The flags of every verb that reads recordings.
struct DataFlags {
  std::vector<std::string> recordings;  ///< logs of any format that is read, or manifests (.yaml)
  std::string mapping;
  std::string joint;
  std::string rate;
  std::string target;
  std::string inputs;
  std::string load_file;  ///< from which the target is computed
  std::size_t initialise = torsio::Dataset{}.initialise_samples;

  void add_recordings(CLI::App& verb, const char* help);
  void add_mapping(CLI::App& verb);
  /// `add_mapping` for a verb that is given a model file (`use_model_mapping`).
  void add_model_mapping(CLI::App& verb);
  void add_target_and_inputs(CLI::App& verb);
  void add_initialise(CLI::App& verb);
  void add_load(CLI::App& verb, const char* help);

  /// Recordings are read with the mapping that the model was trained with, unless `--mapping` or a
  /// manifest gives another; `--mapping none`: without.
  /// @param text `ModelCard::mapping`
  /// @param model path of the model file, for messages
  void use_model_mapping(const std::string& text, const std::string& model);
  /// The target and the mapping of a model, for a verb that compares it with recordings.
  void use_model(const torsio::ModelFile& file, const std::string& path);

  /// The recordings as training data, further ones with other roles.
  [[nodiscard]] torsio::Dataset load(const std::vector<std::string>& validation,
                                     const std::vector<std::string>& test,
                                     const torsio::Progress& progress) const;
  /// The recordings as test data, except where a manifest gives roles.
  [[nodiscard]] torsio::Dataset load_as_test(const torsio::Progress& progress) const;
  /// The recordings for a model with these raw inputs; other channels may be missing.
  [[nodiscard]] torsio::Dataset load_inputs(const std::vector<std::string>& channels,
                                            const torsio::Progress& progress) const;
  [[nodiscard]] torsio::LoadOptions load_options(const torsio::Progress& progress) const;
  [[nodiscard]] std::vector<std::string> wanted_inputs() const;
  /// With `--load` the target becomes the torque of the known load (`torsio::add_load_target`).
  /// @param before how that of a model was computed
  void add_target(torsio::Dataset& dataset, const torsio::FeatureSpec& features,
                  const torsio::LoadTarget& before = {}) const;
  /// The same with remarks, for a verb that does not print them as notes of a fit.
  void compute_target(torsio::Dataset& dataset, const torsio::FeatureSpec& features,
                      const torsio::LoadTarget& before = {}) const;
  /// Refuses outputs (an empty one is none) that would replace one of the files that are read, that
  /// are the same file, or whose folder does not exist. `load` and `load_as_test` compare them again
  /// with the files that a manifest names.
  void check_outputs(const std::vector<std::string>& outputs,
                     const std::vector<std::string>& more_inputs = {});

  /// Prints warnings of truncated files, and what reading assumed.
  static void remark_on_reading(std::span<const torsio::Recording* const> recordings);

 private:
  void add_rate_and_joint(CLI::App& verb);
  void require_recordings() const;
  void check_not_read(const std::vector<std::string>& files_read) const;

  void remark_on_mapping(const torsio::Dataset& dataset) const;
  /// Loads, and compares the outputs with the files that were read.
  template <class Load>
  [[nodiscard]] torsio::Dataset checked(const Load& load) const;

  std::vector<std::string> outputs_;
  std::string model_mapping_;        ///< text
  std::string model_mapping_place_;  ///< "joint.safetensors: mapping"
};

inline constexpr std::uint64_t kDefaultSeed = 1;

/// A frequency of a loop in Hz or rad/s ("8Hz", "50rad_s"), in rad/s.
/// @throws torsio::UsageError if it is not above 0.
[[nodiscard]] double angular_frequency_rad_s(const std::string& text, const char* option);
/// The families that `--models all` leaves out.
[[nodiscard]] std::vector<std::string_view> families_beyond_all();
/// `--models`, for every verb that fits several families. `more` completes the sentence on `all`.
void add_models(CLI::App& verb, std::string& models, std::string_view more);
/// Whether `all` is in a list of models.
[[nodiscard]] bool has_all(const std::string& models);
/// `--seed`, for every verb that draws random numbers.
void add_seed(CLI::App& verb, std::uint64_t& seed, const char* help);
/// @returns the number. @throws UsageError naming the flag unless it is finite and above 0.
[[nodiscard]] double above_zero(double value, const char* flag);
/// The options of all `--set option=value` by name.
[[nodiscard]] std::map<std::string, std::string> parse_settings(
    const std::vector<std::string>& settings);
