#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sim/faults/fault_injector.hpp"
#include "support/allocation_counter.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {
namespace {

using test::heap_calls_during;

TEST(FaultInjector, NeverTouchesTheHeapWhateverFails) {
  const DataSheet sheet = data_sheet("dfki-50");
  FaultSchedule schedule;
  double start_s = 0.0;
  for (const FaultKind kind :
       {FaultKind::freeze, FaultKind::jump, FaultKind::drift, FaultKind::sign_flip,
        FaultKind::quantised, FaultKind::dropout, FaultKind::nan}) {
    for (const std::string& sensor : fault_sensors(sheet))
      schedule.faults.push_back(
          {.what = sensor, .kind = kind, .start_s = start_s, .duration_s = 0.2, .amount = 0.1});
    start_s += 0.1;
  }
  schedule.faults.push_back(
      {.what = "friction", .kind = FaultKind::drift, .amount = 2.0, .over_s = 0.5});
  schedule.faults.push_back({.what = "spring", .kind = FaultKind::broken, .start_s = 0.4});
  FaultInjector injector(schedule, sheet);
  std::size_t not_a_number = 0;
  double friction = 0.0;
  EXPECT_EQ(heap_calls_during([&] {
              for (int tick = 0; tick < 1000; ++tick) {
                Measurement measured{.motor_angle_rad = 1.0, .is_torque_fresh = tick % 8 == 0};
                injector.apply(measured, 1e-3 * tick);
                not_a_number += std::isnan(measured.motor_angle_rad) ? 1U : 0U;
                friction = injector.condition(1e-3 * tick).friction_factor;
              }
              injector.reset();
            }),
            0U);
  EXPECT_EQ(not_a_number, 100U);  // for the other 100 ticks of theirs the sensor is silent
  EXPECT_EQ(friction, 2.0);
}

}  // namespace
}  // namespace torsio
