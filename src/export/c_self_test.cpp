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
constexpr std::uint32_t kLongestStart = 120'000;
constexpr std::uint32_t kEvery = 16;  ///< ticks from one comparison to the next
constexpr int kTriangle = 1024;       ///< its amplitude as a whole number
constexpr std::uint32_t kPeriod = 4 * kTriangle;
constexpr std::uint32_t kMissing = 700;
constexpr std::uint32_t kGap = 1100;
constexpr std::uint32_t kGapEnd = 1160;
constexpr std::uint32_t kJump = 1500;

/// Raw inputs that move together: each by its amplitude times a triangle over its 1024.
struct TestMotion {
  std::vector<double> amplitudes = {};  ///< each raw input has one: in SI, or in counts
  std::uint32_t step = 0;               ///< step of the phase, 4096 of which are a period
};
struct TestMotions {
  std::vector<double> bases = {};  ///< each raw input has one
  std::vector<TestMotion> motions = {};
};

int triangle(std::uint32_t tick, std::uint32_t step) {
  const auto phase = static_cast<int>(tick * step % kPeriod);
  return phase < 2 * kTriangle ? phase - kTriangle : 3 * kTriangle - phase;
}

/// The features at rest.
std::vector<double> features_at(FeaturePipeline& pipeline, const std::vector<double>& raw) {
  pipeline.reset();
  const auto features = pipeline.step(raw);
  return {features.begin(), features.end()};
}

constexpr double kSmall = 1e-6;  ///< in which features are linear
constexpr double kShare = 0.8;   ///< share of the range

/// Motions that lead the features through most of their ranges. Each feature is left to the raw input on which it depends most
/// among those that are not taken yet, and moves so slowly that its rates are inside their ranges as well. Raw inputs of which the
/// features have rates only, as the angle of a joint beside a deflection, move with those that keep the other features.
class MotionPlan {
 public:
  MotionPlan(const EstimatorSettings& settings, const std::vector<CInput>& inputs)
      : settings_(settings),
        inputs_(inputs),
        pipeline_(settings.features, settings.sample_rate_Hz),
        plan_{.bases = std::vector<double>(inputs.size(), 0.0)},
        owner_(inputs.size(), kNone) {}

  TestMotions make() {
    const std::vector<double> at_rest = features_at(pipeline_, plan_.bases);
    for (std::size_t j = 0; j < at_rest.size(); ++j) leave_to_an_input(j, at_rest[j]);
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      if (owner_[i] != kNone) slow_down(plan_.motions[owner_[i]]);
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      if (owner_[i] == kNone) move_by_rates(i);
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      if (inputs_[i].is_counted()) count(i, *inputs_[i].unit);
    return plan_;
  }

 private:
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  struct Owned {
    std::size_t input;
    std::vector<double> slopes;  ///< slopes of the feature, by raw input
  };

  [[nodiscard]] TestMotion motion_of(std::size_t input) const {
    TestMotion motion{.amplitudes = std::vector<double>(inputs_.size(), 0.0),
                      .step = static_cast<std::uint32_t>(7 + 4 * plan_.motions.size())};
    motion.amplitudes[input] = kSmall;
    return motion;
  }
  [[nodiscard]] double half_range(std::size_t feature) const {
    return 0.5 * (settings_.ranges.highest[feature] - settings_.ranges.lowest[feature]);
  }

  void leave_to_an_input(std::size_t feature, double at_rest) {
    Owned owned{.input = kNone, .slopes = std::vector<double>(inputs_.size(), 0.0)};
    double steepest = 0.0;
    const std::vector<double> rest(inputs_.size(), 0.0);
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      std::vector<double> moved = rest;
      moved[i] = kSmall;
      const double slope = (features_at(pipeline_, moved)[feature] - at_rest) / kSmall;
      if (!std::isfinite(slope)) continue;
      owned.slopes[i] = slope;
      if (owner_[i] != kNone || std::abs(slope) <= std::abs(steepest)) continue;
      steepest = slope;
      owned.input = i;
    }
    if (owned.input == kNone) return;
    owner_[owned.input] = plan_.motions.size();
    const double middle =
        0.5 * (settings_.ranges.lowest[feature] + settings_.ranges.highest[feature]);
    plan_.bases[owned.input] = (middle - at_rest) / steepest;
    plan_.motions.push_back(motion_of(owned.input));
    plan_.motions.back().amplitudes[owned.input] = kShare * half_range(feature) / steepest;
    owned_.push_back(std::move(owned));
  }

  /// The largest share of its half range by which a feature moves.
  [[nodiscard]] double largest_share(const TestMotion& motion) {
    const std::vector<double> from = features_at(pipeline_, plan_.bases);
    pipeline_.reset();
    double largest = 0.0;
    for (std::uint32_t tick = 0; tick < 2 * kPeriod / motion.step; ++tick) {
      std::vector<double> raw = plan_.bases;
      for (std::size_t i = 0; i < raw.size(); ++i)
        raw[i] += motion.amplitudes[i] * triangle(tick, motion.step) / kTriangle;
      const auto features = pipeline_.step(raw);
      for (std::size_t j = 0; j < features.size(); ++j) {
        const double share = std::abs(features[j] - from[j]) / half_range(j);
        if (std::isfinite(share)) largest = std::max(largest, share);
      }
    }
    return largest;
  }

  /// So that rates are not larger than the share either.
  void slow_down(TestMotion& motion) {
    while (motion.step > 1 && largest_share(motion) > 1.1 * kShare) motion.step /= 2;
  }

  void move_by_rates(std::size_t input) {
    TestMotion motion = motion_of(input);
    for (const Owned& owned : owned_)
      motion.amplitudes[owned.input] -= kSmall * owned.slopes[input] / owned.slopes[owned.input];
    const double share = largest_share(motion);
    for (double& amplitude : motion.amplitudes)
      amplitude = share > 0.0 ? amplitude * kShare / share : 0.0;
    plan_.motions.push_back(std::move(motion));
  }

  void count(std::size_t input, double unit) {
    plan_.bases[input] = std::round(plan_.bases[input] / unit);
    for (TestMotion& motion : plan_.motions)
      motion.amplitudes[input] =
          std::round(motion.amplitudes[input] / unit / kTriangle) * kTriangle;
  }

  const EstimatorSettings& settings_;
  const std::vector<CInput>& inputs_;
  FeaturePipeline pipeline_;
  TestMotions plan_;
  std::vector<std::size_t> owner_;  ///< the motion of each raw input
  std::vector<Owned> owned_ = {};
};

/// How far the first raw input is away in the tick of a jump.
double jump_of(const TestMotions& plan) {
  for (const TestMotion& motion : plan.motions)
    if (motion.amplitudes.front() != 0.0) return motion.amplitudes.front();
  return 0.0;
}

/// What the program is given in a tick, in SI. @param jump added to the first raw input
double given_at(const TestMotions& plan, std::size_t input, const CInput& channel,
                std::uint32_t tick, CReal real, bool jumps) {
  const double jump = jumps ? jump_of(plan) : 0.0;
  if (channel.is_counted()) {
    double counts = plan.bases[input] + jump;
    for (const TestMotion& motion : plan.motions)
      counts += motion.amplitudes[input] / kTriangle * triangle(tick, motion.step);
    return counts * *channel.unit;
  }
  const auto sum = [&](auto value) {
    using Real = decltype(value);
    for (const TestMotion& motion : plan.motions) {
      if (motion.amplitudes[input] == 0.0) continue;
      value += static_cast<Real>(motion.amplitudes[input]) *
               (static_cast<Real>(triangle(tick, motion.step)) / static_cast<Real>(kTriangle));
    }
    return static_cast<double>(value + static_cast<Real>(jump));
  };
  return real == CReal::twofold ? sum(plan.bases[input])
                                : sum(static_cast<float>(plan.bases[input]));
}

/// Ticks that are not compared, since a long memory must receive its inputs before the estimator uses the model.
/// @param value_at the raw inputs of a tick @returns 0 for other models, also if it is not used within `kLongestStart`
template <class ValueAt>
std::uint32_t start_of(BasicEstimator<AnyModel> estimator, std::size_t inputs,
                       const ValueAt& value_at) {
  std::vector<double> raw(inputs);
  for (std::uint32_t tick = 0; tick < kLongestStart; ++tick) {
    for (std::size_t i = 0; i < inputs; ++i) raw[i] = value_at(i, tick);
    if (estimator.step(raw).fault == Fault::none) return tick < kMissing ? 0 : tick;
  }
  return 0;
}

/// The declaration of a raw input in a tick, as `given_at`.
std::string input_text(const CText& c, const TestMotions& plan, const std::vector<CInput>& inputs,
                       std::size_t input) {
  const bool is_counted = inputs[input].is_counted();
  std::string text =
      is_counted ? fmt::format("    int32_t in_{} = {:.0f}", input, plan.bases[input])
                 : c.filled("    @real in_$I$ = $BASE$", {{"I", fmt::format("{}", input)},
                                                          {"BASE", c.number(plan.bases[input])}});
  for (const TestMotion& motion : plan.motions) {
    const double amplitude = motion.amplitudes[input];
    if (amplitude == 0.0) continue;
    const std::string at = c.filled("@triangle(tick, $STEP$)", {{"STEP", counted(motion.step)}});
    text += is_counted ? fmt::format(" + {:.0f} * {}", amplitude / kTriangle, at)
                       : c.filled(" + $AMPLITUDE$ * ((@real)$AT$ / (@real)$TRIANGLE$)",
                                  {{"AMPLITUDE", c.number(amplitude)},
                                   {"AT", at},
                                   {"TRIANGLE", fmt::format("{}", kTriangle)}});
  }
  return text + ";\n";
}

}  // namespace

std::string self_test_text(const CText& c, const ModelFile& model,
                           const std::vector<CInput>& inputs) {
  const TestMotions plan = MotionPlan(model.settings, inputs).make();
  BasicEstimator<AnyModel> estimator(model.settings, AnyModel(model.parameters));
  for (const std::string& channel : model.settings.zeroed_channels)
    estimator.set_zero(channel, 0.0);
  const bool has_real =
      std::ranges::any_of(inputs, [](const CInput& input) { return !input.is_counted(); });
  std::vector<double> raw(inputs.size());
  const std::uint32_t start =
      start_of(estimator, inputs.size(), [&](std::size_t i, std::uint32_t tick) {
        return given_at(plan, i, inputs[i], tick, c.real(), false);
      });
  std::string values;
  std::string faults;
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (std::uint32_t tick = 0; tick < start + kTicks; ++tick) {
    const bool is_missing =
        has_real && (tick == start + kMissing || (tick >= start + kGap && tick < start + kGapEnd));
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      raw[i] = given_at(plan, i, inputs[i], tick, c.real(), tick == start + kJump && i == 0);
      if (is_missing && !inputs[i].is_counted()) raw[i] = std::numeric_limits<double>::quiet_NaN();
    }
    const Estimate estimate = estimator.step(raw);
    lowest = std::min(lowest, estimate.value);
    highest = std::max(highest, estimate.value);
    if (tick < start || (tick - start) % kEvery != kEvery - 1) continue;
    values += (values.empty() ? "" : ", ") + c.number(estimate.value);
    faults += fmt::format("{}{}", faults.empty() ? "" : ", ", static_cast<int>(estimate.fault));
  }
  std::string arguments;
  std::string body;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    arguments += fmt::format(", in_{}", i);
    body += input_text(c, plan, inputs, i);
  }
  if (const double jump = jump_of(plan); jump != 0.0)
    body += c.filled("    if (tick == $TICK$) in_0 += $AMPLITUDE$;\n",
                     {{"TICK", counted(start + kJump)},
                      {"AMPLITUDE", inputs.front().is_counted() ? fmt::format("{:.0f}", jump)
                                                                : c.number(jump)}});
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
    if ($UNUSED$(tick - $START$) % $EVERY$ != $EVERY$ - 1U) continue;
    apart = estimate.value - @expected[(tick - $START$) / $EVERY$];
    if (apart < (@real)0) apart = -apart;
    if (!(apart <= worst)) worst = apart;
    if (estimate.fault != (int)@expected_fault[(tick - $START$) / $EVERY$]) return (@real)1000;
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
       {"TICKS", counted(start + kTicks)},
       {"START", counted(start)},
       {"UNUSED", start == 0 ? std::string() : fmt::format("tick < {} || ", counted(start))},
       {"BODY", body},
       {"MISSING",
        missing.empty()
            ? ""
            : fmt::format("    if (tick == {} || (tick >= {} && tick < {})) {{\n{}    }}\n",
                          counted(start + kMissing), counted(start + kGap),
                          counted(start + kGapEnd), missing)},
       {"ARGUMENTS", arguments},
       {"EVERY", counted(kEvery)},
       {"PER_RANGE", c.number(1.0 / range)}});
}

}  // namespace torsio
