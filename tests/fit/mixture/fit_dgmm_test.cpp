#include "fit/mixture/fit_dgmm.hpp"

#include <gmock/gmock-matchers.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "fit/common/fitted.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

// A spring with friction, swept to and fro: torque = 10 x + 2 tanh(rate / 0.1) + noise.
double spring_torque(double deflection, double rate) {
  return 10.0 * deflection + 2.0 * std::tanh(rate / 0.1);
}

TrainingData sweeps(std::size_t count, unsigned seed, double amplitude = 1.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  TrainingData data;
  data.inputs = {{.expression = "spring_deflection_rad"},
                 {.expression = "rate(spring_deflection_rad)", .is_rate = true}};
  data.target = "torque_Nm";
  data.sample_rate_Hz = 100.0;
  for (std::size_t s = 0; s < 2; ++s) {
    Sequence sequence;
    sequence.recording = "sweep";
    sequence.features = Matrix(count, 2);
    for (std::size_t i = 0; i < count; ++i) {
      const double phase = 0.01 * static_cast<double>(i) * (1.0 + 0.3 * static_cast<double>(s));
      const double swell = amplitude * (1.0 + 0.3 * std::sin(0.1 * phase));
      const double deflection = swell * std::sin(phase);
      const double rate = swell * std::cos(phase);
      sequence.features(i, 0) = deflection;
      sequence.features(i, 1) = rate;
      sequence.target.push_back(spring_torque(deflection, rate) + 0.02 * normal(random));
      sequence.use.push_back(1);
    }
    data.sequences.push_back(sequence);
  }
  return data;
}

double rmse(Dgmm model, const TrainingData& data) {
  double square = 0.0;
  std::size_t count = 0;
  for (const Sequence& sequence : data.sequences)
    for (std::size_t i = 0; i < sequence.target.size(); ++i, ++count)
      square += std::pow(model.step(sequence.features.row(i)).value - sequence.target[i], 2);
  return std::sqrt(square / static_cast<double>(count));
}

TEST(FitDgmm, LearnsFrictionThatALineCannot) {
  const Dgmm::Parameters parameters = fit_dgmm(sweeps(4000, 1)).parameters;
  const double line_rmse = parameters.clamp.width / 2.0;
  EXPECT_GT(line_rmse, 0.2);
  EXPECT_LT(rmse(Dgmm(parameters), sweeps(1000, 2, 0.9)), 0.5 * line_rmse);
}

TEST(FitDgmm, RefinementFitsBetterThanTheOnlinePassAlone) {
  DgmmOptions options;
  options.online.components = 30;
  options.em_iterations = 0;
  const double online = rmse(Dgmm(fit_dgmm(sweeps(4000, 1), options).parameters), sweeps(1000, 2));
  options.em_iterations = 10;
  EXPECT_LT(rmse(Dgmm(fit_dgmm(sweeps(4000, 1), options).parameters), sweeps(1000, 2)), online);
}

TEST(FitDgmm, ItsErrorBarIsTheSizeOfItsErrors) {
  Dgmm model(fit_dgmm(sweeps(4000, 1)).parameters);
  const TrainingData test = sweeps(1000, 2);
  double square = 0.0;
  for (std::size_t i = 0; i < 1000; ++i) {
    const Estimate estimate = model.step(test.sequences[0].features.row(i));
    square += std::pow((estimate.value - test.sequences[0].target[i]) / estimate.std_dev, 2);
  }
  EXPECT_GT(std::sqrt(square / 1000.0), 0.05);
  EXPECT_LT(std::sqrt(square / 1000.0), 1.5);
}

TEST(FitDgmm, IsALineFarFromAllData) {
  const Dgmm::Parameters parameters = fit_dgmm(sweeps(2000, 1)).parameters;
  Dgmm model(parameters);
  const double at_ten = model.step(std::vector{10.0, 0.0}).value;
  const double line = parameters.clamp.intercept + 10.0 * parameters.clamp.slope[0];
  EXPECT_NEAR(at_ten, line, parameters.clamp.width * (1.0 + 1e-12));
  EXPECT_NEAR(parameters.clamp.slope[0], 10.0, 0.5);
}

TEST(FitDgmm, ItsLineLeavesRatesOut) {
  TrainingData data = sweeps(2000, 1);
  EXPECT_EQ(fit_dgmm(data).parameters.clamp.slope[1], 0.0);
  data.inputs[0].is_rate = true;  // nothing is left: a constant
  const LinearClamp clamp = fit_dgmm(data).parameters.clamp;
  EXPECT_EQ(clamp.slope, (std::vector{0.0, 0.0}));
  EXPECT_TRUE(std::isfinite(clamp.intercept));
}

// The spread of an expression is not related to the resolution of a sensor.
TEST(FitDgmm, OnlyAChannelHasTheResolutionOfItsSensor) {
  TrainingData data = sweeps(1000, 1, 1e-5);
  constexpr double kResolution_rad = rad_from_deg(0.01);
  EXPECT_EQ(fit_dgmm(data).parameters.mixture.scale[1], kResolution_rad);
  data.inputs[0].expression = "1e-5 * spring_deflection_rad";
  data.inputs[1].expression = "rate(1e-5 * spring_deflection_rad)";
  const std::vector<double> scale = fit_dgmm(data).parameters.mixture.scale;
  EXPECT_NEAR(scale[1], 0.7e-5, 0.2e-5);
  EXPECT_NEAR(scale[2], 0.7e-5, 0.2e-5);
}

TEST(FitDgmm, TheBackgroundAloneLeadsBackToTheLine) {
  DgmmOptions options;
  options.clamp = 0.0;
  const Dgmm::Parameters parameters = fit_dgmm(sweeps(2000, 1), options).parameters;
  const double value = Dgmm(parameters).step(std::vector{30.0, 0.0}).value;
  const double line = parameters.clamp.intercept + 30.0 * parameters.clamp.slope[0];
  EXPECT_NEAR(value, line, 0.01 * std::abs(line));
}

TEST(FitDgmm, LeavesUnusableSamplesOut) {
  TrainingData data = sweeps(2000, 1);
  const Dgmm::Parameters clean = fit_dgmm(data).parameters;
  for (Sequence& sequence : data.sequences) {
    sequence.target.push_back(std::nan(""));
    sequence.use.push_back(0);
    sequence.features.values.insert(sequence.features.values.end(), {1e9, 1e9});
    ++sequence.features.rows;
  }
  EXPECT_EQ(fit_dgmm(data).parameters.mixture, clean.mixture);
}

TEST(FitDgmm, IsDeterministicForAnyNumberOfThreads) {
  DgmmOptions one{.em_iterations = 3, .threads = 1};
  DgmmOptions two{.em_iterations = 3, .threads = 2};
  EXPECT_EQ(fit_dgmm(sweeps(3000, 1), one).parameters.mixture,
            fit_dgmm(sweeps(3000, 1), two).parameters.mixture);
}

TEST(FitDgmm, AcceptsLinearlyDependentInputs) {
  TrainingData data = sweeps(2000, 1);
  data.inputs[1] = data.inputs[0];
  for (Sequence& sequence : data.sequences)
    for (std::size_t i = 0; i < sequence.features.rows; ++i)
      sequence.features(i, 1) = sequence.features(i, 0);
  const Dgmm::Parameters parameters = fit_dgmm(data).parameters;
  EXPECT_LT(rmse(Dgmm(parameters), data), 1.05 * parameters.clamp.width / 2.0);
}

TEST(FitDgmm, NotesThatItRanOutOfComponents) {
  DgmmOptions options;
  options.online.initial_spread = 0.15;
  EXPECT_TRUE(fit_dgmm(sweeps(2000, 1), options).notes.empty());
  options.online.components = 10;
  EXPECT_EQ(fit_dgmm(sweeps(2000, 1), options).notes.size(), 1U);
}

// A torque over a deflection and a support position that is another constant in every record. The
// frequencies are how quickly the torque curves over the deflection and over the support.
TrainingData supports(double over_deflection, double over_support) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  TrainingData data;
  data.inputs = {{.expression = "spring_deflection_rad"}, {.expression = "support_m"}};
  data.target = "torque_Nm";
  data.sample_rate_Hz = 100.0;
  for (const double support : {0.0, 0.2, 0.4, 0.6, 0.8, 1.0}) {
    Sequence sequence{.recording = "one support", .features = Matrix(1500, 2)};
    for (std::size_t i = 0; i < 1500; ++i) {
      const double deflection = std::sin(0.01 * static_cast<double>(i));
      sequence.features(i, 0) = deflection;
      sequence.features(i, 1) = support;
      sequence.target.push_back(10.0 * std::sin(over_deflection * deflection) +
                                20.0 * deflection * std::sin(over_support * support) +
                                0.05 * normal(random));
      sequence.use.push_back(1);
    }
    data.sequences.push_back(std::move(sequence));
  }
  return data;
}

// Follows "initial_spread " in the first note.
double noted_spread(const Fitted<Dgmm>& fitted) {
  const std::string lead = "initial_spread ";
  EXPECT_EQ(fitted.notes.at(0).rfind(lead, 0), 0U) << fitted.notes.at(0);
  return std::stod(fitted.notes.at(0).substr(lead.size()));
}

TEST(FitDgmmSpread, IsWideWhereConditionsLieFarApart) {
  const Fitted<Dgmm> fitted = fit_dgmm(supports(0.8, 1.2));
  EXPECT_GE(noted_spread(fitted), 0.4) << fitted.notes[0];
}

TEST(FitDgmmSpread, IsNarrowWhereTheSurfaceIsCurved) {
  TrainingData data = supports(12.0, 0.0);
  data.inputs.resize(1);
  for (Sequence& sequence : data.sequences) {
    Matrix deflection(sequence.features.rows, 1);
    for (std::size_t i = 0; i < deflection.rows; ++i) deflection(i, 0) = sequence.features(i, 0);
    sequence.features = deflection;
  }
  const Fitted<Dgmm> fitted = fit_dgmm(data);
  EXPECT_LE(noted_spread(fitted), 0.15) << fitted.notes[0];
}

TEST(FitDgmmSpread, IsTheSameForAnyNumberOfThreads) {
  const Fitted<Dgmm> one = fit_dgmm(supports(0.8, 1.2), {.em_iterations = 3, .threads = 1});
  const Fitted<Dgmm> two = fit_dgmm(supports(0.8, 1.2), {.em_iterations = 3, .threads = 2});
  EXPECT_EQ(one.notes, two.notes);
  EXPECT_EQ(one.parameters.mixture, two.parameters.mixture);
}

TEST(FitDgmmSpread, OfOneRecordIsFoundByItsBlocks) {
  TrainingData data = sweeps(2000, 1);
  data.sequences.resize(1);
  EXPECT_NE(fit_dgmm(data).notes.at(0).find("a fifth of the record at a time"), std::string::npos);
}

TEST(FitDgmmSpread, StaysAtTheDefaultWhereNoRecordCanBeEvaluatedByTheOthers) {
  TrainingData data = supports(0.8, 1.2);
  data.sequences.resize(2);
  const Fitted<Dgmm> fitted = fit_dgmm(data);
  EXPECT_EQ(noted_spread(fitted), 0.15);
  DgmmOptions given;
  given.online.initial_spread = 0.15;
  given.online.novelty_distance = 0.25;
  EXPECT_EQ(fitted.parameters.mixture, fit_dgmm(data, given).parameters.mixture);
}

TEST(FitDgmm, StatesWhatIsWrong) {
  TrainingData empty = sweeps(10, 1);
  for (Sequence& sequence : empty.sequences) sequence.use.assign(10, 0);
  EXPECT_THROW(static_cast<void>(fit_dgmm(empty)), Error);
  EXPECT_THROW(static_cast<void>(fit_dgmm(sweeps(10, 1), {.clamp = -1.0})), UsageError);
  EXPECT_THROW(static_cast<void>(fit_dgmm(sweeps(10, 1), {.background_weight = 1.0})), UsageError);
}

TEST(FitDgmm, NamesASampleThatIsAbsurdlyFarOut) {
  for (const double outlier : {1.2e19, -1e8, 1e300}) {
    TrainingData data = sweeps(500, 1);
    data.sequences[1].recording = "second";
    data.sequences[1].target[42] = outlier;
    const std::string found = test::error_message([&] { static_cast<void>(fit_dgmm(data)); });
    EXPECT_THAT(found, testing::HasSubstr("second: torque_Nm, sample 42"));
    EXPECT_THAT(found, testing::HasSubstr("outlier or a mistaken unit"));
    EXPECT_THROW(static_cast<void>(fit_dgmm_paper(data)), Error);
    data.sequences[1].use[42] = 0;
    EXPECT_NO_THROW(static_cast<void>(fit_dgmm_paper(data, {.components = 10})));
  }
}

TEST(FitDgmm, StopsWhenAsked) {
  const Progress stop = [](double, std::string_view) { return false; };
  EXPECT_THROW(static_cast<void>(fit_dgmm(sweeps(100, 1), {}, stop)), Cancelled);
  EXPECT_THROW(static_cast<void>(fit_dgmm_paper(sweeps(100, 1), {}, stop)), Cancelled);
}

TEST(FitDgmm, CanBeStoppedInEveryIterationOfTheSearchForItsSpread) {
  // More often than once in each fit: 6 spreads, 5 folds.
  constexpr std::size_t kFits = 6 * 5;
  std::size_t calls = 0;
  const Progress count = [&](double, std::string_view doing) {
    if (doing == "choosing the spread") ++calls;
    return true;
  };
  static_cast<void>(fit_dgmm(sweeps(1000, 1), {.em_iterations = 20}, count));
  EXPECT_GE(calls, 4 * kFits);
}

TEST(FitDgmmPaper, ItsCovariancesAreFixedAndIsotropic) {
  const GaussianMixture mixture =
      fit_dgmm_paper(sweeps(2000, 1), {.components = 50}).parameters.mixture;
  ASSERT_EQ(mixture.size(), 50U);
  for (std::size_t i = 0; i < 50; ++i)
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_EQ(mixture.covariances(i, r * 3 + c), r == c ? 0.15 * 0.15 : 0.0);
}

TEST(FitDgmmPaper, IsWorseThanALine) {
  const double line_rmse = fit_dgmm(sweeps(4000, 1)).parameters.clamp.width / 2.0;
  EXPECT_GT(
      rmse(Dgmm(fit_dgmm_paper(sweeps(4000, 1), {.components = 50}).parameters), sweeps(1000, 2)),
      line_rmse);
}

}  // namespace
}  // namespace torsio
