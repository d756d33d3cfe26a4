#include "stress/references.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "data/recording_rows.hpp"
#include "support/bench_dataset.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/estimate/adaptive_estimator.hpp"
#include "torsio/evaluate/adaptation.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio::stress {
namespace {

using test::add_record;

constexpr double kWorse = 1.3;
constexpr std::size_t kAllowed = 2;
constexpr double kBegin_s = 15.0;
constexpr double kEnd_s = 30.0;
constexpr double kSensorStd_Nm = 0.03;

enum class Kind : std::uint8_t { dead, opposite, delayed, scaled, unrelated, reversed };

struct WrongReference {
  Kind kind;
  const char* name;
  std::array<double, 7> strengths;
};

constexpr std::array<WrongReference, 6> kWrong{{
    {Kind::dead, "dead with noise of Nm", {0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0}},
    {Kind::opposite, "opposite sign, share of the time", {0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0}},
    {Kind::delayed, "late by s", {0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64}},
    {Kind::scaled, "times", {0.25, 0.5, 0.67, 1.5, 2.0, 3.0, 10.0}},
    {Kind::unrelated, "a sine of Hz", {0.1, 0.2, 0.31, 0.5, 1.0, 2.0, 5.0}},
    {Kind::reversed, "reversed in parts of s", {1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 15.0}},
}};

/// @returns the torque with the reference wrong from `begin` to `end`
std::vector<double> spoilt(const Channel& torque, double rate_Hz, const WrongReference& wrong,
                           double strength, std::size_t begin, std::size_t end) {
  std::vector<double> values = torque.values;
  Random random(7);
  const auto ticks = [&](double time_s) { return static_cast<std::size_t>(time_s * rate_Hz); };
  double noise = 0.0;
  for (std::size_t n = begin; n < end; ++n) {
    if (torque.is_fresh(n)) noise = random.normal();
    const double time_s = static_cast<double>(n) / rate_Hz;
    const std::size_t part = wrong.kind == Kind::reversed ? ticks(strength) : 1;
    const std::size_t first = begin + (n - begin) / part * part;
    const std::size_t last = std::min(first + part, end) - 1;
    switch (wrong.kind) {
      case Kind::dead: values[n] = strength * noise; break;
      case Kind::opposite:
        if (static_cast<double>(n - begin) < strength * static_cast<double>(end - begin))
          values[n] = -values[n];
        break;
      case Kind::delayed: values[n] = torque.values[n - std::min(n, ticks(strength))]; break;
      case Kind::scaled: values[n] *= strength; break;
      case Kind::unrelated:
        values[n] = 10.0 * std::sin(2.0 * std::numbers::pi * strength * time_s);
        break;
      case Kind::reversed: values[n] = torque.values[first + last - n]; break;
    }
  }
  return values;
}

Recording walk(const char* actuator, double duration_s, std::uint64_t seed) {
  return simulate({.actuator = actuator,
                   .experiment = "random-walk",
                   .seed = seed,
                   .duration_s = duration_s,
                   .torque_amplitude_Nm = 12.0});
}

double rmse_of(const ModelFile& model, const Dataset& exam) {
  return evaluate(make_estimator(model, exam.sample_rate_Hz()), exam, Role::test)
      .together.metrics.rmse;
}

/// One model with its lesson and its exam, both of the same joint.
struct Case {
  std::string name;
  ModelFile model;
  Recording lesson;
  Dataset exam;
  double frozen_rmse = 0.0;
};

/// Adapted in the loop.
double after_loop(const Case& one, const std::vector<double>& reference) {
  const double rate_Hz = one.lesson.sample_rate_Hz();
  AdaptiveEstimator adaptive(make_estimator(one.model, rate_Hz).settings(),
                             one.model.parameters.at_sample_period(1.0 / rate_Hz),
                             {.sensor_std = kSensorStd_Nm});
  for (const std::string& channel : adaptive.settings().zeroed_channels)
    adaptive.set_zero(channel, 0.0);
  const Channel& torque = one.lesson.channel("torque_Nm");
  RecordingRows rows(one.lesson, adaptive.raw_inputs());
  for (std::size_t n = 0; n < one.lesson.size(); ++n) {
    (void)adaptive.step(rows.at(n));
    const bool is_used = torque.is_fresh(n) && static_cast<double>(n) < kEnd_s * rate_Hz;
    (void)adaptive.learn({.value = is_used ? reference[n] : kNotMeasured});
  }
  ModelFile adapted = one.model;
  adapted.parameters = adaptive.adapted().at_sample_period(1.0 / one.model.settings.sample_rate_Hz);
  return rmse_of(adapted, one.exam);
}

/// Adapted by `adapt_model`. @returns the frozen error if that refuses
double after_adapt(const Case& one, std::vector<double> reference) {
  Dataset dataset = one.exam;
  add_record(
      dataset,
      test::with_torque(one.lesson, [&](Channel& torque) { torque.values = std::move(reference); }),
      Role::train);
  try {
    return rmse_of(adapt_model(one.model, dataset, {.sensor_std = kSensorStd_Nm}).file, one.exam);
  } catch (const Error&) {
    return one.frozen_rmse;
  }
}

void run_case(const Case& one, bool in_loop, bool whole, const Deadline& deadline,
              Outcome& outcome) {
  const Channel& torque = one.lesson.channel("torque_Nm");
  const double rate_Hz = one.lesson.sample_rate_Hz();
  const auto begin = whole ? 0 : static_cast<std::size_t>(kBegin_s * rate_Hz);
  const auto end = whole ? one.lesson.size() : static_cast<std::size_t>(kEnd_s * rate_Hz);
  const auto after = [&](std::vector<double> reference) {
    return in_loop ? after_loop(one, reference) : after_adapt(one, std::move(reference));
  };
  const double sound_rmse = after(torque.values);
  const double usual_rmse = std::max(one.frozen_rmse, sound_rmse);
  std::vector<std::string> worse;
  double worst = 0.0;
  for (const WrongReference& wrong : kWrong)
    for (const double strength : wrong.strengths) {
      if (deadline.passed()) return;
      const double ratio = after(spoilt(torque, rate_Hz, wrong, strength, begin, end)) / usual_rmse;
      worst = std::max(worst, ratio);
      ++outcome.cases;
      if (!(ratio <= kWorse))
        worse.push_back(fmt::format("{} {}: {:.2f}", wrong.name, strength, ratio));
    }
  const std::string name = fmt::format("{}, {}, {}", one.name, in_loop ? "in the loop" : "adapt",
                                       whole ? "all of the lesson" : "15 s of it");
  std::string list;
  for (const std::string& text : worse) list += (list.empty() ? ": " : "; ") + text;
  const std::string row = fmt::format(
      "{}: frozen {:.3f} Nm, sound lesson {:.2f} of that, worst {:.2f}, {} of 42 above {}{}", name,
      one.frozen_rmse, sound_rmse / one.frozen_rmse, worst, worse.size(), kWorse, list);
  (worse.size() > kAllowed ? outcome.failures : outcome.rows).push_back(row);
}

}  // namespace

Outcome wrong_references(const Settings& settings) {
  const Deadline deadline(settings.seconds);
  Outcome outcome;
  Dataset training;
  for (std::uint64_t seed = 1; seed <= 2; ++seed)
    add_record(training, walk("dfki-50#01", 20.0, 100 * settings.seed + seed), Role::train);
  add_record(training,
             simulate({.actuator = "dfki-50#01",
                       .experiment = "chirp",
                       .seed = settings.seed,
                       .torque_amplitude_Nm = 12.0}),
             Role::train);
  const FeatureSpec features =
      resolve_inputs(training, {"gear_angle_rad - joint_angle_rad",
                                "lowpass(rate(gear_angle_rad - joint_angle_rad), 10Hz)"});
  for (const char* family : {"grey_box", "dgmm", "mlp"}) {
    const ModelFile model =
        train_model(training, {.family = family, .features = features}, settings.seed).file;
    for (const char* joint : {"dfki-50#01", "dfki-50#02"}) {
      Case one{.name = fmt::format("{} on {}", family, joint),
               .model = model,
               .lesson = walk(joint, 40.0, 100 * settings.seed + 11),
               .exam = {}};
      add_record(one.exam, walk(joint, 20.0, 100 * settings.seed + 12), Role::test);
      one.frozen_rmse = rmse_of(model, one.exam);
      run_case(one, true, false, deadline, outcome);
      run_case(one, false, false, deadline, outcome);
      run_case(one, false, true, deadline, outcome);
    }
  }
  return outcome;
}

}  // namespace torsio::stress
