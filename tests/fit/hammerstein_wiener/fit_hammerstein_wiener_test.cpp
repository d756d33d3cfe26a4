#include "fit/hammerstein_wiener/fit_hammerstein_wiener.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "evaluate/initial_state.hpp"
#include "fit/common/model_run.hpp"
#include "hammerstein_wiener_example.hpp"
#include "support/error_message.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

using test::known_hammerstein_wiener;
using test::recorded;
using testing::AnyOf;
using testing::Contains;
using testing::HasSubstr;

const HammersteinWienerOptions kTrueShape{
    .zeros = 1, .poles = 2, .input_degree = 2, .output_degree = 3, .is_searched = false};

std::vector<double> sorted_poles(const Sections& sections) {
  std::vector<double> found;
  for (const auto pole : poles(sections)) found.push_back(pole.real());
  std::ranges::sort(found);
  return found;
}

/// RMSE of the model against the noise-free output, on another record.
double error_on_new_record(const HammersteinWiener::Parameters& parameters) {
  const TrainingData clean = recorded(known_hammerstein_wiener(), 3000, 0.0, 77);
  HammersteinWiener model(parameters);
  double sum = 0.0;
  const Sequence& sequence = clean.sequences.front();
  for (std::size_t n = 0; n < sequence.target.size(); ++n)
    sum += std::pow(model.step(sequence.features.row(n)).value - sequence.target[n], 2);
  return std::sqrt(sum / static_cast<double>(sequence.target.size()));
}

TEST(FitHammersteinWiener, RecoversAKnownSystemFromNoisyData) {
  constexpr double kNoise = 0.2;
  const auto fitted =
      fit_hammerstein_wiener(recorded(known_hammerstein_wiener(), 6000, kNoise, 1), kTrueShape);
  const auto found = sorted_poles(fitted.parameters.sections);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(found[0], 0.6, 0.03);
  EXPECT_NEAR(found[1], 0.95, 0.01);
  EXPECT_NEAR(zeros(fitted.parameters.sections).front().real(), 0.9, 0.02);
  EXPECT_LT(error_on_new_record(fitted.parameters), 0.1 * kNoise);
}

TEST(FitHammersteinWiener, EstimatesStandardErrorsThatHold) {
  // The true value lies within three standard errors for nearly all of the numbers of several fits.
  std::size_t within = 0;
  std::size_t count = 0;
  const auto truth =
      fit_hammerstein_wiener(recorded(known_hammerstein_wiener(), 4000, 0.0, 1), kTrueShape);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto data = recorded(known_hammerstein_wiener(), 4000, 0.2, seed);
    const auto fitted = fit_hammerstein_wiener(data, kTrueShape);
    for (std::size_t k = 0; k < fitted.table.size(); ++k) {
      const FittedParameter& of = fitted.table[k];
      if (of.name.front() != 'b' && of.name.front() != 'f') continue;  // the same in every scale
      ++count;
      EXPECT_GT(of.std_error, 0.0) << of.name;
      if (std::abs(of.value - truth.table[k].value) < 3.0 * of.std_error) ++within;
    }
  }
  EXPECT_EQ(count, 15U);
  EXPECT_GE(within, 14U);
}

TEST(FitHammersteinWiener, FindsTheStructure) {
  const auto fitted =
      fit_hammerstein_wiener(recorded(known_hammerstein_wiener(), 3000, 0.05, 2), {});
  EXPECT_THAT(fitted.notes,
              Contains(HasSubstr("1 zero, 2 poles, degrees 2 and 3: the smallest of")));
  EXPECT_LT(error_on_new_record(fitted.parameters), 0.02);
}

TEST(FitHammersteinWiener, FollowsBentCurvesWithKnots) {
  HammersteinWienerOptions options{.zeros = 1, .poles = 2, .is_searched = false};
  options.is_piecewise_linear = true;
  options.knots = 7;
  const auto fitted =
      fit_hammerstein_wiener(recorded(known_hammerstein_wiener(), 6000, 0.05, 4), options);
  EXPECT_EQ(fitted.parameters.input.knots.size(), 7U);
  EXPECT_LT(error_on_new_record(fitted.parameters), 0.06);
}

TEST(FitHammersteinWiener, StartsRecordsWhereTheyAre) {
  TrainingData data = recorded(known_hammerstein_wiener(), 6000, 0.05, 5);
  Sequence& sequence = data.sequences.front();  // cut from the middle of a movement
  constexpr std::size_t kCut = 5000;
  Sequence tail{.recording = "tail", .features = Matrix(sequence.target.size() - kCut, 1)};
  for (std::size_t n = kCut; n < sequence.target.size(); ++n) {
    tail.features(n - kCut, 0) = sequence.features(n, 0);
    tail.target.push_back(sequence.target[n]);
    tail.use.push_back(1);
  }
  data.sequences = {tail};
  const auto fitted = fit_hammerstein_wiener(data, kTrueShape);
  EXPECT_NEAR(sorted_poles(fitted.parameters.sections)[1], 0.95, 0.02);
}

TEST(FitHammersteinWiener, SkipsWhatWasNotMeasured) {
  TrainingData data = recorded(known_hammerstein_wiener(), 4000, 0.05, 6);
  for (std::size_t n = 1000; n < 1500; ++n) {
    data.sequences[0].target[n] = std::numeric_limits<double>::quiet_NaN();
    data.sequences[0].use[n] = 0;
  }
  EXPECT_LT(error_on_new_record(fit_hammerstein_wiener(data, kTrueShape).parameters), 0.02);
}

TEST(FitHammersteinWiener, KeepsPolesInsideTheUnitCircle) {
  // An integrator's pole is on the circle; the fit comes near and stays inside.
  HammersteinWiener::Parameters nearly = known_hammerstein_wiener();
  nearly.sections = sections_of({{0.01}, {1.0, -0.99999}});
  nearly.input.values = {0.0, 1.0};
  nearly.output.values = {0.0, 1.0};
  const auto data = recorded(nearly, 3000, 0.001, 7);
  for (const std::size_t orders : {1U, 2U, 3U}) {
    const auto fitted = fit_hammerstein_wiener(data, {.zeros = orders - 1,
                                                      .poles = orders,
                                                      .input_degree = 1,
                                                      .output_degree = 1,
                                                      .is_searched = false,
                                                      .iterations = 1000});
    EXPECT_TRUE(is_stable(fitted.parameters.sections)) << orders;
    EXPECT_GT(sorted_poles(fitted.parameters.sections).back(), 0.999) << orders;
  }
}

TEST(FitHammersteinWiener, ReportsWhereSlowMotionLeavesItsTrainingRange) {
  // Fast motion never fills the slow pole; slow motion of the same amplitude does.
  HammersteinWiener::Parameters slow = known_hammerstein_wiener();
  slow.sections = sections_of({{0.05}, {1.0, -0.99}});
  HammersteinWienerOptions shape = kTrueShape;
  shape.zeros = 0;
  shape.poles = 1;
  const auto estimate = fit_hammerstein_wiener(recorded(slow, 6000, 0.01, 1), shape);
  HammersteinWiener model(estimate.parameters);
  const auto data = recorded(slow, 6000, 0.0, 1);
  const auto [lowest, highest] = std::ranges::minmax(data.sequences[0].target);
  const double u = std::ranges::max(data.sequences[0].features.values);
  Estimate last;
  for (int n = 0; n < 20'000; ++n) {
    last = model.step({&u, 1});
    ASSERT_GE(last.value, lowest - 0.5);
    ASSERT_LE(last.value, highest + 0.5);
  }
  EXPECT_EQ(last.fault, Fault::outside_training_range);
}

TEST(FitHammersteinWiener, ClaimsNoMemoryThatNoRecordCouldShow) {
  // Torque that drifts linearly: any pole slower than the record's length fits as well.
  TrainingData data = recorded(known_hammerstein_wiener(), 3000, 0.01, 12);
  for (std::size_t n = 0; n < 3000; ++n)
    data.sequences[0].target[n] += 1e-3 * static_cast<double>(n);
  auto shape = kTrueShape;
  shape.iterations = 1000;
  for (const ContinuousForm form : {ContinuousForm::none, ContinuousForm::refined}) {
    shape.continuous = form;
    const auto fitted = fit_hammerstein_wiener(data, shape);
    EXPECT_LT(sorted_poles(fitted.parameters.sections).back(), std::exp(-1.0 / 30'001.0));
  }
}

TEST(FitHammersteinWiener, GoesToContinuousTimeAndWarnsOfArtefacts) {
  HammersteinWiener::Parameters printed = hammerstein_wiener_of(Paper003::discrete);
  printed.input.half_range = 1.0;  // u in degrees: within what the output curve holds
  const TrainingData data = recorded(printed, 4000, 0.02, 8);
  const auto discrete = fit_hammerstein_wiener(data, kTrueShape);
  EXPECT_THAT(discrete.notes, Contains(HasSubstr("beyond Nyquist (628.3 rad/s)")));
  EXPECT_THAT(discrete.notes, Contains(HasSubstr("by Tustin: X/W = ")));

  HammersteinWiener::Parameters slow = printed;
  slow.sections = hammerstein_wiener_of(Paper003::refined).sections;
  HammersteinWienerOptions options = kTrueShape;
  options.zeros = 2;  // as a first-order hold makes of two poles
  options.continuous = ContinuousForm::refined;
  const TrainingData of_slow = recorded(slow, 8000, 0.002, 8);
  const auto refined = fit_hammerstein_wiener(of_slow, options);
  EXPECT_THAT(refined.notes, Contains(HasSubstr("refined in continuous time")));
  const auto found = sorted_poles(refined.parameters.sections);
  EXPECT_NEAR(std::log(found[0]) / 0.005, -1.416, 0.1);
  EXPECT_NEAR(std::log(found[1]) / 0.005, -0.128, 0.1);  // 40 s are few for 8 s
  EXPECT_LT(evaluate(AnyModel(HammersteinWiener(refined.parameters)), of_slow).rmse, 0.003);
}

TEST(FitHammersteinWiener, ReportsThatOnlyTheFirstInputIsUsed) {
  TrainingData data = recorded(known_hammerstein_wiener(), 2000, 0.05, 9);
  data.inputs.push_back({"v_1"});
  Matrix both(2000, 2);
  for (std::size_t n = 0; n < 2000; ++n) both(n, 0) = data.sequences[0].features(n, 0);
  data.sequences[0].features = both;
  const auto fitted = fit_hammerstein_wiener(data, kTrueShape);
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("of the 2 inputs only the first, u_1, is used")));
  EXPECT_EQ(fitted.parameters.inputs, 2U);
}

TEST(FitHammersteinWiener, RefusesDataWithoutInformation) {
  const auto message = [](TrainingData data, const HammersteinWienerOptions& options) {
    return test::error_message([&] { (void)fit_hammerstein_wiener(data, options); });
  };
  const TrainingData good = recorded(known_hammerstein_wiener(), 500, 0.05, 9);
  TrainingData constant = good;
  for (double& u : constant.sequences[0].features.values) u = 0.3;
  EXPECT_THAT(message(constant, {}), HasSubstr("a first input that changes"));
  TrainingData flat = good;
  std::ranges::fill(flat.sequences[0].target, 1.0);
  EXPECT_THAT(message(flat, {}), HasSubstr("a target that changes"));
  EXPECT_THAT(message(recorded(known_hammerstein_wiener(), 30, 0.05, 9), kTrueShape),
              HasSubstr("100 measured samples or more"));
  auto long_lag = kTrueShape;
  long_lag.poles = 30;
  EXPECT_THAT(message(recorded(known_hammerstein_wiener(), 20, 0.05, 9, 40), long_lag),
              HasSubstr("a record longer than its lags of 30 samples"));
  auto wrong = kTrueShape;
  wrong.zeros = 1000;
  EXPECT_THAT(message(good, wrong), HasSubstr("zeros"));
  auto improper = kTrueShape;
  improper.zeros = 3;
  improper.continuous = ContinuousForm::refined;
  EXPECT_THAT(message(good, improper), HasSubstr("no more zeros than poles"));
  TrainingData unseen = good;
  for (double& u : unseen.sequences[0].features.values)
    u = std::numeric_limits<double>::quiet_NaN();
  std::ranges::fill(unseen.sequences[0].use, 0);
  EXPECT_THAT(message(unseen, {}), HasSubstr("measured samples"));
}

TEST(FitHammersteinWiener, ReportsThatItDidNotConverge) {
  auto hurried = kTrueShape;
  hurried.iterations = 1;
  EXPECT_THAT(test::error_message([&] {
                (void)fit_hammerstein_wiener(recorded(known_hammerstein_wiener(), 500, 0.05, 9),
                                             hurried);
              }),
              AllOf(HasSubstr("did not converge"), HasSubstr("within 1 iterations")));
}

TEST(FitHammersteinWiener, GoesOnFromTheMiddleOfAMovement) {
  const TrainingData data = recorded(known_hammerstein_wiener(), 600, 0.0, 10);
  const Sequence& whole = data.sequences.front();
  constexpr std::size_t kBegin = 300;
  constexpr std::size_t kGiven = 50;
  Matrix estimate(kGiven, 1);
  for (std::size_t n = 0; n < kGiven; ++n) estimate(n, 0) = whole.features(kBegin + n, 0);
  AnyModel model{HammersteinWiener(known_hammerstein_wiener())};
  start_where_measured(model, estimate, std::span(whole.target).subspan(kBegin, kGiven), 1e-6);
  for (std::size_t n = kBegin; n < whole.target.size(); ++n) {
    const double value = model.step(whole.features.row(n)).value;
    EXPECT_NEAR(value, whole.target[n], 1e-3) << n;
  }
}

FittedModel fitted_with(const TrainingData& data, const std::map<std::string, std::string>& given) {
  const FamilyInfo& family = find_family("hammerstein_wiener");
  return family.fit(data, Options(family.options, given), {});
}

TEST(HammersteinWienerFamily, LoadsThePapersCoefficientsAsTheyAre) {
  TrainingData data = recorded(hammerstein_wiener_of(Paper003::refined), 500, 0.0, 11);
  data.target = "torque_Nm";
  const FittedModel loaded = fitted_with(data, {{"published", "refined"}});
  EXPECT_EQ(evaluate(loaded.model, data).rmse, 0.0);
  EXPECT_THAT(loaded.notes, Contains(HasSubstr("not fitted: u_1 in rad")));
  data.sample_rate_Hz = 100.0;
  EXPECT_THAT(test::error_message([&] {
                (void)fitted_with(data, {{"published", "tustin"}});
              }),
              HasSubstr("expected 200 Hz, found 100 Hz"));
}

TEST(HammersteinWienerFamily, RefusesWordsThatItDoesNotKnow) {
  const TrainingData data = recorded(known_hammerstein_wiener(), 500, 0.0, 11);
  for (const char* option : {"structure", "map", "continuous", "published"})
    EXPECT_THAT(test::error_message([&] {
                  (void)fitted_with(data, {{option, "maybe"}});
                }),
                AllOf(HasSubstr(option), HasSubstr("\"maybe\"")));
}

TEST(FitHammersteinWiener, StatesWhatTheDataDoNotDetermine) {
  // A constant but for one jump to one other value: a square and a linear function are equivalent.
  TrainingData data = recorded(known_hammerstein_wiener(), 400, 0.0, 9);
  Sequence& sequence = data.sequences[0];
  HammersteinWiener model(known_hammerstein_wiener());
  for (std::size_t n = 0; n < 400; ++n) {
    sequence.features(n, 0) = n % 100 < 50 ? 0.0 : 0.7;
    sequence.target[n] = model.step(sequence.features.row(n)).value;
  }
  const auto fitted = fit_hammerstein_wiener(data, kTrueShape);
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("the data do not determine ")));
}

}  // namespace
}  // namespace torsio
