#include "torsio/link/frame_counters.hpp"

#include <algorithm>

namespace torsio {
namespace {

std::uint16_t pair_key(std::uint8_t sender, std::uint8_t receiver) noexcept {
  return static_cast<std::uint16_t>(static_cast<unsigned>(sender) << 8U | receiver);
}

}  // namespace

const ReceivedFrames::Entry* ReceivedFrames::find(std::uint16_t key) const noexcept {
  const auto* const end = entries_.data() + count_;
  const auto* const found =
      std::find_if(entries_.data(), end, [&](const Entry& entry) { return entry.key == key; });
  return found == end ? nullptr : found;
}

void ReceivedFrames::add(std::uint8_t sender, std::uint8_t receiver,
                         std::uint8_t counter) noexcept {
  const std::uint16_t key = pair_key(sender, receiver);
  auto* entry = const_cast<Entry*>(find(key));
  if (entry == nullptr) {
    if (count_ == kPairs) {
      ++untracked_;
      return;
    }
    entry = &entries_[count_++];
    *entry = {.key = key, .last = counter, .pair = {.received = 1}};
    return;
  }
  Pair& pair = entry->pair;
  ++pair.received;
  const auto ahead = static_cast<std::uint8_t>(counter - entry->last);
  if (ahead == 0) {
    ++pair.repeated;
  } else if (ahead < 128) {
    pair.lost += ahead - 1U;
    entry->last = counter;
    entry->has_late = false;
  } else if (entry->has_late && counter == static_cast<std::uint8_t>(entry->last_late + 1U)) {
    ++pair.restarts;
    entry->last = counter;
    entry->has_late = false;
  } else {
    ++pair.late;
    entry->last_late = counter;
    entry->has_late = true;
  }
}

ReceivedFrames::Pair ReceivedFrames::pair(std::uint8_t sender,
                                          std::uint8_t receiver) const noexcept {
  const Entry* const entry = find(pair_key(sender, receiver));
  return entry == nullptr ? Pair{} : entry->pair;
}

ReceivedFrames::Pair ReceivedFrames::total() const noexcept {
  Pair sum;
  for (std::size_t k = 0; k < count_; ++k) {
    const Pair& pair = entries_[k].pair;
    sum.received += pair.received;
    sum.lost += pair.lost;
    sum.repeated += pair.repeated;
    sum.late += pair.late;
    sum.restarts += pair.restarts;
  }
  return sum;
}

}  // namespace torsio
