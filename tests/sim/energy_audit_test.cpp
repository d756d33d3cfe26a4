#include "torsio/sim/energy_audit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "support/every_actuator.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {
namespace {

constexpr double kStep_s = 1e-4;

/// What the books say after a long random drive.
struct Books {
  double throughput_J = 0.0;
  double lost_J = 0.0;
  double largest_residual_J = 0.0;
  double hysteretic_loss_J = 0.0;
  double largest_fall_J = 0.0;  ///< of the hysteretic loss, below what it had reached
};

/// A smooth random current and a smooth random torque on the output, each three tenths of what is
/// rated.
Books driven_at_random(const std::string& actuator, double longest_step_s = 0.0) {
  constexpr double kShare = 0.3;
  constexpr int kTicks = 30'000;
  const DataSheet sheet = data_sheet(actuator);
  const PlantParameters parts = plant_parameters(sheet);
  Plant plant(parts, longest_step_s);
  const int steps = static_cast<int>(std::ceil(1e-3 / plant.longest_step()));
  const double step_s = 1e-3 / steps;
  RandomWalk current({.rms = kShare * sheet.rating.current_A.value, .cutoff_Hz = 2.0, .seed = 3},
                     1000.0);
  RandomWalk torque({.rms = kShare * sheet.rating.torque_Nm.value, .cutoff_Hz = 1.0, .seed = 4},
                    1000.0);
  Load load = test::tenth_of_the_rating(sheet);
  plant.reset(0.0, load);
  EnergyAudit audit(plant, load);
  double largest_J = 0.0;
  Books books;
  for (int tick = 0; tick < kTicks; ++tick) {
    const PlantCommand command{.current_A = current.step()};
    load.external_torque_Nm = torque.step();
    for (int i = 0; i < steps; ++i) {
      EXPECT_EQ(plant.step(command, load, step_s), Fault::none);
      audit.observe(plant, load, step_s);
    }
    books.largest_residual_J = std::max(books.largest_residual_J, std::abs(audit.residual()));
    largest_J = std::max(largest_J, audit.hysteretic_loss());
    books.largest_fall_J = std::max(books.largest_fall_J, largest_J - audit.hysteretic_loss());
  }
  books.throughput_J = audit.throughput();
  books.lost_J = audit.lost();
  books.hysteretic_loss_J = audit.hysteretic_loss();
  return books;
}

// Measured: residuals of up to 6e-5 of the throughput (elastomer), falls of up to 1.5e-5 of the
// hysteretic loss (harmonic drive). A fall comes where the twist turns within a step.
TEST(EnergyAudit, BooksOfEveryActuatorCloseUnderARandomDrive) {
  for (const std::string& actuator : test::every_actuator()) {
    const Books books = driven_at_random(actuator);
    EXPECT_LT(books.largest_residual_J, 1e-4 * books.throughput_J) << actuator;
    EXPECT_LT(books.largest_fall_J, 5e-5 * books.hysteretic_loss_J)
        << actuator << ": a hysteretic element gave energy";
    EXPECT_GT(books.hysteretic_loss_J, 1e-4 * books.throughput_J) << actuator;
    EXPECT_GT(books.lost_J, 0.1 * books.throughput_J) << actuator;
  }
}

TEST(EnergyAudit, WhatDoesNotCloseIsTheStepsError) {
  for (const char* actuator : {"dfki-50", "elastomer", "harmonic-drive"}) {
    const Books books = driven_at_random(actuator);
    const Books finer = driven_at_random(actuator, 2.5e-5);
    EXPECT_LT(finer.largest_residual_J, 0.35 * books.largest_residual_J) << actuator;
    EXPECT_LT(finer.largest_fall_J, 0.6 * books.largest_fall_J) << actuator;
  }
}

TEST(EnergyAudit, SeesAPlantThatCreatesEnergy) {
  const PlantParameters parts = plant_parameters(data_sheet("dfki-50"));
  Plant plant(parts, kStep_s);
  const Load load = lever(9.0, 0.2);
  const Load billed = lever(9.0, 0.1);
  plant.reset(PlantState{.joint_angle_rad = 0.0, .joint_speed_rad_s = 1.0});
  EnergyAudit audit(plant, billed);
  for (int i = 0; i < 10000; ++i) {
    ASSERT_EQ(plant.step({}, load, kStep_s), Fault::none);
    audit.observe(plant, billed, kStep_s);
  }
  EXPECT_GT(std::abs(audit.residual()), 1e-2);
}

}  // namespace
}  // namespace torsio
