#include "torsio/safety/command_watchdog.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "support/any_number.hpp"
#include "support/error_message.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::any_random;
using State = CommandWatchdog::State;
using Reason = CommandWatchdog::Reason;

constexpr std::int64_t kTick = 1'000'000;  // ns
constexpr std::int64_t kStart = 5'000'000'000;

/// A loop at 1 kHz around a watchdog.
struct Loop {
  CommandWatchdog dog{CommandWatchdog::Settings{}};
  std::int64_t now_ns = kStart;

  State step(const CommandWatchdog::Command& command, Fault fault = Fault::none) {
    now_ns += kTick;
    return dog.step(now_ns, command, fault);
  }
  State with_fresh_command(Fault fault = Fault::none) {
    return step({.written_ns = now_ns + kTick / 2, .is_valid = true}, fault);
  }
  /// Armed, and driven for a moment.
  void start() {
    dog.arm(now_ns);
    for (int n = 0; n < 10; ++n) static_cast<void>(with_fresh_command());
    ASSERT_EQ(dog.state(), State::running);
  }
};

TEST(CommandWatchdog, PreventsMotionBeforeItIsArmed) {
  Loop loop;
  for (int n = 0; n < 100; ++n) EXPECT_EQ(loop.with_fresh_command(), State::disarmed);
  const std::int64_t old_ns = loop.now_ns;
  loop.dog.arm(loop.now_ns);
  EXPECT_EQ(loop.step({.written_ns = old_ns, .is_valid = true}), State::waiting)
      << "written before it was armed";
  EXPECT_EQ(loop.step({}), State::waiting);
  EXPECT_EQ(loop.with_fresh_command(), State::running);
}

TEST(CommandWatchdog, TakesNoStampForACommandHoweverFarAway) {
  Loop loop;
  loop.dog.arm(loop.now_ns);
  for (const std::int64_t written_ns :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()})
    EXPECT_EQ(loop.step({.written_ns = written_ns, .is_valid = true}), State::waiting)
        << written_ns;
}

TEST(CommandWatchdog, StopsWithin20MsOfTheLastCommandAndStaysStopped) {
  Loop loop;
  loop.start();
  const CommandWatchdog::Command last = {.written_ns = loop.now_ns + kTick / 2, .is_valid = true};
  while (loop.step(last) == State::running) {
  }
  EXPECT_LE(loop.now_ns - last.written_ns, 20 * kTick);
  EXPECT_GE(loop.now_ns - last.written_ns, 18 * kTick);
  EXPECT_EQ(loop.dog.reason(), Reason::command_lost);
  for (int n = 0; n < 1000; ++n) EXPECT_EQ(loop.with_fresh_command(), State::stopped);
  loop.dog.arm(loop.now_ns);
  EXPECT_EQ(loop.step(last), State::waiting) << "needs a fresh command, too";
  EXPECT_EQ(loop.with_fresh_command(), State::running);
}

TEST(CommandWatchdog, IsNotFedByCommandsThatWereRefused) {
  Loop loop;
  loop.start();
  int ticks = 0;
  while (loop.step({.written_ns = loop.now_ns + kTick / 2, .is_valid = false}) == State::running)
    ++ticks;
  EXPECT_LT(ticks, 20);
}

TEST(CommandWatchdog, IsNotFedFromTheFuture) {
  Loop loop;
  loop.start();
  int ticks = 0;
  while (loop.step({.written_ns = loop.now_ns + 3600 * 1000 * kTick, .is_valid = true}) ==
         State::running)
    ++ticks;
  EXPECT_LT(ticks, 20);
}

// Stamps that are ahead once kept the joint running for as long again.
TEST(CommandWatchdog, ACommandFromTheNearFutureDoesNotCountForLonger) {
  for (const std::int64_t ahead_ns : {5 * kTick, 17 * kTick}) {
    Loop loop;
    loop.start();
    int ticks = 0;
    while (loop.step({.written_ns = loop.now_ns + kTick + ahead_ns, .is_valid = true}) ==
           State::running)
      ++ticks;
    EXPECT_LT(ticks, 20) << ahead_ns;
  }
  // Two periods ahead, it counts as one of now.
  Loop loop;
  loop.start();
  const CommandWatchdog::Command last = {.written_ns = loop.now_ns + 3 * kTick, .is_valid = true};
  const std::int64_t seen_ns = loop.now_ns + kTick;
  ASSERT_EQ(loop.step(last), State::running);
  while (loop.step({}) == State::running) {
  }
  EXPECT_EQ(loop.now_ns - seen_ns, 18 * kTick);
}

TEST(CommandWatchdog, StopsWhereTheClockRunsBackwards) {
  Loop loop;
  loop.start();
  loop.now_ns -= 3 * kTick;
  EXPECT_EQ(loop.with_fresh_command(), State::stopped);
  EXPECT_EQ(loop.dog.reason(), Reason::clock);
}

TEST(CommandWatchdog, StopsAfterAFaultThatLasts) {
  Loop loop;
  loop.dog = CommandWatchdog({.longest_fault_s = 0.005});
  loop.start();
  for (int n = 0; n < 100; ++n)
    EXPECT_EQ(loop.with_fresh_command(n % 5 == 0 ? Fault::none : Fault::outside_training_range),
              State::running);
  EXPECT_EQ(loop.with_fresh_command(), State::running);
  for (int n = 0; n < 4; ++n)
    EXPECT_EQ(loop.with_fresh_command(Fault::model_not_finite), State::running);
  EXPECT_EQ(loop.with_fresh_command(Fault::model_not_finite), State::stopped);
  EXPECT_EQ(loop.dog.reason(), Reason::fault);
}

TEST(CommandWatchdog, StopsWhenAsked) {
  Loop loop;
  loop.start();
  loop.dog.stop();
  EXPECT_EQ(loop.with_fresh_command(), State::stopped);
  EXPECT_EQ(loop.dog.reason(), Reason::requested);
  EXPECT_EQ(name(loop.dog.state()), "stopped");
  EXPECT_EQ(name(loop.dog.reason()), "requested");
}

TEST(CommandWatchdog, ACommandIsValidForLessThanTheTimeOut) {
  Loop loop;
  loop.dog.arm(loop.now_ns);
  const std::int64_t written_ns = loop.now_ns + 1;
  const auto at = [&](std::int64_t age_ns) {
    return loop.dog.step(written_ns + age_ns, {.written_ns = written_ns, .is_valid = true});
  };
  EXPECT_EQ(at(18 * kTick), State::waiting) << "as old as the time-out";
  loop.dog.arm(loop.now_ns);
  EXPECT_EQ(at(18 * kTick - 1), State::running);
  EXPECT_EQ(at(18 * kTick - 1), State::running) << "twice at the same time";
  EXPECT_EQ(at(18 * kTick), State::stopped);
  EXPECT_EQ(loop.dog.reason(), Reason::command_lost);
}

TEST(CommandWatchdog, ItsClockBeginsWhenItIsArmed) {
  Loop loop;
  loop.dog.arm(loop.now_ns);
  EXPECT_EQ(loop.dog.step(loop.now_ns - 1, {}), State::stopped);
  EXPECT_EQ(loop.dog.reason(), Reason::clock);
}

TEST(CommandWatchdog, CountsNoFaultBeforeItRuns) {
  Loop loop;
  loop.dog = CommandWatchdog({.longest_fault_s = 0.005});
  loop.dog.stop();
  EXPECT_EQ(loop.dog.state(), State::disarmed) << "nothing to stop";
  loop.dog.arm(loop.now_ns);
  for (int n = 0; n < 100; ++n) static_cast<void>(loop.step({}, Fault::diverged));
  EXPECT_EQ(loop.with_fresh_command(Fault::diverged), State::running);
  for (int n = 0; n < 4; ++n)
    EXPECT_EQ(loop.with_fresh_command(Fault::diverged), State::running) << n;
  EXPECT_EQ(loop.with_fresh_command(Fault::diverged), State::stopped);
  EXPECT_EQ(loop.dog.reason(), Reason::fault);
  loop.dog.stop();
  EXPECT_EQ(loop.dog.reason(), Reason::fault) << "the first reason";
  loop.dog.arm(loop.now_ns);
  EXPECT_EQ(loop.with_fresh_command(), State::running);
  EXPECT_EQ(loop.dog.reason(), Reason::none);
}

TEST(CommandWatchdog, TakesTimesUpToAnHour) {
  EXPECT_EQ(test::error_message([] { CommandWatchdog({.timeout_s = 3600.0}); }), "");
  EXPECT_EQ(test::error_message([] { CommandWatchdog({.timeout_s = 3601.0}); }),
            "command watchdog: timeout_s: expected above 0, at most 3600, found 3601");
}

TEST(CommandWatchdog, NamesItsStatesAndReasons) {
  EXPECT_EQ(name(State::disarmed), "disarmed");
  EXPECT_EQ(name(State::waiting), "waiting");
  EXPECT_EQ(name(State::running), "running");
  EXPECT_EQ(name(State::stopped), "stopped");
  EXPECT_EQ(name(static_cast<State>(9)), "stopped");
  EXPECT_EQ(name(static_cast<Reason>(9)), "requested");
  EXPECT_EQ(name(Reason::none), "none");
  EXPECT_EQ(name(Reason::command_lost), "command_lost");
  EXPECT_EQ(name(Reason::fault), "fault");
  EXPECT_EQ(name(Reason::clock), "clock");
  EXPECT_EQ(name(Reason::requested), "requested");
}

TEST(CommandWatchdog, RefusesTimesThatAreNone) {
  const auto refusal = [](const CommandWatchdog::Settings& settings) {
    return test::error_message([&] { CommandWatchdog dog(settings); });
  };
  EXPECT_EQ(refusal({}), "");
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), 1e9})
    EXPECT_NE(refusal({.timeout_s = bad}), "") << bad;
  EXPECT_NE(refusal({.longest_fault_s = 0.0}), "");
  EXPECT_EQ(refusal({.longest_ahead_s = 0.0}), "");
  for (const double bad : {-1e-3, std::numeric_limits<double>::quiet_NaN(), 1e9})
    EXPECT_EQ(refusal({.longest_ahead_s = bad}).find("command watchdog: longest_ahead_s"), 0U)
        << bad;
}

// 100 cases of 10^4 ticks: whatever is sent, it runs only on an arming and a valid command since,
// the last of which is younger than the time-out.
RC_GTEST_PROP(CommandWatchdog, RunsOnlyOnAFreshValidCommandSinceItWasArmed, ()) {
  Random random = any_random();
  Loop loop;
  CommandWatchdog::Command command;
  std::int64_t armed_ns = std::numeric_limits<std::int64_t>::max();
  std::int64_t valid_ns = std::numeric_limits<std::int64_t>::min();
  State last = State::disarmed;
  for (int n = 0; n < 10'000; ++n) {
    if (random.uniform() < 0.2) {
      command = {.written_ns =
                     loop.now_ns + static_cast<std::int64_t>((random.uniform() < 0.1 ? 1e8 : 1e6) *
                                                             random.normal()),
                 .is_valid = random.uniform() < 0.8};
    }
    const bool is_armed = random.uniform() < 0.002;
    if (is_armed) {
      if (last != State::running) armed_ns = loop.now_ns;
      loop.dog.arm(loop.now_ns);
    }
    if (random.uniform() < 0.001) loop.dog.stop();
    const State state = loop.step(command);
    const std::int64_t age_ns = loop.now_ns - command.written_ns;
    if (command.is_valid && std::max(age_ns, -age_ns) < 18 * kTick && command.written_ns > armed_ns)
      valid_ns = std::max(valid_ns, command.written_ns);
    if (state == State::running) {
      RC_ASSERT(valid_ns > armed_ns);
      RC_ASSERT(loop.now_ns - valid_ns < 18 * kTick);
    }
    RC_ASSERT(is_armed || !(last == State::stopped && state == State::running));
    last = state;
  }
}

}  // namespace
}  // namespace torsio
