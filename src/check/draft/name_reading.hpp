#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace torsio {

/// What a column of a log is.
enum class Quantity : std::uint8_t {
  unknown,
  time,
  angle,
  speed,
  deflection,
  deflection_rate,
  torque,
  force,
  current,
  voltage,
  temperature,
  duty,
  mask,
  other
};

/// Which side of gear and spring it belongs to (docs/use/units.md).
enum class Side : std::uint8_t { unknown, motor, gear, joint };

/// What the name of a column states.
struct NameReading {
  Quantity quantity = Quantity::unknown;
  Side side = Side::unknown;
  bool is_goal = false;    ///< commanded, not measured
  bool is_clear = false;   ///< by a word, not by a single letter
  std::string word = {};   ///< that shows the quantity
  std::string unit = {};   ///< suffix of a unit that the name has as a word ("PosDeg"); empty: none
  bool is_sensor = false;  ///< measured, not computed by a controller
  bool is_counted = false;  ///< in counts, whose size the name does not state
  std::string number = {};  ///< digits in the name: which of several joints or sensors
};

/// @param name without a unit at its end that torsio reads
[[nodiscard]] NameReading read_name(std::string_view name);

/// "joint_angle": the channel of a quantity without its unit; empty for one that has none.
[[nodiscard]] std::string channel_of(Quantity quantity, Side side, bool is_goal);
/// "rad"
[[nodiscard]] std::string_view si_unit_of(Quantity quantity) noexcept;
/// What a column in that SI unit is; `unknown` where several quantities have it.
[[nodiscard]] Quantity quantity_of_unit(std::string_view si_unit) noexcept;

}  // namespace torsio
