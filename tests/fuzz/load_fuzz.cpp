#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <variant>

#include "torsio/core/error.hpp"
#include "torsio/joint_load/known_load.hpp"

namespace {

/// A recording that has a condition of each unit, so that names of conditions are accepted, too.
torsio::Recording recording_with_conditions() {
  torsio::Recording recording("r", 1000.0);
  recording.add({"joint_angle_rad", {0.0, 0.1}});
  for (const char* const condition : {"mass_kg", "lever_m", "arm_mass_kg", "tilt_rad"})
    recording.add_condition(condition, 0.5);
  return recording;
}

bool is_possible(const torsio::JointLoad& load) {
  return std::isfinite(load.gravity_Nm) && std::isfinite(load.inertia_kg_m2) &&
         std::isfinite(load.zero_rad);
}

}  // namespace

/// Any text is a load of finite numbers, or an Error with a text.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const torsio::Recording recording = recording_with_conditions();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const torsio::LoadSheet sheet = torsio::parse_load_sheet(text, "fuzz.yaml");
    // A URDF would be read from the disk: its reader has a target of its own.
    if (!std::holds_alternative<torsio::PendulumFacts>(sheet.facts)) return 0;
    const torsio::KnownLoad known = torsio::known_load(sheet, recording);
    if (!is_possible(known.load)) std::abort();
    for (const torsio::LoadError& error : known.errors)
      if (!is_possible(error.change)) std::abort();
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
