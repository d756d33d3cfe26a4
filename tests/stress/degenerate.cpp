#include "stress/degenerate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "support/bench_dataset.hpp"
#include "torsio/check/check.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio::stress {
namespace {

constexpr double kRate_Hz = 1000.0;
constexpr std::size_t kSamples = 20'000;
constexpr double kAmplitude_rad = 0.03;
constexpr double kNoise_Nm = 0.02;
constexpr double kBars = 5.0;
constexpr std::size_t kLongest = 50;  ///< ticks
constexpr double kAllowedShare = 0.05;
constexpr double kAllowed = 0.02;  ///< share of the cases
constexpr double kLargestFactor = 3.0;

enum class Lack : std::uint8_t { seconds, levels, relation, size, reversals, torque };
constexpr std::array<const char*, 6> kNames{"short",        "held levels", "unrelated torque",
                                            "small motion", "one ramp",    "torque stops"};
constexpr std::array<const char*, 13> kFamilies{"linear",
                                                "linear_coulomb",
                                                "polynomial",
                                                "maxwell_slip",
                                                "prandtl_ishlinskii",
                                                "bouc_wen",
                                                "grey_box",
                                                "dgmm",
                                                "viscoelastic",
                                                "arx",
                                                "mlp",
                                                "narx_polynomial",
                                                "nonlinear_backlash"};

double between(Random& random, double low, double high) {
  return low + (high - low) * random.uniform();
}

std::vector<double> walk(Random& random, std::size_t samples, double amplitude_rad) {
  constexpr std::array<std::array<double, 2>, 3> kParts{{{0.21, 0.5}, {0.53, 0.3}, {0.97, 0.2}}};
  std::vector<double> deflection_rad(samples, 0.0);
  for (const auto& [frequency_Hz, share] : kParts) {
    const double phase = between(random, 0.0, 2.0 * std::numbers::pi);
    for (std::size_t n = 0; n < samples; ++n)
      deflection_rad[n] +=
          amplitude_rad * share *
          std::sin(2.0 * std::numbers::pi * frequency_Hz * static_cast<double>(n) / kRate_Hz +
                   phase);
  }
  return deflection_rad;
}

/// A stiffening spring beside one that slips.
std::vector<double> torque_of(const std::vector<double>& deflection_rad) {
  std::vector<double> torque_Nm;
  double slip_Nm = 0.0;
  double last_rad = deflection_rad.front();
  for (const double now_rad : deflection_rad) {
    slip_Nm = std::clamp(slip_Nm + 300.0 * (now_rad - last_rad), -1.5, 1.5);
    last_rad = now_rad;
    torque_Nm.push_back(500.0 * now_rad + 2e5 * std::pow(now_rad, 3) + slip_Nm);
  }
  return torque_Nm;
}

Recording recorded(const char* name, const std::vector<double>& deflection_rad,
                   std::vector<double> torque_Nm, Random& random) {
  for (double& value : torque_Nm) value += kNoise_Nm * random.normal();
  Recording recording(name, kRate_Hz);
  recording.add({"gear_angle_rad", deflection_rad});
  recording.add({"joint_angle_rad", std::vector<double>(deflection_rad.size(), 0.0)});
  recording.add({"torque_Nm", std::move(torque_Nm)});
  return recording;
}

std::vector<double> held_levels(Random& random) {
  constexpr std::size_t kHold = 1000;
  const auto count = static_cast<std::size_t>(between(random, 2.0, 9.0));
  std::vector<double> deflection_rad;
  while (deflection_rad.size() < kSamples) {
    const auto level = static_cast<double>(
        static_cast<std::size_t>(random.uniform() * 0.999 * static_cast<double>(count)));
    const double held_rad = kAmplitude_rad * (2.0 * level / static_cast<double>(count - 1) - 1.0);
    for (std::size_t n = 0; n < kHold; ++n)
      deflection_rad.push_back(held_rad + 1e-6 * random.normal());
  }
  return deflection_rad;
}

Recording lesson_of(Lack lack, Random& random) {
  std::vector<double> deflection_rad = walk(random, kSamples, kAmplitude_rad);
  std::vector<double> torque_Nm = torque_of(deflection_rad);
  switch (lack) {
    case Lack::seconds:
      deflection_rad.resize(static_cast<std::size_t>(between(random, 100.0, 1500.0)));
      torque_Nm.resize(deflection_rad.size());
      break;
    case Lack::levels:
      deflection_rad = held_levels(random);
      torque_Nm = torque_of(deflection_rad);
      break;
    case Lack::relation: torque_Nm = torque_of(walk(random, kSamples, kAmplitude_rad)); break;
    case Lack::size:
      deflection_rad = walk(random, kSamples, kAmplitude_rad * between(random, 1e-4, 5e-2));
      torque_Nm = torque_of(deflection_rad);
      break;
    case Lack::reversals:
      for (std::size_t n = 0; n < kSamples; ++n)
        deflection_rad[n] =
            kAmplitude_rad * (2.0 * static_cast<double>(n) / static_cast<double>(kSamples) - 1.0);
      torque_Nm = torque_of(deflection_rad);
      break;
    case Lack::torque: {
      const auto stop = static_cast<std::size_t>(between(random, 0.1, 0.7) * kSamples);
      std::fill(torque_Nm.begin() + static_cast<std::ptrdiff_t>(stop), torque_Nm.end(),
                torque_Nm[stop]);
      break;
    }
  }
  return recorded("lesson", deflection_rad, std::move(torque_Nm), random);
}

struct Tally {
  std::size_t cases = 0;
  std::size_t refused = 0;
  std::size_t failures = 0;
  double worst_share = 0.0;
  double largest_factor = 0.0;
};

/// @returns what is wrong with the model in an ordinary motion; empty if nothing
std::string problem_of(const ModelFile& file, const Recording& lesson, Random& random,
                       Tally& tally) {
  const std::vector<double> deflection_rad = walk(random, kSamples, kAmplitude_rad);
  const std::vector<double> torque_Nm = torque_of(deflection_rad);
  double trained_Nm = 0.0;
  for (const double value : lesson.channel("torque_Nm").values)
    trained_Nm = std::max(trained_Nm, std::abs(value));
  BasicTorqueEstimator<AnyModel> estimator(make_estimator(file));
  std::size_t usable = 0;
  std::size_t beyond = 0;
  std::size_t run = 0;
  double largest_Nm = 0.0;
  for (std::size_t n = 0; n < kSamples; ++n) {
    const Estimate now = estimator.step({.t_s = static_cast<double>(n) / kRate_Hz,
                                         .gear_angle_rad = deflection_rad[n],
                                         .joint_angle_rad = 0.0});
    if (!std::isfinite(now.value)) return fmt::format("tick {}: a value that is not finite", n);
    if (now.fault != Fault::none) {
      run = 0;
      continue;
    }
    ++usable;
    largest_Nm = std::max(largest_Nm, std::abs(now.value));
    // Without an error bar nothing is claimed.
    run = std::abs(now.value - torque_Nm[n]) > kBars * now.std_dev ? run + 1 : 0;
    if (run > kLongest) ++beyond;
  }
  const double share =
      static_cast<double>(beyond) / static_cast<double>(std::max<std::size_t>(1, usable));
  tally.worst_share = std::max(tally.worst_share, share);
  tally.largest_factor = std::max(tally.largest_factor, largest_Nm / trained_Nm);
  if (largest_Nm > kLargestFactor * trained_Nm)
    return fmt::format("{:.3g} Nm without a fault, trained up to {:.3g} Nm", largest_Nm,
                       trained_Nm);
  if (share > kAllowedShare)
    return fmt::format("{:.0f} % of {} samples beyond {} error bars", 100.0 * share, usable, kBars);
  return {};
}

}  // namespace

Outcome degenerate_training(const Settings& settings) {
  const Deadline deadline(settings.seconds);
  Outcome outcome;
  std::map<std::string, Tally> tallies;
  std::vector<std::string> wrong;
  for (std::size_t n = 0; n < settings.count && !deadline.passed(); ++n) {
    Random random(settings.seed * 1'000'003 + n);
    const char* const family = kFamilies.at(n % kFamilies.size());
    const std::size_t lack = n / kFamilies.size() % kNames.size();
    const Recording lesson = lesson_of(static_cast<Lack>(lack), random);
    Dataset training;
    test::add_record(training, lesson, Role::train);
    Tally& tally = tallies[fmt::format("{:18} {}", family, kNames.at(lack))];
    ++tally.cases;
    ++outcome.cases;
    std::string problem;
    try {
      const FeatureSpec features =
          resolve_inputs(training, {"gear_angle_rad - joint_angle_rad",
                                    "lowpass(rate(gear_angle_rad - joint_angle_rad), 10Hz)"});
      const FitCheck check = check_for_fit(training, features, false);
      if (!check.failures.empty()) {
        ++tally.refused;
        continue;
      }
      const ModelFile file = train_model(training, check.data.value(),
                                         {.family = family, .features = features}, settings.seed)
                                 .file;
      problem = problem_of(file, lesson, random, tally);
    } catch (const Error&) {
      ++tally.refused;
    }
    if (problem.empty()) continue;
    ++tally.failures;
    wrong.push_back(fmt::format("training {} ({}, {}): {}", n, family, kNames.at(lack), problem));
  }
  for (const auto& [name, tally] : tallies)
    outcome.rows.push_back(
        fmt::format("{:36} {:4} trained, {:4} refused, {:3} wrong; at most {:.1f} % beyond {} "
                    "error bars, {:.2f} of the trained torque",
                    name, tally.cases, tally.refused, tally.failures, 100.0 * tally.worst_share,
                    kBars, tally.largest_factor));
  outcome.add_wrong(wrong, kAllowed);
  return outcome;
}

}  // namespace torsio::stress
