#include "torsio/core/units.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

#include "core/trimmed.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kDeg = kTurn / 360.0;
constexpr double kPoundForce = 4.4482216152605;  // N

constexpr auto kUnits = std::to_array<Unit>({
    {"1", "1"},
    {"pct", "1", 0.01},
    {"s", "s"},
    {"ms", "s", 1e-3},
    {"us", "s", 1e-6},
    {"ns", "s", 1e-9},
    {"min", "s", 60.0},
    {"Hz", "Hz"},
    {"kHz", "Hz", 1e3},
    {"rad", "rad"},
    {"mrad", "rad", 1e-3},
    {"urad", "rad", 1e-6},
    {"deg", "rad", kDeg},
    {"rev", "rad", kTurn},
    {"arcmin", "rad", kDeg / 60.0},
    {"arcsec", "rad", kDeg / 3600.0},
    {"rad_s", "rad_s"},
    {"radps", "rad_s"},
    {"deg_s", "rad_s", kDeg},
    {"degps", "rad_s", kDeg},
    {"dps", "rad_s", kDeg},
    {"rpm", "rad_s", kTurn / 60.0},
    {"rev_s", "rad_s", kTurn},
    {"rps", "rad_s", kTurn},
    {"rad_s2", "rad_s2"},
    {"deg_s2", "rad_s2", kDeg},
    {"Nm", "Nm"},
    {"mNm", "Nm", 1e-3},
    {"Ncm", "Nm", 1e-2},
    {"Nmm", "Nm", 1e-3},
    {"kNm", "Nm", 1e3},
    {"lbft", "Nm", kPoundForce * 0.3048},
    {"lbin", "Nm", kPoundForce * 0.0254},
    {"ozin", "Nm", kPoundForce * 0.0254 / 16.0},
    {"Nm_s", "Nm_s"},
    {"Nm_rad", "Nm_rad"},
    {"Nm_deg", "Nm_rad", 1.0 / kDeg},
    {"Nms_rad", "Nms_rad"},
    {"A", "A"},
    {"mA", "A", 1e-3},
    {"V", "V"},
    {"mV", "V", 1e-3},
    {"W", "W"},
    {"N", "N"},
    {"mN", "N", 1e-3},
    {"kN", "N", 1e3},
    {"m", "m"},
    {"cm", "m", 1e-2},
    {"mm", "m", 1e-3},
    {"um", "m", 1e-6},
    {"m_s", "m_s"},
    {"mm_s", "m_s", 1e-3},
    {"m_s2", "m_s2"},
    {"kg", "kg"},
    {"g", "kg", 1e-3},
    {"kg_m2", "kg_m2"},
    {"kgm2", "kg_m2"},
    {"gcm2", "kg_m2", 1e-7},
    {"J", "J"},
    {"Pa", "Pa"},
    {"kPa", "Pa", 1e3},
    {"MPa", "Pa", 1e6},
    {"GPa", "Pa", 1e9},
    {"K", "K"},
    {"degC", "K", 1.0, 273.15},
});

}  // namespace

std::span<const Unit> known_units() noexcept { return kUnits; }

const Unit* find_unit(std::string_view suffix) noexcept {
  for (const Unit& unit : kUnits)
    if (unit.suffix == suffix) return &unit;
  return nullptr;
}

const Unit* find_written_unit(std::string_view text) noexcept {
  const auto is_alike = [](char written, char in_suffix) {
    return written == in_suffix || (written == '/' && in_suffix == '_');
  };
  for (const Unit& unit : kUnits)
    if (std::ranges::equal(text, unit.suffix, is_alike)) return &unit;
  return nullptr;
}

std::string known_unit_list() {
  std::string list;
  for (const Unit& unit : kUnits) {
    if (!list.empty()) list += ", ";
    list.append("_").append(unit.suffix);
  }
  return list;
}

std::string ChannelName::si() const {
  return std::string(quantity).append("_").append(unit->si_suffix);
}

std::optional<ChannelName> split_channel_name(std::string_view name) noexcept {
  for (std::size_t at = name.find('_', 1); at != std::string_view::npos;
       at = name.find('_', at + 1)) {
    if (const Unit* unit = find_unit(name.substr(at + 1)))
      return ChannelName{name.substr(0, at), unit};
  }
  return std::nullopt;
}

std::string unit_label(std::string_view channel_name) {
  const auto parts = split_channel_name(channel_name);
  if (!parts || parts->unit->si_suffix == "1") return {};
  std::string label(parts->unit->si_suffix);
  if (const auto at = label.find('_'); at != std::string::npos) label[at] = '/';
  return label;
}

double si_quantity(std::string_view text, std::string_view expected_si, std::string_view place) {
  const std::string_view all = trimmed(text);
  double number = 0.0;
  const auto [end, code] = std::from_chars(all.data(), all.data() + all.size(), number);
  const std::string_view suffix = trimmed(all.substr(static_cast<std::size_t>(end - all.data())));
  const Unit* unit = suffix.empty() ? find_unit(expected_si) : find_written_unit(suffix);
  if (code != std::errc{} || unit == nullptr || unit->si_suffix != expected_si ||
      !std::isfinite(unit->si(number)))
    throw UsageError(
        {.place = std::string(place),
         .expected = "a number in " + std::string(expected_si) + " or a unit of the same quantity",
         .found = "'" + std::string(text) + "'"});
  return unit->si(number);
}

}  // namespace torsio
