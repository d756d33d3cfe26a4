#include <algorithm>
#include <cmath>

#include "torsio/model/common/model_adapter.hpp"

namespace torsio::detail {

std::size_t ticks_in(double time_s, double period_s) noexcept {
  constexpr double kMaxTicks = 1e9;
  return static_cast<std::size_t>(std::clamp(std::ceil(time_s / period_s), 1.0, kMaxTicks));
}

MovingComparison::MovingComparison(std::size_t ticks)
    : sums_(std::max<std::size_t>(1, (ticks + kMovingBlocks - 1) / kMovingBlocks)) {}

void MovingComparison::reset() noexcept {
  sums_.reset();
  first_rms_ = 0.0;
}

bool MovingComparison::step(double first_square, double second_square) noexcept {
  sums_.current().add({first_square, second_square, 1.0});
  return pass();
}

bool MovingComparison::pass() noexcept {
  const Sums* const ended = sums_.end_tick();
  if (ended == nullptr) return false;
  const Sums total = sums_.total();
  if (ended->count > 0.0) first_rms_ = std::sqrt(total.first / total.count);
  return sums_.is_full() && total.first > total.second;
}

}  // namespace torsio::detail
