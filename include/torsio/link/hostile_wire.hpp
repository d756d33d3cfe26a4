#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "torsio/core/random.hpp"

namespace torsio {

/// One direction of a line that delays, reorders, drops, duplicates, damages, splits and joins what is sent: for tests of
/// hosts and joints. Seeded, without a clock of its own: the same calls give the same bytes. Uses the heap.
///
///     wire.send(frame, now_ns);
///     wire.take(now_ns, [&](std::span<const std::uint8_t> bytes) { joint.receive(bytes, now_ns); });
class HostileWire {
 public:
  /// Each share is the probability for a frame.
  struct Settings {
    double dropped = 0.1;
    double doubled = 0.15;
    double damaged = 0.05;        ///< one bit
    double truncated = 0.02;      ///< its end is lost
    double lengthened = 0.02;     ///< a byte is inserted
    double usual_delay_s = 3e-3;  ///< at most
    double slow = 0.1;            ///< delayed by up to longest_delay_s, so that others overtake it
    double longest_delay_s = 0.2;
    double split = 0.3;  ///< that an end of what has arrived comes with the next
  };
  struct Counts {
    std::uint64_t sent = 0;
    std::uint64_t dropped = 0;
    std::uint64_t doubled = 0;
    std::uint64_t damaged = 0;  ///< truncated and lengthened ones included
    std::uint64_t delivered = 0;
  };

  /// @throws Error if a share is not in 0 to 1, or a delay is negative.
  HostileWire(const Settings& settings, std::uint64_t seed);

  void send(std::span<const std::uint8_t> frame, std::uint64_t now_ns);
  /// Calls visit(bytes) for what has arrived by now, joined, and cut at random places.
  template <class Visit>
  void take(std::uint64_t now_ns, const Visit& visit) {
    if (!collect(now_ns)) return;
    const std::size_t cut = random_.below(joined_.size() + 1);
    visit(std::span<const std::uint8_t>(joined_).first(cut));
    if (random_.uniform() < settings_.split) {
      joined_.erase(joined_.begin(), joined_.begin() + static_cast<std::ptrdiff_t>(cut));
      return;
    }
    visit(std::span<const std::uint8_t>(joined_).subspan(cut));
    joined_.clear();
  }
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  struct Frame {
    std::uint64_t due_ns = 0;
    std::uint64_t order = 0;
    std::vector<std::uint8_t> bytes = {};
  };
  static bool is_later(const Frame& one, const Frame& other) noexcept {
    return one.due_ns != other.due_ns ? one.due_ns > other.due_ns : one.order > other.order;
  }
  void damage(std::vector<std::uint8_t>& bytes);
  [[nodiscard]] bool collect(std::uint64_t now_ns);

  Settings settings_;
  Random random_;
  std::vector<Frame> frames_ = {};  ///< a heap by `is_later`
  std::vector<std::vector<std::uint8_t>> unused_ = {};
  std::vector<std::uint8_t> joined_ = {};
  Counts counts_ = {};
};

}  // namespace torsio
