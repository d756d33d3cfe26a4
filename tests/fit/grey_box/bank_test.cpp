#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "fit/common/model_run.hpp"
#include "fit/grey_box/bank_choice.hpp"
#include "fit/grey_box/fit_grey_box.hpp"
#include "fit/grey_box/grey_box_sums.hpp"
#include "fit/transfer/refit.hpp"
#include "support/example_data.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;
using testing::HasSubstr;
using Row = std::span<const double>;

constexpr GreyBoxOptions kWithoutResidual{.residual = ResidualKind::none};

/// A spring driven by a shaft whose friction follows the shaft's own angle: a record of the twist and the
/// shaft's rate (or angle). `travel` is how far the shaft turns.
Sequence shaft_record(double travel, double friction_Nm, bool by_rate, std::uint64_t seed) {
  Random random(seed);
  const double phase = 7.0 * random.uniform();
  constexpr std::size_t kSamples = 6000;
  Matrix features(kSamples, 2);
  double before = 0.0;
  double stop = 0.0;
  Sequence record{.recording = "shaft"};
  for (std::size_t n = 0; n < kSamples; ++n) {
    const double t = 0.004 * static_cast<double>(n) + phase;
    const double twist = 0.05 * std::sin(1.3 * t) + 0.03 * std::sin(2.9 * t + 1.0);
    const double angle = travel * (std::sin(0.7 * t) + 0.4 * std::sin(3.1 * t));
    if (n > 0) stop = std::clamp(stop + angle - before, -0.01, 0.01);
    features(n, 0) = twist;
    features(n, 1) = by_rate ? (n > 0 ? (angle - before) * kRate_Hz : 0.0) : angle;
    before = angle;
    record.target.push_back(300.0 * twist - friction_Nm * stop / 0.01 + 0.05 * random.normal());
  }
  record.features = std::move(features);
  record.use.assign(kSamples, 1);
  return record;
}

TrainingData shaft_data(double friction_Nm, bool by_rate = true,
                        const std::vector<double>& travels = {0.1, 0.3, 5.0, 20.0}) {
  TrainingData data;
  data.inputs = {
      {.expression = "twist_rad"},
      {.expression = by_rate ? "shaft_speed_rad_s" : "shaft_angle_rad", .is_rate = by_rate}};
  data.target = "torque_Nm";
  data.sample_rate_Hz = kRate_Hz;
  for (std::size_t k = 0; k < travels.size(); ++k)
    data.sequences.push_back(shaft_record(travels[k], friction_Nm, by_rate, k + 1));
  return data;
}

TrainingData test_data(double friction_Nm, bool by_rate = true) {
  TrainingData data = shaft_data(friction_Nm, by_rate, {});
  data.sequences.push_back(shaft_record(0.2, friction_Nm, by_rate, 77));
  return data;
}

TEST(GreyBoxBanks, FindFrictionThatLivesInTheIntegralOfARate) {
  const TrainingData data = shaft_data(4.0);
  const Fitted<GreyBox> with = fit_grey_box(data, kWithoutResidual);
  const Fitted<GreyBox> without =
      fit_grey_box(data, {.banks = false, .residual = ResidualKind::none});
  ASSERT_EQ(with.parameters.terms.banks.size(), 1U) << with.notes.back();
  const InputBank& bank = with.parameters.terms.banks[0];
  EXPECT_EQ(bank.input, 1U);
  EXPECT_TRUE(bank.is_integrated);
  EXPECT_FALSE(bank.thresholds.empty());
  const std::size_t first = with.parameters.terms.first_bank();
  for (std::size_t j = 0; j < bank.first_curve(); ++j)
    EXPECT_LE(with.parameters.coefficients.values(0, first + j), 0.0) << "its torque is taken off";
  const double error = evaluate(GreyBox(with.parameters), test_data(4.0)).rmse;
  EXPECT_LT(error, 0.6);
  EXPECT_LT(error, 0.5 * evaluate(GreyBox(without.parameters), test_data(4.0)).rmse);
  EXPECT_THAT(with.notes.back(), HasSubstr("over shaft_speed_rad_s"));
  EXPECT_LT(with.held_out_rmse, without.held_out_rmse);
}

TEST(GreyBoxBanks, FollowAnAngleWhereOneIsLogged) {
  const Fitted<GreyBox> fitted = fit_grey_box(shaft_data(4.0, false), kWithoutResidual);
  ASSERT_EQ(fitted.parameters.terms.banks.size(), 1U) << fitted.notes.back();
  EXPECT_FALSE(fitted.parameters.terms.banks[0].is_integrated);
  EXPECT_LT(evaluate(GreyBox(fitted.parameters), test_data(4.0, false)).rmse, 0.6);
}

TEST(GreyBoxBanks, AreLeftOutWhereNothingIsGained) {
  const TrainingData data = shaft_data(0.0);
  const Fitted<GreyBox> with = fit_grey_box(data, kWithoutResidual);
  const Fitted<GreyBox> without =
      fit_grey_box(data, {.banks = false, .residual = ResidualKind::none});
  EXPECT_TRUE(with.parameters.terms.banks.empty()) << with.notes.back();
  EXPECT_EQ(with.parameters.coefficients, without.parameters.coefficients);
  EXPECT_EQ(with.held_out_rmse, without.held_out_rmse);
}

TEST(GreyBoxBanks, AreNotPartOfAPassiveBox) {
  EXPECT_TRUE(fit_grey_box(shaft_data(4.0), {.passive = true}).parameters.terms.banks.empty());
}

TEST(GreyBoxBanks, AreTheSameEachTime) {
  const TrainingData data = shaft_data(4.0);
  const Fitted<GreyBox> first = fit_grey_box(data, kWithoutResidual);
  const Fitted<GreyBox> second = fit_grey_box(data, kWithoutResidual);
  EXPECT_EQ(first.parameters.terms, second.parameters.terms);
  EXPECT_EQ(first.parameters.coefficients, second.parameters.coefficients);
}

TEST(GreyBoxBanks, AreRefittedToAnotherSpecimen) {
  const Fitted<GreyBox> base = fit_grey_box(shaft_data(4.0), kWithoutResidual);
  const FeatureRanges ranges{.lowest = {-0.08, -20.0}, .highest = {0.08, 20.0}};
  const AnyModel::Parameters other =
      refitted(base.parameters, ranges, shaft_data(6.0, true, {0.3, 5.0}), 1e-4);
  const double before = evaluate(GreyBox(base.parameters), test_data(6.0)).rmse;
  EXPECT_GT(before, 1.0);
  EXPECT_LT(evaluate(AnyModel(other), test_data(6.0)).rmse, 0.5 * before);
}

TEST(GreyBoxBanks, ResolveTheRecordingInWhichTheCoordinateMovesLeast) {
  const std::vector<InputBank> banks = finest_banks(shaft_data(4.0), 0);
  ASSERT_EQ(banks.size(), 1U);
  EXPECT_LT(banks[0].thresholds.back(), 0.05);
  EXPECT_GT(banks[0].thresholds.back(), 0.01);
  EXPECT_TRUE(finest_banks(shaft_data(4.0), 1).empty()) << "it schedules";
}

TEST(GreyBoxBanks, HaveNoSlipsOverWhatTheFirstInputIs) {
  TrainingData data = shaft_data(0.0);
  for (Sequence& record : data.sequences)
    for (std::size_t n = 1; n < record.target.size(); ++n)
      record.features(n, 1) = (record.features(n, 0) - record.features(n - 1, 0)) * kRate_Hz;
  const std::vector<InputBank> banks = finest_banks(data, 0);
  ASSERT_EQ(banks.size(), 1U);
  EXPECT_TRUE(banks[0].thresholds.empty());
}

/// Any choice is the finest bank's terms in other proportions.
TEST(GreyBoxBanks, AChosenBankIsASumOfTheColumnsOfTheFinest) {
  const InputBank finest = finest_banks(shaft_data(4.0), 0).front();
  const BankChoice choice{
      .slips = 2, .forces = 1, .curve = 2, .product = 2, .relaxations = 2, .is_negative = true};
  const InputBank chosen = bank_of(finest, choice);
  std::vector<ColumnShare> shares;
  add_bank_columns(shares, finest, 0, chosen, 0, choice);
  InputBankTerms fine(finest, 1.0 / kRate_Hz, "fine");
  InputBankTerms coarse(chosen, 1.0 / kRate_Hz, "coarse");
  const Sequence record = shaft_record(0.3, 4.0, true, 5);
  for (std::size_t n = 0; n < record.target.size(); ++n) {
    const Features features = record.features.row(n);
    fine.move(features[1]);
    coarse.move(features[1]);
    std::vector<double> of_fine(finest.columns(), 0.0);
    std::vector<double> of_coarse(chosen.columns(), 0.0);
    InputBankTerms::visit(finest, 0, features[0], features, fine.state(),
                          [&](std::size_t column, double value) { of_fine[column] += value; });
    InputBankTerms::visit(chosen, 0, features[0], features, coarse.state(),
                          [&](std::size_t column, double value) { of_coarse[column] += value; });
    std::vector<double> summed(chosen.columns(), 0.0);
    for (const auto& each : shares) summed[each.to] += each.factor * of_fine[each.from];
    for (std::size_t j = 0; j < summed.size(); ++j) {
      const double sign = j < chosen.first_curve() ? -1.0 : 1.0;
      ASSERT_NEAR(summed[j], sign * of_coarse[j], 1e-9) << "column " << j << ", sample " << n;
    }
  }
}

TEST(GreyBoxBanks, LeaveAGapBetweenHeldOutBlocks) {
  const TrainingData one = shaft_data(4.0, true, {0.3});
  GreyBoxTerms::Structure main;
  main.curve_knots = {-0.1, 0.1};
  main.friction_knots = {0.0};
  main.rate_scales = {0.0, 0.0};
  main.sample_period_s = 1.0 / kRate_Hz;
  const GreyBoxSums sums = gather_banks(one, "", main);
  ASSERT_EQ(sums.gap.size(), 1U);
  std::size_t in_blocks = 0;
  for (const NormalEquations& cell : sums.cells) in_blocks += cell.rows;
  EXPECT_EQ(in_blocks + sums.gap[0].rows, one.usable_samples());
  EXPECT_NEAR(static_cast<double>(sums.gap[0].rows),
              0.1 * static_cast<double>(one.usable_samples()), 100.0);
  EXPECT_TRUE(gather_banks(shaft_data(4.0), "", main).gap.empty()) << "records in turn";
}

}  // namespace
}  // namespace torsio
