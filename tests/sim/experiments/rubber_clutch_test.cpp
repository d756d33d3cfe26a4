#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "sim/experiments/results.hpp"
#include "sim/loops/bench_position_loop.hpp"
#include "sim/plant/energy_audit.hpp"
#include "support/refusal.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::largest;
using test::range;
using test::stage_loss;

constexpr double kStatic_Nm = 0.5;
constexpr double kSliding_Nm = 0.45;
constexpr double kCable_Nm_rad = 50.0;
constexpr double kBandwidth_rad_s = 200.0;

Recording record(const char* experiment, std::uint64_t seed = 1) {
  return simulate(
      {.actuator = "rubber-clutch", .experiment = experiment, .seed = seed, .with_truth = true});
}

Recording sine(double amplitude_deg, double frequency_Hz) {
  return simulate({.actuator = "rubber-clutch",
                   .experiment = "grid",
                   .angle_amplitude_rad = rad_from_deg(amplitude_deg),
                   .frequency_Hz = frequency_Hz,
                   .with_truth = true});
}

const std::vector<double>& values(const Recording& recording, const char* channel) {
  return recording.channel(channel).values;
}

/// How far the clutch has slipped, at each sample [rad].
std::vector<double> slipped(const Recording& recording) {
  const auto& twist = values(recording, "truth_clutch_deflection_rad");
  const auto& torque = values(recording, "truth_clutch_torque_Nm");
  std::vector<double> slip(twist.size());
  for (std::size_t i = 0; i < slip.size(); ++i) slip[i] = twist[i] - torque[i] / kCable_Nm_rad;
  return slip;
}

/// Results from the last periods of a sine.
struct HysteresisLoop {
  double width_Nm = 0.0;          ///< at the middle
  double stiffness_Nm_rad = 0.0;  ///< from end to end
  double height_Nm = 0.0;         ///< from end to end
};
HysteresisLoop loop_of(const Recording& recording, double frequency_Hz) {
  const auto& angle = values(recording, "truth_rubber_deflection_rad");
  const auto& torque = values(recording, "truth_torque_Nm");
  const std::size_t first =
      angle.size() -
      static_cast<std::size_t>(std::lround(2.0 * recording.sample_rate_Hz() / frequency_Hz));
  double up_Nm = 0.0;
  double down_Nm = 0.0;
  for (std::size_t i = first; i + 1 < angle.size(); ++i) {
    if (angle[i] * angle[i + 1] > 0.0) continue;
    const double share = angle[i] / (angle[i] - angle[i + 1]);
    (angle[i + 1] > angle[i] ? up_Nm : down_Nm) = torque[i] + share * (torque[i + 1] - torque[i]);
  }
  const double height_Nm = range(std::span(torque).subspan(first));
  return {up_Nm - down_Nm, height_Nm / range(std::span(angle).subspan(first)), height_Nm};
}

// A fitted value, not a result: the stiffness is that of the paper's 12.4 and -11.3 deg at 0.5 Nm,
// and the elastic share of 0.964 makes curve and slip elements meet them together.
TEST(RubberClutch, SlowTestMeetsTheAnglesThatTheSheetWasFittedTo) {
  const Recording recording = record("slow-cycles");
  const auto& torque = values(recording, "truth_torque_Nm");
  const auto& deflection = values(recording, "truth_rubber_deflection_rad");
  const auto angle_deg = [&](auto reaches) {
    const auto found = std::ranges::find_if(torque, reaches);
    return deg_from_rad(deflection[static_cast<std::size_t>(found - torque.begin())]);
  };
  EXPECT_NEAR(angle_deg([](double torque_Nm) { return torque_Nm > 0.998 * kStatic_Nm; }), 12.4,
              0.2);
  EXPECT_NEAR(angle_deg([](double torque_Nm) { return torque_Nm < -0.998 * kStatic_Nm; }), -11.3,
              0.2);
  EXPECT_NEAR(largest(torque), kStatic_Nm, 0.002);
  const auto& input = values(recording, "input_angle_rad");
  // 1 rad/min, seen over ten seconds of the first ramp.
  EXPECT_NEAR((input[600] - input[100]) / 10.0, 1.0 / 60.0, 1e-4);
}

// Paper 002, section IV-A: "the magnitude of the output torque [...] decreases when the stator and
// the rotor of the clutch slide". It prints no number for it.
TEST(RubberClutch, SlowTestLosesTorqueInBothDirectionsOnceTheClutchSlides) {
  const Recording recording = record("slow-cycles");
  const auto& torque = values(recording, "truth_torque_Nm");
  const std::vector<double> slip = slipped(recording);
  for (const double sign : {1.0, -1.0}) {
    const auto reached = std::ranges::find_if(
        torque, [&](double torque_Nm) { return sign * torque_Nm > 0.998 * kStatic_Nm; });
    ASSERT_NE(reached, torque.end());
    const auto at = static_cast<std::size_t>(reached - torque.begin());
    double lowest_Nm = kStatic_Nm;
    for (std::size_t i = at; i < at + 50; ++i)  // 1 s, in which the input turns by 1 deg
      lowest_Nm = std::min(lowest_Nm, sign * torque[i]);
    EXPECT_LE(lowest_Nm, kSliding_Nm) << sign;
    EXPECT_GT(lowest_Nm, 0.5 * kStatic_Nm) << sign;
    EXPECT_GT(sign * (slip[at + 50] - slip[at]), rad_from_deg(0.5)) << sign;
  }
}

TEST(RubberClutch, SlipsAtItsStaticTorqueAndThenHoldsNineTenths) {
  const Recording recording = record("slip");
  const auto& clutch = values(recording, "truth_clutch_torque_Nm");
  EXPECT_LE(largest(clutch), kStatic_Nm);
  for (const double sign : {1.0, -1.0}) {
    // From rest to one end, and over to the other one.
    const std::size_t first = sign > 0.0 ? 0 : 250;
    const std::size_t last = sign > 0.0 ? 100 : 450;
    std::size_t begins = first;
    const auto slides = [&](std::size_t i) {
      return std::abs(sign * clutch[i] - kSliding_Nm) < 1e-12;
    };
    while (begins < last && !slides(begins)) ++begins;
    ASSERT_LT(begins, last) << "never seen slipping";
    double reached_Nm = 0.0;
    for (std::size_t i = first; i < begins; ++i)
      reached_Nm = std::max(reached_Nm, sign * clutch[i]);
    EXPECT_GT(reached_Nm, 0.97 * kStatic_Nm);
    EXPECT_GT(std::count_if(clutch.begin() + static_cast<std::ptrdiff_t>(begins),
                            clutch.begin() + static_cast<std::ptrdiff_t>(last),
                            [&](double torque_Nm) {
                              return std::abs(sign * torque_Nm - kSliding_Nm) < 1e-12;
                            }),
              2)
        << "sticks and slips in turn";
  }
}

TEST(RubberClutch, TorqueSensorSeesTheDropFromStaticToSlidingFriction) {
  const Recording recording = record("slip");
  const auto& torque = values(recording, "torque_Nm");
  double drop_Nm = 0.0;
  for (std::size_t i = 1; i < 100; ++i) drop_Nm = std::max(drop_Nm, torque[i - 1] - torque[i]);
  EXPECT_GT(drop_Nm, 0.8 * (kStatic_Nm - kSliding_Nm));
  for (std::size_t i = 110; i < 200; ++i)
    EXPECT_LT(torque[i], kSliding_Nm) << "the torque relaxes at rest";
}

TEST(RubberClutch, SticksAgainOnReversal) {
  const Recording recording = record("slip");
  const std::vector<double> slip = slipped(recording);
  const auto& input = values(recording, "input_angle_rad");
  EXPECT_GT(deg_from_rad(slip[200] - slip[0]), 6.0) << "20 deg, of which 13 are elastic";
  const auto torque = std::span(values(recording, "truth_clutch_torque_Nm"));
  std::size_t last = 205;
  while (torque[last] > -0.9 * kSliding_Nm) ++last;
  EXPECT_LT(range(std::span(slip).subspan(205, last - 205)), 1e-4);
  const double stiffness_Nm_deg =
      (torque[205] - torque[last]) / deg_from_rad(input[205] - input[last]);
  EXPECT_NEAR(stiffness_Nm_deg, 0.042, 0.004) << "cable and rubber in series";
}

TEST(RubberClutch, MultisineStaysBelowSlipForTheTwentyFourSeeds) {
  std::vector<double> ends_deg;
  for (std::uint64_t seed = 1; seed <= 24; ++seed) {
    const Recording recording = record("multisine", seed);
    EXPECT_EQ(recording.size(), 2000U);
    EXPECT_LT(largest(values(recording, "truth_clutch_torque_Nm")), 0.96 * kStatic_Nm) << seed;
    EXPECT_LT(range(slipped(recording)), 1e-4) << seed;
    ends_deg.push_back(deg_from_rad(largest(values(recording, "input_angle_rad"))));
    EXPECT_GT(ends_deg.back(), 3.8) << seed;
    EXPECT_LT(ends_deg.back(), 9.2) << seed;
  }
  EXPECT_GT(range(ends_deg), 3.0) << "the amplitude is drawn";
}

TEST(RubberClutch, InputAngleFollowsNineDegreesAtOneHertz) {
  const Recording recording = sine(9.0, 1.0);
  const auto& input = values(recording, "input_angle_rad");
  double error_deg = 0.0;
  for (std::size_t i = 0; i < input.size(); ++i) {
    const double wanted_deg = 9.0 * std::sin(2.0 * std::numbers::pi * recording.time_s(i));
    error_deg = std::max(error_deg, std::abs(deg_from_rad(input[i]) - wanted_deg));
  }
  RecordProperty("tracking_error_deg", std::to_string(error_deg));
  EXPECT_LT(error_deg, 0.2);
}

TEST(RubberClutch, SensorsAreThoseOfTheSheet) {
  const Recording recording = record("grid");
  EXPECT_EQ(recording.sample_rate_Hz(), 50.0);
  const auto& torque = values(recording, "torque_Nm");
  const auto& truth = values(recording, "truth_torque_Nm");
  const auto& input = values(recording, "input_angle_rad");
  const double count_rad = 2.0 * std::numbers::pi / (4096.0 * 51.0);
  double square = 0.0;
  for (std::size_t i = 0; i < torque.size(); ++i) {
    square += (torque[i] - truth[i]) * (torque[i] - truth[i]);
    const double counts = (input[i] - input[0]) / count_rad;
    ASSERT_NEAR(counts, std::round(counts), 1e-6);
  }
  EXPECT_NEAR(std::sqrt(square / static_cast<double>(torque.size())), 0.5e-3, 0.025e-3);
}

TEST(RubberClutch, GridWalksAllItsPointsFromRest) {
  const Recording recording = record("grid");
  const auto& input = values(recording, "input_angle_rad");
  std::vector<double> peaks_deg(1, 0.0);
  std::size_t at_rest = 0;
  for (const double angle_rad : input) {
    const double angle_deg = std::abs(deg_from_rad(angle_rad));
    at_rest = angle_deg < 0.1 ? at_rest + 1 : 0;
    if (at_rest == 15) peaks_deg.push_back(0.0);
    peaks_deg.back() = std::max(peaks_deg.back(), angle_deg);
  }
  ASSERT_EQ(peaks_deg.size(), 221U) << "the first is before the first point";
  for (std::size_t i = 0; i < 220; ++i)
    EXPECT_NEAR(peaks_deg[i + 1], 4.0 + 0.5 * static_cast<double>(i % 11), 0.15) << i;
  EXPECT_NEAR(static_cast<double>(input.size()), 44554.0, 50.0) << "near the paper's samples";
  EXPECT_LT(range(slipped(recording)), 1e-4);
}

TEST(RubberClutch, LoopGrowsAndSoftensWithTheAmplitude) {
  const HysteresisLoop small = loop_of(sine(1.0, 0.1), 0.1);
  const HysteresisLoop middle = loop_of(sine(4.0, 0.1), 0.1);
  const HysteresisLoop large = loop_of(sine(9.0, 0.1), 0.1);
  EXPECT_GT(small.width_Nm, 0.005);
  EXPECT_GT(middle.width_Nm, 1.2 * small.width_Nm);
  EXPECT_GT(large.width_Nm, 1.1 * middle.width_Nm);
  EXPECT_LT(middle.stiffness_Nm_rad, 0.92 * small.stiffness_Nm_rad) << "Payne";
  EXPECT_LT(large.stiffness_Nm_rad, 0.98 * middle.stiffness_Nm_rad);
}

TEST(RubberClutch, RubberIsStifferWhenTurnedFaster) {
  const HysteresisLoop slow = loop_of(sine(9.0, 0.1), 0.1);
  const HysteresisLoop fast = loop_of(sine(9.0, 1.0), 1.0);
  EXPECT_GT(fast.stiffness_Nm_rad, 1.03 * slow.stiffness_Nm_rad);
  EXPECT_LT(fast.stiffness_Nm_rad, 1.15 * slow.stiffness_Nm_rad) << "three branches of 5 % each";
}

TEST(RubberClutch, HeldAngleRelaxes) {
  const Recording recording = record("hold");
  const auto& torque = values(recording, "truth_torque_Nm");
  EXPECT_GT(torque[46] - torque[96], 0.003) << "one second after the ramp";
  EXPECT_LT(std::abs(torque[1000] - torque[1500]), 1e-4) << "relaxed";
  EXPECT_NEAR(deg_from_rad(values(recording, "input_angle_rad").back()), 9.0, 0.02);
}

TEST(RubberClutch, StaticCycleReachesFourFifthsOfTheRating) {
  const Recording recording = record("static-cycle");
  EXPECT_NEAR(largest(values(recording, "torque_Nm")), 0.4, 0.004);
  EXPECT_LT(range(slipped(recording)), 1e-4);
}

/// Largest contact torque of the collision with a clutch that slips at this torque.
double contact_Nm(double static_torque_Nm) {
  DataSheet sheet = data_sheet("rubber-clutch");
  std::get<ClutchSheet>(sheet.first).static_torque_Nm.value = static_torque_Nm;
  return largest(
      values(simulate(sheet, {.actuator = {}, .experiment = "collision", .with_truth = true}),
             "torque_Nm"));
}

TEST(RubberClutch, LimitsTheTorqueOfACollisionToThatOfItsClutch) {
  for (const double static_torque_Nm : {0.5, 0.6, 0.7, 0.8})
    EXPECT_NEAR(contact_Nm(static_torque_Nm), static_torque_Nm, 0.01 * static_torque_Nm);
  // Without slip the contact has the torque of cable and rubber in series, turned by 27 deg.
  const double without_Nm = contact_Nm(100.0);
  EXPECT_EQ(contact_Nm(50.0), without_Nm);
  const double rubber_Nm_rad = 0.5 / rad_from_deg(12.4);  // its secant
  EXPECT_NEAR(without_Nm, rad_from_deg(27.0) / (1.0 / rubber_Nm_rad + 1.0 / kCable_Nm_rad), 0.03);
}

// Fitted values, not results: the arm is 0.5 Nm / 8.82 N, and the way of 27 deg is the whole degree
// that comes nearest to 18.29 N, of which half a degree is 0.34 N. It is another test than the
// paper's.
TEST(RubberClutch, CollisionHasTheForcesThatItsArmAndWayWereFittedTo) {
  constexpr double kArm_m = 0.0567;
  EXPECT_NEAR(contact_Nm(kStatic_Nm) / kArm_m, 8.82, 0.05);
  EXPECT_NEAR(contact_Nm(100.0) / kArm_m, 18.29, 0.35);
}

TEST(RubberClutch, CollisionTouchesAtTheWallAndLetsGo) {
  const Recording recording = record("collision");
  const auto& joint = values(recording, "joint_angle_rad");
  const auto& contact = values(recording, "truth_torque_Nm");
  for (std::size_t i = 0; i < joint.size(); ++i) {
    if (contact[i] > 0.0) {
      EXPECT_GT(deg_from_rad(joint[i]), 44.95) << i;
    }
  }
  EXPECT_NEAR(deg_from_rad(*std::ranges::max_element(joint)), 45.1, 0.1) << "a stiff wall";
  EXPECT_EQ(contact.front(), 0.0);
  EXPECT_EQ(contact.back(), 0.0);
}

/// The input follows a reference, the output clamped; `after_step` is called after each step.
template <class Reference, class AfterStep>
void follow(Plant& plant, Reference reference, double duration_s, double dt_s,
            const AfterStep& after_step) {
  const Load load{.is_locked = true};
  BenchPositionLoop loop(plant.parameters(), 1000.0, kBandwidth_rad_s);
  const int steps = static_cast<int>(std::lround(1e-3 / dt_s));
  for (int tick = 0; tick < static_cast<int>(std::lround(1000.0 * duration_s)); ++tick) {
    const PlantCommand command{.current_A =
                                   loop.step(reference.step(), plant.state().rotor_angle_rad)};
    for (int i = 0; i < steps; ++i) {
      ASSERT_EQ(plant.step(command, load, dt_s), Fault::none);
      after_step(load);
    }
  }
}

struct Books {
  double hysteretic_loss_J = 0.0;
  double largest_fall_J = 0.0;  ///< largest decrease of that loss
  double residual_share = 0.0;  ///< residual as a share of the throughput
};
template <class Reference>
Books books(const Reference& reference, double duration_s, double dt_s) {
  Plant plant(plant_parameters(data_sheet("rubber-clutch")), dt_s);
  EnergyAudit audit(plant, {.is_locked = true});
  Books of;
  double highest_J = 0.0;
  follow(plant, reference, duration_s, dt_s, [&](const Load& load) {
    audit.observe(plant, load, dt_s);
    highest_J = std::max(highest_J, stage_loss(audit));
    of.largest_fall_J = std::max(of.largest_fall_J, highest_J - stage_loss(audit));
  });
  of.hysteretic_loss_J = stage_loss(audit);
  of.residual_share = std::abs(audit.residual()) / audit.throughput();
  return of;
}

template <class Reference>
void expect_closed_books(const Reference& reference, double duration_s, double least_loss_J) {
  const Books of = books(reference, duration_s, 5e-5);
  EXPECT_GT(of.hysteretic_loss_J, least_loss_J);
  EXPECT_LT(of.residual_share, 5e-6);
  EXPECT_LT(of.largest_fall_J, 5e-5 * of.hysteretic_loss_J) << "a slip element gave energy";
  const Books finer = books(reference, duration_s, 2.5e-5);
  EXPECT_LT(finer.residual_share, 0.6 * of.residual_share) << "it is integration error";
  EXPECT_LT(finer.largest_fall_J, 0.6 * of.largest_fall_J) << "it is integration error";
}

TEST(RubberClutch, NoEnergyAppearsFromNothingOverTheGridsFrequencies) {
  expect_closed_books(
      Chirp({.amplitude = rad_from_deg(9.0), .start_Hz = 0.1, .end_Hz = 1.0, .duration_s = 20.0},
            1000.0),
      20.0, 0.05);
}

TEST(RubberClutch, NoEnergyAppearsFromNothingInSlip) {
  expect_closed_books(Triangle({.amplitude = rad_from_deg(20.0), .frequency_Hz = 0.125}, 1000.0),
                      16.0, 0.3);
}

TEST(RubberClutch, ErrorShrinksWithTheStep) {
  const auto torque_after_a_second = [](double dt_s) {
    Plant plant(plant_parameters(data_sheet("rubber-clutch")), dt_s);
    follow(plant, Chirp({.amplitude = rad_from_deg(9.0), .start_Hz = 0.8, .end_Hz = 0.8}, 1000.0),
           1.1, dt_s, [](const Load&) {});
    return plant.torques().joint_Nm;
  };
  const double reference = torque_after_a_second(1e-4 / 64.0);
  const double coarse = std::abs(torque_after_a_second(1e-4) - reference);
  const double middle = std::abs(torque_after_a_second(5e-5) - reference);
  const double fine = std::abs(torque_after_a_second(2.5e-5) - reference);
  RecordProperty("error_100us_Nm", std::to_string(coarse));
  EXPECT_LT(coarse, 1e-3);
  EXPECT_LT(middle, 0.65 * coarse);
  EXPECT_LT(fine, 0.65 * middle);
}

TEST(RubberClutch, RefusesWhatItsBenchCannotDo) {
  const auto grid = [](std::optional<double> amplitude, std::optional<double> frequency_Hz) {
    return test::refusal_of({.actuator = "rubber-clutch",
                             .experiment = "grid",
                             .angle_amplitude_rad = amplitude,
                             .frequency_Hz = frequency_Hz});
  };
  EXPECT_NE(grid({}, 0.0).find("0.001 to 10 Hz"), std::string::npos);
  EXPECT_NE(grid({}, 1.5).find("0 < Hz <= 1"), std::string::npos);
  EXPECT_NE(grid(rad_from_deg(12.0), {}).find("at most 9 deg"), std::string::npos)
      << "the clutch would slip";
  EXPECT_NE(test::refusal_of({.actuator = "rubber-clutch", .experiment = "sweep"})
                .find("one of grid, multisine, slow-cycles, slip, collision, hold, static-cycle"),
            std::string::npos);
}

}  // namespace
}  // namespace torsio
