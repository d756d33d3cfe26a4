#include "fit/grey_box/fit_grey_box.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "fit/common/fitted.hpp"
#include "fit/common/model_run.hpp"
#include "fit/grey_box/fit_input_products.hpp"
#include "fit/grey_box/grey_box_sums.hpp"
#include "fit/linear/fit_linear.hpp"
#include "numerics/nnls.hpp"
#include "support/error_message.hpp"
#include "support/example_data.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;
using Row = std::span<const double>;

constexpr GreyBoxOptions kBoxAlone{.banks = false, .residual = ResidualKind::none};
constexpr GreyBoxOptions kWithoutBanks{.banks = false};

/// A slow, uneven to and fro of about +-0.1.
Matrix wander(std::size_t samples, double start = 0.0) {
  Matrix features(samples, 1);
  for (std::size_t n = 0; n < samples; ++n) {
    const double t = start + 0.004 * static_cast<double>(n);
    features(n, 0) = 0.06 * std::sin(t) + 0.03 * std::sin(2.7 * t) + 0.015 * std::sin(7.1 * t);
  }
  return features;
}

/// A stiffening spring with two slip elements, and noise of 0.05.
class TrueSpring {
 public:
  explicit TrueSpring(std::uint64_t seed) : random_(seed) {}
  double torque(double x) {
    const double limits[] = {0.004, 0.02};
    const double forces[] = {1.5, 1.0};
    double sum = 400.0 * x + 2e4 * x * x * x;
    for (int i = 0; i < 2; ++i) {
      stops_[i] = std::clamp(stops_[i] + x - last_, -limits[i], limits[i]);
      sum += forces[i] * stops_[i] / limits[i];
    }
    last_ = x;
    return sum + 0.05 * random_.normal();
  }

 private:
  Random random_;
  double stops_[2] = {0.0, 0.0};
  double last_ = 0.0;
};

TrainingData spring_data(std::uint64_t seed, double start = 0.0) {
  TrueSpring spring(seed);
  return test::training_data_of({{.expression = "spring_deflection_rad"}}, wander(8000, start),
                                [&](Row x) { return spring.torque(x[0]); });
}

TEST(FitGreyBox, FindsAStiffeningSpringWithFrictionToItsNoise) {
  const Fitted<GreyBox> fitted = fit_grey_box(spring_data(1), kBoxAlone);
  EXPECT_LT(evaluate(GreyBox(fitted.parameters), spring_data(2, 100.0)).rmse, 0.2)
      << "the noise, and an unknown start";
  EXPECT_FALSE(fitted.parameters.terms.thresholds.empty());
  ASSERT_FALSE(fitted.notes.empty());
  EXPECT_THAT(fitted.notes[0], HasSubstr("slip elements"));
}

TEST(FitGreyBox, HasErrorBarsOfThePartOfARecordingThatDiffers) {
  TrueSpring spring(1);
  TrainingData data =
      test::training_data_of({{.expression = "spring_deflection_rad"}}, wander(24000),
                             [&](Row x) { return spring.torque(x[0]); });
  Sequence& sequence = data.sequences[0];
  const std::size_t samples = sequence.target.size();
  for (std::size_t n = samples - samples / 5; n < samples; ++n) sequence.target[n] += 1.0;
  const Fitted<GreyBox> fitted = fit_grey_box(data, kBoxAlone);
  EXPECT_GT(fitted.held_out_rmse, 0.45) << "of blocks, which contain both parts, at most 0.4";
  EXPECT_THAT(fitted.notes, testing::Contains(HasSubstr("contiguous fifths")));
}

TEST(FitGreyBox, DoesNotHoldOutContiguousFifthsOfFewStrokes) {
  const TrainingData data = spring_data(1);
  EXPECT_LT(strokes_of(data), 20U);
  EXPECT_THAT(fit_grey_box(data, kBoxAlone).notes,
              testing::Not(testing::Contains(HasSubstr("contiguous fifths"))));
}

TEST(GreyBoxSums, AreThoseOfTheCompleteTableOfTerms) {
  TrainingData data = spring_data(1);
  for (std::size_t k = 1; k < 4; ++k)
    data.sequences.push_back(spring_data(1 + k, 30.0 * static_cast<double>(k)).sequences[0]);
  for (Sequence& sequence : data.sequences)
    for (std::size_t n = 0; n < sequence.use.size(); n += 3) sequence.use[n] = 0;
  const GreyBoxSums sums = gather(data, "", 0.2);
  Matrix table(data.usable_samples(), sums.all.columns());
  std::vector<double> target;
  for (const Sequence& sequence : data.sequences) {
    GreyBoxTerms terms(sums.all);
    for (std::size_t n = 0; n < sequence.use.size(); ++n) {
      terms.move(sequence.features.row(n));
      if (sequence.use[n] == 0) continue;
      terms.visit(sequence.features.row(n),
                  [&](std::size_t column, double value) { table(target.size(), column) = value; });
      target.push_back(sequence.target[n]);
    }
  }
  const NormalEquations complete = normal_equations(table, target);
  ASSERT_EQ(sums.cells.size(), 4U) << "a fold for each record";
  NormalEquations streamed(sums.all.columns());
  for (const NormalEquations& cell : sums.cells) add(streamed, cell);
  EXPECT_EQ(streamed.rows, complete.rows);
  EXPECT_NEAR(streamed.square, complete.square, 1e-12 * complete.square);
  const auto nearly = [](const std::vector<double>& found, const std::vector<double>& expected) {
    double largest = 0.0;
    double difference = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      largest = std::max(largest, std::abs(expected[i]));
      difference = std::max(difference, std::abs(found[i] - expected[i]));
    }
    return difference <= 1e-12 * largest;
  };
  EXPECT_TRUE(nearly(streamed.product.values, complete.product.values));
  EXPECT_TRUE(nearly(streamed.projection, complete.projection));
}

/// Records of a straight spring whose torque also follows a wave over a second input; a slow load cell
/// measures every fourth sample.
TrainingData records_of_a_wave(std::size_t records, std::size_t samples, double height_Nm) {
  TrainingData data;
  Random random(8);
  for (std::size_t r = 0; r < records; ++r) {
    const Matrix motion = wander(samples, 40.0 * static_cast<double>(r));
    Matrix features(motion.rows, 2);
    for (std::size_t n = 0; n < motion.rows; ++n) {
      features(n, 0) = motion(n, 0);
      features(n, 1) = std::sin(0.0031 * static_cast<double>(n + 500 * r));
    }
    TrainingData record = test::training_data_of(
        {{.expression = "spring_deflection_rad"}, {.expression = "support_m"}}, std::move(features),
        [&](Row x) {
          return 400.0 * x[0] + height_Nm * std::cos(3.0 * x[1]) + 0.1 * random.normal();
        });
    for (std::size_t n = 0; n < samples; ++n) record.sequences[0].use[n] = n % 4 == 0 ? 1 : 0;
    if (r == 0) {
      data = std::move(record);
    } else {
      data.sequences.push_back(std::move(record.sequences[0]));
    }
  }
  return data;
}

TEST(FitGreyBox, AddsTheResidualThatItsTrialsFindWorthwhile) {
  for (const std::size_t records : {1, 4}) {
    SCOPED_TRACE(records);
    const TrainingData data = records_of_a_wave(records, 24000 / records, 4.0);
    const Fitted<GreyBox> tried = fit_grey_box(data, kWithoutBanks);
    ASSERT_TRUE(tried.parameters.residual) << tried.notes.back();
    EXPECT_LT(evaluate(GreyBox(tried.parameters), data).rmse,
              0.8 * evaluate(GreyBox(fit_grey_box(data, kBoxAlone).parameters), data).rmse);
  }
}

TEST(FitGreyBox, TrialsDoNotChangeTheResidualThatIsKept) {
  const TrainingData data = records_of_a_wave(4, 6000, 4.0);
  const Fitted<GreyBox> tried = fit_grey_box(data, kWithoutBanks);
  ASSERT_TRUE(tried.parameters.residual);
  const auto kind = tried.notes.back().starts_with("a network")    ? ResidualKind::mlp
                    : tried.notes.back().starts_with("a Gaussian") ? ResidualKind::gp
                                                                   : ResidualKind::products;
  const Fitted<GreyBox> named = fit_grey_box(data, {.banks = false, .residual = kind});
  EXPECT_EQ(tried.parameters.residual->bound, named.parameters.residual->bound);
  const double expected = evaluate(GreyBox(named.parameters), data).rmse;
  EXPECT_EQ(evaluate(GreyBox(tried.parameters), data).rmse, expected) << tried.notes.back();
}

TEST(FitGreyBox, EveryKindOfResidualLowersTheError) {
  const TrainingData data = records_of_a_wave(3, 6000, 4.0);
  const double alone = evaluate(GreyBox(fit_grey_box(data, kBoxAlone).parameters), data).rmse;
  for (const ResidualKind kind :
       {ResidualKind::mlp, ResidualKind::dgmm, ResidualKind::products, ResidualKind::gp}) {
    const Fitted<GreyBox> fitted = fit_grey_box(data, {.banks = false, .residual = kind});
    EXPECT_LT(evaluate(GreyBox(fitted.parameters), data).rmse, 0.9 * alone)
        << kResidualNames.at(static_cast<std::size_t>(kind));
  }
}

TEST(FitInputProducts, FindsTheProductsThatAreThere) {
  Random random(5);
  const std::size_t samples = 4000;
  Matrix features(samples, 3);
  for (double& value : features.values) value = 100.0 + random.normal();
  const auto truth = [](Row x) {
    const double a = x[0] - 100.0;
    const double c = x[2] - 100.0;
    return 2.0 + 3.0 * a * c - 0.5 * a * a * c;
  };
  const TrainingData data = test::training_data_of(
      {{.expression = "a"}, {.expression = "b"}, {.expression = "c"}}, std::move(features), truth);
  InputProducts products(fit_input_products(data, 3, 0));
  double largest = 0.0;
  for (std::size_t n = 0; n < samples; ++n) {
    const auto x = data.sequences[0].features.row(n);
    largest = std::max(largest, std::abs(products.step(x).value - truth(x)));
  }
  EXPECT_LT(largest, 0.3) << "the ridge of 0.01 takes about a hundredth off each product";
}

TEST(FitInputProducts, UsesASpreadOfTheSlips) {
  Random random(6);
  Matrix features(500, 12);
  for (double& value : features.values) value = random.normal();
  for (std::size_t n = 0; n < features.rows; ++n) features(n, 1) = 4.0;
  std::vector<InputInfo> inputs(12, InputInfo{.expression = "x"});
  const TrainingData data =
      test::training_data_of(inputs, std::move(features), [](Row x) { return x[0] * x[11]; });
  const InputProducts::Parameters found = fit_input_products(data, 2, 10);
  EXPECT_EQ(found.used(), (std::vector<std::size_t>{0, 2, 3, 5, 7, 8, 10}));
  EXPECT_EQ(found.scales[1], 0.0) << "a constant input";
}

TEST(FitGreyBox, AddsNoResidualWhereNothingIsLeft) {
  const Fitted<GreyBox> fitted = fit_grey_box(records_of_a_wave(4, 4000, 0.0), kWithoutBanks);
  EXPECT_FALSE(fitted.parameters.residual);
  EXPECT_THAT(fitted.notes.back(), HasSubstr("not added"));
}

TEST(FitGreyBox, StopsOnRequestWhileANetworkIsTried) {
  const auto stop = [](double, std::string_view doing) { return !doing.starts_with("epoch 3"); };
  EXPECT_THROW(
      (void)fit_grey_box(records_of_a_wave(4, 4000, 4.0), kWithoutBanks, {.progress = stop}),
      Cancelled);
}

TEST(FitGreyBox, LeavesAStraightLineAStraightLine) {
  Random random(3);
  const TrainingData data =
      test::training_data_of({{.expression = "spring_deflection_rad"}}, wander(8000),
                             [&](Row x) { return 1.0 + 500.0 * x[0] + 0.1 * random.normal(); });
  const Fitted<GreyBox> fitted = fit_grey_box(data, kBoxAlone);
  EXPECT_EQ(fitted.parameters.terms.curve_knots.size(), 2U);
  EXPECT_TRUE(fitted.parameters.terms.thresholds.empty());
  EXPECT_TRUE(fitted.parameters.terms.time_constants_s.empty());
  GreyBox box(fitted.parameters);
  EXPECT_NEAR(box.step(std::vector{0.02}).value, 11.0, 0.02);
}

TEST(FitGreyBox, FindsARelaxationIfThereIsOne) {
  double branch = 0.0;
  double last = 0.0;
  const TrainingData data =
      test::training_data_of({{.expression = "spring_deflection_rad"}}, wander(8000), [&](Row x) {
        branch = branch * std::exp(-0.001 / 0.1) + (x[0] - last);
        last = x[0];
        return 300.0 * x[0] + 200.0 * branch;
      });
  const Fitted<GreyBox> fitted = fit_grey_box(data, kBoxAlone);
  const GreyBoxTerms::Structure& terms = fitted.parameters.terms;
  EXPECT_FALSE(terms.time_constants_s.empty());
  // Three or six are tried, and the search leaves most of them at 0.
  EXPECT_LT(terms.time_constants_s.size(), 3U);
  for (std::size_t j = terms.first_relaxation(); j < terms.first_slope(); ++j)
    EXPECT_GT(fitted.parameters.coefficients.values(0, j), 0.0);
  // Its time constant lies between two of the grid.
  const Fitted<Linear> line = fit_linear(data, {});
  EXPECT_LT(evaluate(GreyBox(fitted.parameters), data).rmse,
            0.2 * evaluate(Linear(line.parameters), data).rmse);
}

TEST(FitGreyBox, FrictionOfTheWrongSignNeedsSignedForces) {
  // Friction of the wrong sign on one side: only signed forces can follow.
  TrueSpring spring(4);
  double last = 0.0;
  const TrainingData data =
      test::training_data_of({{.expression = "spring_deflection_rad"}}, wander(8000), [&](Row x) {
        const double sign = x[0] > last ? 1.0 : -1.0;
        last = x[0];
        return 400.0 * x[0] + (x[0] > 0.0 ? -sign : sign);
      });
  const auto lowest_force = [](const GreyBox::Parameters& p) {
    const auto row = p.coefficients.values.row(0);
    const auto first = static_cast<std::ptrdiff_t>(p.terms.first_slip());
    const auto last_force = static_cast<std::ptrdiff_t>(p.terms.first_slope());
    return std::ranges::min(std::vector<double>(row.begin() + first, row.begin() + last_force));
  };
  const auto passive = fit_grey_box(data, {.passive = true}).parameters;
  const auto any = fit_grey_box(data, kBoxAlone).parameters;
  ASSERT_LT(any.terms.first_slip(), any.terms.first_slope());
  EXPECT_LT(lowest_force(any), -0.5);
  EXPECT_LT(evaluate(GreyBox(any), data).rmse, 0.6 * evaluate(GreyBox(passive), data).rmse);
}

/// What the box takes around a closed path of deflections, the second time around it: its memory is then periodic, too.
double work_around(const GreyBox::Parameters& parameters, std::size_t inputs) {
  GreyBox box(parameters);
  constexpr std::size_t kSteps = 400;
  double work = 0.0;
  double before = 0.0;
  for (std::size_t n = 0; n <= 2 * kSteps; ++n) {
    const double phase = 2.0 * std::numbers::pi * static_cast<double>(n) / kSteps;
    const double x = 0.03 * std::sin(phase) + 0.02 * std::sin(3.0 * phase);
    const double step = x - before;
    before = x;
    std::vector<double> features(inputs, step / 0.001);
    features[0] = x;
    const double torque = box.step(features).value;
    if (n > kSteps) work += torque * step;
  }
  return work;
}

TEST(FitGreyBox, APassiveOneTakesEnergyAroundEveryPath) {
  // A spring with friction that a rate drives instead of braking it: -5 Nm s/rad.
  TrueSpring spring(4);
  Matrix features(8000, 2);
  const Matrix motion = wander(8000);
  for (std::size_t n = 0; n < 8000; ++n) {
    features(n, 0) = motion(n, 0);
    features(n, 1) = n == 0 ? 0.0 : (motion(n, 0) - motion(n - 1, 0)) / 0.001;
  }
  const TrainingData data = test::training_data_of(
      {{.expression = "spring_deflection_rad"},
       {.expression = "rate(spring_deflection_rad)", .is_rate = true}},
      std::move(features), [&](Row x) { return spring.torque(x[0]) - 5.0 * x[1]; });
  const auto passive = fit_grey_box(data, {.passive = true}).parameters;
  ASSERT_FALSE(passive.terms.thresholds.empty());
  EXPECT_GE(work_around(passive, 2), 0.0);
  EXPECT_FALSE(passive.residual.has_value());
  EXPECT_LT(work_around(fit_grey_box(data, kBoxAlone).parameters, 2), 0.0);
  EXPECT_THROW((void)fit_grey_box(data, {.passive = true, .residual = ResidualKind::mlp}),
               UsageError);
}

TEST(FitGreyBox, InterpolatesOverAConditionThatItIsScheduledBy) {
  const auto at = [](double support, std::uint64_t seed) {
    Random random(seed);
    Matrix features(4000, 2);
    const Matrix motion = wander(4000, static_cast<double>(seed));
    for (std::size_t n = 0; n < 4000; ++n) {
      features(n, 0) = motion(n, 0);
      features(n, 1) = support;
    }
    return test::training_data_of(
        {{.expression = "spring_deflection_rad"}, {.expression = "support_m"}}, std::move(features),
        [&](Row x) {
          return (300.0 + 4000.0 * x[1]) * x[0] * (1.0 + 30.0 * x[0] * x[0]) +
                 0.02 * random.normal();
        });
  };
  TrainingData data = at(0.0, 1);
  for (const double support : {0.01, 0.03, 0.04})
    data.sequences.push_back(at(support, 7).sequences[0]);
  const Fitted<GreyBox> fitted =
      fit_grey_box(data, {.schedule = "support_m", .residual = ResidualKind::none});
  EXPECT_EQ(fitted.parameters.coefficients.knots.size(), 4U);
  EXPECT_LT(evaluate(GreyBox(fitted.parameters), at(0.02, 9)).rmse, 0.15);
}

TEST(FitGreyBox, EstimatesItsErrorBetweenTheKnotsOfItsSchedule) {
  const auto at = [](double support) {
    Matrix features(4000, 2);
    const Matrix motion = wander(4000, support);
    for (std::size_t n = 0; n < 4000; ++n) {
      features(n, 0) = motion(n, 0);
      features(n, 1) = support;
    }
    // No curve through four supports determines what is between them.
    return test::training_data_of(
        {{.expression = "spring_deflection_rad"}, {.expression = "support_m"}}, std::move(features),
        [](Row x) { return 400.0 * x[0] * (1.0 + std::sin(400.0 * x[1])); });
  };
  TrainingData data = at(0.0);
  for (const double support : {0.01, 0.03, 0.04})
    data.sequences.push_back(at(support).sequences[0]);
  const FittedGreyBox fitted =
      fit_grey_box(data, {.schedule = "support_m", .residual = ResidualKind::none});
  const double at_the_knots = evaluate(GreyBox(fitted.parameters), data).rmse;
  const double between = evaluate(GreyBox(fitted.parameters), at(0.02)).rmse;
  EXPECT_GT(between, 10.0 * at_the_knots);
  EXPECT_GT(fitted.held_out_rmse, 10.0 * at_the_knots);
  EXPECT_LT(fitted.held_out_rmse, 3.0 * between);
}

TEST(FitGreyBox, IsNotEvaluatedWhereAHeldOutRecordLeavesTheOthersRange) {
  // Beyond +-0.06 the spring is another one, and one record of four goes there.
  const auto record = [](double amplitude, std::uint64_t seed) {
    Random random(seed);
    Matrix features = wander(4000, static_cast<double>(seed));
    for (std::size_t n = 0; n < 4000; ++n) features(n, 0) *= amplitude;
    return test::training_data_of(
        {{.expression = "spring_deflection_rad"}}, std::move(features), [&](Row x) {
          const double beyond = std::max(std::abs(x[0]) - 0.06, 0.0);
          return 300.0 * x[0] + std::copysign(2e4 * beyond, x[0]) + 0.1 * random.normal();
        });
  };
  TrainingData data = record(0.5, 1);
  data.sequences.push_back(record(0.55, 2).sequences[0]);
  data.sequences.push_back(record(0.5, 3).sequences[0]);
  data.sequences.push_back(record(1.0, 4).sequences[0]);
  const FittedGreyBox fitted = fit_grey_box(data, kBoxAlone);
  EXPECT_LT(fitted.held_out_rmse, 1.0) << "a line on from the others misses by hundreds";
  EXPECT_LT(evaluate(GreyBox(fitted.parameters), record(1.0, 5)).rmse, 3.0)
      << "what lies there is fitted all the same";
}

TEST(FitGreyBox, FindsDryFrictionThatChangesSignWithinAFractionOfTheUsualRate) {
  const auto scale_of = [](double turns_within) {
    Matrix features(8000, 2);
    const Matrix motion = wander(8000);
    for (std::size_t n = 0; n < 8000; ++n) {
      features(n, 0) = motion(n, 0);
      features(n, 1) = std::sin(0.0007 * static_cast<double>(n) * static_cast<double>(n % 997));
    }
    const TrainingData data = test::training_data_of(
        {{.expression = "spring_deflection_rad"}, {.expression = "rate(q)", .is_rate = true}},
        std::move(features),
        [&](Row x) { return 400.0 * x[0] + 2.0 * std::tanh(x[1] / turns_within); });
    return fit_grey_box(data, kBoxAlone).parameters.terms.rate_scales.at(1);
  };
  const double wide = scale_of(0.14);
  EXPECT_NEAR(wide, 0.14, 0.02);
  EXPECT_NEAR(scale_of(0.01), 0.1 * wide, 1e-3);
}

TEST(FitGreyBox, ANetworkIsKeptOnlyWhereItHelps) {
  // The second input bends the torque: no term of the box can.
  const auto data_of = [](double bend) {
    Random random(6);
    Matrix features(6000, 2);
    const Matrix motion = wander(6000);
    for (std::size_t n = 0; n < 6000; ++n) {
      features(n, 0) = motion(n, 0);
      features(n, 1) = std::sin(0.0031 * static_cast<double>(n));
    }
    return test::training_data_of(
        {{.expression = "spring_deflection_rad"}, {.expression = "joint_angle_rad"}},
        std::move(features),
        [&](Row x) { return 400.0 * x[0] + bend * x[1] * x[1] + 0.2 * random.normal(); });
  };
  const Fitted<GreyBox> straight = fit_grey_box(data_of(0.0), kWithoutBanks);
  EXPECT_FALSE(straight.parameters.residual.has_value());
  const TrainingData bent = data_of(5.0);
  const Fitted<GreyBox> learned = fit_grey_box(bent, kWithoutBanks);
  ASSERT_TRUE(learned.parameters.residual.has_value());
  EXPECT_LT(evaluate(GreyBox(learned.parameters), bent).rmse,
            0.5 * evaluate(GreyBox(fit_grey_box(bent, kBoxAlone).parameters), bent).rmse);
}

TEST(FitGreyBox, StatesWhyItCannotBeFitted) {
  TrainingData still = spring_data(1);
  for (std::size_t n = 0; n < still.sequences[0].features.rows; ++n)
    still.sequences[0].features(n, 0) = 0.1;
  EXPECT_THAT(test::error_message([&] { (void)fit_grey_box(still, kBoxAlone); }),
              HasSubstr("spring_deflection_rad is constant"));
  TrainingData few = spring_data(1);
  std::fill(few.sequences[0].use.begin() + 100, few.sequences[0].use.end(), 0);
  EXPECT_THAT(test::error_message([&] { (void)fit_grey_box(few, kBoxAlone); }),
              HasSubstr("too few training samples"));
}

/// Sines of 4, 2, 1 and 0.5 Hz for 10 s each, at 250 Hz, on a spring whose stiffness has a part that relaxes.
TrainingData relaxing_data(double relaxing_Nm_rad) {
  Matrix features(10000, 1);
  const double frequencies_Hz[] = {4.0, 2.0, 1.0, 0.5};
  for (std::size_t n = 0; n < 10000; ++n)
    features(n, 0) = 0.1 * std::sin(2.0 * std::numbers::pi * frequencies_Hz[n / 2500] * 0.004 *
                                    static_cast<double>(n % 2500));
  Random random(4);
  // Creep without end: time constants far beyond those that a fast stroke shows.
  std::vector<double> forces(3, 0.0);
  double last = 0.0;
  return test::training_data_of({{.expression = "spring_deflection_rad"}}, features, [&](Row x) {
    double torque = 100.0 * x[0] + 0.02 * random.normal();
    for (std::size_t i = 0; i < forces.size(); ++i) {
      const double time_constant_s = 0.05 * std::pow(6.0, static_cast<double>(i));
      forces[i] =
          (forces[i] + relaxing_Nm_rad * (x[0] - last)) * std::exp(-0.004 / time_constant_s);
      torque += forces[i] * (1.0 + 8.0 * x[0] * x[0] / 0.01);
    }
    last = x[0];
    return torque;
  });
}

TEST(FitGreyBox, ErrorBarsGrowWithTheDurationOfAStrokeOnlyWhereSlowStrokesShowIt) {
  const double relaxing = fit_grey_box(relaxing_data(40.0), kBoxAlone, {}).stroke_growth;
  const double elastic = fit_grey_box(relaxing_data(0.0), kBoxAlone, {}).stroke_growth;
  EXPECT_GT(relaxing, 0.05);
  EXPECT_LT(elastic, 0.01);
}

}  // namespace
}  // namespace torsio
