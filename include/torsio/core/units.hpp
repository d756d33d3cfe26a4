#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace torsio {

/// A unit that a channel name may end in, and the way to its SI unit:
/// si = scale * value + offset.
struct Unit {
  std::string_view suffix;     ///< as written after the last underscore(s): "deg_s"
  std::string_view si_suffix;  ///< the unit that torsio computes in: "rad_s"
  double scale = 1.0;
  double offset = 0.0;

  [[nodiscard]] constexpr double si(double value) const noexcept { return scale * value + offset; }
};

/// Every unit that torsio reads, grouped by quantity.
[[nodiscard]] std::span<const Unit> known_units() noexcept;

/// The unit with that suffix, or null.
[[nodiscard]] const Unit* find_unit(std::string_view suffix) noexcept;
/// The same for a unit as people write it: "deg/s" besides "deg_s".
[[nodiscard]] const Unit* find_written_unit(std::string_view text) noexcept;

/// A comma-separated list of the suffixes, for error messages and help.
[[nodiscard]] std::string known_unit_list();

/// A channel name taken apart: "spring_deflection_rate_deg_s" is the quantity
/// "spring_deflection_rate" in "deg_s".
struct ChannelName {
  std::string_view quantity;
  const Unit* unit = nullptr;

  /// The name that the channel has inside torsio: quantity and SI unit.
  [[nodiscard]] std::string si() const;
};

/// Splits off the longest suffix that is a known unit; empty when there is none or nothing is
/// before it.
[[nodiscard]] std::optional<ChannelName> split_channel_name(std::string_view name) noexcept;

/// The SI unit of a channel name, written as a person writes it ("Nm", "rad/s"); empty for a number
/// without unit.
[[nodiscard]] std::string unit_label(std::string_view channel_name);

/// Reads "10Hz", "0.1s", "50 ms" or "3deg" as an SI number. A bare number is taken to be in
/// `expected_si` already.
/// @throws UsageError naming `place` if the text is not a number, or its unit is not one of
/// `expected_si`'s quantity.
[[nodiscard]] double si_quantity(std::string_view text, std::string_view expected_si,
                                 std::string_view place);

[[nodiscard]] constexpr double rad_from_deg(double degrees) noexcept {
  return degrees * 0.017453292519943295;
}
[[nodiscard]] constexpr double deg_from_rad(double radians) noexcept {
  return radians * 57.29577951308232;
}

}  // namespace torsio
