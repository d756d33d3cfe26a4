#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "torsio/core/realtime.hpp"
#include "torsio/core/time_distance.hpp"

namespace torsio {

/// The latest value that one thread has for another: set-points and gains into a loop, a state
/// out of it. Of the values between two reads only the last is read; nothing is queued.
///
/// One thread writes, one other reads; both are wait-free (one atomic exchange at most). Three
/// slots are exchanged: the writer's, the reader's and one between them, so that neither accesses a
/// value that the other is working on. A reader gets whole values only, and after a value never an
/// older one.
///
/// A mailbox makes a change atomic, not sensible: check gains before they are written.
template <class T>
  requires std::is_trivially_copyable_v<T>
class Mailbox {
 public:
  struct Letter {
    T value{};
    std::uint64_t sequence = 0;   ///< 1 for the first value written; 0: the initial one still
    std::int64_t written_ns = 0;  ///< on the writer's clock, as given to `write`

    /// Absolute time between now and the write: a stamp ahead of the clock is as old as one equally
    /// far in the past, otherwise it would be fresh for ever. Never negative; infinite (the largest
    /// number) if nothing was written yet, because an initial value is not a command.
    [[nodiscard]] std::int64_t age_ns(std::int64_t now_ns) const noexcept {
      return sequence == 0 ? std::numeric_limits<std::int64_t>::max()
                           : detail::distance_ns(now_ns, written_ns);
    }
  };

  /// @param initial what a reader gets before the first write
  explicit Mailbox(const T& initial = T{}) noexcept {
    for (Slot& slot : slots_) slot.letter.value = initial;
  }
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  /// Called by the writing thread. `now_ns`: the time of the value on the clock with which its age
  /// is computed (`MonotonicClock`): the source's time stamp, if it has one.
  void write(const T& value, std::int64_t now_ns) noexcept TORSIO_REALTIME {
    slots_[back_].letter = {.value = value, .sequence = ++written_, .written_ns = now_ns};
    back_ =
        between_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel) &
        kSlot;
  }

  /// Called by the reading thread: the latest value; unchanged until this thread reads again.
  [[nodiscard]] const Letter& read() noexcept TORSIO_REALTIME {
    if ((between_.load(std::memory_order_relaxed) & kFresh) != 0)
      front_ = between_.exchange(front_, std::memory_order_acq_rel) & kSlot;
    return slots_[front_].letter;
  }

 private:
  static constexpr std::size_t kCacheLine = 64;
  static constexpr std::uint8_t kSlot = 3;
  static constexpr std::uint8_t kFresh = 4;  ///< the reader has not taken the middle slot
  static_assert(std::atomic<std::uint8_t>::is_always_lock_free);

  struct alignas(kCacheLine) Slot {
    Letter letter;
  };

  std::array<Slot, 3> slots_{};
  alignas(kCacheLine) std::atomic<std::uint8_t> between_{1};
  alignas(kCacheLine) std::uint8_t back_ = 0;  ///< the writer's
  std::uint64_t written_ = 0;
  alignas(kCacheLine) std::uint8_t front_ = 2;  ///< the reader's
};

}  // namespace torsio
