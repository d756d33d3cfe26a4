#include <gtest/gtest.h>

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "safety/monitor_fixture.hpp"
#include "support/error_message.hpp"

namespace torsio::test {
namespace {

TEST(Monitor, NamesItsChecksActionsAndStates) {
  const std::vector<std::string> checks = {
      "disagreement", "drift", "sign",  "source_lost", "source_fault", "redundancy_lost", "novelty",
      "not_finite",   "stale", "range", "rate",        "wrap",         "frozen",          "period"};
  ASSERT_EQ(checks.size(), kMonitorChecks);
  for (std::size_t i = 0; i < kMonitorChecks; ++i)
    EXPECT_EQ(name(static_cast<MonitorCheck>(i)), checks[i]);
  EXPECT_EQ(name(MonitorCheck::requested), "requested");
  EXPECT_EQ(name(static_cast<MonitorCheck>(kMonitorChecks + 1)), "unknown");
  EXPECT_EQ(name(MonitorAction::off), "off");
  EXPECT_EQ(name(MonitorAction::warn), "warn");
  EXPECT_EQ(name(MonitorAction::stop), "stop");
  EXPECT_EQ(name(static_cast<MonitorAction>(9)), "unknown");
  EXPECT_EQ(name(State::unproven), "unproven");
  EXPECT_EQ(name(State::ready), "ready");
  EXPECT_EQ(name(State::watching), "watching");
  EXPECT_EQ(name(State::stopped), "stopped");
  EXPECT_EQ(name(static_cast<State>(9)), "unknown");
}

TEST(Monitor, DescribesAnEventOfOtherSettings) {
  EXPECT_EQ(describe({.check = MonitorCheck::not_finite, .first = 3, .value = kNaN}, joint()),
            "? is not a finite number");
  EXPECT_EQ(describe({.check = MonitorCheck::sign, .first = 3, .second = 4, .value = 1.0}, joint()),
            "the torques of ? and ? have opposite signs and differ by 1 Nm");
  EXPECT_EQ(describe({.check = static_cast<MonitorCheck>(kMonitorChecks + 1)}, joint()), "");
}

std::string refusal(const std::function<void(MonitorSettings&)>& change) {
  MonitorSettings settings = joint();
  change(settings);
  return error_message([&] { Monitor{settings}; });
}

TEST(Monitor, RefusesNamesThatAreNotTheirOwn) {
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& s) { s.sources[1] = "current"; }),
            "monitor: sources: expected names of their own, found 'current'");
  EXPECT_EQ(refusal([](auto& s) { s.sources[1] = ""; }),
            "monitor: sources: expected names of their own, found ''");
  EXPECT_EQ(refusal([](auto& s) { s.signals[2].name = "gear_angle_rad"; }),
            "monitor: signals: expected names of their own, found 'gear_angle_rad'");
  EXPECT_EQ(refusal([](auto& s) {
              for (char c = 'a'; s.sources.size() < 9; ++c) s.sources.emplace_back(1, c);
            }),
            "monitor: sources: expected at most 8, found 9");
  EXPECT_EQ(refusal([](auto& s) {
              for (char c = 'a'; s.sources.size() < 8; ++c) s.sources.emplace_back(1, c);
              for (char c = 'a'; s.signals.size() < 16; ++c)
                s.signals.push_back({.name = std::string(1, c)});
            }),
            "");
  EXPECT_EQ(refusal([](auto& s) {
              for (char c = 'a'; s.signals.size() < 17; ++c)
                s.signals.push_back({.name = std::string(1, c)});
            }),
            "monitor: signals: expected at most 16, found 17");
}

TEST(Monitor, RefusesSignalsThatAreNotValid) {
  const auto of_gear = [](const std::function<void(MonitoredSignal&)>& change) {
    return refusal([&](MonitorSettings& settings) { change(settings.signals[1]); });
  };
  EXPECT_EQ(of_gear([](auto& s) { s.lowest = 3.0; }),
            "monitor: gear_angle_rad: expected a lowest value below the highest, found 3");
  EXPECT_NE(of_gear([](auto& s) { s.highest = kNaN; }), "");
  EXPECT_EQ(of_gear([](auto& s) { s.largest_rate = 0.0; }),
            "monitor: gear_angle_rad: largest_rate: expected above 0, found 0");
  EXPECT_NE(of_gear([](auto& s) { s.largest_rate = kNaN; }), "");
  EXPECT_EQ(of_gear([](auto& s) { s.longest_age_s = 0.0; }),
            "monitor: gear_angle_rad: longest_age_s: expected above 0, found 0");
  EXPECT_EQ(of_gear([](auto& s) { s.turn = -1.0; }),
            "monitor: gear_angle_rad: turn: expected 0 or the turn of its encoder, found -1");
  EXPECT_NE(of_gear([](auto& s) { s.turn = kInfinity; }), "");
  EXPECT_EQ(of_gear([](auto& s) { s.largest_hidden_travel = 0.0; }),
            "monitor: gear_angle_rad: largest_hidden_travel: expected above 0, found 0");
  const std::string no_companion =
      "monitor: gear_angle_rad: moves_with: expected another signal, found ";
  EXPECT_EQ(of_gear([](auto& s) { s.moves_with = "oil_K"; }), no_companion + "'oil_K'");
  EXPECT_EQ(of_gear([](auto& s) { s.moves_with = "gear_angle_rad"; }),
            no_companion + "'gear_angle_rad'");
}

TEST(Monitor, RefusesPairsThatAreNotValid) {
  const auto of_pair = [](const std::function<void(PairLimits&)>& change) {
    return refusal([&](MonitorSettings& settings) { change(settings.pairs[1]); });
  };
  EXPECT_EQ(of_pair([](auto& p) { p.first = 3; }),
            "monitor: pair 3, 2: expected two different sources of 3, found pair 3, 2");
  EXPECT_NE(of_pair([](auto& p) { p.second = 3; }), "");
  EXPECT_NE(of_pair([](auto& p) { p.second = 0; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.factor = 0.0; }),
            "monitor: pair 0, 2: factor: expected a positive number, found 0");
  EXPECT_NE(of_pair([](auto& p) { p.factor = kInfinity; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.ceiling_Nm = p.floor_Nm = 0.0; }),
            "monitor: pair 0, 2: ceiling_Nm: expected above 0, found 0");
  EXPECT_EQ(of_pair([](auto& p) { p.floor_Nm = -0.5; }),
            "monitor: pair 0, 2: floor_Nm: expected 0 to the ceiling, found -0.5");
  EXPECT_EQ(of_pair([](auto& p) { p.floor_Nm = 4.5; }),
            "monitor: pair 0, 2: floor_Nm: expected 0 to the ceiling, found 4.5");
  EXPECT_EQ(of_pair([](auto& p) { p.largest_armed_Nm = 0.5; }),
            "monitor: pair 0, 2: largest_armed_Nm: expected at least floor_Nm, found 0.5");
  EXPECT_EQ(of_pair([](auto& p) { p.largest_armed_Nm = p.floor_Nm; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.floor_Nm = p.ceiling_Nm; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.floor_Nm = 0.0; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.drift_allowance = 0.0; }),
            "monitor: pair 0, 2: drift_allowance: expected between 0 and 1, found 0");
  EXPECT_NE(of_pair([](auto& p) { p.drift_allowance = 1.0; }), "");
  EXPECT_EQ(of_pair([](auto& p) { p.drift_limit_s = 0.0; }),
            "monitor: pair 0, 2: drift_limit_s: expected above 0, found 0");
  EXPECT_EQ(refusal([](auto& s) { s.pairs.resize(28, s.pairs[0]); }), "");
  EXPECT_EQ(refusal([](auto& s) { s.pairs.resize(29, s.pairs[0]); }),
            "monitor: pairs: expected at most 28, found 29");
  EXPECT_EQ(refusal([](auto& s) { s.correlation = {1.0}; }),
            "monitor: expected a correlation of 3 x 3 numbers, found 1");
}

TEST(Monitor, RefusesTimesThatAreNotValid) {
  const auto check = [](double MonitorSettings::*field, const std::string& text,
                        std::vector<double> good, std::vector<double> bad) {
    bad.push_back(kNaN);
    for (const double value : good)
      EXPECT_EQ(refusal([&](auto& s) { s.*field = value; }), "") << text << value;
    for (const double value : bad)
      EXPECT_TRUE(refusal([&](auto& s) { s.*field = value; }).starts_with("monitor: " + text))
          << text << value << refusal([&](auto& s) { s.*field = value; });
  };
  using S = MonitorSettings;
  check(&S::sample_period_s, "sample_period_s: expected above 0, at most 1, found ", {1e-4, 1.0},
        {0.0, -1.0, 1.1});
  check(&S::persistence_s,
        "persistence_s: expected 0 or more, and at most a million sample periods, found ",
        {0.0, 1.0}, {-1e-9, kInfinity});
  check(&S::release_share, "release_share: expected above 0, at most 1, found ", {0.1, 1.0},
        {0.0, 1.1});
  check(&S::longest_loss_s, "longest_loss_s: expected 0 or more, found ", {0.0, kInfinity},
        {-1e-9});
  check(&S::longest_fault_s, "longest_fault_s: expected 0 or more, found ", {0.0, kInfinity},
        {-1e-9});
  check(&S::longest_warm_up_s, "longest_warm_up_s: expected 0 or more, found ", {0.0, kInfinity},
        {-1e-9});
  check(&S::longest_command_age_s, "longest_command_age_s: expected above 0, found ",
        {1e-3, kInfinity}, {0.0});
  check(&S::largest_novelty, "largest_novelty: expected above 0, found ", {0.1, kInfinity}, {0.0});
  check(&S::proof_s, "proof_s: expected 0 or more, found ", {0.0, 10.0}, {-1e-9, kInfinity});
  check(&S::spike_memory_s, "spike_memory_s: expected 0 or more, found ", {0.0, kInfinity},
        {-1e-9});
  EXPECT_EQ(refusal([](auto& s) { s.longest_overrun = 0; }),
            "monitor: longest_overrun: expected 1 or more, found 0");
  EXPECT_EQ(refusal([](auto& s) { s.longest_overrun = 1; }), "");
  EXPECT_EQ(refusal([](auto& s) { s.spikes_in_a_row = 0; }),
            "monitor: spikes_in_a_row: expected 1 or more, found 0");
  EXPECT_EQ(refusal([](auto& s) { s.spikes_in_a_row = 1; }), "");
}

TEST(Monitor, OneLateTickIsEnoughForALimitOfOne) {
  MonitorSettings settings = joint();
  settings.longest_overrun = 1;
  settings.spikes_in_a_row = 1;
  Loop loop(settings);
  loop.start();
  EXPECT_EQ(loop.step(1.45e-3), State::watching);
  EXPECT_EQ(loop.step(1.55e-3), State::stopped);
  Loop spike(settings);
  spike.start();
  spike.signals[2].value = 0.0;
  EXPECT_EQ(spike.step(), State::stopped);
}

}  // namespace
}  // namespace torsio::test
