#include "evaluate/drift/verdicts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace torsio {
namespace {

constexpr double kQuantile = 1.96;        // 95 %
constexpr double kModelErrorShare = 0.3;  // share of the remaining residual
constexpr double kExplained = 0.8;        // error with the changes corrected over that without
constexpr double kWorthFactor = 1.5;      // error now over that of the calibration
constexpr double kReserve = 1.5;  // factor on a length: the change that is found varies, too

DriftQuantity& named(Drift& drift, const char* name) {
  return *std::ranges::find(drift.quantities, name, &DriftQuantity::name);
}

const DriftQuantity& named(const Drift& drift, const char* name) {
  return *std::ranges::find(drift.quantities, name, &DriftQuantity::name);
}

bool is_decided(const DriftQuantity& of) { return of.verdict != DriftVerdict::undetermined; }

/// How many times as long the recordings have to be for an interval that decides, if the change remains the same.
double times_as_long(const DriftQuantity& of, const DriftHalfWidth& now) {
  const double size = std::abs(of.change);
  const double needed = std::max(size - of.tolerance, of.smallest - size);
  const double noise = now.noise * now.noise;
  const double model = now.model * now.model;
  if (now.model_lasts)
    return needed > now.model ? noise / (needed * needed - model)
                              : std::numeric_limits<double>::infinity();
  // noise / n + model / sqrt(n) = needed^2
  const double root = std::hypot(model, 2.0 * now.noise * needed);
  const double falls_to = 2.0 * needed * needed / (model + root);  // 1 / sqrt(n)
  return 1.0 / (falls_to * falls_to);
}

/// What lasts of an interval, and what falls as the recordings grow.
DriftHalfWidth parts_of(const DriftQuantity& of, double scale) {
  const double all = 0.5 * (of.highest - of.lowest);
  if (!std::isfinite(all)) return {.noise = kNotMeasured};
  return {.noise = scale * std::sqrt(std::max(0.0, all * all - of.lasting * of.lasting)),
          .model = scale * of.lasting};
}

std::string what_would_determine(const DriftQuantity& of, const DriftHalfWidth& now) {
  if (std::isfinite(of.times_as_long))
    return fmt::format("record {:.0f} times as long",
                       std::max(2.0, std::ceil(kReserve * of.times_as_long)));
  const double least = of.tolerance + now.model;
  return fmt::format(
      "the error of the model hides changes below {}, however long the recordings are: fit one "
      "with "
      "a smaller error",
      std::isfinite(of.before) ? fmt::format("{:.2g} %", 100.0 * least / std::abs(of.before))
                               : fmt::format("{:.2g} {}", least, of.unit));
}

}  // namespace

double DriftHalfWidth::all() const noexcept { return std::hypot(noise, model); }

void decide(DriftQuantity& of, double change, const DriftHalfWidth& parts) {
  const double half_width = parts.all();
  of.change = change;
  of.lowest = change - half_width;
  of.highest = change + half_width;
  of.relative = std::isfinite(of.before) ? change / of.before : kNotMeasured;
  of.verdict = DriftVerdict::undetermined;
  of.reason.clear();
  of.lasting = parts.model_lasts ? parts.model : 0.0;
  of.times_as_long = kNotMeasured;
  if (std::abs(change) - half_width > of.tolerance) {
    of.verdict = DriftVerdict::changed;
  } else if (std::abs(change) + half_width < of.smallest) {
    of.verdict = DriftVerdict::not_changed;
  } else {
    of.times_as_long = times_as_long(of, parts);
    of.reason = what_would_determine(of, parts);
  }
}

DriftQuantity direction_quantity(std::string of, std::string unit, double before,
                                 const DirectionFit& fit, std::size_t column,
                                 const LastingError& model_error, double tolerance,
                                 double smallest) {
  DriftQuantity result{.name = std::move(of), .unit = std::move(unit), .before = before};
  const double scale = std::isfinite(before) ? before : 1.0;
  result.tolerance = tolerance * scale;
  result.smallest = smallest * scale;
  if (!(fit.own_rms[column] > 0.0)) {
    result.reason = "this motion does not separate it from the other changes";
    return result;
  }
  const double error = fit.standard_errors[column];
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
  decide(result, change * scale,
         {.noise = kQuantile * error * scale,
          .model = kQuantile * kModelErrorShare * model_error.rms / fit.own_rms[column] * scale,
          .model_lasts = model_error.is_resolved});
  return result;
}

void conclude(Drift& drift) {
  bool is_certain = true;
  bool has_changed = false;
  bool longer_decides = false;
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
    longer_decides |= !is_decided(of) && !std::isinf(of.times_as_long);
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
    drift.advice = longer_decides ? DriftAdvice::record_more : DriftAdvice::better_model;
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
    const DriftHalfWidth of_gain = parts_of(of_reference, 1.0 / of_reference.before);
    const DriftHalfWidth of_both = parts_of(both, 1.0);
    decide(sensor, gain, of_gain);
    if (std::isfinite(of_both.all()))
      decide(stiffness, both.change - gain * both.before,
             {.noise = std::hypot(of_both.noise, of_gain.noise * both.before),
              .model = std::hypot(of_both.model, of_gain.model * both.before)});
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
