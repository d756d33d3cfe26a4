#include "torsio/evaluate/comparison.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "numerics/metrics_accumulator.hpp"
#include "support/bench_dataset.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/report/results.hpp"

namespace torsio {
namespace {

/// A bench whose torque also rises with a heat, 0 to 1 in the training recordings; in the test
/// recording it is 3 from sample `hot_from` on.
Dataset heated_bench(std::size_t hot_from) {
  Dataset cold = test::bench_dataset();
  Dataset dataset;
  for (const DatasetRecord& record : cold.records) {
    Recording recording(record.recording.name(), 1000.0);
    const bool is_test = record.has_role(Role::test);
    Channel heat{"heat_1", {}};
    for (std::size_t n = 0; n < record.recording.size(); ++n)
      heat.values.push_back(is_test && n >= hot_from ? 3.0
                                                     : static_cast<double>(n % 1000) / 1000.0);
    for (Channel channel : record.recording.channels()) {
      if (channel.name == "torque_Nm")
        for (std::size_t n = 0; n < channel.values.size(); ++n) channel.values[n] += heat.values[n];
      recording.add(std::move(channel));
    }
    recording.add(std::move(heat));
    test::add_record(dataset, std::move(recording), record.segments.front().role);
  }
  return dataset;
}

/// `linear_coulomb`, whose inputs stay in range, and `linear`, which is also given the heat.
std::vector<ModelChoice> friction_and_heat(const Dataset& dataset) {
  return {
      {.family = "linear_coulomb", .input_set = "plain", .features = resolve_inputs(dataset, {})},
      {.family = "linear",
       .input_set = "heat",
       .features = resolve_inputs(dataset, {"spring_deflection_rad", "heat_1"})}};
}

const ResultRow& test_row(const Results& results, const std::string& family) {
  return *std::ranges::find_if(results.rows, [&](const ResultRow& row) {
    return row.family == family && row.split == Role::test && !row.recording;
  });
}

TEST(Compare, RanksOnTheSamplesThatNoRankedModelGuarded) {
  constexpr std::size_t kHotFrom = 2400;
  const Dataset dataset = heated_bench(kHotFrom);
  const Comparison comparison = compare(dataset, friction_and_heat(dataset), 1, false);
  const ResultRow& friction = test_row(comparison.results, "linear_coulomb");
  const ResultRow& heat = test_row(comparison.results, "linear");
  EXPECT_EQ(friction.score.guarded_samples, 0U);
  EXPECT_EQ(heat.score.guarded_samples, 4000U - kHotFrom);
  // Over all samples the fallback of a guard would win.
  EXPECT_LT(heat.score.metrics.rmse, friction.score.metrics.rmse);
  EXPECT_LT(friction.score.common.rmse, 0.6 * heat.score.common.rmse);
  ASSERT_TRUE(comparison.best);
  EXPECT_EQ(comparison.best->file.card.fitted_as, "linear_coulomb");

  const Recording& recording = dataset.records.back().recording;
  const std::vector<double>& target = recording.channel("torque_Nm").values;
  const TrainedModel trained = train_model(dataset, friction_and_heat(dataset)[0], 1);
  const Prediction prediction = predict(make_estimator(trained.file), recording);
  MetricsAccumulator by_hand;
  for (std::size_t n = 0; n < kHotFrom; ++n)
    if (prediction.estimates[n].fault == Fault::none)
      by_hand.add(prediction.estimates[n].value, target[n]);
  EXPECT_EQ(friction.score.common.samples, by_hand.metrics().samples);
  EXPECT_NEAR(friction.score.common.rmse, by_hand.metrics().rmse, 1e-12);

  ASSERT_EQ(comparison.results.rankings.size(), 1U);
  const Ranking& ranking = comparison.results.rankings.front();
  EXPECT_TRUE(ranking.is_possible());
  EXPECT_NEAR(ranking.guarded_share(), 0.4, 0.01);
  EXPECT_NE(ranking_note(ranking).find("WARNING: in 40."), std::string::npos)
      << ranking_note(ranking);
  const std::string table = ranked_table(comparison.results, Role::test);
  EXPECT_LT(table.find("linear_coulomb"), table.find("linear ")) << table;
}

TEST(Compare, ScoresAreThoseOfAllSamplesWhereNoGuardActs) {
  const Dataset dataset = test::bench_dataset();
  const Results results = compare(dataset, model_choices(dataset, "linear", {}), 1, false).results;
  const Score& score = test_row(results, "linear").score;
  EXPECT_EQ(score.common.rmse, score.metrics.rmse);
  EXPECT_EQ(score.common.max_abs, score.metrics.max_abs);
  EXPECT_EQ(score.common.samples, score.metrics.samples);
  EXPECT_EQ(ranking_note(results.rankings.front()), "");
}

TEST(Compare, DoesNotRankOnLessThanHalfOfTheSamples) {
  const Dataset dataset = heated_bench(1000);
  std::vector<ModelChoice> choices = friction_and_heat(dataset);
  choices.erase(choices.begin());
  choices.push_back(choices.front());
  choices.back().family = "polynomial";
  const Comparison comparison = compare(dataset, choices, 1, false);
  EXPECT_FALSE(comparison.best);
  const Ranking& ranking = comparison.results.rankings.front();
  EXPECT_FALSE(ranking.is_possible());
  EXPECT_NE(ranking_note(ranking).find("NO RANKING: in 75."), std::string::npos)
      << ranking_note(ranking);
  const std::string table = ranked_table(comparison.results, Role::test);
  EXPECT_LT(table.find("linear"), table.find("polynomial")) << "the order of the call";
  EXPECT_EQ(test_row(comparison.results, "linear").score.common.samples, 0U);
}

TEST(Compare, AModelThatHardlyRanDoesNotPreventTheRankingOfOthers) {
  const Dataset dataset = heated_bench(1000);
  const Comparison comparison = compare(dataset, friction_and_heat(dataset), 1, false);
  EXPECT_EQ(comparison.results.rankings.front().guarded_share(), 0.0);
  ASSERT_TRUE(comparison.best);
  EXPECT_EQ(comparison.best->file.card.fitted_as, "linear_coulomb");
  const std::string table = ranked_table(comparison.results, Role::test);
  EXPECT_NE(table.find("not in the ranking:\n  linear (heat): guarded: 75."), std::string::npos)
      << table;
}

TEST(Compare, ShowsTheCoverageOfTheErrorBar) {
  const Dataset dataset = test::bench_dataset();
  const Results results =
      compare(dataset, model_choices(dataset, "linear_coulomb", {}), 1, false).results;
  const std::string table = ranked_table(results, Role::test);
  const Score& score = test_row(results, "linear_coulomb").score;
  EXPECT_GT(score.within_std_dev, 0.5);
  for (const std::string& text :
       {std::string("in 1 sd %  in 2 sd %"), fmt::format(" {:.1f}  ", 100.0 * score.within_std_dev),
        fmt::format(" {:.1f}  ", 100.0 * score.within_2_std_dev)})
    EXPECT_NE(table.find(text), std::string::npos) << text << '\n' << table;
}

/// Rows of one model on its training data and on a test recording.
std::vector<ResultRow> rows_with(double train_fit_percent, const std::string& train_status) {
  ResultRow train{.family = "arx", .split = Role::train, .status = train_status};
  train.score.metrics.fit_percent = train_fit_percent;
  train.reason = "free run left the output's range in 3.0 % of the samples";
  return {train, {.family = "arx", .split = Role::test}};
}

TEST(Divergence, InTrainingMarksAllRowsOfTheModel) {
  std::vector<ResultRow> twice = rows_with(-100.5, "ok");
  mark_divergence_in_training(twice);
  for (const ResultRow& row : twice) {
    EXPECT_EQ(row.status, "diverged");
    EXPECT_EQ(
        row.reason,
        "on its own training data: the error is 2 times the standard deviation of the target");
  }
  std::vector<ResultRow> free_run = rows_with(80.0, "diverged");
  mark_divergence_in_training(free_run);
  EXPECT_EQ(free_run.back().status, "diverged");
  std::vector<ResultRow> poor = rows_with(-99.0, "ok");
  mark_divergence_in_training(poor);
  EXPECT_EQ(poor.back().status, "ok");
}

}  // namespace
}  // namespace torsio
