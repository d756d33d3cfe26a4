#include "torsio/sim/closed_loop/impedance_tracking.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "ideal_tube.hpp"
#include "support/error_message.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/report/tracking.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

const ImpedanceSpec kSoft = {.kind = ImpedanceSpec::Kind::wanted,
                             .stiffness_Nm_rad = 1000.0,
                             .damping_Nms_rad = 30.0,
                             .duration_s = 10.0};

const ImpedanceRun& ideal_run() {
  static const ImpedanceRun run = track_impedance(test::ideal_tube(), kSoft, 1);
  return run;
}

const ImpedancePoint& at(const ImpedanceRun& run, double frequency_Hz) {
  for (const ImpedancePoint& point : run.points)
    if (point.frequency_Hz == frequency_Hz) return point;
  throw std::out_of_range("no such frequency");
}

TEST(ImpedanceTracking, RendersTheLinearModelWithoutDryFriction) {
  const ImpedanceRun& run = ideal_run();
  ASSERT_EQ(run.points.size(), 11U);
  for (const ImpedancePoint& point : run.points) {
    const std::complex<double> ratio = point.rendered_Nm_rad / point.linear_Nm_rad;
    EXPECT_NEAR(std::abs(ratio), 1.0, 0.03) << point.frequency_Hz;
    EXPECT_NEAR(deg_from_rad(std::arg(ratio)), 0.0, 2.0) << point.frequency_Hz;
  }
  // K and D of the task where inertia does not matter.
  EXPECT_NEAR(at(run, 0.1).rendered_Nm_rad.real(), 1000.0, 30.0);
  EXPECT_DOUBLE_EQ(at(run, 0.5).wanted_Nm_rad.imag(), 30.0 * M_PI);
  EXPECT_EQ(run.limited_share, 0.0);
}

TEST(ImpedanceTracking, TheLinearModelIsTheImpedanceOfTheTask) {
  const ImpedanceRun& run = ideal_run();
  const double rad_s = 2.0 * M_PI * 0.1;
  // In parallel with the viscous friction of the output and of the rotor.
  const std::complex<double> linear = at(run, 0.1).linear_Nm_rad;
  EXPECT_NEAR(linear.real(), 1000.0, 5.0);
  EXPECT_GT(linear.imag() / rad_s, 30.0);
  EXPECT_GT(run.passive_to_Hz, ImpedanceRun::kPassiveTo_Hz);
  EXPECT_NEAR(run.largest_passive_Nm_rad, 20694.0, 0.06 * 20694.0) << "docs/robot/control.md";
}

TEST(ImpedanceTracking, HighIsStiffAndZeroGivesWay) {
  const DataSheet sheet = data_sheet("harmonic-drive");
  const ImpedanceRun high =
      track_impedance(sheet, {.kind = ImpedanceSpec::Kind::high, .duration_s = 20.0}, 1);
  const ImpedanceRun zero =
      track_impedance(sheet, {.kind = ImpedanceSpec::Kind::zero, .duration_s = 20.0}, 1);
  // N_h k K_pp K_tp / (K_tp + k / N_g)
  EXPECT_NEAR(high.stiffness_Nm_rad, 51.0 * 40.95 * 75.0 / (5.0 + 40.95 / 2.0), 1e-6);
  EXPECT_EQ(high.passive_to_Hz, 0.0) << "stable only with dry friction";
  EXPECT_EQ(zero.stiffness_Nm_rad, 0.0);
  EXPECT_GT(zero.passive_to_Hz, ImpedanceRun::kPassiveTo_Hz);
  EXPECT_GT(std::abs(at(high, 0.1).rendered_Nm_rad), 5000.0);
  EXPECT_LT(std::abs(at(zero, 0.1).rendered_Nm_rad), 100.0);
  EXPECT_GT(zero.hand.joint_range_deg, 20.0 * high.hand.joint_range_deg);
  // Against a wall the arm is deflected by the whole motion of the hand. Zero impedance does not
  // make the torque small: inertia and friction of the drive remain.
  const double wall_Nm =
      high.hand.arm_stiffness_Nm_rad * rad_from_deg(0.5 * high.hand.hand_range_deg);
  EXPECT_NEAR(high.hand.max_Nm, wall_Nm, 0.25 * wall_Nm);
  EXPECT_NEAR(high.hand.rms_N, 2.0 * high.hand.rms_Nm, 1e-9) << "at 0.5 m";
  EXPECT_LE(high.hand.rms_Nm, high.hand.max_Nm);
  EXPECT_GT(zero.hand.mean_power_W, 0.0) << "the joint takes energy, it does not give it";
}

// A hand against a wall of 1000 Nm/rad is a spring against a spring.
TEST(ImpedanceTracking, TheHandMeetsTheWantedImpedance) {
  const ImpedanceRun& run = ideal_run();
  const HandForces& hand = run.hand;
  const double share = hand.arm_stiffness_Nm_rad / (hand.arm_stiffness_Nm_rad + 1000.0);
  EXPECT_NEAR(hand.joint_range_deg, share * hand.hand_range_deg, 0.2 * share * hand.hand_range_deg);
  EXPECT_LT(hand.rms_to_wanted_Nm, 0.15 * hand.rms_Nm);
  EXPECT_TRUE(run.record.has("truth_joint_angle_rad"));
  EXPECT_NEAR(static_cast<double>(run.record.size()) / run.record.sample_rate_Hz(), 10.0, 0.02);
}

TEST(ImpedanceTracking, EqualSeedsGiveEqualRuns) {
  const DataSheet sheet = data_sheet("harmonic-drive:soft#04");
  const ImpedanceRun once = track_impedance(sheet, kSoft, 5);
  EXPECT_EQ(impedance_json(once), impedance_json(track_impedance(sheet, kSoft, 5)));
  EXPECT_NE(impedance_json(once), impedance_json(track_impedance(sheet, kSoft, 6)));
  EXPECT_EQ(once.actuator, "harmonic-drive#04");
  EXPECT_EQ(once.variant, "soft");
  const auto json = nlohmann::json::parse(impedance_json(once));
  EXPECT_EQ(json.at("schema_version"), 1);
  EXPECT_EQ(json.at("frequencies").size(), once.points.size());
}

TEST(ImpedanceTracking, WorksWithEveryTube) {
  for (const char* tube : {"harmonic-drive", "harmonic-drive:soft", "harmonic-drive:rigid"}) {
    const ImpedanceRun run = track_impedance(data_sheet(tube), kSoft, 2);
    EXPECT_NEAR(std::abs(at(run, 0.2).rendered_Nm_rad), 1000.0, 400.0) << tube;
  }
}

struct Task {
  const char* actuator;
  double stiffness_Nm_rad;
  double damping_Nms_rad;
};

class EveryActuator : public testing::TestWithParam<Task> {};

TEST_P(EveryActuator, RendersAnImpedance) {
  const Task& task = GetParam();
  const ImpedanceRun run = track_impedance(data_sheet(task.actuator),
                                           {.kind = ImpedanceSpec::Kind::wanted,
                                            .stiffness_Nm_rad = task.stiffness_Nm_rad,
                                            .damping_Nms_rad = task.damping_Nms_rad,
                                            .duration_s = 10.0},
                                           1);
  EXPECT_DOUBLE_EQ(run.stiffness_Nm_rad, task.stiffness_Nm_rad);
  // The friction of the drive keeps a share of the torque: the more, the smaller the actuator is.
  EXPECT_NEAR(std::abs(at(run, 0.2).rendered_Nm_rad), task.stiffness_Nm_rad,
              0.6 * task.stiffness_Nm_rad);
  EXPECT_NEAR(at(run, 0.1).linear_Nm_rad.real(), task.stiffness_Nm_rad,
              0.02 * task.stiffness_Nm_rad);
  EXPECT_GT(run.passive_to_Hz, ImpedanceRun::kPassiveSpringTo_Hz);
  EXPECT_GE(run.largest_passive_Nm_rad, task.stiffness_Nm_rad);
  EXPECT_LT(run.hand.max_Nm, data_sheet(task.actuator).rating.torque_Nm.value);
  EXPECT_GT(run.hand.joint_range_deg, 1.0);
}

INSTANTIATE_TEST_SUITE_P(All, EveryActuator,
                         testing::Values(Task{"dfki-28", 60.0, 2.0}, Task{"dfki-50", 100.0, 5.0},
                                         Task{"dfki-120", 200.0, 10.0},
                                         Task{"dfki-300", 400.0, 10.0},
                                         Task{"elastomer", 15.0, 0.5},
                                         Task{"rubber-clutch", 0.5, 0.02},
                                         Task{"harmonic-drive", 1000.0, 30.0}),
                         [](const auto& each) {
                           std::string name = each.param.actuator;
                           std::erase(name, '-');
                           return name;
                         });

// Without damping the integral of the torque loop is not passive, but the loop is stable.
TEST(ImpedanceTracking, StatesThatAStableLoopIsNotPassive) {
  const ImpedanceRun run = track_impedance(
      data_sheet("dfki-50"),
      {.kind = ImpedanceSpec::Kind::wanted, .stiffness_Nm_rad = 80.0, .duration_s = 10.0}, 1);
  ASSERT_EQ(run.passive_to_Hz, 0.0);
  EXPECT_NE(impedance_text(run).find("stable, but not passive"), std::string::npos);
}

// What an error proposes is what it accepts.
TEST(ImpedanceTracking, ProposesStableGains) {
  for (const char* actuator :
       {"dfki-28", "dfki-50", "dfki-120", "dfki-300", "elastomer", "rubber-clutch"}) {
    const DataSheet sheet = data_sheet(actuator);
    const double stiff_Nm_rad = 0.9 * series_elastic_joint(sheet).stiffness_Nm_rad;
    const auto refusal = [&](double stiffness_Nm_rad, double damping_Nms_rad) {
      return test::error_message([&] {
        static_cast<void>(track_impedance(sheet,
                                          {.kind = ImpedanceSpec::Kind::wanted,
                                           .stiffness_Nm_rad = stiffness_Nm_rad,
                                           .damping_Nms_rad = damping_Nms_rad,
                                           .duration_s = 10.0},
                                          1));
      });
    };
    const std::string message = refusal(stiff_Nm_rad, 0.0);
    const auto number_after = [&](const std::string& words) {
      const std::size_t at = message.find(words);
      return at == std::string::npos ? 0.0 : std::stod(message.substr(at + words.size()));
    };
    const double least_Nm_rad = number_after("at most ");
    const double softer_Nm_rad = number_after("for example ");
    ASSERT_GT(least_Nm_rad + softer_Nm_rad, 0.0) << actuator << ": " << message;
    if (least_Nm_rad > 0.0) {
      EXPECT_EQ(refusal(least_Nm_rad, 0.0), "") << actuator;
    } else {
      EXPECT_EQ(refusal(softer_Nm_rad, number_after("Nm/rad with ")), "") << actuator;
    }
    const double damping_Nms_rad = number_after("a damping from ");
    if (damping_Nms_rad > 0.0) {
      EXPECT_EQ(refusal(stiff_Nm_rad, damping_Nms_rad), "") << actuator;
    }
  }
}

// The figure belongs to the joint, not to the stiffness that was refused, and is the border.
TEST(ImpedanceTracking, ProposesTheSameLargestStiffnessForEveryRequest) {
  const DataSheet sheet = data_sheet("dfki-50");
  const auto refusal = [&](double stiffness_Nm_rad) {
    return test::error_message([&] {
      static_cast<void>(track_impedance(sheet,
                                        {.kind = ImpedanceSpec::Kind::wanted,
                                         .stiffness_Nm_rad = stiffness_Nm_rad,
                                         .duration_s = 10.0},
                                        1));
    });
  };
  const std::string words = "at most ";
  const std::string first = refusal(100.0);
  ASSERT_NE(first.find(words), std::string::npos) << first;
  const double largest_Nm_rad = std::stod(first.substr(first.find(words) + words.size()));
  for (const double stiffness_Nm_rad : {97.0, 107.0, 123.0, 200.0, 281.0}) {
    const std::string message = refusal(stiffness_Nm_rad);
    EXPECT_NE(message.find(fmt::format("at most {:g} Nm/rad with this damping", largest_Nm_rad)),
              std::string::npos)
        << message;
  }
  EXPECT_EQ(refusal(largest_Nm_rad), "");
  EXPECT_NE(refusal(1.01 * largest_Nm_rad), "") << "not 1 % below the border";
}

TEST(ImpedanceTracking, HasNoRatioAtAnAntiresonance) {
  const ImpedanceRun run = track_impedance(
      data_sheet("dfki-50"),
      {.kind = ImpedanceSpec::Kind::wanted, .stiffness_Nm_rad = 50.0, .duration_s = 10.0}, 1);
  const std::string text = impedance_text(run);
  EXPECT_NE(text.find("-: an antiresonance"), std::string::npos) << text;
  ImpedanceRun without = run;
  std::erase_if(without.points, [](const ImpedancePoint& point) {
    return std::abs(point.linear_Nm_rad) < 0.5 * std::abs(point.wanted_Nm_rad);
  });
  EXPECT_LT(without.points.size(), run.points.size());
  EXPECT_EQ(impedance_text(without).find("antiresonance"), std::string::npos);
}

Dataset recordings_of(const char* actuator, const ExperimentSpec& spec, int count) {
  Dataset dataset;
  for (int n = 0; n < count; ++n) {
    ExperimentSpec each = spec;
    each.seed = static_cast<std::uint64_t>(n + 1);
    if (spec.lever_m) each.lever_m = *spec.lever_m * (1.0 + 0.3 * n);
    Recording recording = simulate(data_sheet(actuator), each);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, Role::train)});
  }
  return dataset;
}

ModelFile model_of(const Dataset& dataset, const char* family,
                   const std::vector<std::string>& inputs) {
  return train_model(dataset, {.family = family, .features = resolve_inputs(dataset, inputs)}, 1)
      .file;
}

double error_up_to_1_Hz(const ImpedanceRun& run) {
  double sum = 0.0;
  for (const ImpedancePoint& point : run.points)
    if (point.frequency_Hz <= 1.0)
      sum += std::abs(point.rendered_Nm_rad - point.wanted_Nm_rad) / std::abs(point.wanted_Nm_rad);
  return sum;
}

// The inverse of a learned spring with its hysteresis renders more exactly than a linear model.
TEST(ImpedanceTracking, ALearnedInverseIsNearerToTheTask) {
  const DataSheet sheet = data_sheet("dfki-50");
  Dataset dataset =
      recordings_of("dfki-50", {.experiment = "sweep", .duration_s = 40.0, .lever_m = 0.1}, 2);
  for (DatasetRecord& chirp :
       recordings_of("dfki-50", {.experiment = "chirp", .duration_s = 60.0}, 1).records)
    dataset.records.push_back(std::move(chirp));
  const ModelFile file = model_of(dataset, "grey_box", {});
  const std::vector<ImpedanceModel> models = {impedance_model("learned", file, sheet)};
  EXPECT_EQ(models.front().reason, "");
  const auto runs = track_impedances(sheet,
                                     {.kind = ImpedanceSpec::Kind::wanted,
                                      .stiffness_Nm_rad = 100.0,
                                      .damping_Nms_rad = 5.0,
                                      .duration_s = 20.0},
                                     models, 1);
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs.front().model, "linear");
  EXPECT_LT(error_up_to_1_Hz(runs.back()), 0.85 * error_up_to_1_Hz(runs.front()));
  EXPECT_LT(runs.back().hand.rms_to_wanted_Nm, 0.85 * runs.front().hand.rms_to_wanted_Nm);
}

// The friction of the harmonic drive is not in the tube, but in what a model has learned.
TEST(ImpedanceTracking, AnEstimateCorrectsTheTorqueOfATube) {
  const DataSheet sheet = data_sheet("harmonic-drive");
  Dataset dataset = recordings_of(
      "harmonic-drive",
      {.experiment = "human-torque", .duration_s = 40.0, .is_impedance_zero = true}, 2);
  for (DatasetRecord& high :
       recordings_of("harmonic-drive", {.experiment = "human-torque", .duration_s = 40.0}, 1)
           .records)
    dataset.records.push_back(std::move(high));
  const ModelFile file =
      model_of(dataset, "grey_box",
               {"motor_angle_rad / 2 - wave_generator_angle_rad", "motor_torque_Nm",
                "lowpass(rate(wave_generator_angle_rad), 10Hz)"});
  const std::vector<ImpedanceModel> models = {impedance_model("learned", file, sheet)};
  EXPECT_NE(models.front().reason, "");
  const ImpedanceSpec spec = {.kind = ImpedanceSpec::Kind::wanted,
                              .stiffness_Nm_rad = 500.0,
                              .damping_Nms_rad = 20.0,
                              .duration_s = 20.0};
  const auto runs = track_impedances(sheet, spec, models, 1);
  EXPECT_LT(error_up_to_1_Hz(runs.back()), 0.5 * error_up_to_1_Hz(runs.front()));
  EXPECT_LT(runs.back().hand.rms_to_wanted_Nm, 0.8 * runs.front().hand.rms_to_wanted_Nm);
  // A correction as fast as the loop is not passive, and the error states the reason.
  ImpedanceSpec fast = spec;
  fast.correction_rad_s = 100.0;
  const std::string refused =
      test::error_message([&] { static_cast<void>(track_impedances(sheet, fast, models, 1)); });
  EXPECT_NE(refused.find("the estimate corrects too fast"), std::string::npos) << refused;
  EXPECT_NE(test::error_message([&] {
              static_cast<void>(impedance_model("learned", file, data_sheet("dfki-50")));
            }).find("inputs that its sensors measure"),
            std::string::npos);
}

TEST(ImpedanceTracking, AModelWithoutAnInverseCorrectsTheTorqueOfASpring) {
  const DataSheet sheet = data_sheet("dfki-50");
  const Dataset dataset = recordings_of("dfki-50", {.experiment = "chirp", .duration_s = 20.0}, 1);
  const ImpedanceModel model = impedance_model("net", model_of(dataset, "mlp", {}), sheet);
  EXPECT_EQ(model.name, "net");
  EXPECT_TRUE(model.reason.starts_with("the model has no inverse: ")) << model.reason;
  EXPECT_EQ(model.reason.find('\n'), std::string::npos) << model.reason;
  const ImpedanceRun run = track_impedance(sheet,
                                           {.kind = ImpedanceSpec::Kind::wanted,
                                            .stiffness_Nm_rad = 100.0,
                                            .damping_Nms_rad = 5.0,
                                            .duration_s = 10.0},
                                           model, 1);
  EXPECT_EQ(run.model, "net");
  EXPECT_NEAR(std::abs(at(run, 0.2).rendered_Nm_rad), 100.0, 40.0);
  const auto json = nlohmann::json::parse(impedance_json(run));
  EXPECT_EQ(json.at("model"), "net");
  EXPECT_GT(json.at("gains").at("proportional_A_rad"), 0.0);
}

TEST(ImpedanceTracking, RefusesWhatIsNotPassive) {
  const auto refusal = [](const char* actuator, const ImpedanceSpec& spec) {
    return test::error_message(
        [&] { static_cast<void>(track_impedance(data_sheet(actuator), spec, 1)); });
  };
  const auto expect = [](const std::string& message, const std::string& words) {
    EXPECT_NE(message.find(words), std::string::npos) << words << " in: " << message;
  };
  expect(refusal("dfki-50", {}),
         "gains are those of paper 004 for harmonic-drive; expected a "
         "stiffness for dfki-50, found high");
  const auto wanted = [](double stiffness_Nm_rad, double damping_Nms_rad, double gain_Nm_rad) {
    return ImpedanceSpec{.kind = ImpedanceSpec::Kind::wanted,
                         .stiffness_Nm_rad = stiffness_Nm_rad,
                         .damping_Nms_rad = damping_Nms_rad,
                         .torque_gain_Nm_rad = gain_Nm_rad};
  };
  const std::string stiff = refusal("harmonic-drive", wanted(12000.0, 0.0, 0.5));
  expect(stiff, "not passive up to 10 Hz; expected at most 9");
  expect(stiff, "found 12000 Nm/rad");
  expect(refusal("harmonic-drive", wanted(1000.0, 0.0, 5.0)), "no stiffness is passive");
  EXPECT_EQ(refusal("harmonic-drive", wanted(12000.0, 20.0, 0.5)), "")
      << "damping extends the range";
  expect(refusal("harmonic-drive", wanted(-1.0, 0.0, 0.5)), "0 Nm/rad or more, found -1");
  expect(refusal("harmonic-drive", wanted(1.0, std::nan(""), 0.5)), "0 Nms/rad or more, found nan");
  expect(refusal("harmonic-drive", wanted(1.0, 0.0, 0.0)), "above 0 Nm/rad, found 0");
  expect(refusal("harmonic-drive", {.amplitude_Nm = 51.0}), "at most 50 Nm, found 51");
  expect(refusal("harmonic-drive", {.duration_s = 1.0}), "10 to 3600 s, found 1");
}

}  // namespace
}  // namespace torsio
