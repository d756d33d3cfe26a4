#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "sim/faults/fault_injector.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace {

/// What a schedule does to a measurement and a plant stays in the range that a plant takes.
void inject(const torsio::FaultSchedule& schedule, const torsio::DataSheet& sheet) {
  torsio::FaultInjector injector(schedule, sheet);
  for (const double time_s : {0.0, 0.001, 1.0, 1.5, 60.0, 36000.0, 1e6}) {
    torsio::Measurement measured{.motor_angle_rad = 1.0, .torque_Nm = -2.0};
    injector.apply(measured, time_s);
    const torsio::PlantCondition condition = injector.condition(time_s);
    if (std::isinf(measured.motor_angle_rad) || std::isinf(measured.torque_Nm) ||
        !(condition.friction_factor >= 0.0) || !(condition.torque_constant_factor >= 0.0) ||
        !(condition.second_stage_factor >= 0.0 && condition.second_stage_factor <= 1.0) ||
        !(condition.stop_twist_rad > 0.0) || !std::isfinite(condition.stop_stiffness_Nm_rad))
      std::abort();
  }
}

}  // namespace

/// Any text is a schedule that can be injected, or an Error; for a bench of each family.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const char* actuator : {"dfki-50", "elastomer", "rubber-clutch", "harmonic-drive"}) {
    const torsio::DataSheet sheet = torsio::data_sheet(actuator);
    try {
      inject(torsio::parse_fault_schedule(text, "fuzz.yaml", sheet), sheet);
    } catch (const torsio::Error&) {
    }
  }
  return 0;
}
