#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "safety/monitor_fixture.hpp"
#include "support/any_number.hpp"
#include "torsio/core/random.hpp"

namespace torsio::test {
namespace {

// Whatever number of any input is NaN in whatever tick: a stop if it watches, no arming if it does
// not.
RC_GTEST_PROP(Monitor, NeverWatchesWithNaN, ()) {
  Random random = any_random();
  MonitorSettings settings = joint();
  settings.longest_loss_s = 0.0;
  settings.longest_fault_s = 0.0;
  settings.persistence_s = 0.0;
  Loop loop(settings);
  bool watching = random.uniform() < 0.5;
  if (watching) loop.start();
  loop.step_for(static_cast<int>(100.0 * random.uniform()));
  const auto place = static_cast<std::size_t>(10.0 * random.uniform());
  if (place < 3) loop.sources[place].value = kNaN;
  if (place >= 3 && place < 6) loop.sources[place - 3].std_dev = kNaN;
  if (place >= 6 && place < 9) loop.signals[place - 6].value = kNaN;
  if (place == 9) loop.t_s = kNaN;
  (void)loop.step();
  RC_ASSERT(!loop.monitor.is_watching());
  RC_ASSERT(watching == (loop.monitor.state() == State::stopped));
  RC_ASSERT(!loop.monitor.arm(1e9));
}

// The same with the default settings, for NaN that lasts: NaN in any number but a novelty.
RC_GTEST_PROP(Monitor, StopsOnNaNWithTheDefaultSettings, ()) {
  Random random = any_random();
  Loop loop;
  const bool watching = random.uniform() < 0.5;
  if (watching) loop.start();
  loop.step_for(static_cast<int>(40.0 * random.uniform()));
  const auto place = static_cast<std::size_t>(13.0 * random.uniform());
  if (place < 3) loop.sources[place].value = kNaN;
  if (place >= 3 && place < 6) loop.sources[place - 3].std_dev = kNaN;
  if (place >= 6 && place < 9) loop.signals[place - 6].value = kNaN;
  if (place >= 9 && place < 12) loop.signals[place - 9].age_s = kNaN;
  const std::size_t most = place < 3 ? 501 : place < 6 ? 16 : 1;
  for (std::size_t n = 0; n < most; ++n) (void)loop.step(place == 12 ? kNaN : kPeriod_s);
  RC_ASSERT(!loop.monitor.is_watching());
  RC_ASSERT(watching == (loop.monitor.state() == State::stopped));
  RC_ASSERT(!loop.monitor.arm(loop.t_s));
}

// 10^4 ticks of anything: what was stopped watches again only after a reset, a proof and an arming
// with a command written since.
RC_GTEST_PROP(Monitor, IsLatchedUnderAnyInputs, ()) {
  Random random = any_random();
  Loop loop;
  double reset_s = -kInfinity;
  bool was_reset = true;
  double silent_s = 0.0;
  State last = State::unproven;
  const auto any = [&] {
    constexpr std::array kNumbers{kNaN, kInfinity, -kInfinity, 0.0, -1.0, 30.0, 1e200};
    return kNumbers[random.below(kNumbers.size())];
  };
  int disturbed = 0;  // ticks for which this disturbance lasts
  for (int n = 0; n < 10'000; ++n) {
    if (disturbed > 0 && --disturbed == 0) {
      for (Estimate& source : loop.sources) source = {.value = 0.0, .std_dev = 0.1};
      for (SignalSample& sample : loop.signals) sample = {.value = 0.0};
      loop.signals[2].value = 300.0;
    }
    if (disturbed == 0 && random.uniform() < 0.004) {
      disturbed = 1 + static_cast<int>(random.below(20));
      const std::size_t which = random.below(3);
      switch (random.below(5)) {
        case 0: loop.sources[which].value = any(); break;
        case 1: loop.sources[which].std_dev = any(); break;
        case 2:
          loop.sources[which].fault =
              random.uniform() < 0.5 ? Fault::input_not_finite : Fault::outside_training_range;
          break;
        case 3: loop.signals[which].value = any(); break;
        default: loop.signals[which].age_s = any(); break;
      }
    }
    const bool is_bad = std::ranges::any_of(
        loop.signals, [](const SignalSample& of) { return !std::isfinite(of.value); });
    if (random.uniform() < 0.001) loop.monitor.stop(loop.t_s);
    if (random.uniform() < 0.02) {
      reset_s = loop.t_s;
      loop.monitor.reset(loop.t_s);
      was_reset = true;
      silent_s = 0.0;
      last = State::unproven;
    }
    if (random.uniform() < 0.2) {
      const double written_s = loop.t_s + 0.05 * (random.uniform() - 0.5);
      const bool is_fresh = written_s > reset_s && written_s <= loop.t_s + kPeriod_s;
      const bool may = last == State::watching || (last == State::ready && is_fresh);
      RC_ASSERT(loop.monitor.arm(written_s) == (may && loop.monitor.state() != State::stopped));
    }
    const bool was_watching = loop.monitor.is_watching();
    const bool was_stopped = loop.monitor.state() == State::stopped;
    const double period_s = random.uniform() < 0.002 ? random.uniform() * 0.1 : kPeriod_s;
    last = loop.step(period_s);
    silent_s = loop.monitor.active() == 0 ? silent_s + period_s : 0.0;
    if (was_stopped) {
      RC_ASSERT(last == State::stopped);
      was_reset = false;
    }
    if (last == State::watching) RC_ASSERT(was_watching && was_reset);
    if (last == State::ready) RC_ASSERT(silent_s >= 0.05 - 1e-9);
    if (was_watching && is_bad) RC_ASSERT(last == State::stopped);
  }
}

}  // namespace
}  // namespace torsio::test
