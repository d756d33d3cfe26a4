#include "fit/viscoelastic/fit_viscoelastic.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "fit/common/excited_band.hpp"
#include "fit/common/fitted.hpp"
#include "fit/viscoelastic/network_order.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr double kRate_Hz = 200.0;

/// Sines from 0.01 Hz or from `lowest_Hz` to 6 Hz and their sum, from somewhere.
Sequence record(const char* network, double duration_s, double lowest_Hz, double noise,
                std::uint64_t seed) {
  Random random(seed);
  Viscoelastic model({.network = parse_network(network),
                      .offset = 0.3,
                      .sample_period_s = 1.0 / kRate_Hz,
                      .inputs = 1});
  const auto samples = static_cast<std::size_t>(duration_s * kRate_Hz);
  constexpr int kLines = 8;
  std::vector<double> phases;
  for (int i = 0; i < kLines; ++i) phases.push_back(2.0 * std::numbers::pi * random.uniform());
  Sequence sequence{.recording = "a",
                    .features = Matrix(samples, 1),
                    .target = std::vector<double>(samples),
                    .use = std::vector<std::uint8_t>(samples, 1)};
  for (std::size_t n = 0; n < samples; ++n) {
    double u = 0.05;
    for (int i = 0; i < kLines; ++i) {
      const double frequency = lowest_Hz * std::pow(6.0 / lowest_Hz, i / (kLines - 1.0));
      u += 0.02 * std::sin(2.0 * std::numbers::pi * frequency * static_cast<double>(n) / kRate_Hz +
                           phases[static_cast<std::size_t>(i)]);
    }
    sequence.features(n, 0) = u;
    sequence.target[n] = model.step(sequence.features.row(n)).value + noise * random.normal();
  }
  return sequence;
}

TrainingData data_of(const char* network, double noise, double lowest_Hz = 0.01) {
  return {.inputs = {{"spring_deflection_rad"}},
          .target = "torque_Nm",
          .sample_rate_Hz = kRate_Hz,
          .sequences = {record(network, 40.0, lowest_Hz, noise, 1),
                        record(network, 10.0, lowest_Hz, noise, 2)}};
}

double value_of(const Fitted<Viscoelastic>& fitted, const std::string& name) {
  for (const FittedParameter& each : fitted.table)
    if (each.name == name) return each.value;
  throw Error({.problem = name});
}

TEST(FitViscoelastic, FindsTheParametersThatMadeTheData) {
  // Given by other names and from other values.
  const auto fitted =
      fit_viscoelastic(data_of("003a", 0.0), {.network = "series(kv(k4, d4), k6, kv(k5=9, d5))"});
  const std::vector<double> expected = parse_network("003a").values();
  const char* names[] = {"k4", "d4", "k5", "d5", "k6"};
  for (std::size_t j = 0; j < expected.size(); ++j)
    EXPECT_NEAR(value_of(fitted, names[j]) / expected[j], 1.0, 1e-5) << names[j];
  EXPECT_NEAR(value_of(fitted, "offset"), 0.3, 1e-6);
  EXPECT_EQ(fitted.table[0].unit, "Nm/rad");
  EXPECT_EQ(fitted.table[1].unit, "Nm s/rad");
  EXPECT_EQ(fitted.table.back().unit, "Nm");
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("relaxes within 7.79 s, 0.386 s")));
  EXPECT_THAT(fitted.notes, Not(Contains(HasSubstr("do not determine"))));
}

TEST(FitViscoelastic, EstimatesStandardErrorsThatHoldInNoise) {
  const std::vector<double> expected = parse_network("003a").values();
  const auto fitted = fit_viscoelastic(data_of("003a", 0.05), {.network = "003a"});
  double squares = 0.0;
  for (std::size_t j = 0; j < expected.size(); ++j) {
    const FittedParameter& each = fitted.table[j];
    EXPECT_GT(each.std_error, 0.0);
    EXPECT_LT(each.std_error, 0.1 * each.value) << each.name;
    squares += std::pow((each.value - expected[j]) / each.std_error, 2.0);
  }
  EXPECT_LT(squares, 5.0 * 4.0);
}

// Specification 3.6: six parameters, five coefficients.
TEST(FitViscoelastic, StatesWhichCombinationTheDataDoNotDetermine) {
  const char* near_b = "parallel(series(kv(k2=30, d2=40), k3=60), maxwell(k6=40, d3=350), k5=9)";
  const char* near_d =
      "series(k7=300, parallel(k5=30, maxwell(k6=70, d3=500), maxwell(k4=9, d4=9)))";
  for (const auto& [network, first, second] :
       {std::tuple{near_b, "k5", "k3"}, {near_d, "k7", "k5"}}) {
    const auto fitted = fit_viscoelastic(data_of(network, 0.02), {.network = network, .starts = 1});
    std::size_t nulls = 0;
    for (const std::string& note : fitted.notes) {
      if (note.find("do not determine") == std::string::npos) continue;
      ++nulls;
      EXPECT_THAT(note, AllOf(HasSubstr(first), HasSubstr(second)));
    }
    EXPECT_EQ(nulls, 1U) << network << testing::PrintToString(fitted.notes);
  }
}

TEST(FitViscoelastic, EstimatesOnlyTheSumOfTwoParallelSprings) {
  const auto fitted =
      fit_viscoelastic(data_of("k1=40", 0.01), {.network = "parallel(k1, k2)", .starts = 2});
  EXPECT_NEAR(value_of(fitted, "k1") + value_of(fitted, "k2"), 40.0, 0.05);
  EXPECT_THAT(fitted.notes, Contains(HasSubstr("k1 + k2 (relative changes)")));
  EXPECT_TRUE(std::isnan(fitted.table[0].std_error));
}

TEST(FitViscoelastic, ReportsThatNothingExcitedASlowRelaxation) {
  const auto fitted = fit_viscoelastic(data_of("003a", 0.001, 0.4), {.network = "003a"});
  EXPECT_THAT(fitted.notes, Contains(AllOf(HasSubstr("s (0.02 Hz) lies below the 0."),
                                           HasSubstr("k2, d2"), HasSubstr("add a slow record"))));
}

TEST(FitViscoelastic, APriorHoldsWhatTheDataLeaveOpen) {
  const TrainingData data = data_of("003b", 0.02);
  const std::string near =
      "parallel(series(kv(k2=30, d2=40), k3=60), maxwell(k6=40, d3=350), k5=1)";
  const auto held = fit_viscoelastic(data, {.network = near, .starts = 2, .prior = 1.0});
  const auto other =
      fit_viscoelastic(data, {.network = near, .starts = 6, .prior = 1.0}, {.seed = 5});
  for (std::size_t j = 0; j < held.table.size(); ++j)
    EXPECT_NEAR(held.table[j].value / other.table[j].value, 1.0, 1e-2) << held.table[j].name;
}

TEST(FitViscoelastic, FindsTheStateOfRecordsThatStartInMotion) {
  TrainingData data = data_of("003a", 0.0);
  for (Sequence& sequence : data.sequences) {
    constexpr std::size_t kLater = 700;
    const std::size_t samples = sequence.target.size() - kLater;
    Matrix features(samples, 1);
    for (std::size_t n = 0; n < samples; ++n) features(n, 0) = sequence.features(n + kLater, 0);
    sequence.features = features;
    sequence.target.erase(sequence.target.begin(), sequence.target.begin() + kLater);
    sequence.use.resize(samples);
  }
  const std::vector<double> expected = parse_network("003a").values();
  const auto largest_error = [&](bool is_at_rest) {
    const auto fitted =
        fit_viscoelastic(data, {.network = "003a", .starts = 2, .is_at_rest = is_at_rest});
    double largest = 0.0;
    for (std::size_t j = 0; j < expected.size(); ++j)
      largest = std::max(largest, std::abs(fitted.table[j].value / expected[j] - 1.0));
    return largest;
  };
  EXPECT_GT(largest_error(true), 1e-2);
  EXPECT_LT(largest_error(false), 1e-4);
}

TEST(FitViscoelastic, TakesValuesAsTheyAre) {
  const TrainingData data = data_of("003a", 0.0);
  const auto fitted = fit_viscoelastic(data, {.network = "003a", .is_refined = false});
  EXPECT_EQ(fitted.parameters.network, parse_network("003a"));
  EXPECT_NEAR(fitted.parameters.offset, 0.3, 1e-9);
  EXPECT_THAT(test::error_message([&] {
                (void)fit_viscoelastic(data, {.network = "kv(k1=3, d1)", .is_refined = false});
              }),
              HasSubstr("a value for d1, like d1=1, since refine=false"));
}

TEST(FitViscoelastic, IsTheSameForASeedAndLeavesOtherInputsAlone) {
  TrainingData data = data_of("003a", 0.05);
  const auto first = fit_viscoelastic(data, {});
  EXPECT_EQ(fit_viscoelastic(data, {}).parameters, first.parameters);
  data.inputs.push_back({"rate_rad_s", true});
  for (Sequence& sequence : data.sequences) {
    Matrix wider(sequence.features.rows, 2);
    for (std::size_t n = 0; n < wider.rows; ++n) wider(n, 0) = sequence.features(n, 0);
    sequence.features = wider;
  }
  const auto second = fit_viscoelastic(data, {});
  EXPECT_EQ(second.parameters.network, first.parameters.network);
  EXPECT_EQ(second.parameters.inputs, 2U);
  EXPECT_THAT(second.notes, Contains(HasSubstr("rate_rad_s not used")));
}

TEST(FitViscoelastic, RefusesWhatItCannotFit) {
  const auto message = [](TrainingData data, const ViscoelasticOptions& options) {
    return test::error_message([&] { (void)fit_viscoelastic(data, options); });
  };
  TrainingData data = data_of("003a", 0.0);
  EXPECT_THAT(message(data, {.network = "series(k1, k1)"}), HasSubstr("column 12"));
  EXPECT_THAT(message(data, {.starts = 0}), HasSubstr("option starts"));
  EXPECT_THAT(message(data, {.prior = -1.0}), HasSubstr("option prior"));
  for (Sequence& sequence : data.sequences) sequence.features = Matrix(sequence.features.rows, 1);
  EXPECT_THAT(message(data, {}), HasSubstr("spring_deflection_rad is constant"));
  EXPECT_THROW((void)fit_viscoelastic(data_of("003a", 0.0), {},
                                      {.progress = [](double, std::string_view) { return false; }}),
               Cancelled);
}

TEST(ExcitedBand, IsWhereTheLinesAre) {
  const ExcitedBand band = excited_band(data_of("003a", 0.0, 0.4));
  EXPECT_NEAR(band.lowest_Hz, 0.4, 0.1);
  EXPECT_NEAR(band.highest_Hz, 6.0, 0.1);
}

TEST(NetworkOrder, PutsTheFasterOfEqualPartsFirst) {
  const auto ordered = [](const char* text) {
    return text_of(fastest_first(parse_network(text)), 3);
  };
  EXPECT_EQ(ordered("series(kv(k1=1, d1=9), k3=3, kv(k2=2, d2=2))"),
            "series(kv(k1=2, d1=2), k3=3, kv(k2=1, d2=9))");
  EXPECT_EQ(ordered("parallel(k1=5, k2=1)"), "parallel(k1=5, k2=1)");
  EXPECT_EQ(
      ordered("parallel(series(k1=1, maxwell(k2=1, d2=8)), series(k3=1, maxwell(k4=1, d4=2)))"),
      "parallel(series(k1=1, maxwell(k2=1, d2=2)), series(k3=1, maxwell(k4=1, d4=8)))");
  EXPECT_EQ(ordered("series(kv(k1=1, d1=9), maxwell(k2=2, d2=2))"),
            "series(kv(k1=1, d1=9), maxwell(k2=2, d2=2))");
}

}  // namespace
}  // namespace torsio
