#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/load_target.hpp"
#include "torsio/core/provenance.hpp"
#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// The version that this release writes; docs/robot/model_file.md lists which release reads which.
inline constexpr int kModelFormatVersion = 1;

/// A larger file is refused before memory is allocated for it.
inline constexpr std::size_t kMaxModelFileBytes = std::size_t{256} << 20;

/// The description of a model in its file, which is not needed to run it. Nothing here depends on
/// the clock or the machine: the same fit gives the same bytes.
struct ModelCard {
  std::string torsio_version;  ///< version that wrote the file; `save_model` sets it
  std::string fitted_as;       ///< the fitter's name, where families have several: "dgmm_paper"
  std::map<std::string, std::string> options;  ///< options of the fitter, as given
  std::uint64_t seed = 0;
  std::vector<Source> training_files;
  std::vector<ZeroRule> zeros;  ///< how the training records were zeroed
  LoadTarget load_target = {};  ///< the load that the target was computed from, if it was
  /// The mapping of the training records as text (`mapping_text`); empty: none, or several.
  std::string mapping = {};
  std::string held_out;                   ///< description of the samples of `metrics`
  std::map<std::string, double> metrics;  ///< in the target's unit: "rmse", "mad", ...
  std::string device_serial;  ///< serial number of the actuator that the model belongs to, or empty
  bool operator==(const ModelCard&) const = default;
};

/// A model with its settings and card. Plain data.
struct ModelFile {
  ModelCard card;
  EstimatorSettings settings;
  AnyModel::Parameters parameters;
};

/// The bytes of a model file (docs/robot/model_file.md).
[[nodiscard]] std::vector<std::byte> model_bytes(const ModelFile& model);

/// Reads a model from untrusted bytes. When this returns, the estimator can be built.
/// @param place the file's name, for messages.
/// @param expected_serial the device that the model will run on; empty: any.
/// @throws Error naming the tensor or the card's entry: not a model file, another format version,
/// an unknown family, a tensor missing, unknown, of the wrong type or shape or not finite, settings
/// that contradict the model, or a model that belongs to another device.
[[nodiscard]] ModelFile parse_model(std::span<const std::byte> bytes, std::string_view place,
                                    std::string_view expected_serial = {});

/// Writes a model file completely or not at all (`write_whole_file`). @throws Error also for a
/// model that `load_model` would refuse.
void save_model(const std::filesystem::path& path, const ModelFile& model);

/// @throws Error as `parse_model`, or if the file cannot be read.
[[nodiscard]] ModelFile load_model(const std::filesystem::path& path,
                                   std::string_view expected_serial = {});

/// The estimator of a model, at the rate in its settings. Filters and continuous-time models are
/// discretised for any rate; a discrete model with memory (a recurrent network, narx) is not.
/// @throws Error if settings and model do not fit together, or such a model would run at another rate
/// than that of its training (0.1 % is tolerated).
[[nodiscard]] Estimator make_estimator(const ModelFile& model);
/// The same at another sample rate.
[[nodiscard]] Estimator make_estimator(const ModelFile& model, double sample_rate_Hz);

/// The conditions under which a robot uses a model file.
struct EstimatorOptions {
  /// At which `step` will be called. NaN: the rate in the file.
  double rate_Hz = kNotMeasured;
  /// Serial number of the device; a model of another one is refused. Empty: any.
  std::string serial = {};
};

/// `load_model` and `make_estimator` in one call, for the robot.
/// @throws Error as both; UsageError if the rate is not a positive number.
[[nodiscard]] Estimator load_estimator(const std::filesystem::path& path,
                                       const EstimatorOptions& options = {});

}  // namespace torsio
