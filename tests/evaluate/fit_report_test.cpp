#include "torsio/evaluate/fit_report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "report/fit_report.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

/// A record of a spring of 500 Nm/rad whose torque is off by `error(n)`.
template <class Error>
Dataset spring_with(Error error, std::size_t samples = 4000) {
  Recording recording("spring", 100.0);
  Channel deflection{"spring_deflection_rad", {}};
  Channel torque{"torque_Nm", {}};
  for (std::size_t n = 0; n < samples; ++n) {
    deflection.values.push_back(0.1 * std::sin(0.013 * static_cast<double>(n)));
    torque.values.push_back(500.0 * deflection.values.back() + error(n));
  }
  recording.add(std::move(deflection));
  recording.add(std::move(torque));
  Dataset dataset;
  auto segments = whole_record(recording.size(), Role::train);
  dataset.records.push_back({std::move(recording), std::move(segments)});
  return dataset;
}

FitReport report_of(const Dataset& dataset) {
  TrainedModel model = train_model(
      dataset,
      {.family = "linear", .features = {.inputs = {"spring_deflection_rad"}, .definitions = {}}},
      1);
  model.table = {{.name = "k", .unit = "Nm/rad", .value = 500.0, .std_error = 1.0}};
  return fit_report(model, dataset);
}

TEST(FitReportOf, WhiteResidualsAreIndependent) {
  Random random(4);
  const FitReport report = report_of(spring_with([&](std::size_t) { return random.normal(); }));
  EXPECT_EQ(report.split, "train");
  EXPECT_EQ(report.samples, 4000U);
  ASSERT_EQ(report.correlations.size(), 2U);
  EXPECT_LT(std::abs(report.correlations[0].strongest), 0.07);
  EXPECT_LT(report.correlations[0].share_outside, 0.04);
  EXPECT_NEAR(report.effective_samples, 4000.0, 800.0);
  EXPECT_NEAR(report.table[0].std_error, 1.0, 0.15);
}

TEST(FitReportOf, ColouredResidualsHaveFewerEffectiveSamples) {
  // First order with 0.95: 1 + 2 sum = 39.
  Random random(4);
  double state = 0.0;
  const FitReport report =
      report_of(spring_with([&](std::size_t) { return state = 0.95 * state + random.normal(); }));
  EXPECT_GT(report.correlations[0].strongest, 0.9);
  EXPECT_NEAR(report.correlations[0].lag_s, 0.01, 1e-12);
  EXPECT_NEAR(report.memory_s, 0.2, 0.1);
  EXPECT_NEAR(report.effective_samples, 4000.0 / 39.0, 60.0);
  EXPECT_NEAR(report.table[0].std_error, std::sqrt(4000.0 / report.effective_samples), 1e-9);
}

TEST(FitReportOf, ResidualsThatAreCorrelatedOverMoreThanTheListedLagsHaveTheirTime) {
  // First order with 0.999: 1 + 2 sum = 1999, and 1/e after 1000 samples, twice `kMaxLags`.
  Random random(4);
  double state = 0.0;
  const FitReport report = report_of(
      spring_with([&](std::size_t) { return state = 0.999 * state + random.normal(); }, 200000));
  EXPECT_NEAR(report.memory_s, 10.0, 2.5);
  // Over the listed lags alone it would be 254.
  EXPECT_NEAR(report.effective_samples, 100.0, 45.0);
}

TEST(FitReportOf, WhiteNoiseBesideASlowErrorIsForgottenAfterASample) {
  // A tenth of the variance is of first order with 0.999: 1 + 2 sum = 201.
  Random random(4);
  double state = 0.0;
  const double drive = std::sqrt((1.0 - 0.999 * 0.999) / 9.0);
  const FitReport report = report_of(spring_with(
      [&](std::size_t) {
        state = 0.999 * state + drive * random.normal();
        return state + random.normal();
      },
      200000));
  EXPECT_NEAR(report.memory_s, 0.01, 1e-12);
  EXPECT_LT(report.effective_samples, 2000.0) << "1000, and 2500 of the listed lags alone";
}

TEST(FitReportOf, PartOfARecordHasNoMoreEffectiveThanScoredSamples) {
  Random random(4);
  double state = 0.0;
  Dataset dataset =
      spring_with([&](std::size_t) { return state = 0.95 * state + random.normal(); });
  dataset.records[0].segments = {{0, 3000, Role::train}, {3000, 4000, Role::test}};
  const FitReport report = report_of(dataset);
  EXPECT_EQ(report.samples, 1000U);
  EXPECT_NEAR(report.correlations[0].lag_s, 0.01, 1e-12);
  EXPECT_LT(report.effective_samples, 1000.0 / 39.0 * 3.0);
}

TEST(FitReportOf, NamesTheInputThatWouldExplainMore) {
  Random random(4);
  double last = 0.0;
  const FitReport report = report_of(spring_with([&](std::size_t n) {
    const double now = 0.1 * std::sin(0.013 * static_cast<double>(n));
    const double sign = now > last ? 2.0 : -2.0;  // dry friction, which a line leaves over
    last = now;
    return sign + 0.1 * random.normal();
  }));
  EXPECT_EQ(report.correlations[1].with, "spring_deflection_rad");
  EXPECT_GT(std::abs(report.correlations[1].strongest), 0.6);
  EXPECT_GT(report.correlations[1].share_outside, 0.9);
}

TEST(FitReportOf, ItsTextAndDocumentHaveWhatWasFound) {
  Random random(4);
  const FitReport report = report_of(spring_with([&](std::size_t) { return random.normal(); }));
  const std::string text = fit_report_text(report);
  EXPECT_NE(text.find("spring_deflection_rad"), std::string::npos);
  EXPECT_NE(text.find("Nm/rad"), std::string::npos);
  EXPECT_NE(text.find("white and uncorrelated"), std::string::npos);
  double state = 0.0;
  const std::string coloured = fit_report_text(
      report_of(spring_with([&](std::size_t) { return state = 0.95 * state + random.normal(); })));
  EXPECT_NE(coloured.find("the residuals are correlated with their past: "), std::string::npos)
      << coloured;
  const std::string document = fit_json({}, report, {"a note"});
  EXPECT_NE(document.find("\"effective_samples\""), std::string::npos);
  EXPECT_NE(document.find("\"a note\""), std::string::npos);
}

TEST(FitReportOf, NamesTheFilterOfAnInputThatTheResidualsFollow) {
  FitReport report{.split = "train",
                   .samples = 10000,
                   .correlations = {{.with = "residual", .strongest = 1.0, .share_outside = 1.0},
                                    {.with = "lowpass(joint_speed_rad_s, 10Hz)",
                                     .strongest = 0.6,
                                     .share_outside = 1.0}},
                   .table = {}};
  report.effective_samples = 5000.0;
  EXPECT_NE(fit_report_text(report).find(
                "another model could reduce them, as could inputs that are filtered less: "
                "lowpass(joint_speed_rad_s, 10Hz) leaves out what is faster than 10Hz"),
            std::string::npos)
      << fit_report_text(report);
  report.correlations[1].with = "joint_speed_rad_s";
  EXPECT_EQ(fit_report_text(report).find("filtered less"), std::string::npos);
}

TEST(FitReportOf, FewIndependentSamplesAreNoReasonToCallResidualsWhite) {
  FitReport report{.split = "train",
                   .samples = 10000,
                   .correlations = {{.with = "residual", .strongest = 1.0, .share_outside = 1.0},
                                    {.with = "x", .strongest = 0.3, .share_outside = 1.0}},
                   .table = {}};
  report.effective_samples = 6.0;
  const std::string text = fit_report_text(report);
  EXPECT_EQ(text.find("white"), std::string::npos) << text;
  EXPECT_NE(text.find("correlated with their past"), std::string::npos) << text;
  EXPECT_NE(
      text.find("effective sample size 6: too small to exclude input correlations of up to 1.00"),
      std::string::npos)
      << text;
}

}  // namespace
}  // namespace torsio
