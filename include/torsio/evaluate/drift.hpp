#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

enum class DriftVerdict : std::uint8_t { not_changed, changed, undetermined };
[[nodiscard]] std::string_view name(DriftVerdict verdict) noexcept;

/// One property of a joint, in the recordings against the model.
struct DriftQuantity {
  std::string name;              ///< "zero", "stiffness or gain", "friction", ...
  std::string unit;              ///< unit of all values but `relative`
  double before = kNotMeasured;  ///< value of the model; NaN: the model has none
  double change = kNotMeasured;  ///< now less `before`
  double lowest = kNotMeasured;  ///< 95 % interval of `change`
  double highest = kNotMeasured;
  double relative = kNotMeasured;   ///< `change` over `before`
  double tolerance = kNotMeasured;  ///< largest |change| of a joint that has not changed
  double smallest = kNotMeasured;   ///< smallest |change| that the recordings must be able to show
  bool is_of_joint = true;          ///< false: of the load cell's mounting or of the lubricant
  DriftVerdict verdict = DriftVerdict::undetermined;
  std::string reason = {};  ///< why it is undetermined, and what would determine it
  double lasting = 0.0;     ///< half of the interval that remains however long the recordings are
  /// How long the recordings would have to be, over their length, to determine it: infinite if no length does;
  /// NaN if it is determined, or if that is not known.
  double times_as_long = kNotMeasured;
};

/// `other_motion`: the error is larger than at the calibration, but none of the changes explains it.
/// `check_sensor`: the gain of the torque sensor has changed, and a calibration would contain it.
/// `better_model`: no longer recording determines what is undetermined.
enum class DriftAdvice : std::uint8_t {
  none,
  set_zero,
  calibrate,
  other_motion,
  record_more,
  check_sensor,
  better_model
};
[[nodiscard]] std::string_view name(DriftAdvice advice) noexcept;

/// What no change explains at one compared sample.
struct DriftResidual {
  std::size_t record = 0;  ///< in the dataset
  std::size_t sample = 0;
  double value = 0.0;      ///< target's unit
  double elastic = 0.0;    ///< the elastic torque E there
  double stiffness = 0.0;  ///< dE/dx
};

/// What has changed since the calibration of a model (docs/robot/drift.md).
struct Drift {
  std::vector<DriftQuantity> quantities = {};
  std::size_t samples = 0;                  ///< measured and compared
  std::size_t outside_samples = 0;          ///< left out: outside the range of the training
  double effective_samples = kNotMeasured;  ///< N / (1 + 2 sum r_k) of the remaining residual
  double calibration_rmse = kNotMeasured;   ///< error of the model file, in the target's unit
  double rmse = kNotMeasured;               ///< error of the model in these recordings
  double zeroed_rmse = kNotMeasured;        ///< the same less its mean
  double corrected_rmse = kNotMeasured;     ///< with all changes above corrected
  DriftVerdict joint = DriftVerdict::undetermined;  ///< all quantities of the joint together
  DriftAdvice advice = DriftAdvice::none;
  std::vector<DriftResidual> residual = {};  ///< only if `DriftOptions::with_residual`
};

struct DriftOptions {
  std::size_t resamples = 400;  ///< number of records of the bootstrap, at least 100
  std::uint64_t seed = 1;       ///< seed of the bootstrap
  /// A model of the same torque from the motor current or the twist of the gear: it separates the
  /// gain of the torque sensor from the stiffness, and with the current it shows the friction of the drive.
  /// Null: gain and stiffness are one quantity.
  const ModelFile* reference = nullptr;
  bool with_residual = false;
};

/// Compares the torque of recordings (role test) with a model of it: generalised least squares of
///
///     e = tau - y = z + s E + f H + g B + sum_k c_k u_k + noise
///
/// on directions of change that belong to the model. y ~ E(x) + H + sum_k v_k u_k is a fit to the output of
/// the model itself on the same motion: an elastic curve E of the first input x, a bank of stop operators H
/// with forces >= 0, and its other inputs u_k. s is the relative change of stiffness (or gain), f that of
/// friction, z the zero, B = -E'(x) clip((x - x0) / w, -1, 1) the effect of more play, where E(x0) = 0. The
/// standard errors are those of a circular block bootstrap; to them the error is added that the model itself
/// may have in each direction: a share of what neighbouring samples of the remaining residual have in common.
/// A quantity has changed if its 95 % interval lies outside of what a joint without a change shows, has not
/// changed if the interval is inside of the smallest change that counts, and is undetermined otherwise.
/// @throws Error if the recordings have too few measured samples, a torque that is constant or does not
/// follow, another unit, or a motion without deflection; as `predict`; UsageError for an option;
/// Cancelled.
[[nodiscard]] Drift detect_drift(const ModelFile& model, const Dataset& dataset,
                                 const DriftOptions& options = {}, const Progress& progress = {});

}  // namespace torsio
