#include "torsio/sim/plant.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "support/every_actuator.hpp"
#include "support/series_elastic.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kStep_s = 1e-4;

/// A gear without losses and error behind a spring without friction: only its mode is left.
PlantParameters lossless(const DataSheet& sheet) {
  PlantParameters parts = plant_parameters(sheet);
  auto& gear = std::get<Gear::Parameters>(parts.first);
  auto& spring = std::get<Spring::Parameters>(parts.second);
  gear.damping_Nms_rad = 0.0;
  gear.hysteresis_Nm = 0.0;
  gear.error_rad = {};
  spring.viscosity_Nms_rad = 0.0;
  spring.elastic.half_gap_rad = 0.0;
  spring.elastic.asymmetry = 0.0;
  auto& slip = std::get<MaxwellSlip<4>::Parameters>(spring.friction);
  slip.constant_Nm = 0.0;
  slip.load_factor = 0.0;
  return parts;
}

TEST(Plant, GearModeHasItsNaturalFrequency) {
  for (const DataSheet& sheet : test::series_elastic_sheets()) {
    const PlantParameters parts = lossless(sheet);
    Plant plant(parts, kStep_s);
    plant.reset(PlantState{.middle_angle_rad = 1e-4});
    int crossings = 0;
    double first_s = 0.0;
    double last_s = 0.0;
    for (int i = 1; i <= 10000; ++i) {
      const double before = plant.state().middle_angle_rad;
      ASSERT_EQ(plant.step({.is_motor_held = true}, {.is_locked = true}, kStep_s), Fault::none);
      const double after = plant.state().middle_angle_rad;
      if (before * after > 0.0) continue;
      last_s = kStep_s * (i - after / (after - before));
      if (crossings++ == 0) first_s = last_s;
    }
    const double measured_Hz = 0.5 * (crossings - 1) / (last_s - first_s);
    const double stiffness = std::get<Gear::Parameters>(parts.first).stiffness_Nm_rad +
                             std::get<Spring::Parameters>(parts.second).elastic.stiffness_Nm_rad;
    const double expected_Hz =
        std::sqrt(stiffness / parts.middle_inertia_kg_m2) / (2.0 * std::numbers::pi);
    EXPECT_NEAR(measured_Hz, expected_Hz, 0.01 * expected_Hz) << sheet.name;
    EXPECT_GT(measured_Hz, 172.0);
    EXPECT_LT(measured_Hz, 207.0);
  }
}

TEST(Plant, StaysWhereResetPutIt) {
  for (const DataSheet& sheet : data_sheets()) {
    Plant plant(plant_parameters(sheet));
    const Load load = test::tenth_of_the_rating(sheet);
    plant.reset(1.0, load);
    const double current_A = plant.current();
    for (int i = 0; i < 20000; ++i)
      ASSERT_EQ(plant.step({.current_A = current_A}, load, kStep_s), Fault::none);
    EXPECT_NEAR(plant.state().joint_angle_rad, 1.0, 2e-4) << sheet.name;
    EXPECT_NEAR(plant.torques().second_Nm, load.gravity_Nm * std::sin(1.0), 0.05) << sheet.name;
  }
}

TEST(Plant, ComesToRestFromAColdStart) {
  for (const DataSheet& sheet : data_sheets()) {
    Plant plant(plant_parameters(sheet));
    plant.reset(PlantState{.joint_angle_rad = 0.02, .joint_speed_rad_s = 0.5});
    const Load load = test::tenth_of_the_rating(sheet);
    // Rubber creeps for long.
    const int steps = sheet.family == ActuatorFamily::series_elastic ? 200000 : 1500000;
    for (int i = 0; i < steps; ++i) ASSERT_EQ(plant.step({}, load, kStep_s), Fault::none);
    EXPECT_NEAR(plant.state().joint_speed_rad_s, 0.0, 1e-6) << sheet.name;
    EXPECT_NEAR(plant.state().middle_speed_rad_s, 0.0, 1e-6) << sheet.name;
    EXPECT_NEAR(plant.state().rotor_speed_rad_s, 0.0, 1e-4) << sheet.name;
  }
}

TEST(Plant, PeakCurrentGivesTheRatedTorqueAtALockedOutput) {
  for (const DataSheet& sheet : data_sheets()) {
    Plant plant(plant_parameters(sheet));
    double reached_Nm = 0.0;
    for (int i = 0; i < 20000; ++i) {
      ASSERT_EQ(plant.step({.current_A = 1e3}, {.is_locked = true}, kStep_s), Fault::none);
      reached_Nm = std::max(reached_Nm, plant.torques().joint_Nm);
    }
    EXPECT_GE(reached_Nm, sheet.rating.torque_Nm.value) << sheet.name;
  }
}

TEST(Plant, ReachesItsTopSpeedUnloaded) {
  for (const DataSheet& sheet : data_sheets()) {
    Plant plant(plant_parameters(sheet));
    for (int i = 0; i < 20000; ++i)
      ASSERT_EQ(plant.step({.current_A = 1e3}, {}, kStep_s), Fault::none);
    EXPECT_GE(plant.state().joint_speed_rad_s, sheet.rating.speed_rad_s.value) << sheet.name;
  }
}

/// Where the joint is after a second of a sine current, from rest with a lever.
double joint_after_a_second(const std::string& actuator, double step_s) {
  const DataSheet sheet = data_sheet(actuator);
  Plant plant(plant_parameters(sheet), step_s);
  const Load load = test::tenth_of_the_rating(sheet);
  plant.reset(0.3, load);
  const int steps = static_cast<int>(std::lround(1e-3 / step_s));
  for (int tick = 0; tick < 1000; ++tick) {
    const double current_A =
        0.5 * sheet.rating.current_A.value * std::sin(2.0 * std::numbers::pi * 1e-3 * tick);
    for (int i = 0; i < steps; ++i)
      EXPECT_EQ(plant.step({.current_A = current_A}, load, step_s), Fault::none);
  }
  return plant.state().joint_angle_rad;
}

struct FirstStep {
  const char* actuator;
  double step_s;
};

// Semi-implicit Euler is of first order, also where friction sticks and slips. The table of steps,
// errors and orders is in docs/actuators.md.
TEST(Plant, ErrorShrinksWithTheStep) {
  constexpr FirstStep kFirstSteps[] = {{"dfki-50", 1e-4},
                                       {"elastomer", 1e-4},
                                       {"rubber-clutch", 1e-4},
                                       {"harmonic-drive", 1e-4},
                                       {"harmonic-drive:rigid", 5e-5}};
  for (const auto& [actuator, first_s] : kFirstSteps) {
    const double reference = joint_after_a_second(actuator, first_s / 128.0);
    double last = 0.0;
    double order = 0.0;
    for (const double divisor : {1.0, 2.0, 4.0, 8.0}) {
      const double error = std::abs(joint_after_a_second(actuator, first_s / divisor) - reference);
      EXPECT_LT(error, divisor == 1.0 ? 2e-3 : 0.7 * last)
          << actuator << ", divided by " << divisor;
      order = std::log2(last / error);
      last = error;
    }
    RecordProperty("order_" + std::string(actuator), std::to_string(order));
    EXPECT_NEAR(order, 1.05, 0.1) << actuator;  // 1.05, since the reference has an error as well
  }
}

TEST(Plant, StaysFiniteUnderAMillionRandomCommands) {
  Random random(11);
  for (const DataSheet& sheet : data_sheets()) {
    Plant plant(plant_parameters(sheet));
    Load load = lever(9.0, 0.4);
    PlantCommand command;
    for (int i = 0; i < 250000; ++i) {
      if (random.below(8) == 0) {
        command = {.current_A = 60.0 * random.normal(), .is_motor_held = random.below(20) == 0};
        load.external_torque_Nm = sheet.rating.torque_Nm.value * random.normal();
        load.is_locked = random.below(20) == 0;
      }
      ASSERT_EQ(plant.step(command, load, kStep_s), Fault::none);
    }
    const PlantState& state = plant.state();
    EXPECT_TRUE(
        std::isfinite(state.rotor_angle_rad + state.middle_angle_rad + state.joint_angle_rad))
        << sheet.name;
    EXPECT_LT(std::abs(plant.second_twist()), 1.0) << sheet.name;
  }
}

TEST(Plant, DividesAStepThatIsLongerThanItsOwn) {
  Plant once(plant_parameters(data_sheet("dfki-120")));
  Plant ten_times(plant_parameters(data_sheet("dfki-120")));
  const Load load = lever(9.0, 0.3);
  for (int i = 0; i < 500; ++i) {
    EXPECT_EQ(once.step({.current_A = 5.0}, load, 1e-3), Fault::none);
    for (int k = 0; k < 10; ++k)
      EXPECT_EQ(ten_times.step({.current_A = 5.0}, load, 1e-3 / 10.0), Fault::none);
  }
  EXPECT_EQ(once.state().rotor_angle_rad, ten_times.state().rotor_angle_rad);
  EXPECT_EQ(once.torques().joint_Nm, ten_times.torques().joint_Nm);
}

TEST(Plant, ImpossibleInputIsAFaultAndNothingMoves) {
  Plant plant(plant_parameters(data_sheet("dfki-28")));
  ASSERT_EQ(plant.step({.current_A = 2.0}, {}, kStep_s), Fault::none);
  const double angle = plant.state().rotor_angle_rad;
  const double nan = std::nan("");
  EXPECT_EQ(plant.step({.current_A = nan}, {}, kStep_s), Fault::input_not_finite);
  EXPECT_EQ(plant.step({}, {.external_torque_Nm = nan}, kStep_s), Fault::input_not_finite);
  EXPECT_EQ(plant.step({}, {.inertia_kg_m2 = -1.0}, kStep_s), Fault::input_not_finite);
  EXPECT_EQ(plant.step({}, {}, 0.0), Fault::input_not_finite);
  EXPECT_EQ(plant.step({}, {}, nan), Fault::input_not_finite);
  EXPECT_EQ(plant.step({}, {}, 1e300), Fault::input_not_finite) << "it would never return";
  EXPECT_EQ(plant.state().rotor_angle_rad, angle);
}

TEST(Plant, RefusesAStepTooLongForItsStiffestModeAndNamesTheLimit) {
  const PlantParameters parts = plant_parameters(data_sheet("dfki-50"));
  EXPECT_NO_THROW(Plant(parts, 1e-4));
  try {
    Plant(parts, 2e-4);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.report().expected, "0 s < step <= 0.000102 s");
    EXPECT_EQ(error.report().found, "0.0002 s");
  }
  EXPECT_THROW(Plant(parts, std::nan("")), Error);
}

TEST(Plant, RefusesImpossibleParts) {
  PlantParameters parts = plant_parameters(data_sheet("dfki-50"));
  parts.rotor_inertia_kg_m2 = -1e-5;
  EXPECT_THROW(Plant{parts}, Error);
  parts = plant_parameters(data_sheet("dfki-50"));
  std::get<Gear::Parameters>(parts.first).stiffness_Nm_rad = 0.0;
  EXPECT_THROW(Plant{parts}, Error);
  EXPECT_THROW(static_cast<void>(lever(-1.0, 0.2)), Error);
}

}  // namespace
}  // namespace torsio
