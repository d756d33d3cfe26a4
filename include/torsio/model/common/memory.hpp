#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// The ranges of a model's inputs in training, in the order of its inputs.
struct InputRanges {
  std::span<const double> lowest;
  std::span<const double> highest;

  [[nodiscard]] double width(std::size_t input) const noexcept {
    return highest[input] - lowest[input];
  }
  [[nodiscard]] double largest_magnitude(std::size_t input) const noexcept {
    return std::max(std::abs(lowest[input]), std::abs(highest[input]));
  }
};

/// A part of a model's memory that decays with time.
struct Relaxation {
  /// Largest contribution to the output for inputs within their ranges [target's unit].
  double gain = 0.0;
  double time_constant_s = 0.0;
  std::size_t input = 0;  ///< whose past it is; only how far the first one moved unseen is limited
};

/// A part of a model's memory that depends on the travel of an input: a stop or play operator.
struct SlipMemory {
  /// Error of the output per travel that is unknown [target's unit over the input's].
  double gain = 0.0;
  /// The history is erased when the input has covered a range of this width.
  double travel = 0.0;
  std::size_t input = 0;  ///< which input of the model
  /// 0: the travel is that of the input. Else the input is a rate, and the travel that of its integral
  /// over time: this many seconds per sample.
  double period_s = 0.0;
};

/// What the output of a model depends on besides the present inputs. The estimator computes from it
/// how large the error of the output can be after some inputs could not be used.
struct ModelMemory {
  std::vector<Relaxation> relaxations = {};
  std::vector<SlipMemory> slips = {};
  /// False: the memory has another form (a hidden state, fed-back outputs). After unusable inputs the
  /// model is reset and runs for the warm-up time that its fit has measured.
  bool is_declared = true;

  [[nodiscard]] bool is_empty() const noexcept {
    return is_declared && relaxations.empty() && slips.empty();
  }
};

/// A model that depends on past inputs; one without this member depends on the present ones only.
template <class M>
concept HasMemory = requires(const M& model, const InputRanges& ranges) {
  { model.memory(ranges) } -> std::same_as<ModelMemory>;
};

namespace detail {

template <class M>
[[nodiscard]] ModelMemory memory_of(const M& model, const InputRanges& ranges) {
  if constexpr (HasMemory<M>) {
    return model.memory(ranges);
  } else {
    return {};
  }
}

/// The state of a model for `StateBytes`; that of a model with memory that does not list it is refused.
template <class M>
void visit_state_of(M& model, StateBytes& bytes) noexcept {
  if constexpr (HasStateBytes<M>) {
    model.visit_state(bytes);
  } else if constexpr (HasMemory<M> || HasState<M> || FeedsBack<M>) {
    bytes.fail();
  }
}

/// Differs for the states of different models: family and, where they list their fields, parameters.
template <class M>
[[nodiscard]] std::uint64_t state_identity_of(const M& model) noexcept {
  if constexpr (requires { model.state_identity(); }) {
    return model.state_identity();
  } else {
    StateHash hash;
    hash.add(model.input_count());
    hash.add(model.parameter_count());
    if constexpr (requires { M::kFamily; }) hash.add(std::string_view(M::kFamily));
    if constexpr (requires(const typename M::Parameters& own) {
                    M::Parameters::visit_fields(own, [](std::string_view, auto&) {});
                  })
      hash.add_value(model.parameters());
    return hash.value();
  }
}

}  // namespace detail

}  // namespace torsio
