// Torques that are not those of the joint: without a sign, at the limit of an amplifier, bent by the weight of a link.
#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "check/checker.hpp"
#include "check/signal_faults.hpp"
#include "check/torque_faults.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kMaxOnPlateau = 2.0 / 3.0;  // share of the samples

/// The ends of its values at which a target stays.
std::string levels_text(const Plateau& plateau, const std::string& target) {
  const std::string unit = unit_label(target);
  if (plateau.is_at_zero) return "zero";
  if (plateau.levels.size() == 1)
    return fmt::format("one end of its values, {:.4g} {}", plateau.levels.front(), unit);
  return fmt::format("its lowest and highest values, {:.4g} and {:.4g} {}", plateau.levels.front(),
                     plateau.levels.back(), unit);
}

}  // namespace

/// Whether the torque has lost its sign, which is reported.
bool Checker::has_lost_sign(std::size_t r) {
  const auto lost = find_lost_sign(pairs_[r]);
  if (!lost) return false;
  const Recording& recording = dataset_.records[r].recording;
  spoiled_[r] = 1;
  coded_[r] = 1;
  add(Verdict::fail, "sign", recording.name(),
      fmt::format(
          "{} has one sign only and grows to both sides of {} = {:.4g} (correlation {:.3f} with "
          "the distance from it): the amount of a torque",
          dataset_.target, spec_.inputs.front(), lost->input, lost->together),
      "Record the torque with its sign: without it, neither friction nor the zero can be learnt.");
  return true;
}

/// Empty where the target is spoiled or has too few samples.
std::optional<double> Checker::noise_of_target(std::size_t r) const {
  const Recording& recording = dataset_.records[r].recording;
  const Channel& target = recording.channel(dataset_.target);
  if (spoiled_[r] != 0 || new_samples(target).size() < kFewestSamples) return {};
  return usual_noise(noise_course(target, recording.sample_rate_Hz()));
}

void Checker::report_plateau(std::size_t r, const Plateau& plateau) {
  std::vector<SampleRange> places;
  for (const Rest& rest : plateau.samples) places.push_back({rest.begin, rest.end});
  const bool hides_most = plateau.share >= kMaxOnPlateau && !plateau.is_at_zero;
  add(hides_most ? Verdict::fail : Verdict::warn, "saturation",
      dataset_.records[r].recording.name(),
      fmt::format("{}: {:.1f} % of the samples lie within its noise at {}, while {} moves through "
                  "{:.0f} % of its range",
                  dataset_.target, 100.0 * plateau.share, levels_text(plateau, dataset_.target),
                  spec_.inputs.front(), 100.0 * plateau.input_share),
      plateau.is_at_zero ? "If the load is gone there, leave it so; if the sensor has no values "
                           "beyond zero, record "
                           "with one that has both signs."
                         : "If that is the limit of the sensor, record again with a larger range "
                           "or smaller loads, "
                           "or cut those parts out.",
      std::move(places));
}

// With two thirds of the target hidden, a model would be that of the sensor's limit.
void Checker::check_hidden_torque() {
  for_each_record([&](std::size_t r) {
    const auto noise = noise_of_target(r);
    const auto plateau = noise ? find_plateau(pairs_[r], *noise) : std::nullopt;
    if (plateau && plateau->share >= kMaxOnPlateau && !plateau->is_at_zero)
      report_plateau(r, *plateau);
  });
}

// The converter after an amplifier adds noise, so that no two samples at its limit are equal.
void Checker::check_limit(std::size_t r) {
  const auto noise = noise_of_target(r);
  if (!noise) return;
  if (const auto plateau = find_plateau(pairs_[r], *noise)) return report_plateau(r, *plateau);
  const auto limit = find_limit(pairs_[r], *noise);
  if (!limit) return;
  std::vector<SampleRange> places;
  for (const Rest& rest : limit->samples) places.push_back({rest.begin, rest.end});
  add(Verdict::warn, "saturation", dataset_.records[r].recording.name(),
      fmt::format(
          "{0} stops {1} times at {2:.4g} {3}, within its noise, although {4} moves on: without a "
          "limit it would have changed by up to {5:.3g} {3} more",
          dataset_.target, limit->visits, limit->level, unit_label(dataset_.target),
          spec_.inputs.front(), limit->hidden),
      "If that is the limit of the sensor or its amplifier, cut those parts out or use a larger "
      "range; a clutch that slips has such a limit, too.",
      std::move(places));
}

/// How many times as far as the spring the joint moves, in the recording where it moves farthest; nothing where the first
/// input is not the difference of two angles.
std::optional<double> Checker::farthest_travel() const {
  std::optional<double> farthest;
  for (std::size_t r = 0; r < sides_.size(); ++r)
    if (sides_[r] && spoiled_[r] == 0)
      farthest = std::max(farthest.value_or(0.0), sides_[r]->travel);
  return farthest;
}

void Checker::check_position() {
  const auto travel = farthest_travel();
  const bool is_examined = !travel || *travel >= kFarTravel;
  const std::size_t before = findings_.size();
  for_each_record([&](std::size_t r) {
    if (spoiled_[r] != 0) return;
    const std::string& recording = dataset_.records[r].recording.name();
    if (const auto& effect = positions_[r]) {
      add(Verdict::warn, "position", recording,
          fmt::format("{} depends on {} by {:.3g} {} at equal {} ({:.2g} % unexplained without it, "
                      "{:.2g} % with it)",
                      dataset_.target, kJointAngle, effect->amplitude, unit_label(dataset_.target),
                      spec_.inputs.front(), 100.0 * effect->unexplained,
                      100.0 * effect->unexplained * effect->left),
          "The weight of a link bends the sensor, or an encoder has an error once per turn: "
          "mount "
          "the sensor without bending loads, calibrate the encoder, or record the error and "
          "subtract it.");
    } else if (const auto& sides = sides_[r]; sides && !changes_[r] && has_wrong_scale(*sides) &&
                                              std::abs(sides->excess) < kScaleOfAGear) {
      // Over a part of a turn a sine is nearly a line.
      add(Verdict::warn, "position", recording,
          fmt::format("apart from the deflection, {} depends on the angle of the joint as if {} "
                      "moved {:.4g} times as far as {}",
                      dataset_.target, sources_[0], 1.0 + sides->excess, sources_[1]),
          "The weight of a link that bends the sensor looks like this, and so does a scale that "
          "is "
          "wrong by that share: turn the unloaded joint and compare the two angles.");
    }
  });
  if (findings_.size() != before) return;
  add(Verdict::pass, "position", "",
      is_examined
          ? "the torque does not depend on the angle of the joint"
          : fmt::format("nothing was found, but a wrong gear ratio would not be found: the joint "
                        "moves {:.2g} times as far as the spring ({:g} are needed)",
                        *travel, kFarTravel),
      is_examined ? ""
                  : "Record the joint once while it moves far without load, and check that "
                    "recording, too.");
}

}  // namespace torsio
