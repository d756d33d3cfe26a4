#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "torsio/core/not_measured.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
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
/// How far other inputs moved meanwhile is not known: s = 1 for relaxations over them, U = W = travel for
/// slips over them or their integrals, c the range that these have covered since. Where they were only
/// limited, s and U are what was cut off.
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
  /// @param others whether the other inputs were missed, too
  void interrupt(double ticks, double share = 1.0, bool others = true) noexcept TORSIO_REALTIME;
  /// At this tick the memory received other values of the inputs than the first: they were limited.
  /// @param missed |input - limited input|, one per input; the first is not looked at
  /// @param widths of the inputs' ranges
  void miss_others(std::span<const double> missed,
                   std::span<const double> widths) noexcept TORSIO_REALTIME;
  /// The memory itself is lost: the model was reset because its output was not finite.
  void lose() noexcept TORSIO_REALTIME;
  /// One tick with usable inputs.
  void follow(std::span<const double> inputs) noexcept TORSIO_REALTIME {
    if (!is_zero_) advance(inputs);
  }

  /// The members that change in a step.
  void visit_state(StateBytes& bytes) noexcept {
    bytes.visit(share_, unknown_travel_, travel_before_, lowest_, highest_, others_, ticks_left_,
                bound_, is_zero_);
  }

 private:
  /// The travel of another input, or of its integral, since it was missed.
  struct Travel {
    [[nodiscard]] double left() const noexcept;
    void visit_state(StateBytes& bytes) noexcept {
      bytes.visit(position, lowest, highest, unknown);
    }

    double position = 0.0;
    double lowest = 0.0;
    double highest = 0.0;
    double unknown = 0.0;  ///< U
  };

  void advance(std::span<const double> inputs) noexcept;
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
  std::vector<Travel> others_;  ///< one for each slip; those of the first input are not used
  double ticks_left_ = 0.0;     ///< to the end of the warm-up
  double negligible_;           ///< a bound below this is 0
  double bound_ = 0.0;
  bool is_zero_ = true;
};

}  // namespace torsio::detail
