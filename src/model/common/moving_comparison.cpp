#include <algorithm>

#include "torsio/model/common/model_adapter.hpp"

namespace torsio::detail {
namespace {

constexpr std::size_t kBlocks = 100;

}  // namespace

MovingComparison::MovingComparison(std::size_t ticks)
    : blocks_(kBlocks), block_ticks_(std::max<std::size_t>(1, (ticks + kBlocks - 1) / kBlocks)) {}

void MovingComparison::reset() noexcept {
  current_ = {};
  ticks_ = filled_ = next_ = 0;
}

bool MovingComparison::step(double first_square, double second_square) noexcept {
  current_.first += first_square;
  current_.second += second_square;
  if (++ticks_ < block_ticks_) return false;
  blocks_[next_] = current_;
  current_ = {};
  ticks_ = 0;
  next_ = (next_ + 1) % kBlocks;
  filled_ = std::min(filled_ + 1, kBlocks);
  if (filled_ < kBlocks) return false;
  Sums total;
  for (const Sums& block : blocks_) {
    total.first += block.first;
    total.second += block.second;
  }
  return total.first > total.second;
}

}  // namespace torsio::detail
