#include "evaluate/monitor/combination_factors.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::size_t kSamples = 4000;

/// Recordings of two sources with error bars of 1 Nm: the errors of the first average out, a share of those of the
/// second persists through a recording, so that the mean squares are equal.
struct Recordings {
  Recordings(double persistent_share, double second_Nm, std::size_t count) {
    for (std::size_t r = 0; r < count; ++r) {
      Random random(r + 1);
      std::vector<SourceRun> sources(2);
      const double persistent_Nm = std::sqrt(persistent_share) * (r % 2 == 0 ? 1.0 : -1.0);
      for (std::size_t n = 0; n < kSamples; ++n) {
        sources[0].value_Nm.push_back(5.0 + random.normal());
        sources[1].value_Nm.push_back(
            5.0 +
            second_Nm * (persistent_Nm + std::sqrt(1.0 - persistent_share) * random.normal()));
      }
      for (SourceRun& source : sources) source.std_dev_Nm.assign(kSamples, 1.0);
      sources_.push_back(sources);
    }
    for (const std::vector<SourceRun>& sources : sources_)
      runs.push_back({.sources = &sources, .torque_Nm = std::vector<double>(kSamples, 5.0)});
  }

  std::vector<MeasuredRun> runs;

 private:
  std::vector<std::vector<SourceRun>> sources_;
};

RedundancySettings two_sources() { return {.sources = {{"a", {}}, {"b", {}}}, .correlation = {}}; }

TEST(CombinationFactors, ErrorsThatAverageOutNeedNone) {
  const Recordings recordings(0.0, 1.0, 4);
  EXPECT_THAT(combination_factors(two_sources(), recordings.runs, kSamples / 2),
              ElementsAre(1.0, 1.0));
}

TEST(CombinationFactors, ASourceThatIsOffInARecordingGetsLessWeight) {
  // In each recording the second source is 4 Nm off, four times its error bar.
  const Recordings recordings(1.0, 4.0, 4);
  const std::vector<double> factors =
      combination_factors(two_sources(), recordings.runs, kSamples / 2);
  ASSERT_EQ(factors.size(), 2U);
  EXPECT_EQ(factors[0], 1.0);
  EXPECT_GE(factors[1], 2.0);
  RedundancySettings settings = two_sources();
  settings.error_bar_factors = factors;
  Redundancy redundancy(settings);
  for (const MeasuredRun& run : recordings.runs) {
    double combined = 0.0;
    double best = 0.0;
    for (std::size_t n = 0; n < kSamples; ++n) {
      std::vector<Estimate> estimates(2);
      for (std::size_t i = 0; i < 2; ++i) {
        estimates[i].value = (*run.sources)[i].value_Nm[n];
        estimates[i].std_dev = 1.0;
      }
      combined += std::pow(redundancy.step(estimates).value_Nm - 5.0, 2);
      best += std::pow(estimates[0].value - 5.0, 2);
    }
    EXPECT_LT(std::sqrt(combined / best), 1.1);
  }
}

TEST(CombinationFactors, WithoutAMeasuredTorqueThereAreNone) {
  Recordings recordings(0.0, 1.0, 2);
  for (MeasuredRun& run : recordings.runs) run.torque_Nm.assign(kSamples, kNotMeasured);
  EXPECT_THAT(combination_factors(two_sources(), recordings.runs, kSamples / 2), IsEmpty());
  EXPECT_THAT(combination_factors(two_sources(), {}, kSamples), IsEmpty());
}

}  // namespace
}  // namespace torsio
