#include "sim/plant/plant.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "sim/plant/plant_batch.hpp"
#include "support/every_actuator.hpp"
#include "support/series_elastic.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kStep_s = 1e-4;

/// A gear without losses and error with a spring without friction: only its mode is left.
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

TEST(NaturalFrequencies, AreThoseOfThreeEqualBodiesInAChain) {
  PlantParameters plant;
  plant.first = Gear::Parameters{.ratio = 10.0, .stiffness_Nm_rad = 400.0};
  plant.second = Gear::Parameters{.ratio = 1.0, .stiffness_Nm_rad = 400.0};
  plant.rotor_inertia_kg_m2 = 1e-2;
  plant.middle_inertia_kg_m2 = 1.0;
  plant.joint_inertia_kg_m2 = 1.0;
  const auto [low_Hz, high_Hz] = natural_frequencies(plant);
  constexpr double kTurn = 2.0 * std::numbers::pi;
  EXPECT_NEAR(low_Hz, 20.0 / kTurn, 1e-12);
  EXPECT_NEAR(high_Hz, 20.0 * std::sqrt(3.0) / kTurn, 1e-12);
}

/// The plant itself, its dissipation and play taken away and its curves straight.
PlantParameters without_losses(PlantParameters parts) {
  for (LuGreFriction::Parameters* friction :
       {&parts.rotor_friction, &parts.middle_friction, &parts.bearing})
    *friction = {};
  parts.joint_viscous_Nms_rad = 0.0;
  parts.motor.ripple = 0.0;
  const auto quiet = [](Gear::Parameters& gear) {
    gear.damping_Nms_rad = 0.0;
    gear.hysteresis_Nm = 0.0;
    gear.error_rad = {};
  };
  quiet(std::get<Gear::Parameters>(parts.first));
  if (auto* gear = std::get_if<Gear::Parameters>(&parts.second)) quiet(*gear);
  if (auto* spring = std::get_if<Spring::Parameters>(&parts.second)) {
    spring->viscosity_Nms_rad = 0.0;
    spring->elastic.half_gap_rad = 0.0;
    spring->elastic.asymmetry = 0.0;
    auto& slip = std::get<MaxwellSlip<4>::Parameters>(spring->friction);
    slip.constant_Nm = 0.0;
    slip.load_factor = 0.0;
  }
  return parts;
}

/// The energy of a signal at a frequency, through a Hann window.
double power_at(const std::vector<double>& signal, double step_s, double frequency_Hz) {
  double in_phase = 0.0;
  double quadrature = 0.0;
  for (std::size_t i = 0; i < signal.size(); ++i) {
    const double turn =
        2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(signal.size());
    const double angle = 2.0 * std::numbers::pi * frequency_Hz * step_s * static_cast<double>(i);
    in_phase += (1.0 - std::cos(turn)) * signal[i] * std::cos(angle);
    quadrature += (1.0 - std::cos(turn)) * signal[i] * std::sin(angle);
  }
  return in_phase * in_phase + quadrature * quadrature;
}

/// Where the power within 10 % of a frequency is highest.
double peak_near(const std::vector<double>& signal, double step_s, double frequency_Hz) {
  double best_Hz = 0.0;
  double most = 0.0;
  for (double share = 0.9; share < 1.1; share += 0.002) {
    const double power = power_at(signal, step_s, share * frequency_Hz);
    if (power <= most) continue;
    most = power;
    best_Hz = share * frequency_Hz;
  }
  return best_Hz;
}

TEST(NaturalFrequencies, AreThoseOfTheRingDown) {
  for (const char* name : {"dfki-50", "harmonic-drive"}) {
    const PlantParameters parts = without_losses(plant_parameters(data_sheet(name)));
    Plant plant(parts, 5e-5);
    ASSERT_EQ(plant.reset(PlantState{.middle_angle_rad = 1e-4}), Fault::none);
    std::vector<double> twist;
    for (int i = 0; i < 20000; ++i) {
      ASSERT_EQ(plant.step({}, {}, 5e-5), Fault::none);
      twist.push_back(plant.state().middle_speed_rad_s);
    }
    for (const double expected_Hz : natural_frequencies(parts))
      EXPECT_NEAR(peak_near(twist, 5e-5, expected_Hz), expected_Hz, 0.01 * expected_Hz) << name;
    EXPECT_EQ(natural_frequencies(parts), natural_frequencies(plant_parameters(data_sheet(name))));
  }
}

TEST(NaturalFrequencies, SeeSoftLobesAndGlassyBranches) {
  const auto low_Hz = [](const char* name) {
    return natural_frequencies(plant_parameters(data_sheet(name)))[0];
  };
  EXPECT_NEAR(low_Hz("elastomer") / low_Hz("elastomer:unbonded"), std::sqrt(1.4), 0.02);
  PlantParameters rubber = plant_parameters(data_sheet("rubber-clutch"));
  const double glassy_Hz = natural_frequencies(rubber)[0];
  std::get<RubberSpring::Parameters>(rubber.second).branches.stiffness_Nm_rad = {};
  EXPECT_NEAR(glassy_Hz / natural_frequencies(rubber)[0], std::sqrt(1.114 / 0.964), 0.01);
}

TEST(Plant, StaysWhereResetPutIt) {
  for (const DataSheet& sheet : data_sheets()) {
    Plant plant(plant_parameters(sheet));
    const Load load = test::tenth_of_the_rating(sheet);
    plant.reset(1.0, load);
    const double current_A = plant.current();
    const double twist_rad = plant.second_twist();
    for (int i = 0; i < 20000; ++i)
      ASSERT_EQ(plant.step({.current_A = current_A}, load, kStep_s), Fault::none);
    const double expected_Nm = load.gravity_Nm * std::sin(1.0);
    EXPECT_NEAR(plant.state().joint_angle_rad, 1.0, 2e-4) << sheet.name;
    EXPECT_NEAR(plant.second_twist(), twist_rad, 0.02 * twist_rad) << sheet.name;
    EXPECT_NEAR(plant.torques().second_Nm, expected_Nm, 0.02 * expected_Nm) << sheet.name;
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

// At the rated current itself an ideal dfki-28 has 0.057 Nm/A · 4.8 A · 100 = 27.4 Nm, short of its
// 28; the peak current, twice as high, has to overcome its friction as well.
TEST(Plant, PeakCurrentGivesTheRatedTorqueAtALockedOutput) {
  for (const DataSheet& sheet : data_sheets()) {
    Plant plant(plant_parameters(sheet));
    double highest_Nm = 0.0;
    for (int i = 0; i < 20000; ++i) {
      ASSERT_EQ(plant.step({.current_A = 1e3}, {.is_locked = true}, kStep_s), Fault::none);
      highest_Nm = std::max(highest_Nm, plant.torques().joint_Nm);
    }
    const double settled_Nm = plant.torques().joint_Nm;
    RecordProperty("settled_Nm_" + std::string(sheet.name), std::to_string(settled_Nm));
    RecordProperty("highest_Nm_" + std::string(sheet.name), std::to_string(highest_Nm));
    // The clutch slides at less than what it held.
    const double held = sheet.family == ActuatorFamily::rubber_clutch
                            ? std::get<ClutchSheet>(sheet.first).sliding_ratio.value
                            : 1.0;
    EXPECT_GE(settled_Nm, held * sheet.rating.torque_Nm.value)
        << sheet.name << ", at most " << highest_Nm << " Nm on the way";
  }
}

TEST(Plant, ReachesItsTopSpeedUnloaded) {
  for (const DataSheet& sheet : data_sheets()) {
    Plant plant(plant_parameters(sheet));
    for (int i = 0; i < 20000; ++i)
      ASSERT_EQ(plant.step({.current_A = 1e3}, {}, kStep_s), Fault::none);
    // The assumed 10 rad/s of the elastomer's drive are more than its printed 24 V allow.
    const double share = sheet.family == ActuatorFamily::elastomer ? 0.9 : 1.0;
    EXPECT_GE(plant.state().joint_speed_rad_s, share * sheet.rating.speed_rad_s.value)
        << sheet.name;
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
// errors and orders is in docs/simulation/actuators.md.
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
    EXPECT_NEAR(order, 1.05, 0.15) << actuator;  // 1.05, since the reference has an error as well
  }
}

bool is_finite(const PlantTorques& t) {
  return std::isfinite(t.motor_Nm + t.rotor_friction_Nm + t.first_Nm + t.first_on_rotor_Nm +
                       t.middle_friction_Nm + t.second_Nm + t.second_on_middle_Nm + t.bearing_Nm +
                       t.joint_Nm + t.wall_Nm);
}

/// A new one for every step.
PlantCommand random_command(const DataSheet& sheet, Random& random) {
  return {.current_A = 3.0 * sheet.rating.current_A.value * random.normal(),
          .is_motor_held = random.below(20) == 0};
}
Load random_load(const DataSheet& sheet, Random& random) {
  Load load = test::tenth_of_the_rating(sheet);
  load.external_torque_Nm = sheet.rating.torque_Nm.value * random.normal();
  load.is_locked = random.below(20) == 0;
  return load;
}

TEST(Plant, StaysFiniteUnderAMillionRandomCommands) {
  Random random(11);
  for (const std::string& name : test::every_actuator()) {
    const DataSheet sheet = data_sheet(name);
    Plant plant(plant_parameters(sheet));
    for (int i = 0; i < 1'000'000 / 19 + 1; ++i) {
      ASSERT_EQ(plant.step(random_command(sheet, random), random_load(sheet, random), kStep_s),
                Fault::none)
          << name;
      ASSERT_TRUE(is_finite(plant.torques())) << name;
    }
    EXPECT_LT(std::abs(plant.second_twist()), 1.0) << name;
  }
}

TEST(PlantBatch, StaysFiniteUnderAMillionRandomCommands) {
  constexpr std::size_t kPlants = 8;
  Random random(12);
  for (const std::string& name : test::every_actuator()) {
    const DataSheet sheet = data_sheet(name);
    PlantBatch batch(std::vector<PlantParameters>(kPlants, plant_parameters(sheet)));
    std::vector<PlantCommand> commands(kPlants);
    std::vector<Load> loads(kPlants);
    for (std::size_t i = 0; i < 1'000'000 / 19 / kPlants + 1; ++i) {
      for (PlantCommand& command : commands) command = random_command(sheet, random);
      for (Load& load : loads) load = random_load(sheet, random);
      ASSERT_EQ(batch.step(commands, loads, kStep_s), Fault::none) << name;
      for (std::size_t at = 0; at < kPlants; ++at) ASSERT_TRUE(is_finite(batch.torques(at)));
    }
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

TEST(Plant, WallThatStepsCannotFollowIsAFault) {
  const PlantParameters parts = plant_parameters(data_sheet("dfki-28"));
  Plant plant(parts);
  const double stiffest = 0.25 * parts.joint_inertia_kg_m2 / (kStep_s * kStep_s);
  for (const Load& load :
       {Load{.wall_stiffness_Nm_rad = -1.0}, Load{.wall_damping_Nms_rad = -1.0},
        Load{.wall_stiffness_Nm_rad = 1.01 * stiffest},
        Load{.wall_damping_Nms_rad = 0.51 * parts.joint_inertia_kg_m2 / kStep_s}}) {
    EXPECT_EQ(plant.step({}, load, kStep_s), Fault::input_not_finite);
  }
  EXPECT_EQ(plant.step({}, {.wall_stiffness_Nm_rad = 0.99 * stiffest}, kStep_s), Fault::none);
}

TEST(Plant, ImpossibleStartOrConditionIsAFaultAndNothingChanges) {
  Plant plant(plant_parameters(data_sheet("dfki-28")));
  ASSERT_EQ(plant.reset(0.3, {}), Fault::none);
  ASSERT_EQ(plant.set_condition({.friction_factor = 1.5}), Fault::none);
  const double nan = std::nan("");
  EXPECT_EQ(plant.reset(nan, {}), Fault::input_not_finite);
  EXPECT_EQ(plant.reset(0.1, {.gravity_Nm = nan}), Fault::input_not_finite);
  EXPECT_EQ(plant.reset(PlantState{.middle_speed_rad_s = nan}), Fault::input_not_finite);
  for (const PlantCondition& condition :
       {PlantCondition{.friction_factor = nan}, PlantCondition{.friction_factor = -1.0},
        PlantCondition{.torque_constant_factor = 1e9}, PlantCondition{.second_stage_factor = -0.1},
        PlantCondition{.stop_twist_rad = -0.1}, PlantCondition{.stop_twist_rad = nan},
        PlantCondition{.stop_stiffness_Nm_rad = 1e12}}) {
    EXPECT_EQ(plant.set_condition(condition), Fault::input_not_finite);
  }
  EXPECT_EQ(plant.state().joint_angle_rad, 0.3);
  EXPECT_EQ(plant.condition().friction_factor, 1.5);
}

TEST(Plant, StateThatIsNoLongerFiniteIsAFaultAndEndsAtRest) {
  const PlantParameters parts = plant_parameters(data_sheet("dfki-28"));
  const Load push{.external_torque_Nm = 1e308};
  Plant plant(parts);
  EXPECT_EQ(plant.step({}, push, 1.0), Fault::model_not_finite);
  EXPECT_EQ(plant.state().joint_angle_rad, 0.0);
  EXPECT_EQ(plant.step({}, {}, kStep_s), Fault::none);
  PlantBatch batch(std::vector<PlantParameters>(3, parts));
  const std::vector<PlantCommand> commands(3);
  std::vector<Load> loads(3);
  loads[1] = push;
  EXPECT_EQ(batch.step(commands, loads, 1.0), Fault::model_not_finite);
  EXPECT_EQ(batch.fault(0), Fault::none);
  EXPECT_EQ(batch.fault(1), Fault::model_not_finite);
  EXPECT_EQ(batch.state(1).joint_angle_rad, 0.0);
  EXPECT_EQ(batch.step(commands, std::vector<Load>(3), kStep_s), Fault::none);
}

TEST(PlantBatch, ImpossibleStartOrConditionIsAFaultAndNothingChanges) {
  PlantBatch batch(std::vector<PlantParameters>(2, plant_parameters(data_sheet("dfki-28"))));
  ASSERT_EQ(batch.reset(0.3, {}), Fault::none);
  EXPECT_EQ(batch.reset(1, std::nan(""), {}), Fault::input_not_finite);
  EXPECT_EQ(batch.reset(1, PlantState{.joint_angle_rad = std::nan("")}), Fault::input_not_finite);
  EXPECT_EQ(batch.set_condition(1, {.friction_factor = -1.0}), Fault::input_not_finite);
  EXPECT_EQ(batch.state(1).joint_angle_rad, 0.3);
}

TEST(Plant, RefusesAStepTooLongForItsDampingAndNamesTheLimit) {
  PlantParameters parts = plant_parameters(data_sheet("dfki-50"));
  parts.joint_viscous_Nms_rad = 2e4 * parts.joint_inertia_kg_m2;
  try {
    Plant(parts, 1e-4);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.report().problem, "the step does not suit the strongest damping");
    EXPECT_EQ(error.report().expected.substr(0, 20), "0 s < step <= 2.5e-0");
  }
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
