#include "sim/closed_loop/impedance_checks.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <variant>

#include "core/checks.hpp"
#include "sim/closed_loop/stable_gains.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kLargestAmplitude_Nm = 50.0;  // as the experiments of the bench
constexpr double kTubeAmplitude_Nm = 20.0;
constexpr double kAmplitudeShare = 0.2;  // share of the rated torque
constexpr double kShortestImpedance_s = 10.0;
constexpr double kLongestImpedance_s = 3600.0;
constexpr double kFastestCorrection_rad_s = 0.1 * kBenchRate_Hz;  // as `EstimateCorrection`

void require_setting(bool holds, const char* what, std::string_view expected, double found) {
  require<UsageError>(holds, fmt::format("{} {}", kImpedance, what), expected, found);
}

void check_spec(const DataSheet& sheet, const ImpedanceSpec& spec) {
  require_setting(spec.stiffness_Nm_rad >= 0.0 && std::isfinite(spec.stiffness_Nm_rad), "stiffness",
                  "0 Nm/rad or more", spec.stiffness_Nm_rad);
  require_setting(spec.damping_Nms_rad >= 0.0 && std::isfinite(spec.damping_Nms_rad), "damping",
                  "0 Nms/rad or more", spec.damping_Nms_rad);
  const auto require_above_zero = [](const std::optional<double>& value, const char* what,
                                     std::string_view expected) {
    if (value) require_setting(*value > 0.0 && std::isfinite(*value), what, expected, *value);
  };
  require_above_zero(spec.torque_gain_Nm_rad, "torque gain", "above 0 Nm/rad");
  require_above_zero(spec.bandwidth_rad_s, "bandwidth", "above 0 rad/s");
  require_above_zero(spec.loop_damping, "damping of the torque loop", "above 0");
  if (const auto& correction_rad_s = spec.correction_rad_s)
    require_setting(*correction_rad_s > 0.0 && *correction_rad_s <= kFastestCorrection_rad_s,
                    "bandwidth of the correction",
                    fmt::format("above 0 and at most {:g} rad/s", kFastestCorrection_rad_s),
                    *correction_rad_s);
  const double largest_Nm = has_tube(sheet) ? kLargestAmplitude_Nm : sheet.rating.torque_Nm.value;
  const double amplitude_Nm = impedance_amplitude_Nm(sheet, spec);
  require_setting(amplitude_Nm > 0.0 && amplitude_Nm <= largest_Nm, "amplitude",
                  fmt::format("above 0 and at most {:g} Nm", largest_Nm), amplitude_Nm);
  require_setting(
      spec.duration_s >= kShortestImpedance_s && spec.duration_s <= kLongestImpedance_s, "duration",
      fmt::format("{:g} to {:g} s", kShortestImpedance_s, kLongestImpedance_s), spec.duration_s);
}

bool has_passive_loop(const ImpedancePlan& plan) {
  return LinearImpedance(plan).passive_to_Hz() >= ImpedanceRun::kPassiveTo_Hz;
}

bool has_stable_loop(const ImpedancePlan& plan) { return LinearImpedance(plan).is_stable(); }

/// "6 rad/s, the estimate held for 10 ms"
std::string correction_text(const ImpedancePlan& plan) {
  const std::size_t ticks = plan.ticks_per_estimate();
  const std::string hold = ticks > 1
                               ? fmt::format(", each estimate held for {:g} ms",
                                             1000.0 * static_cast<double>(ticks) / kBenchRate_Hz)
                               : std::string();
  return fmt::format("{:g} rad/s{}", plan.correction.bandwidth_rad_s, hold);
}

/// Where the loop is as it must be without the correction by an estimate, but not with it.
template <class IsGood>
void require_slow_correction(const ImpedancePlan& plan, const IsGood& is_good,
                             std::string_view problem, std::string_view quality) {
  if (!plan.estimator) return;
  ImpedancePlan without = plan;
  without.estimator.reset();
  if (!is_good(without)) return;
  const auto largest_rad_s = largest_correction_rad_s(plan, is_good);
  throw UsageError(
      {.place = fmt::format("{} correction", kImpedance),
       .problem = std::string(problem),
       .expected = largest_rad_s ? fmt::format("at most {:.3g} rad/s", *largest_rad_s)
                                 : "no correction by this model",
       .found = correction_text(plan),
       .advice = fmt::format("Without the model it is {}: the estimate corrects too fast for it.",
                             quality)});
}

void require_stable(const ImpedancePlan& plan) {
  if (has_stable_loop(plan)) return;
  constexpr auto kProblem =
      "the loop is unstable without dry friction, with the output locked or free";
  require_slow_correction(plan, has_stable_loop, kProblem, "stable");
  const JointImpedance::Gains gains = std::get<ImpedancePlan::Spring>(plan.controller).gains;
  throw UsageError(
      {.place = kImpedance,
       .problem = kProblem,
       .expected = stable_gains(plan),
       .found =
           fmt::format("{:g} Nm/rad, {:g} Nms/rad{}", gains.stiffness_Nm_rad, gains.damping_Nms_rad,
                       plan.estimator ? ", corrected by an estimate at " + correction_text(plan)
                                      : std::string())});
}

void require_passive(const ImpedancePlan& plan) {
  const double passive_to_Hz = LinearImpedance(plan).passive_to_Hz();
  if (passive_to_Hz >= ImpedanceRun::kPassiveTo_Hz) return;
  const std::string problem = fmt::format("not passive up to {:g} Hz", ImpedanceRun::kPassiveTo_Hz);
  require_slow_correction(plan, has_passive_loop, problem, "passive");
  const double largest_Nm_rad = plan.largest_passive_Nm_rad(ImpedanceRun::kPassiveTo_Hz);
  const double gain_Nm_rad = std::get<TubeImpedance::Settings>(plan.controller).gains.torque_Nm_rad;
  const std::string with = fmt::format("a damping of {:g} Nms/rad and a torque gain of {:g} Nm/rad",
                                       plan.damping_Nms_rad(), gain_Nm_rad);
  throw UsageError(
      {.place = kImpedance,
       .problem = problem,
       .expected = largest_Nm_rad > 0.0
                       ? fmt::format("at most {:.4g} Nm/rad with {}", largest_Nm_rad, with)
                       : fmt::format("another damping or torque gain: no stiffness is passive with "
                                     "{}",
                                     with),
       .found =
           fmt::format("{:g} Nm/rad, {}", plan.stiffness_Nm_rad(),
                       passive_to_Hz > 0.0 ? fmt::format("passive up to {:.3g} Hz", passive_to_Hz)
                                           : std::string("unstable without dry friction")),
       .advice = "Take less stiffness, or a torque gain of 1 Nm/rad or less."});
}

}  // namespace

double impedance_amplitude_Nm(const DataSheet& sheet, const ImpedanceSpec& spec) {
  return spec.amplitude_Nm.value_or(
      has_tube(sheet) ? kTubeAmplitude_Nm : kAmplitudeShare * sheet.rating.torque_Nm.value);
}

void require_used_correction(const ImpedanceSpec& spec, bool has_estimator) {
  if (!spec.correction_rad_s || has_estimator) return;
  throw UsageError({.place = fmt::format("{} bandwidth of the correction", kImpedance),
                    .problem = "it has no effect: no estimate of a model corrects the torque",
                    .expected = "none, or a model that is not used as an inverse of the spring",
                    .found = fmt::format("{:g} rad/s", *spec.correction_rad_s)});
}

ImpedancePlan checked_plan(const DataSheet& sheet, const ImpedanceSpec& spec,
                           const std::optional<ImpedanceModel>& model, const LinearInverse& line) {
  check_spec(sheet, spec);
  ImpedancePlan plan = impedance_plan(sheet, spec, model ? &*model : nullptr, line);
  if (!has_tube(sheet))
    require_stable(plan);
  else if (spec.kind == ImpedanceSpec::Kind::wanted ||
           (spec.kind == ImpedanceSpec::Kind::zero && plan.estimator))
    require_passive(plan);
  // The gains of `high` rely on the dry friction, which the linear loop does not have.
  (void)ImpedanceLoop(plan);
  return plan;
}

}  // namespace torsio
