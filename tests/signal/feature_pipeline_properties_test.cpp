#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "support/numbers.hpp"
#include "torsio/core/random.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;

constexpr std::size_t kSteps = 60;

std::string random_expression(Random& random, int depth) {
  static const std::vector<std::string> kLeaves{"a_rad", "b_rad", "c_rad_s", "sum_rad",
                                                "0.3",   "20deg", "2"};
  if (depth == 0) return kLeaves[random.below(kLeaves.size())];
  const std::string left = random_expression(random, depth - 1);
  const std::string right = random_expression(random, depth - 1);
  switch (random.below(12)) {
    case 0: return "(" + left + " + " + right + ")";
    case 1: return "(" + left + " - " + right + ")";
    case 2: return left + " * " + right;
    case 3: return "(" + left + ") / (2 + abs(" + right + "))";
    case 4: return "-(" + left + ")";
    case 5: return "rate(" + left + ")";
    case 6: return "lowpass(" + left + ", " + std::to_string(5 + random.below(300)) + "Hz)";
    case 7: return "lag(" + left + ", " + std::to_string(random.below(9)) + ")";
    case 8: return "tanh(" + left + ")";
    case 9: return "max(" + left + ", " + right + ")";
    case 10: return "sign(" + left + ")";
    default: return "(" + left + ") ^ 2";
  }
}

FeaturePipeline random_pipeline(std::uint64_t seed) {
  Random random(seed);
  FeatureSpec spec{.inputs = {}, .definitions = {{"sum_rad", "a_rad + lowpass(b_rad, 30Hz)"}}};
  for (int i = 0; i < 3; ++i) spec.inputs.push_back(random_expression(random, 3));
  return {spec, kRate_Hz};
}

std::vector<double> random_raw(Random& random, std::size_t count) {
  std::vector<double> raw(count);
  for (double& value : raw) value = random.normal();
  return raw;
}

// Bits, so that even a NaN must be the same.
std::vector<std::uint64_t> run(FeaturePipeline& pipeline, std::uint64_t seed) {
  Random random(seed);
  std::vector<std::uint64_t> outputs;
  for (std::size_t n = 0; n < kSteps; ++n)
    for (const double value : pipeline.step(random_raw(random, pipeline.raw_inputs().size())))
      outputs.push_back(std::bit_cast<std::uint64_t>(value));
  return outputs;
}

RC_GTEST_PROP(FeaturePipelineLaw, ResetMakesARunRepeatable, (std::uint64_t seed)) {
  FeaturePipeline pipeline = random_pipeline(seed);
  const auto first = run(pipeline, seed);
  pipeline.reset();
  RC_ASSERT(run(pipeline, seed) == first);
}

RC_GTEST_PROP(FeaturePipelineLaw, ACopyGoesOnAloneFromTheSameState, (std::uint64_t seed)) {
  FeaturePipeline original = random_pipeline(seed);
  (void)run(original, seed);
  FeaturePipeline copy = original;
  FeaturePipeline untouched = original;
  const auto expected = run(copy, seed + 1);
  (void)run(copy, seed + 2);
  copy.reset();
  RC_ASSERT(run(untouched, seed + 1) == expected);
  RC_ASSERT(run(original, seed + 1) == expected);
}

RC_GTEST_PROP(FeaturePipelineLaw, InputsDoNotDisturbEachOther, (std::uint64_t seed)) {
  const FeaturePipeline together = random_pipeline(seed);
  const std::vector<std::string>& names = together.raw_inputs();
  for (std::size_t i = 0; i < together.feature_count(); ++i) {
    FeaturePipeline all = together;
    FeaturePipeline alone(
        {.inputs = {together.spec().inputs[i]}, .definitions = together.spec().definitions},
        kRate_Hz);
    RC_ASSERT(alone.is_rate(0) == all.is_rate(i));
    RC_ASSERT(alone.settling_samples() <= all.settling_samples());
    Random random(seed);
    for (std::size_t n = 0; n < kSteps; ++n) {
      const std::vector<double> raw = random_raw(random, names.size());
      std::vector<double> own;
      for (const std::string& name : alone.raw_inputs())
        own.push_back(raw[static_cast<std::size_t>(std::find(names.begin(), names.end(), name) -
                                                   names.begin())]);
      RC_ASSERT(std::bit_cast<std::uint64_t>(alone.step(own)[0]) ==
                std::bit_cast<std::uint64_t>(all.step(raw)[i]));
    }
  }
}

RC_GTEST_PROP(FeaturePipelineLaw, AShiftOfAChannelIsAZeroOfIt, (std::uint64_t seed)) {
  FeaturePipeline plain = random_pipeline(seed);
  FeaturePipeline zeroed = plain;
  const std::size_t count = plain.raw_inputs().size();
  for (const std::string& name : plain.raw_inputs()) zeroed.set_zero(name, 8.0);
  Random random(seed);
  for (std::size_t n = 0; n < kSteps; ++n) {
    std::vector<double> raw(count);
    for (double& value : raw) value = static_cast<double>(random.below(64));  // exact when shifted
    std::vector<double> shifted = raw;
    for (double& value : shifted) value += 8.0;
    const std::span<const double> expected = plain.step(raw);
    const std::span<const double> actual = zeroed.step(shifted);
    for (std::size_t i = 0; i < expected.size(); ++i)
      RC_ASSERT(std::bit_cast<std::uint64_t>(actual[i]) ==
                std::bit_cast<std::uint64_t>(expected[i]));
  }
}

RC_GTEST_PROP(SplitInputsLaw, UndoesJoining, (std::uint64_t seed)) {
  Random random(seed);
  std::vector<std::string> parts;
  std::string joined;
  for (std::size_t i = 0; i <= random.below(5); ++i) {
    parts.push_back(random_expression(random, 2));
    joined += (i > 0 ? " , " : "") + parts.back();
  }
  RC_ASSERT(split_inputs(joined) == parts);
}

// A pipeline that has seen the past of a joint, and one that begins in the middle of it.
RC_GTEST_PROP(FeaturePipeline, TheErrorOfAnUnknownStateIsWithinItsBound, (std::uint64_t seed)) {
  Random random(seed);
  const FeatureSpec spec{
      .inputs = {"stop(a, 0.5)", "dahl(a, 0.25)", "dahl(a, 0.3) * abs(b)", "dahl(a, 0.4)^2 * b",
                 "dahl(a - stop(a, 0.1), 0.5)", "3 * stop(a, 0.2) - b * dahl(a, 0.1)",
                 "tanh(5 * stop(a, 0.7))"},
      .definitions = {}};
  FeaturePipeline whole(spec, kRate_Hz);
  double a = 0.0;
  const double largest_step = random.uniform();
  const auto next = [&] {
    a += largest_step * (random.uniform() - 0.5);
    return std::vector{a, 4.0 * random.uniform() - 2.0};
  };
  for (int n = 0; n < 300 || !whole.is_settled(); ++n) static_cast<void>(whole.step(next()));
  FeaturePipeline begun(spec, kRate_Hz);
  for (int n = 0; n < 1000; ++n) {
    const std::vector<double> raw = next();
    const auto expected = whole.step(raw);
    const auto found = begun.step(raw);
    if (begun.is_settled()) break;
    for (std::size_t i = 0; i < found.size(); ++i)
      if (std::abs(found[i] - expected[i]) > begun.state_errors()[i] + 1e-6)
        RC_FAIL(spec.inputs[i] + " after " + std::to_string(n) + " steps");
  }
  while (!begun.is_settled()) static_cast<void>(begun.step(next()));
  for (const double error : begun.state_errors()) RC_ASSERT(error == 0.0);
  begun.reset();
  RC_ASSERT(!begun.is_settled());
}

}  // namespace
}  // namespace torsio
