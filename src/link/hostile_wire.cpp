#include "torsio/link/hostile_wire.hpp"

#include <algorithm>
#include <utility>

#include "core/checks.hpp"

namespace torsio {

HostileWire::HostileWire(const Settings& settings, std::uint64_t seed)
    : settings_(settings), random_(seed) {
  for (const double share :
       {settings.dropped, settings.doubled, settings.damaged, settings.truncated,
        settings.lengthened, settings.slow, settings.split})
    require(share >= 0.0 && share <= 1.0, "hostile wire", "shares of 0 to 1", share);
  require_not_negative("hostile wire", "usual_delay_s", settings.usual_delay_s);
  require_not_negative("hostile wire", "longest_delay_s", settings.longest_delay_s);
}

void HostileWire::damage(std::vector<std::uint8_t>& bytes) {
  bool is_damaged = false;
  if (random_.uniform() < settings_.damaged) {
    bytes[random_.below(bytes.size())] ^= static_cast<std::uint8_t>(1U << random_.below(8));
    is_damaged = true;
  }
  if (random_.uniform() < settings_.truncated) {
    bytes.resize(random_.below(bytes.size()) + 1);
    is_damaged = true;
  }
  if (random_.uniform() < settings_.lengthened) {
    const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(random_.below(bytes.size()));
    bytes.insert(at, static_cast<std::uint8_t>(random_.below(256)));
    is_damaged = true;
  }
  counts_.damaged += is_damaged ? 1U : 0U;
}

void HostileWire::send(std::span<const std::uint8_t> frame, std::uint64_t now_ns) {
  ++counts_.sent;
  if (frame.empty() || random_.uniform() < settings_.dropped) {
    ++counts_.dropped;
    return;
  }
  const bool is_doubled = random_.uniform() < settings_.doubled;
  counts_.doubled += is_doubled ? 1U : 0U;
  for (int copies = is_doubled ? 2 : 1; copies > 0; --copies) {
    Frame made;
    if (!unused_.empty()) {
      made.bytes = std::move(unused_.back());
      unused_.pop_back();
    }
    made.bytes.assign(frame.begin(), frame.end());
    damage(made.bytes);
    const bool is_slow = random_.uniform() < settings_.slow;
    const double delay_s =
        random_.uniform() * (is_slow ? settings_.longest_delay_s : settings_.usual_delay_s);
    made.due_ns = now_ns + static_cast<std::uint64_t>(1e9 * delay_s);
    made.order = counts_.delivered++;
    frames_.push_back(std::move(made));
    std::ranges::push_heap(frames_, is_later);
  }
}

/// @returns whether bytes have arrived, now or before
bool HostileWire::collect(std::uint64_t now_ns) {
  while (!frames_.empty() && frames_.front().due_ns <= now_ns) {
    std::ranges::pop_heap(frames_, is_later);
    std::vector<std::uint8_t>& bytes = frames_.back().bytes;
    joined_.insert(joined_.end(), bytes.begin(), bytes.end());
    unused_.push_back(std::move(bytes));
    frames_.pop_back();
  }
  return !joined_.empty();
}

}  // namespace torsio
