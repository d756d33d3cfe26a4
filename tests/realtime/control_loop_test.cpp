// A torque controller in a RealtimeLoop, on the simulated plant of dfki-50 with a free lever: commands and
// gains through mailboxes, a watchdog before the drive. The clock is simulated, the faults are those of a bad day.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "realtime/simulated_clock.hpp"
#include "sim/plant/plant.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/core/random.hpp"
#include "torsio/realtime/mailbox.hpp"
#include "torsio/realtime/realtime_loop.hpp"
#include "torsio/safety/command_watchdog.hpp"

namespace torsio {
namespace {

using test::kNaN;
using test::kRate_Hz;
using test::SimulatedClock;
using State = CommandWatchdog::State;

constexpr std::int64_t kTick = 1'000'000;  // ns

/// What one tick was like.
struct Moment {
  State state = State::disarmed;
  double current_A = 0.0;
  double wanted_torque_Nm = 0.0;  ///< as the controller took it
  double torque_Nm = 0.0;         ///< at the joint
  double energy_J = 0.0;
  double proportional_gain = 0.0;
  Fault fault = Fault::none;
};

/// A linear spring without a solution for a while, like a model that has left its range.
class Doubting {
 public:
  explicit Doubting(const bool& is_lost) : is_lost_(&is_lost) {}
  void reset() noexcept {}
  Estimate step(double torque_Nm, const JointSample& /*sample*/) const noexcept {
    return {.value = torque_Nm / 573.0,
            .fault = *is_lost_ ? Fault::outside_training_range : Fault::none};
  }

 private:
  const bool* is_lost_;
};

/// The process of a robot. `before` each tick somebody may write, arm, or take time.
class Robot {
 public:
  void run(int ticks, std::function<void(int)> before, std::uint64_t stop_after_overruns = 0) {
    before_ = std::move(before);
    loop_end = RealtimeLoop({.period_s = 1.0 / kRate_Hz,
                             .priority = 0,
                             .lock_memory = false,
                             .stop_after_overruns = stop_after_overruns},
                            &clock)
                   .run([&](const Tick& tick) noexcept {
                     before_(static_cast<int>(history.size()));
                     step(tick);
                     return static_cast<int>(history.size()) < ticks;
                   });
  }
  /// As somebody who sends a torque every tick.
  void send(double torque_Nm) { wanted_Nm.write(torque_Nm, clock.now_ns()); }

  SimulatedClock clock;
  Mailbox<double> wanted_Nm;
  Mailbox<Pid::Gains> gains;
  CommandWatchdog watchdog{CommandWatchdog::Settings{.longest_fault_s = 0.05}};
  JointSample sample;
  bool has_lost_its_model = false;
  bool has_lost_its_sensor = false;
  std::vector<Moment> history;
  LoopReport loop_end;

 private:
  void step(const Tick& tick) noexcept {
    const auto& letter = wanted_Nm.read();
    const auto& new_gains = gains.read();
    if (new_gains.sequence != gains_taken_) {
      gains_taken_ = new_gains.sequence;
      static_cast<void>(controller_.set_gains(new_gains.value));
    }
    sample.motor_angle_rad = plant_.state().rotor_angle_rad;
    sample.gear_angle_rad = has_lost_its_sensor ? kNaN : plant_.state().middle_angle_rad;
    sample.joint_angle_rad = plant_.state().joint_angle_rad;
    Moment now;
    now.state = watchdog.step(tick.due_ns + tick.lateness_ns,
                              {.written_ns = letter.written_ns,
                               .is_valid = letter.sequence > 0 && std::isfinite(letter.value)},
                              fault_);
    fault_ = Fault::none;
    if (now.state == State::running) {
      const auto output = controller_.step(letter.value, sample);
      now.current_A = output.current_A;
      now.wanted_torque_Nm = output.wanted_torque_Nm;
      now.fault = output.fault;
      fault_ = output.fault != Fault::none ? output.fault : output.inverse;
    } else {
      controller_.reset();
    }
    EXPECT_EQ(plant_.step({.current_A = now.current_A}, load_, 1.0 / kRate_Hz), Fault::none);
    now.torque_Nm = plant_.torques().joint_Nm;
    now.energy_J = plant_.stored_energy(load_).all_J;
    now.proportional_gain = controller_.core().deflection().gains().proportional;
    history.push_back(now);
  }

  std::function<void(int)> before_;
  Load load_ = lever(9.0, 0.24);
  Plant plant_{plant_parameters(data_sheet("dfki-50"))};
  TorqueController<Doubting> controller_{
      Doubting(has_lost_its_model),
      TorqueLoopCore::Settings{
          .deflection = {.joint = series_elastic_joint(data_sheet("dfki-50"))}},
      kRate_Hz};
  Fault fault_ = Fault::none;
  std::uint64_t gains_taken_ = 0;
};

double max_current(const Robot& robot, std::size_t begin, std::size_t end) {
  double max_A = 0.0;
  for (std::size_t n = begin; n < end; ++n)
    max_A = std::max(max_A, std::abs(robot.history[n].current_A));
  return max_A;
}

/// The first tick from `begin` on in which the joint is not driven.
std::size_t stop_after(const Robot& robot, std::size_t begin) {
  while (begin < robot.history.size() && robot.history[begin].state == State::running) ++begin;
  return begin;
}

TEST(ControlLoop, FollowsTheTorqueThatIsSent) {
  Robot robot;
  robot.run(1500, [&](int n) {
    if (n == 0) robot.watchdog.arm(robot.clock.now_ns() - 1);
    robot.send(8.0);
  });
  EXPECT_EQ(robot.loop_end.steps, 1500U);
  double mean_Nm = 0.0;
  for (std::size_t n = 1000; n < 1500; ++n) mean_Nm += robot.history[n].torque_Nm / 500.0;
  EXPECT_NEAR(mean_Nm, 8.0, 2.5) << "a linear model does not contain the friction of the spring";
}

// docs/simulation/faults.md 19.
TEST(ControlLoop, GivesNoCurrentBeforeItIsArmed) {
  Robot robot;
  robot.run(600, [&](int n) {
    if (n == 500) robot.watchdog.arm(robot.clock.now_ns() - 1);
    robot.send(8.0);
  });
  EXPECT_EQ(max_current(robot, 0, 500), 0.0);
  EXPECT_GT(max_current(robot, 500, 600), 0.5);
}

// docs/simulation/faults.md 17, 20, 21: at any moment of any motion. The stored energy falls from the stop
// on, and nothing starts the joint again.
TEST(ControlLoop, StopsWithin20MsWithoutCommandsAndTakesUpNoEnergy) {
  Random random(3);
  for (int round = 0; round < 30; ++round) {
    Robot robot;
    const int silence = 300 + static_cast<int>(900.0 * random.uniform());
    const double amplitude_Nm = 12.0 * random.uniform();
    const double rad_s = 2.0 + 20.0 * random.uniform();
    robot.run(2000, [&](int n) {
      if (n == 0) robot.watchdog.arm(robot.clock.now_ns() - 1);
      if (n <= silence || n > silence + 300) robot.send(amplitude_Nm * std::sin(rad_s * 1e-3 * n));
    });
    const std::size_t stop = stop_after(robot, 0);
    EXPECT_LE(stop, static_cast<std::size_t>(silence) + 20);
    EXPECT_GT(stop, static_cast<std::size_t>(silence));
    EXPECT_EQ(robot.watchdog.reason(), CommandWatchdog::Reason::command_lost);
    EXPECT_EQ(max_current(robot, stop, 2000), 0.0)
        << "the commands came back, but it was not armed";
    // The current loop takes half a millisecond to release its current.
    for (std::size_t n = stop + 5; n < 2000; ++n)
      ASSERT_LE(robot.history[n].energy_J, robot.history[n - 1].energy_J + 1e-6) << round;
  }
}

// docs/simulation/faults.md 21: the word of an operator, and a command since.
TEST(ControlLoop, ContinuesOnlyWhenItIsArmedAgainAndCommandedAgain) {
  Robot robot;
  robot.run(1500, [&](int n) {
    if (n == 0 || n == 800) robot.watchdog.arm(robot.clock.now_ns());
    if (n < 400 || n >= 1000) robot.send(8.0);
  });
  const std::size_t stop = stop_after(robot, 1);
  EXPECT_LE(stop, 420U);
  EXPECT_EQ(max_current(robot, stop, 1000), 0.0);
  EXPECT_GT(max_current(robot, 1001, 1500), 0.3);
}

// docs/simulation/faults.md 13, 18: the last good set-point remains in use, but does not feed the watchdog;
// nor do gains.
TEST(ControlLoop, TakesNoPartOfACommandThatIsNotANumber) {
  Robot robot;
  const double usual =
      TorqueController(LinearInverse(573.0),
                       TorqueLoopCore::Settings{
                           .deflection = {.joint = series_elastic_joint(data_sheet("dfki-50"))}},
                       kRate_Hz)
          .core()
          .deflection()
          .gains()
          .proportional;
  robot.run(800, [&](int n) {
    if (n == 0) robot.watchdog.arm(robot.clock.now_ns() - 1);
    robot.send(n < 500 ? 8.0 : kNaN);
    robot.gains.write({.proportional = usual, .integral = n % 2 == 0 ? 700.0 : kNaN},
                      robot.clock.now_ns());
  });
  EXPECT_EQ(robot.history[510].fault, Fault::input_not_finite);
  EXPECT_EQ(robot.history[510].wanted_torque_Nm, 8.0);
  EXPECT_LE(stop_after(robot, 0), 520U);
}

// docs/simulation/faults.md 14: a model out of its range is a line; not for ever.
TEST(ControlLoop, FallsBackOnTheLineAndThenStops) {
  Robot robot;
  robot.run(900, [&](int n) {
    if (n == 0) robot.watchdog.arm(robot.clock.now_ns() - 1);
    robot.has_lost_its_model = (n >= 300 && n < 330) || n >= 600;
    robot.send(8.0);
  });
  const std::size_t stop = stop_after(robot, 0);
  EXPECT_GE(stop, 650U) << "30 ms of doubt are borne";
  EXPECT_LE(stop, 653U);
  EXPECT_EQ(robot.watchdog.reason(), CommandWatchdog::Reason::fault);
}

TEST(ControlLoop, LetsTheCurrentFadeWithoutASensorAndThenStops) {
  Robot robot;
  robot.run(700, [&](int n) {
    if (n == 0) robot.watchdog.arm(robot.clock.now_ns() - 1);
    robot.has_lost_its_sensor = n >= 500;
    robot.send(8.0);
  });
  EXPECT_EQ(robot.history[500].fault, Fault::input_not_finite);
  EXPECT_LT(std::abs(robot.history[501].current_A), std::abs(robot.history[499].current_A));
  EXPECT_LE(stop_after(robot, 0), 553U);
}

// docs/simulation/faults.md 28: no burst, no command that is older than its time stamp, and an end.
TEST(ControlLoop, StopsAfterOverrunsWithoutCatchingUp) {
  Robot robot;
  robot.run(
      2000,
      [&](int n) {
        if (n == 0) robot.watchdog.arm(robot.clock.now_ns() - 1);
        if (n == 300) robot.clock.pass(7 * kTick);  // one late tick is borne
        if (n >= 600) robot.clock.pass(2 * kTick);
        robot.send(8.0);
      },
      5);
  EXPECT_EQ(robot.loop_end.end, LoopEnd::overruns);
  EXPECT_EQ(robot.history.size(), 605U);
  EXPECT_EQ(robot.loop_end.overruns, 6U);
  EXPECT_EQ(robot.loop_end.skipped_periods, 6U + 5U);
}

// docs/simulation/faults.md 27: the loop's own clock does not run backwards; a watchdog whose clock does
// stops.
TEST(ControlLoop, StopsWhereTheClockOfItsCommandsIsAhead) {
  Robot robot;
  robot.run(600, [&](int n) {
    if (n == 0) robot.watchdog.arm(robot.clock.now_ns() - 1);
    robot.wanted_Nm.write(8.0, robot.clock.now_ns() + (n < 300 ? 0 : 3'600'000 * kTick));
  });
  EXPECT_LE(stop_after(robot, 0), 320U);
}

// docs/simulation/faults.md 29: taken whole or not at all, and without a jump.
TEST(ControlLoop, TakesNewGainsWithoutABump) {
  Robot robot;
  double usual = 0.0;
  robot.run(1500, [&](int n) {
    if (n == 0) robot.watchdog.arm(robot.clock.now_ns() - 1);
    robot.send(8.0);
    if (n == 0) return;
    if (n == 1) usual = robot.history[0].proportional_gain;
    const auto at = robot.clock.now_ns();
    if (n == 900) robot.gains.write({0.7 * usual, 4.0 * usual, 4.0}, at);
    if (n == 1200) robot.gains.write({2.0 * usual, -1.0, 6.0}, at);
  });
  EXPECT_DOUBLE_EQ(robot.history[899].proportional_gain, usual);
  EXPECT_DOUBLE_EQ(robot.history[900].proportional_gain, 0.7 * usual);
  EXPECT_DOUBLE_EQ(robot.history[1499].proportional_gain, 0.7 * usual) << "-1 is not a gain";
  const auto jump_A = [&](std::size_t n) {
    return std::abs(robot.history[n].current_A - robot.history[n - 1].current_A);
  };
  double usual_jump_A = 0.0;
  for (std::size_t n = 800; n < 900; ++n) usual_jump_A = std::max(usual_jump_A, jump_A(n));
  EXPECT_LE(jump_A(900), 2.0 * usual_jump_A + 1e-3);
}

}  // namespace
}  // namespace torsio
