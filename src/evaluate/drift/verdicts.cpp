#include "evaluate/drift/verdicts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace torsio {
namespace {

constexpr double kQuantile = 1.96;        // 95 %
constexpr double kModelErrorShare = 0.3;  // share of the remaining residual
constexpr double kExplained = 0.8;        // error with the changes corrected over that without
constexpr double kWorthFactor = 1.5;      // error now over that of the calibration

DriftQuantity& named(Drift& drift, const char* name) {
  return *std::ranges::find(drift.quantities, name, &DriftQuantity::name);
}

const DriftQuantity& named(const Drift& drift, const char* name) {
  return *std::ranges::find(drift.quantities, name, &DriftQuantity::name);
}

bool is_decided(const DriftQuantity& of) { return of.verdict != DriftVerdict::undetermined; }

}  // namespace

void decide(DriftQuantity& of, double change, double half_width) {
  of.change = change;
  of.lowest = change - half_width;
  of.highest = change + half_width;
  of.relative = std::isfinite(of.before) ? change / of.before : kNotMeasured;
  of.verdict = DriftVerdict::undetermined;
  of.reason.clear();
  if (std::abs(change) - half_width > of.tolerance) {
    of.verdict = DriftVerdict::changed;
  } else if (std::abs(change) + half_width < of.smallest) {
    of.verdict = DriftVerdict::not_changed;
  } else if (half_width > of.smallest - of.tolerance) {
    of.reason = "these recordings show too little of it";
  } else {
    of.reason = "near the limit: record longer";
  }
}

DriftQuantity direction_quantity(std::string of, std::string unit, double before,
                                 const DirectionFit& fit, std::size_t column, double model_error,
                                 double tolerance, double smallest) {
  DriftQuantity result{.name = std::move(of), .unit = std::move(unit), .before = before};
  const double scale = std::isfinite(before) ? before : 1.0;
  result.tolerance = tolerance * scale;
  result.smallest = smallest * scale;
  if (!(fit.own_rms[column] > 0.0)) {
    result.reason = "this motion does not separate it from the other changes";
    return result;
  }
  const double error =
      std::hypot(fit.standard_errors[column], kModelErrorShare * model_error / fit.own_rms[column]);
  const double change = fit.coefficients[column];
  result.change = change * scale;
  result.relative = std::isfinite(before) ? change : kNotMeasured;
  if (!std::isfinite(error)) {
    result.reason = fmt::format(
        "the remaining error changes slowly, {:.0f} independent samples: record more, or fit a "
        "model with a smaller error",
        fit.effective_samples);
    return result;
  }
  decide(result, change * scale, kQuantile * error * scale);
  return result;
}

void conclude(Drift& drift) {
  bool is_certain = true;
  bool has_changed = false;
  bool has_new_zero = false;
  bool has_new_gain = false;
  for (const DriftQuantity& of : drift.quantities) {
    if (!of.is_of_joint) {
      const bool is_changed = of.verdict == DriftVerdict::changed;
      has_new_zero |= of.name == drift_names::kZero && is_changed;
      has_new_gain |= of.name == drift_names::kGain && is_changed;
      continue;
    }
    is_certain &= is_decided(of);
    has_changed |= of.verdict == DriftVerdict::changed;
  }
  drift.joint = has_changed  ? DriftVerdict::changed
                : is_certain ? DriftVerdict::not_changed
                             : DriftVerdict::undetermined;
  drift.advice = DriftAdvice::none;
  const double worth = kWorthFactor * drift.calibration_rmse;
  if (has_new_gain) {
    drift.advice = DriftAdvice::check_sensor;
  } else if (drift.zeroed_rmse > worth) {
    drift.advice = drift.corrected_rmse < kExplained * drift.zeroed_rmse
                       ? DriftAdvice::calibrate
                       : DriftAdvice::other_motion;
  } else if (drift.rmse > worth || has_new_zero) {
    drift.advice = DriftAdvice::set_zero;
  } else if (!is_certain && !has_changed) {
    drift.advice = DriftAdvice::record_more;
  }
}

void distrust_scale(Drift& reference, const std::string& reason) {
  DriftQuantity& scale = named(reference, drift_names::kScale);
  scale.relative = kNotMeasured;
  scale.verdict = DriftVerdict::undetermined;
  scale.reason = reason;
}

void separate_gain(Drift& drift, const Drift& reference) {
  DriftQuantity& both = named(drift, drift_names::kScale);
  const DriftQuantity& of_reference = named(reference, drift_names::kScale);
  // As shares, since spring and reference have other units.
  const double gain = of_reference.relative;
  const double gain_half_width =
      0.5 * (of_reference.highest - of_reference.lowest) / of_reference.before;
  DriftQuantity sensor{.name = drift_names::kGain,
                       .unit = {},
                       .before = 1.0,
                       .tolerance = both.tolerance / both.before,
                       .smallest = both.smallest / both.before,
                       .is_of_joint = false};
  DriftQuantity stiffness{.name = drift_names::kStiffness,
                          .unit = both.unit,
                          .before = both.before,
                          .tolerance = both.tolerance,
                          .smallest = both.smallest};
  if (std::isfinite(gain) && std::isfinite(gain_half_width)) {
    decide(sensor, gain, gain_half_width);
    const double half_width = 0.5 * (both.highest - both.lowest);
    if (std::isfinite(half_width))
      decide(stiffness, both.change - gain * both.before,
             std::hypot(half_width, gain_half_width * both.before));
  } else {
    sensor.reason = stiffness.reason = of_reference.reason;
  }
  // Where the stiffness alone is known, it and not the sum is the joint's.
  stiffness.is_of_joint = is_decided(stiffness);
  both.is_of_joint = !stiffness.is_of_joint;
  const auto after = std::ranges::find(drift.quantities, drift_names::kScale, &DriftQuantity::name);
  drift.quantities.insert(after + 1, {std::move(stiffness), std::move(sensor)});
  conclude(drift);
}

}  // namespace torsio
