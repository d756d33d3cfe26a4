#include <algorithm>
#include <cmath>

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
  first_rms_ = 0.0;
}

bool MovingComparison::step(double first_square, double second_square) noexcept {
  current_.first += first_square;
  current_.second += second_square;
  current_.count += 1.0;
  return end_tick();
}

bool MovingComparison::pass() noexcept { return end_tick(); }

bool MovingComparison::end_tick() noexcept {
  if (++ticks_ < block_ticks_) return false;
  const bool has_measurements = current_.count > 0.0;
  blocks_[next_] = current_;
  current_ = {};
  ticks_ = 0;
  next_ = (next_ + 1) % kBlocks;
  filled_ = std::min(filled_ + 1, kBlocks);
  Sums total;
  for (std::size_t block = 0; block < filled_; ++block) {
    total.first += blocks_[block].first;
    total.second += blocks_[block].second;
    total.count += blocks_[block].count;
  }
  if (has_measurements) first_rms_ = std::sqrt(total.first / total.count);
  return filled_ == kBlocks && total.first > total.second;
}

}  // namespace torsio::detail
