#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"

namespace torsio {

/// A channel that is computed from others:
/// `{"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"}`.
struct ChannelDefinition {
  std::string name;
  std::string expression;
  bool operator==(const ChannelDefinition&) const = default;
};

/// The inputs of a model and how they are computed from raw channels. Plain data: it is stored
/// unchanged in the model file.
struct FeatureSpec {
  std::vector<std::string> inputs;  ///< one expression each, causal (see docs/use/expressions.md)
  std::vector<ChannelDefinition>
      definitions;  ///< names that an expression may use besides raw channels
  bool operator==(const FeatureSpec&) const = default;
};

struct PipelineListing;

/// Raw channels of one tick -> features of one tick. Parsed once; `step` allocates nothing.
///
/// An expression is built from channel names, numbers (a unit may follow: `10Hz`, `0.3deg`),
/// `+ - * / ^`, parentheses and the functions `rate lowpass lag stop dahl sign tanh sin cos atan abs sqrt
/// exp min max`.
/// Equal sub-expressions are evaluated once. `rate(x)` is the backward difference over one sample,
/// `lowpass(x, f)` a second-order Butterworth filter re-discretised for the sample rate that starts
/// in the steady state of its first input, `lag(x, n)` the value n samples ago (before there is
/// one, the oldest), `stop(x, r)` the stop operator s <- clip(s + change of x, +-r) that starts at 0,
/// `dahl(x, d)` the friction of Dahl over its level. docs/use/expressions.md describes the whole language.
///
/// Finite raw values can still give a feature that is not finite (`x / y`). Its effect is limited:
/// a low-pass returns it without changing its state, a rate is finite again one sample later, a lag
/// n samples later.
class FeaturePipeline {
 public:
  /// @throws Error naming the expression and the column in it if one cannot be parsed, names
  /// itself, or filters at or above half the sample rate; UsageError if that rate is not positive.
  FeaturePipeline(FeatureSpec spec, double sample_rate_Hz);
  FeaturePipeline(const FeaturePipeline& other);
  FeaturePipeline(FeaturePipeline&& other) noexcept;
  FeaturePipeline& operator=(FeaturePipeline other) noexcept;
  ~FeaturePipeline();

  [[nodiscard]] const FeatureSpec& spec() const noexcept;
  [[nodiscard]] double sample_rate_Hz() const noexcept;
  [[nodiscard]] std::size_t feature_count() const noexcept;

  /// The channels that `step` requires, in this order: those of the expressions after all
  /// definitions are substituted.
  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept;

  /// Whether a feature is a rate of motion: it uses channels only inside `rate(...)` or channels
  /// (raw or defined) that are rates by their unit (`_rad_s`, `_m_s`).
  [[nodiscard]] bool is_rate(std::size_t feature) const noexcept;

  /// Subtracts `value` (SI) from a raw channel from now on; call while configuring.
  /// @returns whether it was another value. @throws UsageError for an unknown channel.
  bool set_zero(std::string_view channel, double value);

  /// Samples after `reset()` until every difference, lag and filter has settled (to 1 % of a step):
  /// the features of that step are the first that may be used. 0 if nothing has a memory.
  [[nodiscard]] std::size_t settling_samples() const noexcept;

  void reset() noexcept;

  /// @param raw one value for each of `raw_inputs()`, all finite.
  /// @returns the features, valid until the next call.
  std::span<const double> step(std::span<const double> raw) noexcept TORSIO_REALTIME;

  /// Whether `settling_samples()` steps were made since `reset()`.
  [[nodiscard]] bool are_filters_settled() const noexcept;
  /// Whether the states of `stop` and `dahl` have forgotten those at `reset()`, too.
  [[nodiscard]] bool is_settled() const noexcept;
  /// The largest error of each feature that the unknown states of `stop` and `dahl` at `reset()` can cause:
  /// what is left of a state is bounded, and each operation is evaluated at the corners of its operands. A
  /// low-pass and a lag are taken as immediate. 0 once it is settled; infinite where there is no bound (the
  /// rate of such a state).
  [[nodiscard]] std::span<const double> state_errors() const noexcept;

  /// What is computed in each step, for what writes it down in another language.
  [[nodiscard]] PipelineListing listing() const;

  /// The members that change in a step; not the zeros.
  void visit_state(detail::StateBytes& bytes) noexcept;

 private:
  struct Program;
  std::unique_ptr<Program> program_;
};

/// The same features at another sample rate: `lag(x, n)` of n samples is as long in time as before. Expressions without
/// such a lag do not change.
/// @throws Error if a lag is not a whole number of samples there.
[[nodiscard]] FeatureSpec at_sample_rate(FeatureSpec spec, double from_Hz, double to_Hz);

/// The channel names that occur in an expression, in order of appearance. @throws Error if it
/// cannot be parsed.
[[nodiscard]] std::vector<std::string> channels_of(std::string_view expression);

/// Splits "a, lowpass(b, 10Hz), c" on the commas outside parentheses and trims the parts.
[[nodiscard]] std::vector<std::string> split_inputs(std::string_view list);

}  // namespace torsio
