#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <span>

#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"

namespace torsio {

/// The inputs of one tick, in the order that the model's own `inputs` list names.
using Features = std::span<const double>;

/// The interface of every model family; tests/laws checks its meaning.
///
/// `M::Parameters` is plain data with everything that `step` needs; constructing from it checks it
/// and may throw `Error`. `step` may assume `input_count()` finite features (the estimator ensures
/// both) and never allocates, locks or throws.
template <class M>
concept Model = std::copyable<M> && requires(M model, const M fixed, Features features) {
  typename M::Parameters;
  M(fixed.parameters());
  { fixed.input_count() } noexcept -> std::same_as<std::size_t>;
  { fixed.parameter_count() } noexcept -> std::same_as<std::size_t>;
  { model.reset() } noexcept;
  { model.step(features) } noexcept -> std::same_as<Estimate>;
};

/// A model whose memory is a few interpretable numbers (a creep, a bristle, a position), so that a
/// run may start from any state. `set_state` takes as many numbers as `state` has, limits them to
/// their bounds (a force above its slip limit) and ignores those that are not finite; after
/// `reset()` the state is that of a joint at rest.
template <class M>
concept HasState = Model<M> && requires(M model, const M fixed, std::span<const double> state) {
  { fixed.state() } noexcept -> std::same_as<std::span<const double>>;
  { model.set_state(state) } noexcept;
};

/// A model with memory whose state can be saved as bytes (`BasicEstimator::save`): it lists every member
/// that a step changes and a later step reads. A model without memory needs no such list.
template <class M>
concept HasStateBytes = Model<M> && requires(M model, detail::StateBytes& bytes) {
  { model.visit_state(bytes) } noexcept;
};

/// A model that feeds its own past output back: its output depends on its earlier outputs.
template <class M>
concept FeedsBack = Model<M> && requires(M model, double measured) {
  { model.correct(measured) } noexcept;
};

/// A model whose memory can be moved without computing the output: after `advance` it is as after `step`.
/// Returns whether the memory is finite.
template <class M>
concept Advances = requires(M& model, Features features) {
  { model.advance(features) } noexcept -> std::same_as<bool>;
};

/// A model that can be inverted: from the target to its first input, whose value in `features` is at
/// most where a search starts. `invert` returns a finite value in every case; it may need scratch
/// space, so it is not const.
template <class M>
concept Invertible = requires(M& model, double target, Features features) {
  { model.invert(target, features) } noexcept -> std::same_as<Estimate>;
};

/// A network whose last layer can be adapted: it provides the input of that layer in the last step.
template <class M>
concept HasLastLayer = requires(const M& model) {
  { model.last_layer_input() } noexcept -> std::same_as<std::span<const float>>;
};

namespace detail {

/// Where a model has no inverse: the given first input, or 0 where that is not a number.
[[nodiscard]] inline Estimate no_inverse(Features features) noexcept {
  return {.value = std::isfinite(features[0]) ? features[0] : 0.0,
          .fault = Fault::model_not_finite};
}

}  // namespace detail

}  // namespace torsio
