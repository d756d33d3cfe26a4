#include "fit/gaussian_process/fit_gaussian_process.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "fit/gaussian_process/fit_parametric_gp.hpp"
#include "fit/gaussian_process/fit_parametric_gp_paper.hpp"
#include "support/error_message.hpp"
#include "support/example_data.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

const PlainKernel kTable2{21.5113, 11.8339, -5.4362, -6.5416, -8.7194,
                          5.9948,  -2.5506, -5.3729, -5.1467};

/// A smooth curve of one input with noise of 0.1.
TrainingData curve(std::size_t samples, double input_scale = 1.0) {
  Random random(3);
  Matrix features(samples, 1);
  for (double& value : features.values) value = input_scale * 6.0 * (random.uniform() - 0.5);
  return test::training_data_of({{.expression = "x_1"}}, features, [&](Features x) {
    return 2.0 + std::sin(2.0 * x[0] / input_scale) + 0.1 * random.normal();
  });
}

template <class Model>
double rmse(const typename Model::Parameters& parameters, double input_scale = 1.0) {
  Model model(parameters);
  double squares = 0.0;
  for (int n = 0; n < 200; ++n) {
    const double x = -2.8 + 5.6 * n / 199.0;
    const double error = model.step(std::vector{input_scale * x}).value - 2.0 - std::sin(2.0 * x);
    squares += error * error;
  }
  return std::sqrt(squares / 200.0);
}

TEST(FitGaussianProcess, FindsACurveAndItsNoiseAndReportsThem) {
  const auto fitted = fit_gaussian_process(curve(300), {.kernel = "se"});
  EXPECT_LT(rmse<GaussianProcess>(fitted.parameters), 0.04);
  EXPECT_NEAR(std::sqrt(fitted.parameters.noise_variance) * fitted.parameters.scaling.target_scale,
              0.1, 0.02);
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("leaving one sample out: RMSE 0.1")));
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("kernel se: se (length")));
}

TEST(FitGaussianProcess, TakesDuplicatesAndAConstantInput) {
  TrainingData data = curve(200);
  Sequence& sequence = data.sequences.front();
  const Matrix one = sequence.features;
  sequence.features = Matrix(200, 2);
  for (std::size_t n = 0; n < 200; ++n) {
    sequence.features(n, 0) = one(n / 4 * 4, 0);  // every point four times
    sequence.features(n, 1) = 0.033;
  }
  data.inputs.push_back({.expression = "support_m"});
  const auto fitted = fit_gaussian_process(data, {.kernel = "se_ard"});
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("support_m is constant")));
  EXPECT_NO_THROW(GaussianProcess{fitted.parameters});
  const auto sparse = fit_variational_gp(data, {.inducing_points = 100});
  EXPECT_LE(sparse.parameters.inducing_points.rows, 50U) << "only so many points differ";
}

TEST(FitGaussianProcess, RefusesMoreSamplesThanItCanTake) {
  const TrainingData data = curve(70'000);
  EXPECT_THAT(error_message([&] { (void)fit_gaussian_process(data, {.samples = 5000}); }),
              AllOf(HasSubstr("at most 4096 with an error bar"), HasSubstr("std_dev=false")));
  EXPECT_THAT(
      error_message([&] { (void)fit_gaussian_process(data, {.samples = 0, .std_dev = false}); }),
      AllOf(HasSubstr("at most 65536"), HasSubstr("found 70000")));
}

TEST(FitGaussianProcess, NamesTheNumberOfSamplesThatFitIntoTheMemory) {
  const double have =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  const auto fits = static_cast<std::size_t>(std::sqrt(have / 16.0));
  if (fits >= 65'000) GTEST_SKIP() << "all that is ever taken fits into this machine's memory";
  EXPECT_THAT(error_message([&] {
                (void)fit_gaussian_process(curve(65'000), {.samples = 0, .std_dev = false});
              }),
              AllOf(HasSubstr("at most " + std::to_string(fits) + " samples"),
                    HasSubstr("found 65000"), HasSubstr("parametric_gp_variational")));
}

TEST(FitGaussianProcess, PassesItsOptionsOn) {
  const FamilyInfo& family = find_family("gaussian_process");
  const auto fitted = family.fit(
      curve(300),
      Options(family.options, {{"kernel", "matern32"}, {"samples", "50"}, {"std_dev", "false"}}),
      {.seed = 1});
  const auto& parameters = fitted.model.get_if<GaussianProcess>()->parameters();
  EXPECT_EQ(text_of(parameters.kernel), "matern32");
  EXPECT_EQ(parameters.weights.size(), 50U);
  EXPECT_FALSE(parameters.with_std_dev);
}

TEST(FitParametricGp, PassesItsOptionsOnAndRefusesWrongOnes) {
  const FamilyInfo& family = find_family("parametric_gp");
  const auto fit = [&](const std::map<std::string, std::string>& options) {
    return family.fit(curve(300), Options(family.options, options), {.seed = 1});
  };
  const auto fitted =
      fit({{"kernel", "se"}, {"inducing_points", "9"}, {"updates", "50"}, {"batch", "7"}});
  EXPECT_EQ(fitted.model.get_if<ParametricGp>()->parameters().weights.size(), 9U);
  EXPECT_THAT(error_message([&] { (void)fit({{"mode", "best"}}); }), HasSubstr("recommended"));
  EXPECT_THAT(error_message([&] { (void)fit({{"kernel", "se*"}}); }), HasSubstr("column 4"));
  EXPECT_THAT(error_message([&] {
                (void)fit({{"kernel_plain", "1/2/3"}});
              }),
              HasSubstr("nine numbers"));
  const FamilyInfo& variational = find_family("parametric_gp_variational");
  const auto sparse = variational.fit(
      curve(300), Options(variational.options, {{"inducing_points", "12"}, {"kernel", "rq"}}),
      {.seed = 1});
  EXPECT_EQ(sparse.model.get_if<ParametricGp>()->parameters().weights.size(), 12U);
}

TEST(FitParametricGp, EveryModeFindsTheCurveWithEverySeed) {
  const TrainingData data = curve(2000);
  const auto error_of = [&](ParametricGpMode mode, std::uint64_t seed) {
    const auto fitted = fit_parametric_gp(
        data, {.mode = mode, .kernel = "se", .updates = 5000, .refit = false}, {.seed = seed});
    return rmse<ParametricGp>(fitted.parameters);
  };
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    for (const auto mode :
         {ParametricGpMode::nlml, ParametricGpMode::elbo, ParametricGpMode::recommended})
      EXPECT_LT(error_of(mode, seed), 0.1) << static_cast<int>(mode) << ", seed " << seed;
  EXPECT_LT(rmse<ParametricGp>(
                fit_variational_gp(data, {.kernel = "se", .inducing_points = 14}).parameters),
            0.03);
}

// Specification 3.3: (16) falls with the amplitude of the whole kernel at every sample.
TEST(FitParametricGpPaper, ThePrintedStepsOnlyLowerTheAmplitude) {
  const TrainingData data = curve(2000);
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    double before = 0.3;  // at the start
    for (const std::size_t updates : {1U, 10U, 100U, 1000U, 5000U}) {
      const auto fitted =
          fit_parametric_gp_paper(data, {.kernel = "se", .updates = updates}, {.seed = seed});
      const double amplitude = fitted.parameters.kernel.nodes.front().amplitude;
      EXPECT_LE(amplitude, before) << updates << " updates, seed " << seed;
      before = amplitude;
    }
    EXPECT_LT(before, 0.29) << "seed " << seed;
    EXPECT_GT(before, 0.0);
  }
}

// (9) to (13) with every theta at 0.3, or at -1.204, where the kernel ends at a distance of 1.87.
TEST(FitParametricGpPaper, StartsFromThePrintedKernel) {
  const TrainingData data = curve(300, 0.3);
  for (const bool is_plain : {false, true}) {
    const auto fitted = fit_parametric_gp_paper(
        data, {.updates = 0, .theta = is_plain ? ThetaReading::plain : ThetaReading::logarithm},
        {.seed = 1});
    const Kernel kernel(fitted.parameters.kernel, 1);
    const double theta = is_plain ? std::log(0.3) : 0.3;
    const double x = 0.4;
    Matrix z(1, 1);
    z.values = {0.1};
    const PackedPoints packed(z);
    detail::AlignedVector<double> value(packed.padded_size());
    kernel.row(&x, packed, 1, value.data());
    const double square = (x - 0.1) * (x - 0.1);
    const double t2 = theta * theta;
    const double sine = std::sin(std::numbers::pi * (x - 0.1) / theta);
    const double expected = t2 * std::exp(-square / (2.0 * t2)) *
                            (t2 * (x - theta) * (0.1 - theta) +
                             t2 * std::exp(-2.0 * sine * sine / t2) *
                                 std::pow(1.0 + square / (2.0 * theta * t2), -theta));
    EXPECT_NEAR(value[0], expected, 1e-12) << is_plain;
    EXPECT_EQ(fitted.table.at(0).value, 0.0);
  }
}

TEST(FitParametricGpPaper, EachOfItsDeparturesChangesTheModel) {
  const TrainingData data = curve(500);
  const PaperGpOptions printed{.kernel = "se", .updates = 200};
  const auto explained_of = [&](const auto& change) {
    PaperGpOptions options = printed;
    change(options);
    return fit_parametric_gp_paper(data, options, {.seed = 1}).parameters.explained;
  };
  const Matrix as_printed = explained_of([](auto&) {});
  EXPECT_NE(explained_of([](auto& o) { o.theta = ThetaReading::plain; }), as_printed);
  EXPECT_NE(explained_of([](auto& o) { o.moments = MomentReading::printed; }), as_printed);
  EXPECT_NE(explained_of([](auto& o) { o.standardise = true; }), as_printed);
  EXPECT_NE(explained_of([](auto& o) { o.first_noise = 0.1; }), as_printed);
  EXPECT_NE(explained_of([](auto& o) { o.adam = true; }), as_printed);
  EXPECT_NE(explained_of([](auto& o) { o.elbo = true; }), as_printed);
  PaperGpOptions refit = printed;
  refit.refit = true;
  EXPECT_THAT(fit_parametric_gp_paper(data, refit, {.seed = 1}).notes,
              Contains(HasSubstr("by the closed form over all samples")));
  PaperGpOptions longer = printed;
  longer.updates = 1500;
  const auto narrow = fit_parametric_gp_paper(data, longer, {.seed = 1});
  longer.widen = true;
  EXPECT_NE(fit_parametric_gp_paper(data, longer, {.seed = 1}).parameters.explained,
            narrow.parameters.explained);
}

TEST(FitParametricGpPaper, ThePrintedMomentsEndTheTrainingAndTheNumberOfSamplesIsReported) {
  const auto fitted = fit_parametric_gp_paper(
      curve(500), {.kernel = "se", .updates = 1000, .moments = MomentReading::printed},
      {.seed = 1});
  ASSERT_EQ(fitted.table.size(), 1U);
  EXPECT_GT(fitted.table[0].value, 0.0);
  EXPECT_LT(fitted.table[0].value, 1000.0);
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("became unusable after update")));
  const auto whole = fit_parametric_gp_paper(curve(500), {.kernel = "se", .updates = 1000}, {});
  EXPECT_EQ(whole.table[0].value, 1000.0);
}

TEST(FitParametricGp, LearnsNothingFromASampleAtWhichItsValuesAreNotFinite) {
  // Steps of this size throw the kernel's numbers to the ends of the range of a double.
  for (const auto mode : {ParametricGpMode::nlml, ParametricGpMode::elbo})
    for (const std::size_t batch : {1U, 10U})
      EXPECT_NO_THROW((void)fit_parametric_gp(
          curve(300), {.mode = mode, .updates = 400, .batch = batch, .learning_rate = 200.0}));
}

TEST(FitParametricGp, TheUseDecidesWhetherTheClosedFormIsKept) {
  // As if the closed form were worse there, and better.
  for (const double sign : {1.0, -1.0}) {
    double estimate = 0.0;
    FitContext context{.seed = 1};
    context.error_of = [&](const AnyModel&) { return estimate += sign; };
    const auto fitted = fit_parametric_gp(curve(300), {.updates = 300}, context);
    EXPECT_THAT(fitted.notes, Contains(AllOf(HasSubstr("RMSE on a free run"),
                                             HasSubstr(sign > 0.0 ? "is not kept" : "is kept"))));
  }
}

TEST(FitGaussianProcess, RequiresAFewSamples) {
  for (const char* family :
       {"gaussian_process", "parametric_gp", "parametric_gp_variational", "mlp"}) {
    const FamilyInfo& info = find_family(family);
    EXPECT_THAT(error_message([&] { (void)info.fit(curve(9), Options(info.options, {}), {}); }),
                HasSubstr("at least 10, found 9"))
        << family;
  }
}

TEST(FitParametricGp, LearnsFromBatchesToo) {
  const auto fitted =
      fit_parametric_gp(curve(2000), {.kernel = "se", .updates = 20000, .batch = 16}, {.seed = 2});
  EXPECT_LT(rmse<ParametricGp>(fitted.parameters), 0.1);
}

TEST(FitParametricGp, KeepsTheClosedFormOnlyWhereItIsBetter) {
  const TrainingData data = curve(2000);
  const auto fitted = fit_parametric_gp(data, {.kernel = "se", .updates = 3000}, {.seed = 2});
  EXPECT_THAT(fitted.notes, Contains(AllOf(HasSubstr("held out"), HasSubstr("which is kept"))));
  // No refit improves on a validation record of the learned model's own outputs.
  const auto learned = fit_parametric_gp(data, {.kernel = "se", .updates = 3000, .refit = false},
                                         {.seed = 2, .validation = &data});
  TrainingData own = curve(100);
  ParametricGp model(learned.parameters);
  for (std::size_t n = 0; n < 100; ++n)
    own.sequences[0].target[n] = model.step(own.sequences[0].features.row(n)).value;
  const auto guarded =
      fit_parametric_gp(data, {.kernel = "se", .updates = 3000}, {.seed = 2, .validation = &own});
  EXPECT_EQ(guarded.parameters.weights, learned.parameters.weights);
  EXPECT_THAT(guarded.notes, Contains(HasSubstr("which is not kept")));
}

TEST(KernelPlain, IsTheCombinedKernelOfThePaper) {
  const Kernel kernel(kernel_plain(kTable2), 2);
  const auto& [t1, t2, t3, t4, t5, t6, t7, t8, t9] = kTable2;
  const std::vector<double> x{0.1, -0.3};
  Matrix z(1, 2);
  z.values = {-0.05, 0.12};
  const PackedPoints packed(z);
  detail::AlignedVector<double> value(packed.padded_size());
  kernel.row(x.data(), packed, 1, value.data());
  double square = 0.0;
  double line = 0.0;
  double sines = 0.0;
  for (std::size_t i = 0; i < 2; ++i) {
    square += (x[i] - z(0, i)) * (x[i] - z(0, i));
    line += (x[i] - t4) * (z(0, i) - t4);
    sines += std::pow(std::sin(std::numbers::pi * (x[i] - z(0, i)) / t7), 2);
  }
  const double expected = t1 * t1 * std::exp(-square / (2.0 * t2 * t2)) *
                          (t3 * t3 * line + t5 * t5 * std::exp(-2.0 * sines / (t6 * t6)) *
                                                std::pow(1.0 + square / (2.0 * t8 * t9 * t9), -t8));
  EXPECT_NEAR(value[0], expected, 1e-12 * expected);
}

TEST(KernelPlain, RefusesNumbersThatDivideByZero) {
  PlainKernel theta = kTable2;
  theta[6] = 0.0;
  EXPECT_THAT(error_message([&] { (void)kernel_plain(theta); }), HasSubstr("theta_7"));
  theta = kTable2;
  theta[3] = 0.0;
  EXPECT_NO_THROW((void)kernel_plain(theta)) << "an offset may be 0";
}

/// Regressors of a NARX model of a rubber spring, 7 past torques and 8 deflections, as
/// specification 3.3 has them.
TrainingData narx_data(double deflection_unit) {
  constexpr std::size_t kSamples = 3000;
  std::vector<double> u;
  std::vector<double> y;
  for (std::size_t n = 0; n < kSamples; ++n) {
    const double t = 0.02 * static_cast<double>(n);
    u.push_back(9.0 * std::numbers::pi / 180.0 * std::sin(2.0 * std::numbers::pi * 0.5 * t) *
                (0.4 + 0.6 * t / 60.0));
    y.push_back(2.4 * u[n] + 0.06 * u[n < 5 ? n : n - 5]);
  }
  Matrix features(kSamples - 8, 15);
  std::vector<InputInfo> inputs;
  for (std::size_t n = 8; n < kSamples; ++n) {
    for (std::size_t i = 0; i < 7; ++i) features(n - 8, i) = y[n - 1 - i];
    for (std::size_t i = 0; i < 8; ++i) features(n - 8, 7 + i) = deflection_unit * u[n - i];
  }
  for (std::size_t i = 0; i < 15; ++i)
    inputs.push_back({.expression = std::string("x").append(std::to_string(i))});
  std::size_t next = 8;
  return test::training_data_of(inputs, features, [&](Features) { return y[next++]; });
}

TEST(KernelPlain, Table2HoldsInRadiansAndIsRefusedInDegrees) {
  const auto fitted =
      fit_parametric_gp(narx_data(1.0), {.updates = 2000, .kernel_plain = kTable2}, {.seed = 1});
  ParametricGp model(fitted.parameters);
  const TrainingData data = narx_data(1.0);
  double squares = 0.0;
  for (std::size_t n = 0; n < data.sequences[0].target.size(); ++n) {
    const double error =
        model.step(data.sequences[0].features.row(n)).value - data.sequences[0].target[n];
    squares += error * error;
  }
  EXPECT_LT(std::sqrt(squares / 2992.0), 0.01) << "Nm, of 0.38";
  EXPECT_THAT(error_message([] {
                (void)fit_parametric_gp(narx_data(180.0 / std::numbers::pi),
                                        {.updates = 100, .kernel_plain = kTable2});
              }),
              AllOf(HasSubstr("theta_8 is negative"), HasSubstr("284.6"), HasSubstr("rad and Nm")));
}

/// How many of fresh targets lie within 1.96 of their standard deviations.
template <class Model>
double covered(const typename Model::Parameters& parameters, const Matrix& features,
               const std::vector<double>& target) {
  Model model(parameters);
  std::size_t inside = 0;
  for (std::size_t n = 0; n < target.size(); ++n) {
    const Estimate estimate = model.step(features.row(n));
    if (std::abs(estimate.value - target[n]) <= 1.96 * estimate.std_dev) ++inside;
  }
  return static_cast<double>(inside) / static_cast<double>(target.size());
}

/// Functions drawn from a Gaussian process; the first half for training, the second for evaluation.
TEST(FitGaussianProcess, ItsIntervalsCoverDataFromThePrior) {
  constexpr std::size_t kLearned = 300;
  constexpr std::size_t kScored = 300;
  constexpr std::size_t kAll = kLearned + kScored;
  constexpr int kDraws = 12;
  double exact = 0.0;
  double sparse = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Random random(100 + static_cast<std::uint64_t>(draw));
    Matrix points(kAll, 2);
    for (double& value : points.values) value = 6.0 * random.uniform();
    const Kernel kernel(parse_kernel("se", 2), 2);
    const PackedPoints packed(points);
    detail::AlignedVector<double> row(packed.padded_size());
    Eigen::MatrixXd k(kAll, kAll);
    for (std::size_t i = 0; i < kAll; ++i) {
      kernel.row(points.row(i).data(), packed, kAll, row.data());
      for (std::size_t j = 0; j < kAll; ++j)
        k(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = row[j];
    }
    k.diagonal().array() += 1e-10;
    const Eigen::VectorXd white =
        Eigen::VectorXd::NullaryExpr(kAll, [&] { return random.normal(); });
    const Eigen::VectorXd f = k.llt().matrixL() * white;
    Matrix learned(kLearned, 2);
    Matrix scored(kScored, 2);
    std::vector<double> target;
    for (std::size_t n = 0; n < kAll; ++n) {
      std::ranges::copy(points.row(n),
                        n < kLearned ? learned.row(n).begin() : scored.row(n - kLearned).begin());
      target.push_back(f(static_cast<Eigen::Index>(n)) + 0.2 * random.normal());
    }
    std::size_t next = 0;
    const TrainingData data =
        test::training_data_of({{.expression = "a_1"}, {.expression = "b_1"}}, learned,
                               [&](Features) { return target[next++]; });
    const std::vector<double> rest(target.begin() + kLearned, target.end());
    exact += covered<GaussianProcess>(
        fit_gaussian_process(data, {.kernel = "se", .restarts = 0}).parameters, scored, rest);
    sparse += covered<ParametricGp>(
        fit_variational_gp(data, {.kernel = "se", .inducing_points = 60}).parameters, scored, rest);
  }
  EXPECT_NEAR(exact / kDraws, 0.95, 0.02);
  EXPECT_NEAR(sparse / kDraws, 0.95, 0.02);
}

}  // namespace
}  // namespace torsio
