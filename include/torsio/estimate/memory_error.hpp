#pragma once

#include <cstddef>
#include <vector>

#include "torsio/core/not_measured.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/common/memory.hpp"

namespace torsio::detail {

/// Bounds the error of a model's output that is caused by inputs that its memory did not receive,
/// because they were missing or outside their range. The model is not stepped with such inputs. The
/// first input is assumed to have remained within its range of width W meanwhile, and to have moved
/// away from its values before and after by no more than the share s of W.
///
///     relaxation: e = g u,  u <- s - (s - u) exp(-t / T) during t without inputs, u <- u exp(-t / T) with
///     slip:       e = g max(0, min(travel, W, U) - c),  U = s W, c the range covered since then
///
/// A memory that is not declared has no bound until the warm-up time has passed after the reset.
class MemoryError {
 public:
  /// @param memory of the model
  /// @param width W of the first input
  /// @param warm_up_s of a memory that is not declared; NaN: only `reset()` ends its recovery
  MemoryError(ModelMemory memory, double width, double sample_period_s, double warm_up_s);

  [[nodiscard]] const ModelMemory& memory() const noexcept { return memory_; }
  /// Whether the memory has received all inputs, as far as its output shows.
  [[nodiscard]] bool is_zero() const noexcept { return is_zero_; }
  /// The bound [target's unit]; infinity where there is none.
  [[nodiscard]] double bound() const noexcept { return bound_; }
  /// Whether the error may be larger than this error bar; NaN, an unknown one, counts as 0.
  [[nodiscard]] bool may_exceed(double error_bar) const noexcept {
    return !is_zero_ && !(bound_ <= error_bar);
  }

  void reset() noexcept;
  /// So many ticks passed without usable inputs. Successive calls without a usable tick between them
  /// are one interruption. @param share s of the whole interruption, 0 to 1
  void interrupt(double ticks, double share = 1.0) noexcept TORSIO_REALTIME;
  /// The memory itself is lost: the model was reset because its output was not finite.
  void lose() noexcept TORSIO_REALTIME;
  /// One tick with usable inputs.
  void follow(double first_input) noexcept TORSIO_REALTIME {
    if (!is_zero_) advance(first_input);
  }

 private:
  void advance(double first_input) noexcept;
  void update_bound() noexcept;

  ModelMemory memory_;
  double width_;
  double warm_up_ticks_;         ///< NaN: without end
  std::vector<double> decay_;    ///< exp(-h / T)
  std::vector<double> share_;    ///< u
  double unknown_travel_ = 0.0;  ///< U
  double travel_before_ = 0.0;   ///< U less c at the beginning of this interruption
  double lowest_ = 0.0;          ///< the first input since the last interruption
  double highest_ = 0.0;
  double ticks_left_ = 0.0;  ///< to the end of the warm-up
  double negligible_;        ///< a bound below this is 0
  double bound_ = 0.0;
  bool is_zero_ = true;
};

}  // namespace torsio::detail
