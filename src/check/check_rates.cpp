// Recorded speeds, compared with the derivatives of the angles.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "check/checker.hpp"
#include "check/mapping_advice.hpp"
#include "check/rate_factor.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kNearFactor = 1.05;
constexpr double kOtherFactor = 1.25;

/// A unit in which the numbers may be.
struct UnitOfRate {
  std::string_view suffix;
  std::string_view written;
};
constexpr auto kUnitsOfRates = std::to_array<UnitOfRate>({{"deg_s", "deg/s"},
                                                          {"rpm", "revolutions per minute"},
                                                          {"rad_s", "rad/s"},
                                                          {"rev_s", "revolutions per second"}});

/// The angle that a speed is the derivative of, in this recording; empty if there is none.
std::vector<double> angle_of_rate(const Recording& recording, std::string_view quantity) {
  std::string_view base = quantity;
  for (const std::string_view ending : {"_speed", "_velocity", "_rate"})
    if (base.ends_with(ending)) base.remove_suffix(ending.size());
  if (base.size() == quantity.size()) return {};
  for (const std::string_view ending : {"_angle_rad", "_rad", "_position_rad"})
    if (const std::string name = std::string(base) + std::string(ending); recording.has(name))
      return bridged(recording.channel(name));
  if (base != "spring_deflection" || !recording.has("gear_angle_rad") ||
      !recording.has("joint_angle_rad"))
    return {};
  std::vector<double> difference = bridged(recording.channel("gear_angle_rad"));
  const std::vector<double> joint = bridged(recording.channel("joint_angle_rad"));
  for (std::size_t i = 0; i < difference.size(); ++i) difference[i] -= joint[i];
  return difference;
}

/// The unit whose numbers are `factor` times those of the assumed unit; null if it is none of the usual ones.
const UnitOfRate* unit_of_rate(double factor, const std::string& assumed) {
  const Unit* const now = find_unit(assumed);
  const double assumed_rad_s = now != nullptr ? now->scale : 1.0;
  for (const UnitOfRate& unit : kUnitsOfRates) {
    const double ratio = std::abs(factor) * find_unit(unit.suffix)->scale / assumed_rad_s;
    if (ratio < kNearFactor && ratio > 1.0 / kNearFactor) return &unit;
  }
  return nullptr;
}

}  // namespace

void Checker::check_rates_of(std::size_t r) {
  const Recording& recording = dataset_.records[r].recording;
  for (const Channel& channel : recording.channels()) {
    const auto parts = split_channel_name(channel.name);
    if (!parts || parts->unit->si_suffix != "rad_s" || channel.name.starts_with(kTruthPrefix) ||
        channel.name == dataset_.target || is_condition(recording, channel.name))
      continue;
    const std::vector<double> angle = angle_of_rate(recording, parts->quantity);
    if (angle.empty()) continue;
    const auto found = factor_of_rate(bridged(channel), angle, recording.sample_rate_Hz());
    if (found) report_rate(r, channel.name, found->factor, found->together);
  }
}

void Checker::report_rate(std::size_t r, const std::string& name, double factor, double together) {
  const Recording& recording = dataset_.records[r].recording;
  const ColumnOfChannel* const column = column_of(recording, name);
  const std::string assumed = column != nullptr ? column->unit : "rad_s";
  const double size = std::abs(factor);
  const UnitOfRate* const unit = unit_of_rate(factor, assumed);
  const bool is_other_unit = unit != nullptr && unit->suffix != assumed;
  const bool is_other_size = size > kOtherFactor || size < 1.0 / kOtherFactor;
  if (factor > 0.0 && !is_other_unit && !is_other_size) return;
  std::vector<std::string> entries;
  if (is_other_unit) entries.push_back(fmt::format("unit: {}", unit->suffix));
  if (factor < 0.0) entries.emplace_back("sign: -1");
  const std::string cause = is_other_unit
                                ? fmt::format("That is the factor between {} and {}. ",
                                              unit->written, assumed == "rad_s" ? "rad/s" : assumed)
                                : std::string();
  const bool is_known = !is_other_size || is_other_unit;
  const bool is_input = std::ranges::find(channels_, name) != channels_.end();
  std::string line;
  for (const std::string& entry : entries) line += (line.empty() ? "" : ", ") + entry;
  add(is_known && is_input ? Verdict::fail : Verdict::warn, "units", recording.name(),
      fmt::format("{} is {:.4g} times the derivative of its angle (correlation {:.3f})", name,
                  factor, together),
      is_known ? cause + rule_advice(recording, name, line) +
                     (factor < 0.0
                          ? "\n         If the angle has the wrong sign instead, invert that one."
                          : "")
               : "Check the unit and the sign of the speed, and whether a gear is between the two "
                 "sensors (gear_ratio: in a mapping).");
}

}  // namespace torsio
