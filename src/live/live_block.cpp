#include "live/live_block.hpp"

#include <bit>
#include <limits>

namespace torsio {
namespace {

template <class Unsigned>
void append(std::vector<std::uint8_t>& bytes, Unsigned number) {
  for (std::size_t i = 0; i < sizeof number; ++i)
    bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
}

}  // namespace

void LiveBlock::add(std::uint64_t number, std::span<const double> values) {
  if (number < next_) return;
  const std::uint64_t missing = number - next_;
  if (count_ == 0 || missing + count_ >= longest_) {
    clear();
    first_ = number;
  } else {
    const std::size_t gaps = static_cast<std::size_t>(missing);
    rows_.insert(rows_.end(), gaps * channels_, std::numeric_limits<float>::quiet_NaN());
    count_ += gaps;
  }
  for (std::size_t j = 0; j < channels_; ++j) {
    const double value = j < values.size() ? values[j] : std::numeric_limits<double>::quiet_NaN();
    rows_.push_back(static_cast<float>(value));
  }
  ++count_;
  next_ = number + 1;
}

void LiveBlock::append_to(std::vector<std::uint8_t>& message, std::uint16_t joint) {
  message.reserve(message.size() + 16 + 4 * rows_.size());
  append(message, joint);
  append(message, static_cast<std::uint16_t>(channels_));
  append(message, static_cast<std::uint32_t>(count_));
  append(message, std::bit_cast<std::uint64_t>(static_cast<double>(first_)));
  for (std::size_t j = 0; j < channels_; ++j)
    for (std::size_t i = 0; i < count_; ++i)
      append(message, std::bit_cast<std::uint32_t>(rows_[i * channels_ + j]));
  clear();
}

}  // namespace torsio
