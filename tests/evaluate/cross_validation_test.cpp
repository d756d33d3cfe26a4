#include "torsio/evaluate/cross_validation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/fit/common/inputs.hpp"

namespace torsio {
namespace {

/// Records of 1000 to 1000 + 100 (n - 1) samples, all to learn from.
Dataset records(std::size_t n) {
  Dataset dataset;
  for (std::size_t i = 0; i < n; ++i)
    test::add_record(dataset,
                     test::bench_recording("record " + std::to_string(i),
                                           {.samples = 1000 + 100 * i, .seed = i + 1}),
                     Role::train);
  return dataset;
}

/// Role of each sample of a record in a fold; -1 where it has none.
std::vector<int> roles(const Dataset& dataset, const Fold& fold, std::size_t record) {
  std::vector<int> of_sample(dataset.records[record].recording.size(), -1);
  for (const Segment& segment : fold.segments[record])
    for (std::size_t n = segment.begin; n < segment.end; ++n) {
      EXPECT_EQ(of_sample[n], -1) << "sample " << n << " is in two segments";
      of_sample[n] = static_cast<int>(segment.role);
    }
  return of_sample;
}

constexpr int kNone = -1;
constexpr int kTrain = static_cast<int>(Role::train);
constexpr int kValidation = static_cast<int>(Role::validation);
constexpr int kHeldOut = static_cast<int>(Role::test);

void expect_each_sample_held_out_once(const Dataset& dataset, const FoldPlan& plan) {
  for (std::size_t i = 0; i < dataset.records.size(); ++i) {
    std::vector<int> times(dataset.records[i].recording.size(), 0);
    for (const Fold& fold : plan.folds) {
      const std::vector<int> of_sample = roles(dataset, fold, i);
      for (std::size_t n = 0; n < times.size(); ++n) times[n] += of_sample[n] == kHeldOut ? 1 : 0;
    }
    EXPECT_EQ(times, std::vector<int>(times.size(), 1)) << "record " << i;
  }
}

ModelChoice choice(const Dataset& dataset, const std::string& family) {
  return {.family = family, .features = resolve_inputs(dataset, {})};
}

TEST(PlanFolds, DealsWholeRecordsSoThatEachIsHeldOutOnce) {
  const Dataset dataset = records(7);
  const FoldPlan plan = plan_folds(dataset, {.folds = 3}, 1);
  ASSERT_EQ(plan.folds.size(), 3U);
  expect_each_sample_held_out_once(dataset, plan);
  for (const Fold& fold : plan.folds) {
    EXPECT_GE(fold.recordings.size(), 2U);
    for (std::size_t i = 0; i < dataset.records.size(); ++i)
      EXPECT_EQ(fold.segments[i].size(), 1U) << "a whole record needs no embargo";
  }
  EXPECT_NE(plan.label.find("7 recordings"), std::string::npos) << plan.label;
}

TEST(PlanFolds, DependsOnTheSeedAlone) {
  const Dataset dataset = records(8);
  const auto assigned = [&](std::uint64_t seed) {
    std::vector<std::vector<std::string>> recordings;
    for (const Fold& fold : plan_folds(dataset, {.folds = 4}, seed).folds)
      recordings.push_back(fold.recordings);
    return recordings;
  };
  EXPECT_EQ(assigned(1), assigned(1));
  std::set<std::vector<std::vector<std::string>>> different;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) different.insert(assigned(seed));
  EXPECT_GT(different.size(), 1U);
}

TEST(PlanFolds, CutsFewerRecordsThanFoldsIntoBlocksWithAnEmbargo) {
  const Dataset dataset = records(2);
  const FoldPlan plan = plan_folds(dataset, {.folds = 5, .embargo_s = 0.05}, 1);
  ASSERT_EQ(plan.folds.size(), 5U);
  EXPECT_NE(plan.label.find("blocks"), std::string::npos) << plan.label;
  expect_each_sample_held_out_once(dataset, plan);
  constexpr std::size_t kEmbargo = 50;  // at 1 kHz
  for (const Fold& fold : plan.folds) {
    for (std::size_t i = 0; i < dataset.records.size(); ++i) {
      const std::vector<int> of_sample = roles(dataset, fold, i);
      for (std::size_t n = 0; n < of_sample.size(); ++n) {
        bool is_near = false;
        for (std::size_t m = n - std::min(n, kEmbargo);
             m <= std::min(n + kEmbargo, of_sample.size() - 1); ++m)
          is_near |= of_sample[m] == kHeldOut;
        const int expected = of_sample[n] == kHeldOut ? kHeldOut : is_near ? kNone : kTrain;
        ASSERT_EQ(of_sample[n], expected) << fold.name << ", record " << i << ", sample " << n;
      }
    }
  }
}

TEST(PlanFolds, LeavesOneRecordOut) {
  const Dataset dataset = records(3);
  const FoldPlan plan = plan_folds(dataset, {.by = "record"}, 1);
  ASSERT_EQ(plan.folds.size(), 3U);
  expect_each_sample_held_out_once(dataset, plan);
  EXPECT_EQ(plan.folds[1].name, "record 1");
  EXPECT_EQ(plan.folds[1].recordings, std::vector<std::string>{"record 1"});
}

TEST(PlanFolds, LeavesOneConditionOut) {
  Dataset dataset = records(5);
  const std::vector<double> supports{0.02, 0.03, 0.02, 0.045, 0.03};
  for (std::size_t i = 0; i < supports.size(); ++i)
    dataset.records[i].recording.add_condition("support_m", supports[i]);
  dataset.records[4].segments.front().role = Role::validation;
  const FoldPlan plan = plan_folds(dataset, {.by = "support_m"}, 1);
  ASSERT_EQ(plan.folds.size(), 3U);
  EXPECT_EQ(plan.folds[0].name, "support_m = 0.02");
  EXPECT_EQ(plan.folds[0].recordings, (std::vector<std::string>{"record 0", "record 2"}));
  EXPECT_EQ(roles(dataset, plan.folds[0], 4).front(), kValidation);
  EXPECT_EQ(plan.folds[1].recordings, std::vector<std::string>{"record 1"});
  EXPECT_EQ(roles(dataset, plan.folds[1], 4).front(), kNone)
      << "the fit would use a validation recording of the held-out condition";
}

TEST(PlanFolds, LeavesTestSegmentsOutAndValidationSegmentsIn) {
  Dataset dataset = records(3);
  dataset.records[0].segments = {{.begin = 0, .end = 600, .role = Role::train},
                                 {.begin = 600, .end = 800, .role = Role::test},
                                 {.begin = 800, .end = 1000, .role = Role::validation}};
  const FoldPlan plan = plan_folds(dataset, {.by = "record"}, 1);
  const std::vector<int> held_out = roles(dataset, plan.folds[0], 0);
  EXPECT_EQ(held_out[599], kHeldOut);
  EXPECT_EQ(held_out[600], kNone);
  EXPECT_EQ(held_out[999], kNone) << "the record is held out as a whole";
  const std::vector<int> learned = roles(dataset, plan.folds[1], 0);
  EXPECT_EQ(learned[599], kTrain);
  EXPECT_EQ(learned[600], kNone);
  EXPECT_EQ(learned[999], kValidation);
}

TEST(PlanFolds, RefusesWhatCannotBeDivided) {
  const Dataset dataset = records(2);
  const auto message = [&](const FoldScheme& scheme) {
    EXPECT_THROW((void)plan_folds(dataset, scheme, 1), UsageError);
    return test::error_message([&] { (void)plan_folds(dataset, scheme, 1); });
  };
  EXPECT_NE(message({.folds = 1}).find("at least 2"), std::string::npos);
  EXPECT_NE(message({.folds = 2000}).find("at most 1000"), std::string::npos);
  EXPECT_NE(message({.folds = 3, .embargo_s = 2.0}).find("shorter --embargo"), std::string::npos);
  EXPECT_NE(message({.embargo_s = -1.0}).find("--embargo"), std::string::npos);
  EXPECT_NE(message({.by = "support_m"}).find("no channel is constant"), std::string::npos);

  Dataset same = records(2);
  for (DatasetRecord& record : same.records) record.recording.add_condition("support_m", 0.02);
  EXPECT_NE(test::error_message([&] {
              (void)plan_folds(same, {.by = "support"}, 1);
            }).find("condition: support_m"),
            std::string::npos);
  EXPECT_NE(test::error_message([&] {
              (void)plan_folds(same, {.by = "support_m"}, 1);
            }).find("at least two values"),
            std::string::npos);

  EXPECT_THROW((void)plan_folds(records(1), {.by = "record"}, 1), UsageError);
  Dataset nothing = records(1);
  nothing.records[0].segments.front().role = Role::test;
  EXPECT_THROW((void)plan_folds(nothing, {}, 1), UsageError);
}

TEST(PlanFolds, RefusesARecordingThatIsGivenTwiceButNotTwoRecordsOfOneFile) {
  Dataset dataset = records(2);
  for (DatasetRecord& record : dataset.records) record.recording.source.sha256 = "abc";
  EXPECT_NO_THROW((void)plan_folds(dataset, {.folds = 2}, 1));
  dataset.records.push_back(dataset.records.front());
  EXPECT_THROW((void)plan_folds(dataset, {.folds = 2}, 1), UsageError);
}

TEST(CrossValidate, ScoresEachFoldAsTrainingOnItsRestDoes) {
  const Dataset dataset = records(3);
  const CrossValidation validation =
      cross_validate(dataset, {choice(dataset, "linear_coulomb")}, {.by = "record"}, 1, false);
  ASSERT_EQ(validation.ranking.size(), 1U);
  double sum = 0.0;
  for (std::size_t held_out = 0; held_out < 3; ++held_out) {
    Dataset by_hand = dataset;
    by_hand.records[held_out].segments.front().role = Role::test;
    const TrainedModel trained = train_model(by_hand, choice(by_hand, "linear_coulomb"), 1);
    const double rmse =
        evaluate(make_estimator(trained.file), by_hand, Role::test).together.metrics.rmse;
    sum += rmse;
    const ResultRow& row = validation.results.rows[2 * held_out];
    EXPECT_EQ(row.fold, "record " + std::to_string(held_out));
    EXPECT_EQ(row.split, Role::validation);
    EXPECT_FALSE(row.recording);
    EXPECT_EQ(row.score.metrics.rmse, rmse);
    EXPECT_EQ(validation.results.rows[2 * held_out + 1].recording, row.fold);
  }
  EXPECT_NEAR(validation.ranking.front().rmse.mean, sum / 3.0, 1e-12);
  EXPECT_EQ(validation.ranking.front().folds, 3U);
  EXPECT_GT(validation.ranking.front().rmse.std_dev, 0.0);
}

TEST(CrossValidate, RanksEveryFamilyAndIsDeterministic) {
  const Dataset dataset = records(3);
  const auto choices = model_choices(dataset, "all", {});
  const FoldScheme scheme{.folds = 5, .embargo_s = 0.02};
  const CrossValidation one = cross_validate(dataset, choices, scheme, 1, false);
  const CrossValidation two = cross_validate(dataset, choices, scheme, 1, false);
  ASSERT_EQ(one.ranking.size(), choices.size());
  for (std::size_t i = 0; i < choices.size(); ++i) {
    EXPECT_EQ(one.ranking[i].family, two.ranking[i].family);
    EXPECT_EQ(one.ranking[i].rmse.mean, two.ranking[i].rmse.mean);
    EXPECT_EQ(one.ranking[i].folds, 5U) << one.ranking[i].family << one.ranking[i].reason;
  }
  EXPECT_TRUE(std::ranges::is_sorted(one.ranking, {}, [](const FoldSummary& summary) {
    return summary.ranked_folds > 0 ? summary.common_rmse.mean
                                    : std::numeric_limits<double>::infinity();
  }));
}

TEST(CrossValidate, MakesAFailedFitARowAndRanksTheModelLast) {
  Dataset dataset = records(3);
  for (std::size_t i = 0; i < 3; ++i)  // in record 0 alone, nothing varies
    dataset.records[i].recording.add_condition("support_m", i == 0 ? 0.0 : 0.01);
  ModelChoice scheduled = choice(dataset, "linear");
  scheduled.options = {{"schedule", "support_m"}};
  scheduled.features = resolve_inputs(dataset, {"spring_deflection_rad", "support_m"});
  ModelChoice plain = scheduled;
  plain.options.clear();
  const CrossValidation validation =
      cross_validate(dataset, {scheduled, plain}, {.by = "record"}, 1, false);
  const FoldSummary& failed = validation.ranking.back();
  EXPECT_EQ(failed.variant, "schedule=support_m");
  EXPECT_EQ(failed.failed_folds, 1U);
  EXPECT_EQ(failed.folds, 2U);
  EXPECT_EQ(failed.reason.substr(0, 10), "record 0: ");
  EXPECT_EQ(validation.ranking.front().failed_folds, 0U);
}

TEST(CrossValidate, RanksOnTheFoldsInWhichTheModelsRan) {
  Dataset dataset = records(4);
  for (std::size_t i = 0; i < 4; ++i)  // the first and the last value are outside the others'
    dataset.records[i].recording.add_condition("support_m", 0.01 * static_cast<double>(i));
  const FeatureSpec features = resolve_inputs(dataset, {"spring_deflection_rad", "support_m"});
  const CrossValidation validation = cross_validate(
      dataset, {{.family = "linear", .features = features}}, {.by = "support_m"}, 1, false);
  const auto& rankings = validation.results.rankings;
  ASSERT_EQ(rankings.size(), 4U);
  EXPECT_FALSE(rankings[0].is_possible());
  EXPECT_TRUE(rankings[1].is_possible());
  EXPECT_TRUE(rankings[2].is_possible());
  EXPECT_FALSE(rankings[3].is_possible());
  const FoldSummary& summary = validation.ranking.front();
  EXPECT_EQ(summary.folds, 4U);
  // Records of 1000, 1100, 1200 and 1300 samples: 2300 of 4600.
  EXPECT_EQ(validation.ranked().common_samples, 2300U);
  EXPECT_TRUE(validation.ranked().is_possible()) << "half of the samples";
  EXPECT_EQ(summary.ranked_folds, 2U);
  const std::vector<ResultRow>& rows = validation.results.rows;
  EXPECT_NEAR(summary.common_rmse.mean,
              0.5 * (rows[2].score.common.rmse + rows[4].score.common.rmse), 1e-12);
  EXPECT_EQ(rows[2].score.common.rmse, rows[2].score.metrics.rmse);
  EXPECT_GT(summary.rmse.mean, 0.0);
  EXPECT_GT(summary.within_2_std_dev, summary.within_std_dev);
}

TEST(CrossValidate, RefusesALeakAndStopsWhenAskedTo) {
  Dataset dataset = records(2);
  const std::vector<ModelChoice> choices{choice(dataset, "linear")};
  EXPECT_THROW((void)cross_validate(dataset, choices, {.by = "record"}, 1, false,
                                    [](double, std::string_view) { return false; }),
               Cancelled);
  dataset.target_computed_from = {"gear_angle_rad"};
  EXPECT_THROW((void)cross_validate(dataset, choices, {.by = "record"}, 1, false), UsageError);
  const CrossValidation allowed = cross_validate(dataset, choices, {.by = "record"}, 1, true);
  EXPECT_TRUE(allowed.ranking.front().leak);
}

}  // namespace
}  // namespace torsio
