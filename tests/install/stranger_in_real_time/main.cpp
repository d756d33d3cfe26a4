#include <array>
#include <cstdio>
#include <exception>

#include "torsio/realtime/realtime_loop.hpp"
#include "torsio/realtime/recorder.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    torsio::Recorder recorder(argv[1], {.channels = {"lateness_s"}});
    torsio::RealtimeLoop loop({.priority = 0, .lock_memory = false});
    loop.run([&](const torsio::Tick& tick) noexcept {
      recorder.push(tick.index, std::array{1e-9 * static_cast<double>(tick.lateness_ns)});
      return tick.index < 10;
    });
    return recorder.close().frames > 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
