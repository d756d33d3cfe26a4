#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace torsio {

/// What a real-time step reports about its own output. The value with it is finite in every case.
enum class Fault : std::uint8_t {
  none,               ///< the value may be used
  input_not_finite,   ///< an input was NaN or infinite; the last good value is held
  input_count_wrong,  ///< the caller passed another number of inputs than `raw_inputs()` lists
  warming_up,         ///< filters, differentiators or hidden state have not settled since `reset()`
  zero_not_set,  ///< a channel whose zero was taken from each training record has none yet (`set_zero`)
  /// An input left its range in training, or jumped; linear fallback, or the model's value without evidence.
  outside_training_range,
  recovering,  ///< the memory of the model has missed inputs that still influence the output; linear fallback
  wrong_rate,        ///< the loop does not run at the sample rate of the estimator; linear fallback
  model_not_finite,  ///< the model produced NaN or infinity; linear fallback in use
  diverged,  ///< a model that feeds its output back left its range and stays at its end; linear fallback
};
inline constexpr std::size_t kFaultCount = static_cast<std::size_t>(Fault::diverged) + 1;

/// The enumerator's own spelling, for logs and JSON.
[[nodiscard]] std::string_view name(Fault fault) noexcept;

}  // namespace torsio
