#include "export/c_self_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "export/c_statements.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/model/any_model.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

constexpr std::uint32_t kTicks = 2048;
constexpr std::uint32_t kEvery = 16;  ///< ticks from one comparison to the next
constexpr int kTriangle = 1024;       ///< its amplitude as a whole number
constexpr std::uint32_t kMissing = 700;
constexpr std::uint32_t kGap = 1100;
constexpr std::uint32_t kGapEnd = 1160;
constexpr std::uint32_t kJump = 1500;

/// A raw input as base + amplitude * triangle / 1024: in SI, or in counts.
struct TestMotion {
  double base = 0.0;
  double amplitude = 0.0;
  std::uint32_t step = 0;  ///< of the phase, 4096 of which are a period
};

int triangle(std::uint32_t tick, std::uint32_t step) {
  const auto phase = static_cast<int>(tick * step % (4 * kTriangle));
  return phase < 2 * kTriangle ? phase - kTriangle : 3 * kTriangle - phase;
}

/// The features at rest.
std::vector<double> features_at(FeaturePipeline& pipeline, const std::vector<double>& raw) {
  pipeline.reset();
  const auto features = pipeline.step(raw);
  return {features.begin(), features.end()};
}

/// Motions that lead the features through the middle of their ranges: each feature is left to the raw input on which it
/// depends most among those that are not taken yet.
std::vector<TestMotion> motions_of(const EstimatorSettings& settings,
                                   const std::vector<CInput>& inputs) {
  FeaturePipeline pipeline(settings.features, settings.sample_rate_Hz);
  const std::vector<double> rest(inputs.size(), 0.0);
  const std::vector<double> at_rest = features_at(pipeline, rest);
  std::vector<TestMotion> motions(inputs.size());
  std::vector<bool> is_taken(inputs.size(), false);
  constexpr double kSmall = 1e-6;
  constexpr double kShare = 0.4;  // of the range, on either side of its middle
  for (std::size_t j = 0; j < at_rest.size(); ++j) {
    std::size_t best = inputs.size();
    double steepest = 0.0;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      if (is_taken[i]) continue;
      std::vector<double> moved = rest;
      moved[i] = kSmall;
      const double slope = (features_at(pipeline, moved)[j] - at_rest[j]) / kSmall;
      if (!std::isfinite(slope) || std::abs(slope) <= std::abs(steepest)) continue;
      steepest = slope;
      best = i;
    }
    if (best == inputs.size()) continue;
    is_taken[best] = true;
    const double low = settings.ranges.lowest[j];
    const double high = settings.ranges.highest[j];
    motions[best] = {.base = (0.5 * (low + high) - at_rest[j]) / steepest,
                     .amplitude = kShare * (high - low) / steepest,
                     .step = static_cast<std::uint32_t>(7 + 4 * best)};
  }
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (!inputs[i].is_counted()) continue;
    motions[i].base = std::round(motions[i].base / *inputs[i].unit);
    motions[i].amplitude =
        std::round(motions[i].amplitude / *inputs[i].unit / kTriangle) * kTriangle;
  }
  return motions;
}

/// What the program is given in a tick, and its value in SI.
struct Given {
  double given = 0.0;
  double value = 0.0;
};

Given given_at(const TestMotion& motion, const CInput& input, std::uint32_t tick, CReal real,
               bool jumps) {
  const int at = triangle(tick, motion.step);
  if (input.is_counted()) {
    const double counts =
        motion.base + motion.amplitude / kTriangle * at + (jumps ? motion.amplitude : 0.0);
    return {counts, counts * *input.unit};
  }
  const double share = static_cast<double>(at) / kTriangle;
  if (real == CReal::twofold) {
    const double value = motion.base + motion.amplitude * share + (jumps ? motion.amplitude : 0.0);
    return {value, value};
  }
  const auto base = static_cast<float>(motion.base);
  const auto amplitude = static_cast<float>(motion.amplitude);
  float value = base + amplitude * static_cast<float>(share);
  if (jumps) value += amplitude;
  return {static_cast<double>(value), static_cast<double>(value)};
}

}  // namespace

std::string self_test_text(const CText& c, const ModelFile& model,
                           const std::vector<CInput>& inputs) {
  const std::vector<TestMotion> motions = motions_of(model.settings, inputs);
  BasicEstimator<AnyModel> estimator(model.settings, AnyModel(model.parameters));
  for (const std::string& channel : model.settings.zeroed_channels)
    estimator.set_zero(channel, 0.0);
  const bool has_real =
      std::ranges::any_of(inputs, [](const CInput& input) { return !input.is_counted(); });
  std::vector<double> raw(inputs.size());
  std::string values;
  std::string faults;
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (std::uint32_t tick = 0; tick < kTicks; ++tick) {
    const bool is_missing = has_real && (tick == kMissing || (tick >= kGap && tick < kGapEnd));
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      raw[i] = given_at(motions[i], inputs[i], tick, c.real(), tick == kJump && i == 0).value;
      if (is_missing && !inputs[i].is_counted()) raw[i] = std::numeric_limits<double>::quiet_NaN();
    }
    const Estimate estimate = estimator.step(raw);
    lowest = std::min(lowest, estimate.value);
    highest = std::max(highest, estimate.value);
    if (tick % kEvery != kEvery - 1) continue;
    values += (values.empty() ? "" : ", ") + c.number(estimate.value);
    faults += fmt::format("{}{}", faults.empty() ? "" : ", ", static_cast<int>(estimate.fault));
  }
  std::string arguments;
  std::string body;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const TestMotion& motion = motions[i];
    const std::string at = c.filled("@triangle(tick, $STEP$)", {{"STEP", counted(motion.step)}});
    const std::string jump =
        i == 0 ? c.filled(
                     " + (tick == $TICK$ ? $AMPLITUDE$ : 0)",
                     {{"TICK", counted(kJump)},
                      {"AMPLITUDE", inputs[i].is_counted() ? fmt::format("{:.0f}", motion.amplitude)
                                                           : c.number(motion.amplitude)}})
               : std::string();
    arguments += fmt::format(", in_{}", i);
    if (inputs[i].is_counted()) {
      body += fmt::format("    int32_t in_{} = {:.0f} + {:.0f} * {}{};\n", i, motion.base,
                          motion.amplitude / kTriangle, at, jump);
      continue;
    }
    body +=
        c.filled("    @real in_$I$ = $BASE$ + $AMPLITUDE$ * ((@real)$AT$ / (@real)$TRIANGLE$);\n",
                 {{"I", fmt::format("{}", i)},
                  {"BASE", c.number(motion.base)},
                  {"AMPLITUDE", c.number(motion.amplitude)},
                  {"AT", at},
                  {"TRIANGLE", fmt::format("{}", kTriangle)}});
    if (i == 0)
      body += c.filled("    if (tick == $TICK$) in_0 += $AMPLITUDE$;\n",
                       {{"TICK", counted(kJump)}, {"AMPLITUDE", c.number(motion.amplitude)}});
  }
  std::string missing;
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (!inputs[i].is_counted()) missing += fmt::format("      in_{} = @not_a_number();\n", i);
  std::string zeros;
  for (const CInput& input : inputs)
    if (input.has_zero) zeros += fmt::format("  @set_zero_{}(&state, 0);\n", input.channel);
  double range = highest > lowest ? highest - lowest : 1.0;
  if (model.settings.output.largest_target > range) range = model.settings.output.largest_target;
  return c.filled(
      R"c(
#ifdef $GUARD$_SELF_TEST
static const @real @expected[$COUNT$] = {$VALUES$};
static const uint8_t @expected_fault[$COUNT$] = {$FAULTS$};

static int32_t @triangle(uint32_t tick, uint32_t step) {
  const int32_t phase = (int32_t)(tick * step % $PERIOD$U);
  return phase < $HALF$ ? phase - $TRIANGLE$ : 3 * $TRIANGLE$ - phase;
}

@real @self_test(void) {
  static @state state;
  @real worst = (@real)0;
  uint32_t tick;
  @reset(&state);
$ZEROS$  for (tick = 0U; tick < $TICKS$; ++tick) {
$BODY$    @estimate estimate;
    @real apart;
$MISSING$    estimate = @step(&state$ARGUMENTS$);
    if (tick % $EVERY$ != $EVERY$ - 1U) continue;
    apart = estimate.value - @expected[tick / $EVERY$];
    if (apart < (@real)0) apart = -apart;
    if (!(apart <= worst)) worst = apart;
    if (estimate.fault != (int)@expected_fault[tick / $EVERY$]) return (@real)1000;
  }
  return worst * $PER_RANGE$;
}
#endif
)c",
      {{"COUNT", fmt::format("{}", kTicks / kEvery)},
       {"VALUES", values},
       {"FAULTS", faults},
       {"PERIOD", fmt::format("{}", 4 * kTriangle)},
       {"HALF", fmt::format("{}", 2 * kTriangle)},
       {"TRIANGLE", fmt::format("{}", kTriangle)},
       {"ZEROS", zeros},
       {"TICKS", counted(kTicks)},
       {"BODY", body},
       {"MISSING",
        missing.empty()
            ? ""
            : fmt::format("    if (tick == {} || (tick >= {} && tick < {})) {{\n{}    }}\n",
                          counted(kMissing), counted(kGap), counted(kGapEnd), missing)},
       {"ARGUMENTS", arguments},
       {"EVERY", counted(kEvery)},
       {"PER_RANGE", c.number(1.0 / range)}});
}

}  // namespace torsio
