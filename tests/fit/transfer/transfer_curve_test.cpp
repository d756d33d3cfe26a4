#include "torsio/evaluate/transfer_curve.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "report/transfer.hpp"
#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

ModelFile base_model() {
  return train_model(test::one_recording({.samples = 8000}),
                     {.family = "linear",
                      .features = {.inputs = {"spring_deflection_rad"},
                                   .definitions = {{"spring_deflection_rad",
                                                    "gear_angle_rad - joint_angle_rad"}}}},
                     1)
      .file;
}

Dataset new_joint() {
  Dataset dataset = test::one_recording(
      {.stiffness_Nm_rad = 300.0, .offset_Nm = 1.0, .samples = 8000, .seed = 6});
  hold_out_after(dataset, 4.0);
  return dataset;
}

TEST(HoldOutAfter, SplitsEachRecording) {
  const Dataset dataset = new_joint();
  ASSERT_EQ(dataset.records[0].segments.size(), 2U);
  EXPECT_EQ(dataset.records[0].segments[0],
            (Segment{.begin = 0, .end = 4000, .role = Role::train}));
  EXPECT_EQ(dataset.records[0].segments[1],
            (Segment{.begin = 4000, .end = 8000, .role = Role::test}));
  Dataset short_one = test::one_recording({.samples = 1000});
  EXPECT_THAT(test::error_message([&] { hold_out_after(short_one, 1.0); }),
              HasSubstr("something is left to score on"));
  EXPECT_THAT(test::error_message([&] { hold_out_after(short_one, 0.0); }),
              HasSubstr("more than 0 s"));
}

TEST(WithTrainingTime, IsPositive) {
  for (const double seconds : {0.0, -5.0, std::nan("")})
    EXPECT_THAT(
        test::error_message([&] { static_cast<void>(with_training_time(new_joint(), seconds)); }),
        HasSubstr("more than 0 s"));
}

TEST(WithTrainingTime, CutsTheTrainingOnly) {
  const Dataset dataset = with_training_time(new_joint(), 1.5);
  ASSERT_EQ(dataset.records[0].segments.size(), 2U);
  EXPECT_EQ(dataset.records[0].segments[0].end, 1500U);
  EXPECT_EQ(dataset.records[0].segments[1].begin, 4000U);
}

TEST(EvaluateTransfer, ScoresEveryMethodAndTheNewDataAlone) {
  const TransferEvaluation evaluation = evaluate_transfer(base_model(), new_joint(), {}, 1);
  EXPECT_DOUBLE_EQ(evaluation.seconds, 4.0);
  ASSERT_EQ(evaluation.methods.size(), 6U);
  ASSERT_NE(evaluation.find("own"), nullptr);
  EXPECT_LT(evaluation.chosen().test.metrics.rmse,
            0.5 * evaluation.find("none")->test.metrics.rmse);
  const std::string text = transfer_text(evaluation, {}, "torque_Nm");
  EXPECT_THAT(text, HasSubstr("chosen"));
  EXPECT_THAT(text, HasSubstr("a model of these data alone"));
  const auto json = nlohmann::json::parse(transfer_json(evaluation, {}, "torque_Nm"));
  EXPECT_EQ(json["methods"].size(), 6U);
  EXPECT_EQ(json["chosen"], evaluation.chosen().method);
  EXPECT_TRUE(json["base_helps_until_s"].is_null());
}

TEST(EvaluateTransfer, TheFileHasTheScoresOfItsTest) {
  const TransferEvaluation evaluation = evaluate_transfer(base_model(), new_joint(), {}, 1);
  EXPECT_EQ(evaluation.transfer.best().file.card.metrics.at("rmse"),
            evaluation.chosen().test.metrics.rmse);
}

TEST(EvaluateTransfer, ATransferredModelCanBeTheBaseOfAnotherTransfer) {
  const ModelFile first = evaluate_transfer(base_model(), new_joint(), {}, 1).transfer.best().file;
  const TransferEvaluation evaluation = evaluate_transfer(first, new_joint(), {}, 1);
  EXPECT_NE(evaluation.find("own"), nullptr);
}

TEST(EvaluateTransfer, NeedsSomethingToScoreOn) {
  EXPECT_THAT(
      test::error_message([] {
        static_cast<void>(evaluate_transfer(base_model(), test::one_recording({.seed = 6}), {}, 1));
      }),
      HasSubstr("no part of the recordings is left"));
}

TEST(TransferCurve, HasAPointForEachTime) {
  const TransferCurve curve = transfer_curve(base_model(), new_joint(), {0.5, 1.0, 4.0}, {}, 1);
  ASSERT_EQ(curve.points.size(), 3U);
  for (const TransferCurve::Point& point : curve.points) {
    EXPECT_GT(point.base_rmse, 0.0);
    EXPECT_FALSE(point.method.empty());
  }
  EXPECT_THAT(
      transfer_text(evaluate_transfer(base_model(), new_joint(), {}, 1), curve, "torque_Nm"),
      HasSubstr("Learning curve"));
  for (const std::vector<double>& wrong : {std::vector{1.0, 0.5}, {5.0}, {0.0}, {std::nan("")}})
    EXPECT_THAT(test::error_message([&] {
                  static_cast<void>(transfer_curve(base_model(), new_joint(), wrong, {}, 1));
                }),
                HasSubstr("ascending times of at most 4 s"));
}

}  // namespace
}  // namespace torsio
