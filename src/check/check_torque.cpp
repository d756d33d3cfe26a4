// Torques that are not those of the joint: without a sign, at the limit of an amplifier, bent by the weight of a link.
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "check/checker.hpp"
#include "check/signal_faults.hpp"
#include "check/torque_faults.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

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

// The converter after an amplifier adds noise, so that no two samples at its limit are equal.
void Checker::check_limit(std::size_t r) {
  const Recording& recording = dataset_.records[r].recording;
  const Channel& target = recording.channel(dataset_.target);
  if (spoiled_[r] != 0 || new_samples(target).size() < kFewestSamples) return;
  const auto limit =
      find_limit(pairs_[r], usual_noise(noise_course(target, recording.sample_rate_Hz())));
  if (!limit) return;
  std::vector<SampleRange> places;
  for (const Rest& rest : limit->samples) places.push_back({rest.begin, rest.end});
  add(Verdict::warn, "saturation", recording.name(),
      fmt::format(
          "{0} stops {1} times at {2:.4g} {3}, within its noise, although {4} moves on: without a "
          "limit it would have changed by up to {5:.3g} {3} more",
          dataset_.target, limit->visits, limit->level, unit_label(dataset_.target),
          spec_.inputs.front(), limit->hidden),
      "If that is the limit of the sensor or its amplifier, cut those parts out or use a larger "
      "range; a clutch that slips has such a limit, too.",
      std::move(places));
}

void Checker::check_position() {
  pass_unless_found("position", "the torque does not depend on the angle of the joint", [&] {
    for_each_record([&](std::size_t r) {
      if (spoiled_[r] != 0) return;
      const std::string& recording = dataset_.records[r].recording.name();
      if (const auto& effect = positions_[r]) {
        add(Verdict::warn, "position", recording,
            fmt::format(
                "{} depends on {} by {:.3g} {} at equal {} ({:.2g} % unexplained without it, "
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
  });
}

}  // namespace torsio
