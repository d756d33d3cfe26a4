// What an exported program computes, against torsio's own step, for each family that can be exported.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "export/exported_families.hpp"
#include "export/exported_program.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/random.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio::test {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// A motion with missing samples, gaps, a spike, other levels and excursions. A jump is far from its limit.
std::vector<std::vector<double>> motion(std::size_t ticks) {
  Random random(3);
  std::vector<std::vector<double>> raw;
  double level = 0.0;
  for (std::size_t n = 0; n < ticks; ++n) {
    const auto t = static_cast<double>(n);
    const std::size_t q = n % 4000;
    if (q == 3300) level += 0.05;
    double gear_rad = 0.06 * std::sin(0.01 * t) + 1e-5 * random.normal() + level;
    double joint_rad = 0.02 * std::sin(0.0037 * t);
    if (q >= 2500 && q < 3000)
      gear_rad +=
          0.2 * std::sin((t - static_cast<double>(n - q) - 2500.0) / 500.0 * std::numbers::pi);
    if (q == 1200) gear_rad += 0.5;
    if (q == 700 || (q >= 900 && q < 905) || (q >= 1600 && q < 1650)) gear_rad = kNan;
    if (q == 800) joint_rad = std::numeric_limits<double>::infinity();
    raw.push_back({gear_rad, joint_rad});
  }
  return raw;
}

double counted(double angle_rad, double counts_per_turn) {
  return std::round(angle_rad / (2.0 * std::numbers::pi) * counts_per_turn);
}

/// Steps both and compares values, error bars and faults. @param tolerance as a share of the range of the torque
void expect_equal(const ModelFile& file, const C99Options& options, double tolerance,
                  std::size_t ticks = 8000) {
  const TemporaryFolder folder;
  BasicEstimator<AnyModel> own(file.settings, AnyModel(file.parameters));
  for (const std::string& channel : file.settings.zeroed_channels) own.set_zero(channel, 0.0);
  ExportedProgram exported(folder, file, options, own.raw_inputs());
  double lowest = 0.0;
  double highest = 0.0;
  double worst = 0.0;
  std::size_t in_use = 0;
  std::size_t other_faults = 0;
  for (std::vector<double> raw : motion(ticks)) {
    std::vector<double> given = raw;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      const auto counts = std::ranges::find(options.counts, own.raw_inputs()[i], &CCounts::channel);
      if (counts != options.counts.end()) {
        if (!std::isfinite(raw[i])) raw[i] = 0.0;
        given[i] = counted(raw[i], counts->counts_per_turn);
        raw[i] = given[i] / counts->counts_per_turn * 2.0 * std::numbers::pi;
      } else if (options.real == CReal::single) {
        given[i] = raw[i] = static_cast<double>(static_cast<float>(raw[i]));
      }
    }
    const Estimate expected = own.step(raw);
    const Estimate found = exported.step(given);
    lowest = std::min(lowest, expected.value);
    highest = std::max(highest, expected.value);
    worst = std::max(worst, std::abs(found.value - expected.value));
    EXPECT_TRUE(std::isfinite(found.value));
    if (found.fault != expected.fault) ++other_faults;
    EXPECT_EQ(std::isnan(found.std_dev), std::isnan(expected.std_dev));
    if (expected.fault == Fault::none) ++in_use;
  }
  EXPECT_LT(worst, tolerance * (highest - lowest));
  EXPECT_EQ(other_faults, 0U);
  EXPECT_GT(in_use, ticks / 20);
  EXPECT_LT(exported.self_test(), tolerance);
}

template <class Family>
class C99 : public testing::Test {};
TYPED_TEST_SUITE(C99, Exported, ExportedName);

TYPED_TEST(C99, InDoubleIsTheEstimator) {
  expect_equal(guarded(any_example<TypeParam>()), {.name = "joint", .real = CReal::twofold}, 1e-6);
}

TYPED_TEST(C99, InFloatIsNearlyTheEstimator) {
  expect_equal(guarded(any_example<TypeParam>()), {.name = "joint", .real = CReal::single}, 1e-4);
}

TYPED_TEST(C99, HasTheWholeLanguageOfItsFeatures) {
  expect_equal(remembering(any_example<TypeParam>()), {.name = "joint", .real = CReal::twofold},
               1e-6);
}

TEST(C99Guards, ReportAMissingZeroFromTheFirstTickOn) {
  ModelFile file = remembering(any_example<Linear>());
  file.settings.zeroed_channels = {"gear_angle_rad"};
  BasicEstimator<AnyModel> own(file.settings, AnyModel(file.parameters));
  const TemporaryFolder folder;
  ExportedProgram exported(folder, file, {.name = "joint", .real = CReal::twofold},
                           own.raw_inputs(), /*sets_zeros=*/false);
  for (int n = 0; n < 100; ++n) {
    const std::vector<double> raw(own.raw_inputs().size(), 1e-4 * n);
    ASSERT_EQ(own.step(raw).fault, Fault::zero_not_set) << n;
    ASSERT_EQ(exported.step(raw).fault, Fault::zero_not_set) << n;
  }
}

TYPED_TEST(C99, TakesCountsOfEncoders) {
  expect_equal(guarded(any_example<TypeParam>()),
               {.name = "joint",
                .real = CReal::single,
                .counts = {{"gear_angle_rad", 16777216.0}, {"joint_angle_rad", -524288.0}}},
               1e-4);
}

}  // namespace
}  // namespace torsio::test
