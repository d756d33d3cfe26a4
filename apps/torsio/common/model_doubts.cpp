#include "common/model_doubts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "check/motion.hpp"
#include "common/output.hpp"
#include "torsio/check/check.hpp"

namespace {

constexpr int kSettled = 2000;  // ticks of 1 ms

/// Deflections with the joint at rest, as an inverse has them.
struct Deflections {
  double range_rad = 0.0;  ///< from -torque to torque
  double rest_rad = 0.0;   ///< at 0 Nm
};

/// None if the inverse has no solution.
std::optional<Deflections> deflections_of(torsio::AnyInverse inverse, double torque_Nm) {
  const auto settled_rad = [&](double at_Nm) -> std::optional<double> {
    inverse.reset();
    torsio::Estimate inverted;
    for (int tick = 0; tick < kSettled; ++tick)
      inverted = inverse.step(at_Nm, {.t_s = 1e-3 * tick,
                                      .motor_angle_rad = 0.0,
                                      .gear_angle_rad = 0.0,
                                      .joint_angle_rad = 0.0,
                                      .motor_current_A = 0.0});
    if (inverted.fault != torsio::Fault::none) return std::nullopt;
    return inverted.value;
  };
  const auto low = settled_rad(-torque_Nm);
  const auto high = settled_rad(torque_Nm);
  const auto rest = settled_rad(0.0);
  if (!low || !high || !rest) return std::nullopt;
  return Deflections{*high - *low, *rest};
}

}  // namespace

void warn_of_another_spring(const std::string& model, torsio::AnyInverse inverse,
                            const torsio::LinearInverse& line, const torsio::DataSheet& sheet,
                            double torque_Nm) {
  constexpr double kAnother = 1.4;  // hysteresis and wear of one spring remain below it
  constexpr double kAnotherZero = 0.25;
  const auto inverted = deflections_of(std::move(inverse), torque_Nm);
  const auto swept = deflections_of(line, torque_Nm);
  if (!swept) return;
  if (!inverted) {
    remark(
        fmt::format("warning: {} has no deflection for -{:.3g}, 0 or {:.3g} Nm: was it trained on "
                    "another actuator than {}?",
                    model, torque_Nm, torque_Nm, sheet.name));
    return;
  }
  const double ratio = inverted->range_rad / swept->range_rad;
  if (ratio > 0.0 && (ratio >= kAnother || ratio <= 1.0 / kAnother))
    remark(
        fmt::format("warning: for {:.3g} Nm {} deflects the spring {:.2g} times as far as the "
                    "linear model of {} does: was it trained on another actuator?",
                    torque_Nm, model, ratio, sheet.name));
  const double apart_rad = inverted->rest_rad - swept->rest_rad;
  if (std::abs(apart_rad) > kAnotherZero * swept->range_rad)
    remark(
        fmt::format("warning: at 0 Nm {} deflects the spring by {:.3g} rad more than the linear "
                    "model of {} does: had the encoders another zero when it was trained?",
                    model, apart_rad, sheet.name));
}

void warn_of_failed_checks(const torsio::FitCheck& check) {
  for (const torsio::Finding& finding : check.failures)
    remark(fmt::format(
        "warning: torsio check: FAIL {}: {}{}; run it on these recordings for advice",
        finding.check, finding.recording.empty() ? "" : finding.recording + ": ", finding.message));
}

void warn_of_failed_checks(const torsio::Dataset& dataset, const torsio::FeatureSpec& features) {
  warn_of_failed_checks(torsio::check_for_fit(dataset, features, true));
}

namespace {

/// Whether each quantity of a motion is within the range of the training recordings, widened by what
/// two motions of one kind differ by: such a recording lies between others.
bool is_between(const torsio::Motion& motion, const std::vector<torsio::Motion>& trained) {
  const auto within = [&](double torsio::Motion::*quantity) {
    const auto [low, high] = std::ranges::minmax(trained, {}, quantity);
    return motion.*quantity >= low.*quantity / torsio::kMotionRatio &&
           motion.*quantity <= high.*quantity * torsio::kMotionRatio;
  };
  const auto [least, greatest] = std::ranges::minmax(trained, {}, &torsio::Motion::rest_share);
  return within(&torsio::Motion::amplitude) && within(&torsio::Motion::rms_speed) &&
         within(&torsio::Motion::frequency_Hz) &&
         motion.rest_share >= least.rest_share - torsio::kRestDifference &&
         motion.rest_share <= greatest.rest_share + torsio::kRestDifference;
}

}  // namespace

std::vector<std::string> other_motion_warnings(const torsio::Dataset& dataset,
                                               const torsio::FeatureSpec& features,
                                               const std::string& place) {
  std::vector<std::string> warnings;
  const auto others = torsio::other_motions(dataset, features);
  if (others.empty()) return warnings;
  std::vector<torsio::Motion> trained;
  for (const torsio::DatasetRecord& record : dataset.records)
    if (const auto motion = torsio::motion_of(record, torsio::Role::train, features);
        motion.rms_speed > 0.0)
      trained.push_back(motion);
  for (const torsio::OtherMotion& other : others)
    if (!is_between(other.held_out, trained))
      warnings.push_back(fmt::format(
          "{}{} moves {} in another way than every training recording, with {} of {}: "
          "its errors and error bars are those of another kind of motion",
          place, other.recording, features.inputs.front(), other.text(), other.nearest));
  return warnings;
}

void warn_of_other_motions(const torsio::Dataset& dataset, const torsio::FeatureSpec& features,
                           const std::string& place) {
  for (const std::string& warning : other_motion_warnings(dataset, features, place))
    remark("warning: " + warning);
}

void warn_of_seen_recordings(const torsio::ModelFile& file, const torsio::Dataset& dataset) {
  const auto& trained = file.card.training_files;
  for (const torsio::DatasetRecord& record : dataset.records) {
    const torsio::Recording& recording = record.recording;
    const bool is_known = std::ranges::any_of(trained, [&](const torsio::Source& source) {
      return !source.sha256.empty() && source.sha256 == recording.source.sha256;
    });
    if (is_known)
      remark("warning: the model was trained on " + recording.name() +
             "; its score is not a held-out score");
  }
}

void warn_of_missing_zeros(const torsio::ModelFile& file, const torsio::Dataset& dataset) {
  for (const torsio::DatasetRecord& record : dataset.records) {
    const torsio::Recording& recording = record.recording;
    for (const std::string& channel : file.settings.zeroed_channels) {
      const bool is_zeroed = std::ranges::any_of(
          recording.zeros, [&](const torsio::ZeroRule& zero) { return zero.channel == channel; });
      if (!is_zeroed)
        remark("warning: the model expects " + channel + " with its zero taken, but " +
               recording.name() + " has it as measured: use the mapping that it was trained with");
    }
  }
}

void warn_of_another_unit(const torsio::ModelFile& file, const torsio::Dataset& dataset) {
  for (const torsio::DatasetRecord& record : dataset.records) {
    const std::string mistake = torsio::unit_doubt(record.recording, file.settings);
    if (!mistake.empty())
      remark("warning: " + file.settings.target + " of " + record.recording.name() + " over " +
             file.settings.features.inputs.front() +
             " differs from the training data by the factor between " + mistake +
             ": check the units of the recording");
  }
}
