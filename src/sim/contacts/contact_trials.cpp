#include "sim/contacts/contact_trials.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "arm/vector3.hpp"
#include "core/report_progress.hpp"
#include "numerics/parallel.hpp"
#include "numerics/shared_progress.hpp"
#include "sim/contacts/arm_free_motion.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr double kTrialHour_s = 3600.0;
constexpr double kLongestTrialPart_s = 600.0;
constexpr std::size_t kTrialsPerPart = 25;
constexpr std::size_t kReportEvery = 20'000;
constexpr double kShortestPause_s = 0.7;
constexpr double kLongestPause_s = 2.5;

std::size_t ticks_of(double duration_s) {
  return static_cast<std::size_t>(std::lround(duration_s * kBenchRate_Hz));
}

std::vector<std::uint64_t> part_seeds(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::vector<std::uint64_t> seeds(count);
  for (std::uint64_t& of : seeds) of = random.bits();
  return seeds;
}

/// A direction of equal probability in all of space.
Vector3 random_direction(Random& random) {
  const Vector3 of = {random.normal(), random.normal(), random.normal()};
  return (1.0 / std::sqrt(dot(of, of))) * of;
}

/// Whether a force is above the error bars of some joint.
bool is_above(const ArmSession& session, const ArmController::Output& output,
              const Vector3& force_N) {
  const ArmDynamics& dynamics = session.controller().dynamics();
  ArmDynamics::Jacobian jacobian;
  dynamics.jacobian(session.angle_rad(), jacobian);
  const std::size_t n = dynamics.size();
  for (std::size_t j = 0; j < n; ++j) {
    double torque_Nm = 0.0;
    for (std::size_t row = 0; row < 3; ++row) torque_Nm += jacobian[row * n + j] * force_N[row];
    if (std::abs(torque_Nm) > kPushErrorBars * output.joints[j].external_std_Nm) return true;
  }
  return false;
}

/// The pushes of one thread.
std::vector<PushTrial> push_part(ArmFreeMotion& motion, const PushTrials& trials, std::size_t count,
                                 Random& random, const Progress& progress) {
  const std::size_t duration = ticks_of(trials.duration_s);
  std::vector<PushTrial> done;
  done.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    report_progress(progress, static_cast<double>(k) / static_cast<double>(count), "pushes");
    const std::size_t pause = ticks_of(random.uniform(kShortestPause_s, kLongestPause_s));
    const Vector3 force_N = trials.force_N * random_direction(random);
    PushTrial trial;
    for (std::size_t tick = 0; tick < pause; ++tick) {
      trial.is_in_contact = motion.control().contact.is_found;
      motion.act({});
    }
    bool was_found = true;  // in the first tick the force has not acted yet
    for (std::size_t tick = 0; tick < duration; ++tick) {
      const ArmController::Output& output = motion.control();
      if (tick == 0) trial.is_above = is_above(motion.session(), output, force_N);
      const double since_s = static_cast<double>(tick) / kBenchRate_Hz;
      if (output.contact.is_found && !was_found && !trial.latency_s) trial.latency_s = since_s;
      was_found = output.contact.is_found;
      // The mean of the ramp over the tick.
      const double share = std::min(1.0, (since_s + 0.5 / kBenchRate_Hz) / trials.rise_s);
      motion.act({.force_N = share * force_N});
    }
    done.push_back(trial);
  }
  return done;
}

}  // namespace

std::size_t count_false_alarms(const ArmSetup& setup, const ArmController::Settings& settings,
                               double hours, std::uint64_t seed, const Progress& progress) {
  const double duration_s = hours * kTrialHour_s;
  const auto parts = static_cast<std::size_t>(std::ceil(duration_s / kLongestTrialPart_s - 1e-9));
  const std::size_t ticks = ticks_of(duration_s / static_cast<double>(parts));
  const std::vector<std::uint64_t> seeds = part_seeds(parts, seed);
  std::vector<std::size_t> alarms(parts, 0);
  ProgressOfParts shared(progress, parts);
  for_each_chunk(parts, 0, [&](std::size_t k) {
    ArmFreeMotion motion(setup, settings, FirstStageForm::rigid, seeds[k]);
    const Progress part = shared.part(k);
    bool was_found = false;
    for (std::size_t tick = 0; tick < ticks; ++tick) {
      if (tick % kReportEvery == 0)
        report_progress(part, static_cast<double>(tick) / static_cast<double>(ticks),
                        "motion without contacts");
      const bool is_found = motion.control().contact.is_found;
      if (is_found && !was_found) ++alarms[k];
      was_found = is_found;
      motion.act({});
    }
  });
  return std::accumulate(alarms.begin(), alarms.end(), std::size_t{0});
}

std::vector<PushTrial> push_trials(const ArmSetup& setup, const ArmController::Settings& settings,
                                   const PushTrials& trials, const Progress& progress) {
  const std::size_t parts = (trials.count + kTrialsPerPart - 1) / kTrialsPerPart;
  const std::vector<std::uint64_t> seeds = part_seeds(2 * parts, trials.seed);
  std::vector<std::vector<PushTrial>> done(parts);
  ProgressOfParts shared(progress, parts);
  for_each_chunk(parts, 0, [&](std::size_t k) {
    ArmFreeMotion motion(setup, settings, FirstStageForm::rigid, seeds[2 * k]);
    Random random(seeds[2 * k + 1]);
    const std::size_t count = std::min(kTrialsPerPart, trials.count - k * kTrialsPerPart);
    done[k] = push_part(motion, trials, count, random, shared.part(k));
  });
  std::vector<PushTrial> all;
  all.reserve(trials.count);
  for (const std::vector<PushTrial>& part : done) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace torsio
