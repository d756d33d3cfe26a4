#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "torsio/core/error.hpp"
#include "torsio/identify/drive/drive_sheet.hpp"

namespace {

bool is_usable(const torsio::LoadFact& fact) {
  return !fact.condition.empty() || std::isfinite(fact.value);
}

/// A number that a rollout would multiply with is finite, and one that it divides by is not 0.
bool is_usable(const torsio::DriveSheet& sheet) {
  if (sheet.gear_ratio && !(*sheet.gear_ratio > 0.0 && std::isfinite(*sheet.gear_ratio)))
    return false;
  if (sheet.error_gain_1_rad && !(*sheet.error_gain_1_rad > 0.0)) return false;
  return is_usable(sheet.gain) && is_usable(sheet.supply_V) && is_usable(sheet.kp_Nm_rad) &&
         is_usable(sheet.kd_Nms_rad) && is_usable(sheet.torque_limit_Nm) &&
         sheet.max_duty_1 > 0.0 && sheet.max_duty_1 <= 1.0 && sheet.speed_filter_Hz >= 0.0 &&
         std::isfinite(sheet.speed_filter_Hz) && !torsio::command_channels(sheet.law).empty();
}

}  // namespace

/// Any text is the law of a drive with usable numbers, or an Error with a text.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    if (!is_usable(torsio::parse_drive_sheet(text, "fuzz.yaml"))) std::abort();
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
