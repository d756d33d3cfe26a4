#include "torsio/sim/contacts/learn_contacts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "core/report_progress.hpp"
#include "evaluate/monitor/exceedance.hpp"
#include "numerics/parallel.hpp"
#include "numerics/shared_progress.hpp"
#include "sim/contacts/arm_free_motion.hpp"
#include "sim/contacts/external_torque_fit.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr double kHour_s = 3600.0;
constexpr double kLongestPart_s = 600.0;  // motion on one thread
constexpr double kFitShare = 0.1;
constexpr double kShortestFit_s =
    360.0;  // in 120 s the variance of a joint is off by up to 2.5 times
constexpr double kShortestHours = 0.02;
constexpr double kLongestHours = 1000.0;
constexpr double kBlock_s = 10.0;
// A threshold from the hours that just support a rate is exceeded about twice as often in other hours.
constexpr double kRateShare = 1.0 / 3.0;
constexpr std::size_t kFitEvery = 50;  // ticks between samples of the fit
constexpr std::size_t kProgressEvery = 20'000;
constexpr double kRateTolerance = 1e-6;
constexpr std::uint64_t kThresholdSeeds = 0x8000'0000;  // added to the seed

using TermsPerJoint = std::span<const ExternalTorqueTerms>;

/// What one thread has found.
struct Part {
  std::vector<ExternalTorqueSamples> samples;
  std::vector<std::vector<double>> maxima;  ///< largest |τ_ext| / σ per block, for each joint
  std::vector<double> squares;
  std::vector<double> ratio_squares;
  std::vector<double> largest_std_dev_Nm;
  std::size_t ticks = 0;
};

struct Work {
  const ArmSetup& setup;
  const ArmController::Settings& settings;
  const ContactLearning& learning;
  const std::vector<ExternalTorqueError>& errors;  ///< empty: samples for the fit
};

void add_ratios(Part& part, const Work& work, const ArmController::Output& output,
                TermsPerJoint terms, ArmDynamics::PerJoint& largest) {
  for (std::size_t j = 0; j < work.errors.size(); ++j) {
    const double external_Nm = output.joints[j].external_Nm;
    const double std_dev_Nm = std::sqrt(work.errors[j].variance(terms[j]));
    const double ratio = std::abs(external_Nm) / std_dev_Nm;
    largest[j] = std::max(largest[j], ratio);
    part.squares[j] += external_Nm * external_Nm;
    part.ratio_squares[j] += ratio * ratio;
    part.largest_std_dev_Nm[j] = std::max(part.largest_std_dev_Nm[j], std_dev_Nm);
  }
}

Part move_freely(const Work& work, double duration_s, std::uint64_t seed,
                 const Progress& progress) {
  const std::size_t joints = work.setup.joints.size();
  ArmFreeMotion motion(
      work.setup, work.settings,
      work.learning.has_gear_stage ? FirstStageForm::elastic : FirstStageForm::rigid, seed);
  Part part{.samples = std::vector<ExternalTorqueSamples>(joints),
            .maxima = std::vector<std::vector<double>>(joints),
            .squares = std::vector<double>(joints, 0.0),
            .ratio_squares = std::vector<double>(joints, 0.0),
            .largest_std_dev_Nm = std::vector<double>(joints, 0.0)};
  const auto ticks = static_cast<std::size_t>(duration_s * kBenchRate_Hz);
  const auto block = static_cast<std::size_t>(kBlock_s * kBenchRate_Hz);
  ExternalTorqueMotion terms_of(kBenchRate_Hz);
  ArmDynamics::PerJoint largest = {};
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    if (tick % kProgressEvery == 0)
      report_progress(progress, static_cast<double>(tick) / static_cast<double>(ticks),
                      "the arm moves");
    const ArmController::Output& output = motion.control();
    const ArmSession& session = motion.session();
    const TermsPerJoint terms =
        terms_of.step(session.controller().dynamics(), session.angle_rad(), session.speed_rad_s(),
                      motion.reference().acceleration_rad_s2);
    if (!work.errors.empty()) {
      add_ratios(part, work, output, terms, largest);
    } else if (tick % kFitEvery == 0) {
      for (std::size_t j = 0; j < joints; ++j) {
        part.samples[j].external_Nm.push_back(output.joints[j].external_Nm);
        part.samples[j].terms.push_back(terms[j]);
      }
    }
    motion.act({});
    if ((tick + 1) % block != 0 || work.errors.empty()) continue;
    for (std::size_t j = 0; j < joints; ++j)
      part.maxima[j].push_back(std::exchange(largest[j], 0.0));
  }
  part.ticks = ticks;
  return part;
}

std::vector<Part> move_in_parts(const Work& work, double duration_s, std::uint64_t first_seed,
                                const Progress& progress) {
  const auto count = static_cast<std::size_t>(std::ceil(duration_s / kLongestPart_s - 1e-9));
  std::vector<Part> parts(count);
  Random random(work.learning.seed + first_seed);
  std::vector<std::uint64_t> seeds(count);
  for (std::uint64_t& seed : seeds) seed = random.bits();
  ProgressOfParts shared(progress, count);
  for_each_chunk(count, work.learning.threads, [&](std::size_t k) {
    parts[k] = move_freely(work, duration_s / static_cast<double>(count), seeds[k], shared.part(k));
  });
  return parts;
}

std::vector<ExternalTorqueError> fit_errors(const std::vector<Part>& parts) {
  std::vector<ExternalTorqueError> errors;
  for (std::size_t j = 0; j < parts.front().samples.size(); ++j) {
    ExternalTorqueSamples all;
    for (const Part& part : parts) {
      const ExternalTorqueSamples& of = part.samples[j];
      all.external_Nm.insert(all.external_Nm.end(), of.external_Nm.begin(), of.external_Nm.end());
      all.terms.insert(all.terms.end(), of.terms.begin(), of.terms.end());
    }
    errors.push_back(fit_external_torque_error(all));
  }
  return errors;
}

/// @returns the wanted rate, or the lowest that the hours support
double checked_rate(const ContactLearning& learning) {
  if (!(learning.hours >= kShortestHours && learning.hours <= kLongestHours))
    throw UsageError({.place = "hours",
                      .expected = fmt::format("{:g} to {:g}", kShortestHours, kLongestHours),
                      .found = fmt::format("{:g}", learning.hours)});
  const double supported = supported_rate_per_hour(learning.hours);
  if (learning.false_alarms_per_hour == 0.0) return supported;
  if (!(learning.false_alarms_per_hour > 0.0) || !std::isfinite(learning.false_alarms_per_hour))
    throw UsageError({.place = "false alarms per hour",
                      .expected = "a rate above 0",
                      .found = fmt::format("{:g}", learning.false_alarms_per_hour)});
  if (learning.false_alarms_per_hour < supported * (1.0 - kRateTolerance))
    throw UsageError(
        {.place = "false alarms per hour",
         .problem = "the motion is too short for this rate",
         .expected = fmt::format("at least {:.3g} per hour, which {:g} hours without a false alarm "
                                 "support with 95 % confidence",
                                 supported, learning.hours),
         .found = fmt::format("{:g}", learning.false_alarms_per_hour),
         .advice = fmt::format("Move for {:.3g} hours or more, or take a higher rate.",
                               supported_rate_per_hour(learning.false_alarms_per_hour))});
  return learning.false_alarms_per_hour;
}

}  // namespace

LearnedContacts learn_contacts(const ArmSetup& setup, const ContactLearning& learning,
                               const Progress& progress) {
  return learn_contacts(setup, arm_controller_settings(setup), learning, progress);
}

LearnedContacts learn_contacts(const ArmSetup& setup, const ArmController::Settings& settings,
                               const ContactLearning& learning, const Progress& progress) {
  const double rate = checked_rate(learning);
  const double duration_s = learning.hours * kHour_s;
  const double fit_s = std::max(kFitShare * duration_s, kShortestFit_s);
  const double fit_share = fit_s / (fit_s + duration_s);
  const std::vector<ExternalTorqueError> none;
  const std::vector<ExternalTorqueError> errors = fit_errors(
      move_in_parts({setup, settings, learning, none}, fit_s, 0, share_of(progress, 0, fit_share)));
  const std::vector<Part> parts = move_in_parts({setup, settings, learning, errors}, duration_s,
                                                kThresholdSeeds, share_of(progress, fit_share, 1));
  LearnedContacts learned{
      .file = {.arm = setup.arm.name,
               .payload_kg = setup.arm.payload.mass_kg,
               .bandwidth_rad_s = settings.observer.bandwidth_rad_s,
               .hours = learning.hours,
               .false_alarms_per_hour = rate,
               .upper_bound_per_hour = supported_rate_per_hour(learning.hours)}};
  const std::size_t joints = setup.joints.size();
  const double share = kRateShare * rate * kBlock_s / kHour_s / static_cast<double>(joints);
  for (std::size_t j = 0; j < joints; ++j) {
    BlockMaxima maxima(1);
    LearnedContacts::Joint& of = learned.joints.emplace_back();
    double ticks = 0.0;
    for (const Part& part : parts) {
      maxima.add(part.maxima[j]);
      of.rmse_Nm += part.squares[j];
      of.mean_variance_ratio += part.ratio_squares[j];
      of.largest_std_dev_Nm = std::max(of.largest_std_dev_Nm, part.largest_std_dev_Nm[j]);
      ticks += static_cast<double>(part.ticks);
    }
    of.rmse_Nm = std::sqrt(of.rmse_Nm / ticks);
    of.mean_variance_ratio /= ticks;
    of.largest_ratio = maxima.largest();
    learned.file.joints.push_back(
        {.name = setup.arm.joints[j].name,
         .detector = {.error = errors[j], .factor = maxima.exceeded_in(share)}});
  }
  return learned;
}

}  // namespace torsio
