#include "report/cross_validation.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/bench_dataset.hpp"
#include "torsio/evaluate/comparison.hpp"

namespace torsio {
namespace {

CrossValidation two_models(const std::string& by) {
  Dataset dataset;
  for (int i = 0; i < 3; ++i) {
    const std::string record = "record " + std::to_string(i);
    test::add_record(dataset,
                     test::bench_recording(record, {.seed = static_cast<std::uint64_t>(i)}),
                     Role::train);
    dataset.records.back().recording.add_condition("support_m", i == 0 ? 0.0 : 0.01);
  }
  const auto choices = model_choices(dataset, "linear,linear:schedule=support_m",
                                     {"gear_angle_rad - joint_angle_rad", "support_m"});
  return cross_validate(dataset, choices, {.folds = 3, .by = by}, 1, false);
}

TEST(CrossValidationJson, HasRowsFoldsAndSummary) {
  const auto json = nlohmann::json::parse(cross_validation_json(two_models("record")));
  EXPECT_EQ(json.at("target"), "torque_Nm");
  ASSERT_EQ(json.at("folds").size(), 3U);
  EXPECT_EQ(json.at("folds").at(1).at("recordings").at(0), "record 1");
  EXPECT_EQ(json.at("folds").at(1).at("held_out_samples"), 4000);
  for (const auto& row : json.at("results")) {
    EXPECT_EQ(row.at("split"), "validation");
    EXPECT_TRUE(row.contains("fold"));
  }
  const auto& best = json.at("summary").at(0);
  EXPECT_EQ(best.at("status"), "ok");
  EXPECT_EQ(best.at("folds"), 3);
  EXPECT_GT(best.at("rmse_mean"), 0.0);
  EXPECT_GT(best.at("rmse_std"), 0.0);
  const auto& failed = json.at("summary").at(1);
  EXPECT_EQ(failed.at("status"), "failed");
  EXPECT_EQ(failed.at("failed_folds"), 1);
  EXPECT_NE(failed.at("reason").get<std::string>().find("record 0: "), std::string::npos);
}

TEST(CrossValidationTable, RanksModelsAndSaysWhatEachFoldHoldsOut) {
  const std::string table = cross_validation_table(two_models(""));
  EXPECT_NE(table.find("worst fold"), std::string::npos) << table;
  EXPECT_NE(table.find(" +- "), std::string::npos) << table;
  EXPECT_NE(table.find("fold 3: 4000 samples of record"), std::string::npos) << table;
  EXPECT_NE(table.find("linear[schedule=support_m]: failed in 1 of 3 folds"), std::string::npos)
      << table;
}

}  // namespace
}  // namespace torsio
