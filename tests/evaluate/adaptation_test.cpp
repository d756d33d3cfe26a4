#include "torsio/evaluate/adaptation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "support/bench_dataset.hpp"
#include "support/dump_any.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::add_record;
using test::bench_recording;
using test::dump;
using test::error_message;
using test::with_torque;
using testing::AllOf;
using testing::HasSubstr;

/// A small network of the bench whose torque is the reference.
const ModelFile& bench_model() {
  static const ModelFile model = [] {
    const Dataset dataset = test::bench_dataset();
    const FeatureSpec features = resolve_inputs(dataset, {});
    return train_model(dataset,
                       {.family = "mlp", .options = {{"layers", "16"}}, .features = features}, 1)
        .file;
  }();
  return model;
}

/// Another specimen: its torque has an offset, and its spring is softer.
Dataset other_specimen(std::size_t samples = 20000) {
  Dataset dataset;
  add_record(
      dataset,
      bench_recording("lesson",
                      {.stiffness_Nm_rad = 470.0, .offset_Nm = 2.0, .samples = samples, .seed = 5}),
      Role::train);
  add_record(dataset,
             bench_recording("exam", {.stiffness_Nm_rad = 470.0,
                                      .offset_Nm = 2.0,
                                      .amplitude_rad = 0.027,
                                      .samples = 8000,
                                      .seed = 6}),
             Role::test);
  return dataset;
}

AdaptationSettings settings_for(const std::string& method) {
  return adaptation_settings(method, {});
}

TEST(AdaptModel, ImprovesOnAnotherPieceByEitherMethod) {
  for (const char* method : {"nlms", "rls"}) {
    const AdaptedModel adapted = adapt_model(bench_model(), other_specimen(), settings_for(method));
    EXPECT_LT(adapted.held_out.back().adapted.rmse, 0.7 * adapted.held_out.back().frozen.rmse)
        << method;
    EXPECT_LT(adapted.as_it_ran.back().adapted.rmse, adapted.as_it_ran.back().frozen.rmse);
    EXPECT_GT(adapted.counts.updates(), 10000U);
    EXPECT_GT(adapted.counts.of(UpdateOutcome::warming_up), 0U);
    EXPECT_GT(adapted.relative_change, 0.0);
  }
}

TEST(AdaptModel, ScoresAreThoseOfTheFilesThatItNames) {
  const Dataset dataset = other_specimen();
  const AdaptedModel adapted = adapt_model(bench_model(), dataset, settings_for("nlms"));
  const TemporaryFolder folder;
  save_model(folder.path("adapted.safetensors"), adapted.file);
  const ModelFile loaded = load_model(folder.path("adapted.safetensors"));
  EXPECT_EQ(dump(loaded.parameters), dump(adapted.file.parameters));
  EXPECT_NE(dump(loaded.parameters), dump(bench_model().parameters));
  const auto rmse_of = [&](const ModelFile& file) {
    return evaluate(make_estimator(file, dataset.sample_rate_Hz()), dataset, Role::test)
        .together.metrics.rmse;
  };
  ASSERT_EQ(adapted.held_out.size(), 2U);
  EXPECT_EQ(rmse_of(loaded), adapted.held_out.back().adapted.rmse);
  EXPECT_EQ(rmse_of(bench_model()), adapted.held_out.back().frozen.rmse);
  EXPECT_EQ(loaded.card.metrics.at("rmse"), adapted.held_out.back().adapted.rmse);
}

TEST(AdaptModel, IsDeterministic) {
  const auto run = [] { return adapt_model(bench_model(), other_specimen(), settings_for("rls")); };
  const AdaptedModel one = run();
  const AdaptedModel two = run();
  EXPECT_EQ(model_bytes(one.file), model_bytes(two.file));
  EXPECT_EQ(one.counts, two.counts);
}

TEST(AdaptModel, TheCardSaysWhereTheWeightsComeFrom) {
  Dataset dataset = other_specimen();
  dataset.records[0].recording.source = {"lesson.csv", "abc"};
  const ModelCard card = adapt_model(bench_model(), dataset, settings_for("nlms")).file.card;
  EXPECT_EQ(card.options.at("adaptation.method"), "nlms");
  EXPECT_EQ(card.options.at("adaptation.step_size"), "0.003");
  EXPECT_EQ(card.options.at("layers"), "16");
  EXPECT_EQ(card.training_files.back(), (Source{"lesson.csv", "abc"}));
  EXPECT_THAT(card.held_out, HasSubstr("test samples"));
}

TEST(AdaptModel, ErrorBarsAreThoseOfTheAdaptedWeights) {
  const AdaptedModel adapted = adapt_model(bench_model(), other_specimen(), settings_for("nlms"));
  EXPECT_NE(adapted.file.settings.residuals.std_dev, bench_model().settings.residuals.std_dev);
  EXPECT_FALSE(adapted.file.settings.residuals.std_dev.empty());
}

TEST(AdaptModel, LearnsFromSegmentsWithTheRoleTrainOnly) {
  Dataset dataset = other_specimen();
  dataset.records.erase(dataset.records.begin() + 1);
  hold_out_ends(dataset, 0.25, 1.0);
  ASSERT_EQ(dataset.records[0].segments.size(), 2U);
  EXPECT_EQ(dataset.records[0].segments[0].end, 14000U);
  EXPECT_EQ(dataset.records[0].segments[1].begin, 15000U);
  const AdaptedModel whole = adapt_model(bench_model(), dataset, settings_for("nlms"));
  // What comes after the lessons, whatever it is, changes nothing.
  dataset.records[0].recording = with_torque(dataset.records[0].recording, [](Channel& torque) {
    for (std::size_t n = 14000; n < torque.values.size(); ++n) torque.values[n] = 1.0;
  });
  const AdaptedModel again = adapt_model(bench_model(), dataset, settings_for("nlms"));
  EXPECT_EQ(dump(whole.file.parameters), dump(again.file.parameters));
  EXPECT_EQ(whole.as_it_ran.back().adapted.rmse, again.as_it_ran.back().adapted.rmse);
  EXPECT_NE(whole.held_out.back().adapted.rmse, again.held_out.back().adapted.rmse);
}

TEST(AdaptModel, DoesNotLearnFromHeldAndMissingReferences) {
  Dataset dataset = other_specimen();
  dataset.records[0].recording = with_torque(dataset.records[0].recording, [](Channel& torque) {
    torque.fresh.assign(torque.values.size(), 0);
    for (std::size_t n = 0; n < torque.values.size(); ++n) {
      if (n % 8 == 0)
        torque.fresh[n] = 1;
      else
        torque.values[n] = torque.values[n - 1];  // 125 Hz
    }
    for (std::size_t n = 8000; n < 9600; ++n) torque.values[n] = std::nan("");
  });
  const AdaptedModel adapted =
      adapt_model(bench_model(), dataset, adaptation_settings("nlms", {{"confirmation_s", "0"}}));
  EXPECT_EQ(adapted.counts.of(UpdateOutcome::reference_not_finite), 1600U);
  EXPECT_NEAR(static_cast<double>(adapted.counts.of(UpdateOutcome::reference_stale)),
              18400 * 7 / 8.0, 300);
  EXPECT_NEAR(static_cast<double>(adapted.counts.updates()), 18400 / 8.0, 50);
  EXPECT_LT(adapted.held_out.back().adapted.rmse, adapted.held_out.back().frozen.rmse);
}

/// The lesson with a reference that is wrong for 8 of its 20 s.
Dataset spoilt_specimen(
    const std::function<double(const std::vector<double>&, std::size_t)>& wrong) {
  Dataset dataset = other_specimen();
  dataset.records[0].recording = with_torque(dataset.records[0].recording, [&](Channel& torque) {
    const std::vector<double> right = torque.values;
    for (std::size_t n = 8000; n < 16000; ++n) torque.values[n] = wrong(right, n);
  });
  return dataset;
}

TEST(AdaptModel, PassesOverAPartWithAWrongReference) {
  using Values = std::vector<double>;
  const std::map<UpdateOutcome, std::function<double(const Values&, std::size_t)>> kinds{
      {UpdateOutcome::reference_dead,
       [](const Values&, std::size_t n) { return 1e-3 * std::sin(1e5 * static_cast<double>(n)); }},
      {UpdateOutcome::reference_opposite, [](const Values& v, std::size_t n) { return -v[n]; }},
      {UpdateOutcome::reference_scaled, [](const Values& v, std::size_t n) { return 3.0 * v[n]; }},
      {UpdateOutcome::reference_unrelated, [](const Values&, std::size_t n) {
         return 10.0 * std::sin(7.3e-3 * static_cast<double>(n));
       }}};
  for (const auto& [outcome, wrong] : kinds) {
    const AdaptedModel adapted =
        adapt_model(bench_model(), spoilt_specimen(wrong), settings_for("nlms"));
    EXPECT_GT(adapted.counts.of(outcome), 100U) << name(outcome);
    std::size_t passed_over = 0;
    for (std::size_t i = static_cast<std::size_t>(UpdateOutcome::reference_unconfirmed);
         i < kUpdateOutcomes; ++i)
      passed_over += adapted.counts.outcomes[i];
    EXPECT_GT(passed_over, 7500U) << name(outcome);
    EXPECT_LE(adapted.held_out.back().adapted.rmse, adapted.held_out.back().frozen.rmse);
  }
}

TEST(AdaptModel, RefusesWhatItCannotLearnFrom) {
  Dataset no_exam = other_specimen();
  no_exam.records.erase(no_exam.records.begin() + 1);
  EXPECT_THAT(error_message([&] { (void)adapt_model(bench_model(), no_exam, {}); }),
              HasSubstr("nothing to score on"));
  Dataset no_lesson = other_specimen();
  no_lesson.records.erase(no_lesson.records.begin());
  EXPECT_THAT(error_message([&] { (void)adapt_model(bench_model(), no_lesson, {}); }),
              HasSubstr("nothing to adapt to"));
  EXPECT_THAT(error_message([&] { (void)adapt_model(bench_model(), other_specimen(20), {}); }),
              HasSubstr("nothing to use with role train"));
  for (const auto& [sensor, problem] : std::map<std::string, std::function<double(double)>>{
           {"a target that changes", [](double) { return 3.0; }},
           {"the opposite sign", [](double torque) { return -torque; }},
           {"of another size", [](double torque) { return 1000.0 * torque; }}}) {
    Dataset broken = other_specimen();
    Recording changed("lesson", 1000.0);
    for (Channel channel : broken.records[0].recording.channels()) {
      if (channel.name == "torque_Nm")
        std::ranges::transform(channel.values, channel.values.begin(), problem);
      changed.add(std::move(channel));
    }
    broken.records[0].recording = std::move(changed);
    EXPECT_THAT(error_message([&] { (void)adapt_model(bench_model(), broken, {}); }),
                HasSubstr(sensor));
  }
  EXPECT_THAT(error_message([&] { hold_out_ends(no_exam, 0.99, 1.0); }),
              HasSubstr("lesson: a training block"));
  EXPECT_THAT(error_message([&] { hold_out_ends(no_exam, 1.0, 1.0); }), HasSubstr("--held-out"));
}

TEST(AdaptModel, StopsWhenAsked) {
  const Progress stop = [](double, std::string_view) { return false; };
  EXPECT_THROW((void)adapt_model(bench_model(), other_specimen(), {}, stop), Cancelled);
}

TEST(AdaptationSettings, AreCheckedAgainstTheirTable) {
  EXPECT_EQ(adaptation_settings("rls", {{"forgetting", "0.99"}}).forgetting, 0.99);
  EXPECT_EQ(adaptation_settings("rls", {}).rule, AdaptationRule::rls);
  EXPECT_THAT(error_message([] { (void)adaptation_settings("lms", {}); }),
              HasSubstr("expected auto, nlms, rls or em"));
  EXPECT_THAT(error_message([] {
                (void)adaptation_settings("nlms", {{"step_size", "2"}});
              }),
              HasSubstr("step_size"));
  EXPECT_THAT(error_message([] {
                (void)adaptation_settings("nlms", {{"mu", "1"}});
              }),
              HasSubstr("one of step_size, leak"));
  EXPECT_TRUE(std::isnan(adaptation_settings("nlms", {}).saturation));
  EXPECT_EQ(adaptation_settings("nlms", {{"saturation", "40"}}).saturation, 40.0);
  EXPECT_EQ(adaptation_settings("nlms", {}).step_size, AdaptationSettings{}.step_size);
}

// ---- a mixture and a grey box -------------------------------------------------------------------

const ModelFile& bench_model_of(const std::string& family) {
  static std::map<std::string, ModelFile> models;
  if (const auto known = models.find(family); known != models.end()) return known->second;
  const Dataset dataset = test::bench_dataset();
  ModelChoice choice{.family = family, .options = {}, .features = resolve_inputs(dataset, {})};
  if (family == "dgmm") choice.options = {{"components", "60"}};
  if (family == "grey_box") choice.options = {{"passive", "true"}};
  return models.emplace(family, train_model(dataset, choice, 1).file).first->second;
}

/// The same joint, whose spring has become softer or stiffer.
Dataset changed_stiffness(double by,
                          const std::function<double(std::size_t, double)>& sensor = {}) {
  Dataset dataset;
  const test::BenchOptions lesson{.stiffness_Nm_rad = 500.0 * by, .samples = 60000, .seed = 5};
  add_record(dataset, bench_recording("lesson", lesson), Role::train);
  if (sensor) {
    dataset.records[0].recording = with_torque(dataset.records[0].recording, [&](Channel& torque) {
      for (std::size_t n = 0; n < torque.values.size(); ++n)
        torque.values[n] = sensor(n, torque.values[n]);
    });
  }
  add_record(
      dataset,
      bench_recording(
          "exam",
          {.stiffness_Nm_rad = 500.0 * by, .amplitude_rad = 0.027, .samples = 8000, .seed = 6}),
      Role::test);
  return dataset;
}

class AdaptFamily : public testing::TestWithParam<const char*> {};

TEST_P(AdaptFamily, FollowsAChangeOfStiffnessOfATenth) {
  for (const double by : {0.9, 1.1}) {
    const AdaptedModel adapted =
        adapt_model(bench_model_of(GetParam()), changed_stiffness(by), settings_for("auto"));
    const AdaptationScore& exam = adapted.held_out.back();
    EXPECT_LT(exam.adapted.rmse, 0.6 * exam.frozen.rmse) << by;
    EXPECT_EQ(adapted.counts.roll_backs, 0U);
  }
}

TEST_P(AdaptFamily, IsDeterministicAndTheFileHasTheScores) {
  const Dataset dataset = changed_stiffness(1.1);
  const AdaptedModel one = adapt_model(bench_model_of(GetParam()), dataset, {});
  const AdaptedModel two = adapt_model(bench_model_of(GetParam()), dataset, {});
  EXPECT_EQ(model_bytes(one.file), model_bytes(two.file));
  EXPECT_EQ(one.counts, two.counts);
  EXPECT_EQ(one.file.card.options.at("adaptation.method"),
            GetParam() == std::string("dgmm") ? "em" : "rls");
  const TemporaryFolder folder;
  save_model(folder.path("adapted.safetensors"), one.file);
  const SplitScore score = evaluate(
      make_estimator(load_model(folder.path("adapted.safetensors")), 1000.0), dataset, Role::test);
  EXPECT_EQ(score.together.metrics.rmse, one.held_out.back().adapted.rmse);
}

TEST_P(AdaptFamily, SaturatedAndStuckSensorsAndGapsAreCountedAndOtherUnitsAreRefused) {
  constexpr double kEnd_Nm = 8.0;
  const auto broken = [kEnd_Nm](std::size_t n, double torque) {
    if (n >= 20000 && n < 25000) return 3.0;           // stuck
    if (n >= 30000 && n < 35000) return std::nan("");  // not measured
    return std::clamp(torque, -kEnd_Nm, kEnd_Nm);
  };
  AdaptationSettings settings = settings_for("auto");
  settings.saturation = kEnd_Nm;
  settings.initial_covariance =
      0.01;  // as the error advises: with such a sensor, the usual one learns from its faults
  const AdaptedModel adapted =
      adapt_model(bench_model_of(GetParam()), changed_stiffness(1.0, broken), settings);
  EXPECT_GT(adapted.counts.of(UpdateOutcome::reference_saturated), 1000U);
  EXPECT_EQ(adapted.counts.of(UpdateOutcome::reference_not_finite), 5000U);
  EXPECT_EQ(adapted.counts.of(UpdateOutcome::reference_stale), 4800U);
  EXPECT_LT(adapted.held_out.back().adapted.rmse, 1.1 * adapted.held_out.back().frozen.rmse);

  const auto refusal = [](const Dataset& dataset, const AdaptationSettings& strict) {
    return error_message([&] { (void)adapt_model(bench_model_of(GetParam()), dataset, strict); });
  };
  const auto millis = [](std::size_t, double torque) { return 1000.0 * torque; };
  EXPECT_THAT(refusal(changed_stiffness(1.0, millis), {}), HasSubstr("of another size"));
  const auto stuck = [](std::size_t, double) { return 3.0; };
  EXPECT_THAT(refusal(changed_stiffness(1.0, stuck), {}), HasSubstr("a target that changes"));
  AdaptationSettings noisy = settings_for("auto");
  noisy.sensor_std = 100.0;
  EXPECT_THAT(
      refusal(changed_stiffness(1.0), noisy),
      AllOf(HasSubstr("no sample could be used for the adaptation"), HasSubstr("dead_zone")));
}

INSTANTIATE_TEST_SUITE_P(, AdaptFamily, testing::Values("dgmm", "grey_box"),
                         [](const auto& family) { return std::string(family.param); });

// ---- the experiment of docs/robot/adaptation.md -------------------------------------------------------

Recording human_torque(const std::string& actuator, std::uint64_t seed) {
  return simulate(
      {.actuator = actuator, .experiment = "human-torque", .seed = seed, .duration_s = 60.0});
}

TEST(AdaptModel, AnLstmOfOneHarmonicDriveImprovesOnOthers) {
  Dataset first;
  for (const std::uint64_t seed : {1U, 2U, 3U})
    add_record(first, human_torque("harmonic-drive:soft#01", seed), Role::train);
  const FeatureSpec features =
      resolve_inputs(first, {"motor_angle_rad - wave_generator_angle_rad", "motor_torque_Nm"});
  const ModelFile lstm = train_model(first, {.family = "lstm", .features = features}, 1).file;
  for (const char* specimen : {"#02", "#03", "#04"}) {
    Dataset other;
    const std::string actuator = std::string("harmonic-drive:soft") + specimen;
    add_record(other, human_torque(actuator, 11), Role::train);
    add_record(other, human_torque(actuator, 12), Role::test);
    for (const char* method : {"nlms", "rls"}) {
      const AdaptedModel adapted = adapt_model(lstm, other, settings_for(method));
      const AdaptationScore& held_out = adapted.held_out.back();
      EXPECT_LT(held_out.adapted.rmse, 0.95 * held_out.frozen.rmse) << specimen << ' ' << method;
    }
  }
}

}  // namespace
}  // namespace torsio
