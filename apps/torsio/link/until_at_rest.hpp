#pragma once

#include <cstdint>

#include "torsio/core/error.hpp"
#include "torsio/realtime/realtime_loop.hpp"

/// Repeats a command that a joint refuses while it moves, for at most `longest_s`.
/// @param wait between two tries
/// @throws torsio::Error of the last try.
template <class Command, class Wait>
void until_at_rest(double longest_s, Command command, Wait wait) {
  torsio::MonotonicClock clock;
  const std::int64_t end_ns = clock.now_ns() + static_cast<std::int64_t>(1e9 * longest_s);
  for (;;) {
    try {
      return command();
    } catch (const torsio::Error&) {
      if (clock.now_ns() > end_ns) throw;
    }
    wait();
  }
}
