#include "parts/spring.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "parts/second_stage.hpp"
#include "sim/plant/plant.hpp"
#include "support/series_elastic.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

Spring spring_of(const DataSheet& sheet) {
  return Spring(std::get<Spring::Parameters>(plant_parameters(sheet).second));
}

/// The sheet's spring with each inner friction (specification 4.6), without viscosity.
std::vector<Spring> variants_of(const DataSheet& sheet) {
  std::vector<Spring> springs;
  for (const std::string_view variant : sheet.variants) {
    const DataSheet variant_sheet = data_sheet(fmt::format("{}:{}", sheet.name, variant));
    auto parameters = std::get<Spring::Parameters>(plant_parameters(variant_sheet).second);
    parameters.viscosity_Nms_rad = 0.0;
    springs.emplace_back(parameters);
  }
  return springs;
}

/// Work [J] that one turn around the path, a sample every `dt_s`, puts into the spring.
double work_of_one_turn(Spring& spring, const std::vector<double>& path, double dt_s) {
  double work_J = 0.0;
  double last_Nm = spring.step(path.back(), 0.0);
  double last_rad = path.back();
  for (const double deflection_rad : path) {
    const double torque_Nm = spring.step(deflection_rad, (deflection_rad - last_rad) / dt_s);
    work_J += 0.5 * (torque_Nm + last_Nm) * (deflection_rad - last_rad);
    last_Nm = torque_Nm;
    last_rad = deflection_rad;
  }
  return work_J;
}

TEST(Spring, NeverGivesWorkOnAClosedPath) {
  Random random(1);
  for (const DataSheet& sheet : test::series_elastic_sheets()) {
    for (int path = 0; path < 30; ++path) {
      const double amplitude_deg = 0.05 + 7.95 * random.uniform();  // beyond 5 deg: second stage
      const auto closed = random_closed_path(rad_from_deg(amplitude_deg), 4000, random);
      const double dt_s = std::pow(10.0, -4.0 + 2.0 * random.uniform());
      std::size_t variant = 0;
      for (Spring& spring : variants_of(sheet)) {
        work_of_one_turn(spring, closed, dt_s);
        work_of_one_turn(spring, closed, dt_s);
        const double work_J = work_of_one_turn(spring, closed, dt_s);
        EXPECT_GE(work_J, 0.0) << sheet.name << ", variant " << variant << ", path " << path << ", "
                               << amplitude_deg << " deg";
        ++variant;
      }
    }
  }
}

TEST(Spring, LoopIsAsWideAsItsFriction) {
  const DataSheet sheet = data_sheet("dfki-50");
  const auto& printed = std::get<SpringSheet>(sheet.second);
  Spring spring = spring_of(sheet);
  const double middle = rad_from_deg(2.0);
  for (double x = 0.0; x < 2.0 * middle; x += 1e-5) spring.step(x, 0.0);
  for (double x = 2.0 * middle; x > middle; x -= 1e-5) spring.step(x, 0.0);
  const double falling_Nm = spring.step(middle, 0.0);
  for (double x = middle; x > -2.0 * middle; x -= 1e-5) spring.step(x, 0.0);
  for (double x = -2.0 * middle; x < middle; x += 1e-5) spring.step(x, 0.0);
  const double rising_Nm = spring.step(middle, 0.0);
  const double limit_Nm =
      printed.friction_Nm.value + printed.load_friction.value * spring.elastic().torque(middle);
  EXPECT_NEAR(rising_Nm - falling_Nm, 2.0 * limit_Nm, 1e-6);
}

TEST(Spring, SticksWithTheStiffnessOfItsFriction) {
  Spring spring = spring_of(data_sheet("dfki-120"));
  spring.reset(0.01);
  const double elastic_Nm = spring.elastic().torque(0.01 + 1e-6);
  const double extra_Nm = spring.step(0.01 + 1e-6, 0.0) - elastic_Nm;
  EXPECT_NEAR(extra_Nm / 1e-6, spring.steepest(elastic_Nm) - spring.elastic().steepest(), 1e-3);
}

TEST(Spring, RefusesImpossibleParameters) {
  Spring::Parameters parameters{.elastic = {.stiffness_Nm_rad = 500.0},
                                .friction = MaxwellSlip<4>::Parameters{
                                    .constant_Nm = 1.0, .break_away_rad = {1e-3, 1e-3, 1e-3, 0.0}}};
  EXPECT_THROW(Spring{parameters}, Error);
  std::get<0>(parameters.friction).break_away_rad[3] = 1e-3;
  EXPECT_NO_THROW(Spring{parameters});
  parameters.viscosity_Nms_rad = -1.0;
  EXPECT_THROW(Spring{parameters}, Error);
}

}  // namespace
}  // namespace torsio
