#include "torsio/report/results.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/bench_dataset.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/report/html/verb_reports.hpp"

namespace torsio {
namespace {

Comparison small_comparison(const std::string& models = "linear,linear_coulomb") {
  const Dataset dataset = test::bench_dataset();
  return compare(dataset, model_choices(dataset, models, {}), 1, false);
}

TEST(ResultsJson, HasTheFieldsOfTheContract) {
  const auto json = nlohmann::json::parse(results_json(small_comparison().results));
  EXPECT_EQ(json.at("target"), "torque_Nm");
  EXPECT_EQ(json.at("unit"), "Nm");
  EXPECT_EQ(json.at("inputs").size(), 3U);
  // Two models, each on train (two records and together) and test (one record and together).
  ASSERT_EQ(json.at("results").size(), 2U * 5U);
  for (const auto& row : json.at("results"))
    for (const char* field : {"family",
                              "split",
                              "recording",
                              "mode",
                              "rmse",
                              "mad",
                              "std_abs",
                              "max_abs",
                              "fit_percent",
                              "samples",
                              "initialised_samples",
                              "within_std_dev",
                              "within_2_std_dev",
                              "mean_std_dev",
                              "without_std_dev",
                              "step_ns_p50",
                              "step_ns_p999",
                              "fit_seconds",
                              "parameter_count",
                              "status",
                              "reason"})
      EXPECT_TRUE(row.contains(field)) << field;
}

TEST(RankingNote, StatesOfWhichSamplesErrorsAre) {
  EXPECT_EQ(
      ranking_note({.scored_samples = 11972, .common_samples = 11958}),
      "errors on 11958 of the 11972 samples at which the sensor gave a new value; in the others "
      "a guard reported a fault of a model\n");
}

TEST(ComparisonReport, NamesTheLargestErrorWithAndWithoutTheSamplesOfGuards) {
  const Dataset dataset = test::bench_dataset();
  Comparison comparison = compare(dataset, model_choices(dataset, "linear", {}), 1, false);
  const auto summary = [&] { return comparison_report(comparison, dataset).summary.front(); };
  EXPECT_EQ(summary().find("that a guard reported"), std::string::npos) << summary();
  for (ResultRow& row : comparison.results.rows)
    if (row.split == Role::test) {
      row.score.common.max_abs = 2.5;
      row.score.metrics.max_abs = 99.0;
    }
  EXPECT_NE(
      summary().find("largest error 2.500 Nm (99.000 Nm with the samples that a guard reported)."),
      std::string::npos)
      << summary();
}

TEST(ResultsJson, WritesWhatIsNotANumberAsNull) {
  Results results{.target = "torque_Nm", .unit = "Nm"};
  results.rows.push_back({.family = "linear", .status = "failed", .reason = "too few samples"});
  const auto json = nlohmann::json::parse(results_json(results));
  EXPECT_TRUE(json.at("results").at(0).at("rmse").is_null());
  EXPECT_EQ(json.at("results").at(0).at("reason"), "too few samples");
}

TEST(RankedTable, HasReadableNumbersOfAnySize) {
  Results results{.target = "torque_Nm", .unit = "Nm"};
  ResultRow row{.family = "linear", .split = Role::test, .status = "ok"};
  for (const double size : {1e-300, 1.0, 1e300}) {
    row.score.metrics = {.rmse = size, .mad = size, .max_abs = size, .fit_percent = -size};
    row.score.metrics.samples = 10;
    results.rows.push_back(row);
  }
  const std::string table = ranked_table(results, Role::test);
  for (std::size_t begin = 0; begin < table.size(); begin = table.find('\n', begin) + 1)
    EXPECT_LT(table.find('\n', begin) - begin, 120U) << table;
  EXPECT_NE(table.find("-1e+300"), std::string::npos) << table;
}

TEST(Compare, KeepsTheModelOfTheLowestTestError) {
  const Comparison comparison = small_comparison();
  ASSERT_TRUE(comparison.best);
  EXPECT_EQ(comparison.best->file.card.fitted_as, "linear_coulomb");
  EXPECT_FALSE(comparison.best->file.card.metrics.empty());
}

TEST(Compare, TurnsAFitThatFailsIntoARowThatSaysWhy) {
  const Dataset dataset = test::bench_dataset();
  const auto choices =
      model_choices(dataset, "linear,linear_coulomb", {"gear_angle_rad - joint_angle_rad"});
  const Comparison comparison = compare(dataset, choices, 1, false);
  const auto& failed = comparison.results.rows.back();
  EXPECT_EQ(failed.family, "linear_coulomb");
  EXPECT_EQ(failed.status, "failed");
  EXPECT_NE(failed.reason.find("rate"), std::string::npos) << failed.reason;
  EXPECT_NE(ranked_table(comparison.results, Role::test).find("not in the ranking"),
            std::string::npos);
}

TEST(Compare, RefusesASettingThatNamesNoInput) {
  const Dataset dataset = test::bench_dataset();
  const auto choices = model_choices(dataset, "linear:schedule=foo", {});
  EXPECT_THROW((void)compare(dataset, choices, 1, false), UsageError);
}

TEST(Compare, RefusesALeakUnlessItIsAllowedAndMarksItThen) {
  Dataset dataset = test::bench_dataset();
  dataset.target_computed_from = {"gear_angle_rad"};
  const auto choices = model_choices(dataset, "linear", {});
  EXPECT_THROW((void)compare(dataset, choices, 1, false), UsageError);
  const Comparison comparison = compare(dataset, choices, 1, true);
  EXPECT_TRUE(comparison.results.rows.front().leak);
  EXPECT_NE(results_json(comparison.results).find("\"leak\": true"), std::string::npos);
}

TEST(Compare, NeedsTestRecords) {
  Dataset dataset = test::bench_dataset();
  dataset.records.pop_back();
  EXPECT_THROW((void)compare(dataset, model_choices(dataset, "linear", {}), 1, false), UsageError);
}

TEST(ModelChoices, ReadFamiliesWithSettings) {
  const Dataset dataset = test::bench_dataset();
  const auto choices = model_choices(dataset, "linear,polynomial:degree=3:branch=false", {});
  ASSERT_EQ(choices.size(), 2U);
  EXPECT_EQ(choices[1].variant(), "branch=false,degree=3");
  EXPECT_THROW((void)model_choices(dataset, "linaer", {}), UsageError);
  EXPECT_THROW((void)model_choices(dataset, "linear:colour=red", {}), UsageError);
  EXPECT_THROW((void)model_choices(dataset, "polynomial:degree", {}), UsageError);
}

TEST(ModelChoices, OfAllScheduleOverAConditionThatChangesInTraining) {
  Dataset dataset = test::bench_dataset();
  double support_m = 0.0;
  for (DatasetRecord& record : dataset.records)
    record.recording.add_condition("support_m", support_m += 0.01);
  const auto choices = model_choices(dataset, "all", {"spring_deflection_rad", "support_m"});
  const auto scheduled = std::ranges::count_if(
      choices, [](const ModelChoice& choice) { return choice.options.contains("schedule"); });
  const auto schedulable = std::ranges::count_if(families(), [](const FamilyInfo& family) {
    return !family.only_if_named && has_option(family, "schedule");
  });
  EXPECT_EQ(scheduled, schedulable);
  EXPECT_GE(scheduled, 3);
}

TEST(ModelChoices, OfAllAndMoreAreAllWithThatAdded) {
  const Dataset dataset = test::bench_dataset();
  const std::size_t all = model_choices(dataset, "all", {}).size();
  const auto more = model_choices(dataset, "all,lstm,linear", {});
  ASSERT_EQ(more.size(), all + 1) << "linear is among all";
  EXPECT_EQ(more.back().family, "lstm");
  EXPECT_EQ(model_choices(dataset, "linear,all", {}).size(), all);
}

TEST(RankedTable, PutsTheBestFirst) {
  const std::string table = ranked_table(small_comparison().results, Role::test);
  EXPECT_LT(table.find("linear_coulomb"), table.find("linear "));
}

}  // namespace
}  // namespace torsio
