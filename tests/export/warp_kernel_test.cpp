// The generated module with a substitute for the package warp, which checks the types that Warp would refuse.

#include "torsio/export/warp_kernel.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "export/exported_families.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/estimate/estimator.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;

constexpr const char* kWarpPython = "/usr/bin/python3";

std::string python_output(const std::string& command) {
  std::string text;
  FILE* pipe = ::popen(command.c_str(), "r");
  std::array<char, 4096> part{};
  while (std::fgets(part.data(), part.size(), pipe) != nullptr) text += part.data();
  EXPECT_EQ(::pclose(pipe), 0) << command << '\n' << text;
  return text;
}

std::string stand_in_command(const TemporaryFolder& folder, const std::string& arguments) {
  return fmt::format("cd '{}' && PYTHONDONTWRITEBYTECODE=1 PYTHONPATH='{}' {} {} 2>&1",
                     folder.path(""), TORSIO_WARP_STAND_IN, kWarpPython, arguments);
}

bool has_warp_stand_in() {
  return std::system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") == 0;
}

void write_module(const TemporaryFolder& folder, const ModelFile& file, GraphPrecision precision) {
  std::ofstream(folder.path("joint_warp.py"))
      << warp_kernel_text(file, {.precision = precision}, "joint.safetensors");
}

/// Rows of a joint in the order of the ticks: a slow motion, an excursion beyond the ranges, and what follows.
std::vector<std::vector<double>> motion_with_excursion(std::size_t ticks, double phase) {
  std::vector<std::vector<double>> rows;
  for (std::size_t n = 0; n < ticks; ++n) {
    const auto t = static_cast<double>(n) + phase;
    double gear_rad = 0.06 * std::sin(0.01 * t);
    if (n >= 400 && n < 900)
      gear_rad += 0.45 * std::sin((static_cast<double>(n) - 400.0) / 500.0 * std::numbers::pi);
    rows.push_back({gear_rad, 0.02 * std::sin(0.0037 * t)});
  }
  return rows;
}

/// Estimates of the generated module, by joint and tick.
std::vector<std::vector<Estimate>> run_module(
    const TemporaryFolder& folder, const std::vector<std::vector<std::vector<double>>>& joints) {
  std::ofstream input(folder.path("rows.txt"));
  for (std::size_t n = 0; n < joints.front().size(); ++n)
    for (const auto& joint : joints)
      input << fmt::format("{} {}\n", joint.at(n).at(0), joint.at(n).at(1));
  input.close();
  const std::string text = python_output(
      stand_in_command(folder, fmt::format("'{}/run_kernel.py' joint_warp {} < rows.txt",
                                           TORSIO_WARP_STAND_IN, joints.size())));
  std::vector<std::vector<Estimate>> result(joints.size());
  const char* at = text.c_str();
  for (std::size_t n = 0; n < joints.front().size(); ++n)
    for (auto& joint : result) {
      char* end = nullptr;
      Estimate estimate;
      estimate.value = std::strtod(at, &end);
      estimate.std_dev = std::strtod(end, &end);
      estimate.fault = static_cast<Fault>(std::strtol(end, &end, 10));
      at = end;
      joint.push_back(estimate);
    }
  EXPECT_EQ(std::string(at), "\n") << text.substr(0, 2000);
  return result;
}

/// @param tolerance as a share of the range of the torque
void expect_kernel_is_estimator(const ModelFile& file, GraphPrecision precision, double tolerance,
                                std::size_t ticks) {
  const TemporaryFolder folder;
  write_module(folder, file, precision);
  std::vector<std::vector<std::vector<double>>> joints{motion_with_excursion(ticks, 0.0),
                                                       motion_with_excursion(ticks, 200.0)};
  if (precision == GraphPrecision::single)
    for (auto& joint : joints)
      for (auto& row : joint)
        for (double& x : row) x = static_cast<double>(static_cast<float>(x));
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t n = 250; n < 290; ++n) joints[1][n] = {kNaN, 0.0};
  const std::vector<std::vector<Estimate>> found = run_module(folder, joints);
  const std::size_t allowed = precision == GraphPrecision::twofold ? 0 : 3;
  for (std::size_t joint = 0; joint < joints.size(); ++joint) {
    BasicEstimator<AnyModel> own(file.settings, AnyModel(file.parameters));
    for (const std::string& channel : file.settings.zeroed_channels) own.set_zero(channel, 0.0);
    double lowest = 0.0;
    double highest = 0.0;
    double worst = 0.0;
    double worst_bar = 0.0;
    std::size_t other_faults = 0;
    std::size_t other_bars = 0;
    std::size_t in_use = 0;
    for (std::size_t n = 0; n < ticks; ++n) {
      const Estimate expected = own.step(joints[joint][n]);
      const Estimate& estimate = found[joint][n];
      ASSERT_TRUE(std::isfinite(estimate.value)) << n;
      lowest = std::min(lowest, expected.value);
      highest = std::max(highest, expected.value);
      worst = std::max(worst, std::abs(estimate.value - expected.value));
      if (estimate.fault != expected.fault) ++other_faults;
      if (std::isnan(estimate.std_dev) != std::isnan(expected.std_dev))
        ++other_bars;
      else if (std::isfinite(expected.std_dev))
        worst_bar =
            std::max(worst_bar, std::abs(estimate.std_dev - expected.std_dev) / expected.std_dev);
      if (expected.fault == Fault::none) ++in_use;
    }
    EXPECT_LT(worst, tolerance * (highest - lowest));
    EXPECT_LT(worst_bar, std::sqrt(tolerance));
    EXPECT_LE(other_faults, allowed);
    EXPECT_LE(other_bars, allowed);
    EXPECT_GT(in_use, ticks / 20);
  }
}

template <class Family>
class WarpKernels : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_warp_stand_in()) GTEST_SKIP() << "no " << kWarpPython << " with numpy";
  }
};
TYPED_TEST_SUITE(WarpKernels, Exported, ExportedName);

/// Some families, since each program takes most of a second.
template <class Family>
class WarpPrecisions : public WarpKernels<Family> {};
using SomeExported = testing::Types<Scheduled, GreyBoxWithBanks, Gru, HammersteinWiener>;
TYPED_TEST_SUITE(WarpPrecisions, SomeExported, ExportedName);

TYPED_TEST(WarpKernels, InDoubleAreTheEstimator) {
  expect_kernel_is_estimator(guarded(any_example<TypeParam>()), GraphPrecision::twofold, 1e-6, 700);
}

TYPED_TEST(WarpKernels, WithWideFeaturesAreNearlyTheEstimator) {
  expect_kernel_is_estimator(guarded(any_example<TypeParam>()), GraphPrecision::mixed, 1e-5, 700);
}

TYPED_TEST(WarpPrecisions, InFloatAreNearlyTheEstimator) {
  expect_kernel_is_estimator(guarded(any_example<TypeParam>()), GraphPrecision::single, 1e-4, 700);
}

TYPED_TEST(WarpKernels, HaveTheWholeLanguageOfTheirFeatures) {
  expect_kernel_is_estimator(remembering(any_example<TypeParam>()), GraphPrecision::twofold, 1e-6,
                             500);
}

TYPED_TEST(WarpPrecisions, HaveTheWholeLanguageAlsoWithWideFeatures) {
  expect_kernel_is_estimator(remembering(any_example<TypeParam>()), GraphPrecision::mixed, 1e-4,
                             300);
}

TEST(WarpModules, ResetSingleJointsAndCheckTheirCalls) {
  if (!has_warp_stand_in()) GTEST_SKIP() << "no " << kWarpPython << " with numpy";
  const TemporaryFolder folder;
  const ModelFile file = guarded(any_example<MaxwellSlipModel>());
  write_module(folder, file, GraphPrecision::mixed);
  folder.file("try.py", R"py(
import numpy as np
import warp as wp
import joint_warp as m

def raises(error, call):
    try:
        call()
    except error as found:
        return str(found)
    raise AssertionError("nothing was refused")

joints, alone = m.make_state(3), m.make_state(3)
inputs = wp.zeros((3, len(m.INPUTS)), dtype=m.NUMBER)
for n in range(200):
    inputs.data[:, 0] = 0.0003 * n
    m.step(inputs, joints)
before = joints.state.numpy().copy()
m.reset(joints, wp.array([0, 1, 0], dtype=wp.int32))
assert (joints.state.numpy()[[0, 2]] == before[[0, 2]]).all() and (joints.state.numpy()[1] == 0).all()
m.step(inputs, joints)
m.step(inputs, alone)
assert joints.value.numpy()[1] == alone.value.numpy()[1] != joints.value.numpy()[0]
assert joints.fault.numpy()[0] != joints.fault.numpy()[1] and m.FAULTS[joints.fault.numpy()[1]] == "warming_up"
m.reset(joints)
assert (joints.state.numpy() == 0).all()
m.step(inputs, joints, timestep_s=0.002)
assert m.FAULTS[joints.fault.numpy()[0]] == "wrong_rate" and np.isfinite(joints.value.numpy()).all()
m.check_timestep(1.0 / m.RATE_HZ)
assert "0.001 s" in raises(ValueError, lambda: m.check_timestep(0.002))
raises(ValueError, lambda: m.check_timestep(float("nan")))
raises(ValueError, lambda: m.step(wp.zeros((3, len(m.INPUTS)), dtype=wp.float32), joints))
assert "(3, 2)" in raises(ValueError, lambda: m.step(wp.zeros((2, len(m.INPUTS)), dtype=m.NUMBER), joints))
)py");
  EXPECT_EQ(python_output(stand_in_command(folder, "try.py")), "");
}

TEST(WarpModules, TheStandInRefusesWhatWarpWould) {
  if (!has_warp_stand_in()) GTEST_SKIP() << "no " << kWarpPython << " with numpy";
  const TemporaryFolder folder;
  folder.file("try.py", R"py(
import warp as wp

def adds_two_types(a: wp.array(dtype=wp.float64)):
    a[0] = a[0] + wp.float32(1.0)

def rounds_a_number(a: wp.array(dtype=wp.float64)):
    a[0] = wp.float64(0.1)

def changes_a_type(a: wp.array(dtype=wp.float64)):
    v = a[0]
    v = wp.float32(v)

def changes_a_constant(a: wp.array(dtype=wp.float64)):
    v = wp.float64(0.0)
    for j in range(20):
        v = v + a[j]

def casts_a_truth(a: wp.array(dtype=wp.float64)):
    a[0] = wp.float64(a[0] < a[1])

for function in (adds_two_types, rounds_a_number, changes_a_type, changes_a_constant, casts_a_truth):
    try:
        wp.kernel(function)
    except TypeError:
        continue
    print(function.__name__)
)py");
  EXPECT_EQ(python_output(stand_in_command(folder, "try.py")), "");
}

TEST(WarpModules, AreRefusedByName) {
  const ModelFile file = guarded(any_example<Linear>());
  for (const char* name : {"", "1joint", "a-b", "a.b", "a b", "class", "None", "warp"})
    EXPECT_THAT(error_message([&] { (void)warp_kernel_text(file, {.name = name}, "m"); }),
                HasSubstr("the name of the module"))
        << name;
  EXPECT_THAT(error_message([] { (void)warp_kernel_text(guarded(any_example<Dgmm>()), {}, "m"); }),
              HasSubstr("dgmm"));
  // A file's name cannot end the description.
  const std::string text = warp_kernel_text(file, {}, "a\"\"\" \\\nimport os");
  EXPECT_THAT(text, HasSubstr("from a___ __import os: linear"));
}

}  // namespace
}  // namespace torsio::test
