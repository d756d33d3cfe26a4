#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "sim/experiments/results.hpp"
#include "sim/loops/bench_torque_loop.hpp"
#include "sim/plant/energy_audit.hpp"
#include "sim/plant/plant.hpp"
#include "support/error_message.hpp"
#include "support/straight_line.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::largest;
using test::stage_loss;

constexpr double kLog_Hz = 200.0;
constexpr std::size_t kSlowCycle = 4000;  // samples

Recording run(const std::string& actuator, const std::string& experiment) {
  return simulate({.actuator = actuator, .experiment = experiment, .with_truth = true});
}

std::vector<double> coupling_deg(const Recording& recording) {
  std::vector<double> deflection = recording.channel("truth_coupling_deflection_rad").values;
  for (double& angle : deflection) angle = deg_from_rad(angle);
  return deflection;
}

const std::vector<double>& torque(const Recording& recording) {
  return recording.channel("truth_torque_Nm").values;
}

double norm(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares);
}

/// BF of paper 003 [%]: 100 (1 − ‖y − ŷ‖ / ‖y − mean y‖).
double best_fit(const std::vector<double>& measured, const std::vector<double>& model) {
  double mean = 0.0;
  for (const double value : measured) mean += value / static_cast<double>(measured.size());
  std::vector<double> error(measured.size());
  std::vector<double> spread(measured.size());
  for (std::size_t i = 0; i < measured.size(); ++i) {
    error[i] = measured[i] - model[i];
    spread[i] = measured[i] - mean;
  }
  return 100.0 * (1.0 - norm(error) / norm(spread));
}

/// Model (a) of paper 003 with its printed parameters, (d1|k1)-(d2|k2)-k3 in Nm, deg and s
/// (specification 2.1 and 3.6), from rest; the twist is linear between samples.
std::vector<double> model_a(const std::vector<double>& twist_deg) {
  constexpr std::array kDamping = {2.172, 13.46};
  constexpr std::array kStiffness = {3.803, 0.564};
  constexpr double kSeries = 1.737;
  constexpr int kParts = 50;
  constexpr double kPart_s = 1.0 / (kLog_Hz * kParts);
  std::array creep = {0.0, 0.0};
  double before_deg = 0.0;
  std::vector<double> torque_Nm;
  for (const double now_deg : twist_deg) {
    for (int part = 0; part < kParts; ++part) {
      const double at_deg = before_deg + (now_deg - before_deg) * (part + 0.5) / kParts;
      const double max_measured_load_Nm = kSeries * (at_deg - creep[0] - creep[1]);
      for (std::size_t j = 0; j < creep.size(); ++j)
        creep[j] += kPart_s * (max_measured_load_Nm - kStiffness[j] * creep[j]) / kDamping[j];
    }
    before_deg = now_deg;
    torque_Nm.push_back(kSeries * (now_deg - creep[0] - creep[1]));
  }
  return torque_Nm;
}

/// The torque at the moments when the twist passes 0, from `first` on.
std::vector<double> torque_without_twist(const Recording& recording, std::size_t first) {
  const std::vector<double> twist = coupling_deg(recording);
  std::vector<double> found;
  for (std::size_t i = first; i < twist.size(); ++i) {
    if (twist[i - 1] * twist[i] < 0.0) found.push_back(torque(recording)[i]);
  }
  return found;
}

TEST(Triangles, AreFollowedFromTheSlowestToTheFastest) {
  // Errors, as a share of the amplitude, stem from the drive's friction, 0.4 Nm + 10 %, which turns
  // over at every corner.
  struct Case {
    double frequency_Hz;
    double amplitude_Nm;
    double rmse_share;
  };
  for (const Case& of : {Case{0.4, 5.0, 0.04}, Case{1.0, 5.0, 0.07}, Case{4.0, 2.0, 0.16}}) {
    const Recording recording = simulate({.actuator = "elastomer",
                                          .experiment = "triangles",
                                          .torque_amplitude_Nm = of.amplitude_Nm,
                                          .frequency_Hz = of.frequency_Hz,
                                          .with_truth = true});
    Triangle wanted({of.amplitude_Nm, of.frequency_Hz}, kLog_Hz);
    std::vector<double> error;
    for (const double torque_Nm : torque(recording)) error.push_back(wanted.step() - torque_Nm);
    const double rmse = norm(error) / std::sqrt(static_cast<double>(error.size()));
    EXPECT_LT(rmse, of.rmse_share * of.amplitude_Nm) << of.frequency_Hz << " Hz";
    EXPECT_GT(largest(torque(recording)), 0.9 * of.amplitude_Nm);
  }
}

TEST(Triangles, AreLoggedAtTwoHundredHertzWithTwelveBitsOfTwist) {
  const Recording recording = simulate({.actuator = "elastomer", .experiment = "triangles"});
  EXPECT_EQ(recording.sample_rate_Hz(), kLog_Hz);
  EXPECT_EQ(recording.size(), 6000U);
  const auto& twist = recording.channel("spring_deflection_rad").values;
  const std::set<double> codes(twist.begin(), twist.end());
  double last = *codes.begin();
  double smallest = 1.0;
  for (const double code : codes) {
    if (code != last) smallest = std::min(smallest, code - last);
    last = code;
  }
  EXPECT_NEAR(deg_from_rad(smallest), 0.0879, 1e-4);
  EXPECT_NEAR(largest(recording.channel("torque_Nm").values), 5.0, 0.1);
}

// Specification 4.3 has 90.6 and 73.6 % for twists that the inverse of (a) gives instead of a loop
// with friction.
TEST(Triangles, ModelAOfThePaperFitsThemAsInThePrototype) {
  const Recording recording = simulate({.actuator = "elastomer", .experiment = "triangles"});
  std::vector<double> twist_deg = recording.channel("spring_deflection_rad").values;
  for (double& angle : twist_deg) angle = deg_from_rad(angle);
  const std::vector<double>& measured = recording.channel("torque_Nm").values;
  EXPECT_NEAR(best_fit(measured, model_a(twist_deg)), 90.6, 2.5);
  const test::Line line = test::straight_line(twist_deg, measured);
  std::vector<double> on_line = twist_deg;
  for (double& value : on_line) value = line.intercept + line.slope * value;
  EXPECT_NEAR(best_fit(measured, on_line), 73.6, 2.5);
}

// No reference from 003: its ±8 deg at ±6 Nm (Fig. 7) are of another coupling, geometry α, than its
// models, geometry ε. The printed output curve is stiffer to the negative side.
TEST(SlowCycles, BondedLoopSpansSixNewtonMetres) {
  const Recording recording = run("elastomer", "slow-cycles");
  EXPECT_EQ(recording.size(), 30 * kSlowCycle);
  const auto [low, high] = std::ranges::minmax_element(torque(recording));
  EXPECT_NEAR(*low, -6.0, 0.1);
  EXPECT_NEAR(*high, 6.0, 0.1);
  const std::vector<double> twist = coupling_deg(recording);
  EXPECT_NEAR(*std::ranges::max_element(twist), 7.5, 0.5);
  EXPECT_NEAR(*std::ranges::min_element(twist), -4.0, 0.5);
}

TEST(SlowCycles, UnbondedLoopsMeetAtZeroAndAreSofter) {
  const Recording bonded = run("elastomer", "slow-cycles");
  const Recording unbonded = run("elastomer:unbonded", "slow-cycles");
  const std::vector<double> open = torque_without_twist(bonded, kSlowCycle);
  const std::vector<double> met = torque_without_twist(unbonded, kSlowCycle);
  ASSERT_GE(open.size(), 50U);
  ASSERT_GE(met.size(), 50U);
  EXPECT_GT(largest(open), 1.0);
  EXPECT_LT(largest(met), 0.1);
  // The first rise, before lobes that crept leave a gap.
  const std::size_t top = kSlowCycle / 4;
  EXPECT_NEAR(coupling_deg(unbonded)[top] / coupling_deg(bonded)[top], 1.4, 0.03);
  EXPECT_NEAR(torque(unbonded)[top], torque(bonded)[top], 0.1);
}

TEST(SlowCycles, CreepingGlueLosesItsShareEachCycle) {
  const Recording recording = run("elastomer:creeping", "slow-cycles");
  const auto& twist_rad = recording.channel("truth_coupling_deflection_rad").values;
  const PlantParameters parts = plant_parameters(data_sheet("elastomer"));
  ElastomerCoupling sound(std::get<ElastomerCoupling::Parameters>(parts.second));
  sound.set_period(1.0 / kLog_Hz);
  sound.reset();
  for (std::size_t i = 0; i < twist_rad.size(); ++i) {
    const double before_rad = i == 0 ? 0.0 : twist_rad[i - 1];
    const double sound_Nm = sound.step(twist_rad[i], (twist_rad[i] - before_rad) * kLog_Hz);
    // The lowest point of a cycle: what the cycle before has cost is gone.
    if (i % kSlowCycle != 3 * kSlowCycle / 4) continue;
    const std::size_t cycles = i / kSlowCycle;
    EXPECT_NEAR(torque(recording)[i] / sound_Nm, std::pow(0.997, static_cast<double>(cycles)),
                0.003)
        << cycles;
  }
}

TEST(SlowCycles, AskWhatCreepingGlueStillCarries) {
  const Recording recording = run("elastomer:creeping", "slow-cycles");
  const double highest_Nm = 6.0 * std::pow(0.997, 30.0);
  EXPECT_NEAR(largest(torque(recording)), highest_Nm, 0.1);
  EXPECT_LT(largest(coupling_deg(recording)), 9.0);
  EXPECT_NE(test::error_message([] {
              static_cast<void>(simulate({.actuator = "elastomer:creeping",
                                          .experiment = "slow-cycles",
                                          .torque_amplitude_Nm = 6.0}));
            }).find("at most 5.483 Nm"),
            std::string::npos);
}

TEST(Hold, CreepsRelaxesAndRecovers) {
  const Recording recording = run("elastomer", "hold");
  const auto at = [](double time_s) { return static_cast<std::size_t>(time_s * kLog_Hz); };
  const std::vector<double> twist = coupling_deg(recording);
  EXPECT_NEAR(torque(recording)[at(2.0)], 3.0, 0.1);
  EXPECT_NEAR(torque(recording)[at(59.0)], 3.0, 0.05);
  EXPECT_GT(twist[at(59.0)], 2.0 * twist[at(2.0)]) << "creep";
  EXPECT_NEAR(twist[at(119.0)], twist[at(61.0)], 0.02) << "the rotor is held";
  EXPECT_LT(torque(recording)[at(119.0)], torque(recording)[at(61.0)] - 0.05) << "relaxation";
  EXPECT_NEAR(torque(recording)[at(122.0)], 0.0, 0.05);
  EXPECT_LT(twist[at(179.0)], 0.3 * twist[at(122.0)]) << "recovery";
}

TEST(Elastomer, EveryExperimentOfEveryVariantIsFinite) {
  for (const char* actuator : {"elastomer", "elastomer:unbonded", "elastomer:creeping"}) {
    for (const char* experiment : {"triangles", "slow-cycles", "static-cycle", "chirp",
                                   "random-walk", "multisine", "hold"}) {
      const Recording recording = simulate({.actuator = actuator, .experiment = experiment});
      for (const Channel& channel : recording.channels()) {
        EXPECT_TRUE(std::ranges::all_of(channel.values, [](double v) { return std::isfinite(v); }))
            << recording.name() << " " << channel.name;
      }
      EXPECT_LT(largest(recording.channel("torque_Nm").values), 6.3) << recording.name();
    }
  }
}

TEST(Elastomer, SameSeedSameRecordingOtherSeedOtherReference) {
  for (const char* experiment : {"random-walk", "multisine"}) {
    ExperimentSpec spec{
        .actuator = "elastomer", .experiment = experiment, .duration_s = 5.0, .with_truth = true};
    const Recording first = simulate(spec);
    const Recording again = simulate(spec);
    spec.seed = 2;
    const Recording differing = simulate(spec);
    for (const Channel& channel : first.channels())
      EXPECT_EQ(channel.values, again.channel(channel.name).values) << channel.name;
    std::vector<double> difference = torque(first);
    for (std::size_t i = 0; i < difference.size(); ++i) difference[i] -= torque(differing)[i];
    EXPECT_GT(largest(difference), 0.5) << experiment;
  }
}

TEST(Elastomer, RefusesWhatItsBenchCannotDo) {
  const auto message = [](const ExperimentSpec& spec) {
    return test::error_message([&] { static_cast<void>(simulate(spec)); });
  };
  ExperimentSpec spec{.actuator = "elastomer", .experiment = "triangles", .frequency_Hz = 0.3};
  EXPECT_NE(message(spec).find("0.4 to 4 Hz"), std::string::npos);
  spec.frequency_Hz = 4.1;
  EXPECT_NE(message(spec).find("0.4 to 4 Hz"), std::string::npos);
  spec = {.actuator = "elastomer", .experiment = "triangles", .torque_amplitude_Nm = 6.1};
  EXPECT_NE(message(spec).find("at most 6 Nm"), std::string::npos);
  EXPECT_NE(message({.actuator = "elastomer", .experiment = "sweep"}).find("one of triangles"),
            std::string::npos);
}

TEST(Elastomer, NoEnergyAppearsFromNothingInTriangles) {
  constexpr double kStep_s = 1e-4;
  const Load locked{.is_locked = true};
  for (const char* name : {"elastomer", "elastomer:unbonded", "elastomer:creeping"}) {
    const PlantParameters parts = plant_parameters(data_sheet(name));
    const ElastomerCoupling coupling(std::get<ElastomerCoupling::Parameters>(parts.second));
    Plant plant(parts, kStep_s);
    plant.reset(0.0, locked);
    EnergyAudit audit(plant, locked);
    BenchTorqueLoop loop(parts, coupling.chain().stiffness(), 1000.0);
    Triangle wanted({5.0, 1.0}, 1000.0);
    double largest_loss_J = 0.0;
    double deepest_fall_J = 0.0;
    for (int tick = 0; tick < 20000; ++tick) {
      const PlantCommand command{.current_A = loop.step(wanted.step(), plant.torques().joint_Nm,
                                                        plant.state().rotor_angle_rad)};
      for (int i = 0; i < 10; ++i) {
        ASSERT_EQ(plant.step(command, locked, kStep_s), Fault::none);
        audit.observe(plant, locked, kStep_s);
      }
      const double elapsed_s = 1e-3 * (tick + 1);
      ASSERT_LE(std::abs(audit.residual()), 1e-6 + 1e-3 * elapsed_s * (1e-2 + audit.throughput()))
          << name << " at " << elapsed_s << " s";
      largest_loss_J = std::max(largest_loss_J, stage_loss(audit));
      deepest_fall_J = std::max(deepest_fall_J, largest_loss_J - stage_loss(audit));
    }
    EXPECT_LT(deepest_fall_J, 1e-4 * stage_loss(audit)) << name << " gave energy";
    EXPECT_GT(stage_loss(audit), 0.1) << name;
    EXPECT_LT(std::abs(audit.residual()), 1e-5 * audit.throughput()) << name;
  }
}

}  // namespace
}  // namespace torsio
