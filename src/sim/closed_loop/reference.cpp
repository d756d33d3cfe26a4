#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "core/checks.hpp"
#include "core/did_you_mean.hpp"
#include "sim/closed_loop/tracking_parts.hpp"
#include "sim/experiments/experiment_table.hpp"
#include "sim/experiments/torque_references.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

namespace torsio {
namespace {

using Kind = TorqueReference::Kind;

constexpr std::array<std::string_view, 5> kNames{"chirp", "random-walk", "steps", "sweep",
                                                 "replay"};
constexpr double kShort_s = 20.0;
constexpr double kHold_s = 2.0;
constexpr double kShortest_s = 3.0;
constexpr double kLongest_s = 3600.0;

double duration_of(const TorqueReference& reference) {
  if (reference.duration_s) return *reference.duration_s;
  switch (reference.kind) {
    case Kind::chirp:
    case Kind::random_walk: break;
    case Kind::steps:
    case Kind::sweep: return kShort_s;
    case Kind::replay:
      return static_cast<double>(reference.recorded_Nm.size()) / reference.recorded_Hz;
  }
  return kTorqueTest_s;
}

std::vector<double> values(auto signal, double duration_s) {
  std::vector<double> all(static_cast<std::size_t>(std::lround(duration_s * kBenchRate_Hz)));
  for (double& value : all) value = signal.step();
  return all;
}

std::vector<double> values_of(const TorqueReference& reference, double amplitude_Nm,
                              double duration_s, std::uint64_t seed) {
  switch (reference.kind) {
    case Kind::chirp: break;
    case Kind::random_walk: return values(torque_walk(amplitude_Nm, seed), duration_s);
    case Kind::steps:
      return values(
          Steps({.levels = {amplitude_Nm, -amplitude_Nm, 0.5 * amplitude_Nm, -0.5 * amplitude_Nm},
                 .hold_s = kHold_s},
                kBenchRate_Hz),
          duration_s);
    case Kind::sweep:
      return values(LogSweep(frequency_sweep(amplitude_Nm, duration_s), kBenchRate_Hz), duration_s);
    case Kind::replay:
      return values(Replay({.values = reference.recorded_Nm, .recorded_Hz = reference.recorded_Hz},
                           kBenchRate_Hz),
                    duration_s);
  }
  return values(torque_chirp(amplitude_Nm), duration_s);
}

}  // namespace

std::span<const std::string_view> reference_names() noexcept { return kNames; }

std::string_view name(Kind kind) noexcept { return kNames[static_cast<std::size_t>(kind)]; }

Kind find_reference(std::string_view name) {
  const auto* const found = std::ranges::find(kNames, name);
  if (found == kNames.end())
    throw UsageError({.problem = fmt::format("no reference is called \"{}\"", name),
                      .expected = fmt::format("one of {}", fmt::join(kNames, ", ")),
                      .advice = did_you_mean(name, kNames)});
  return static_cast<Kind>(found - kNames.begin());
}

double amplitude_of(const TorqueReference& reference, const DataSheet& sheet) {
  if (reference.kind == Kind::replay) {
    double largest_Nm = 0.0;
    for (const double torque_Nm : reference.recorded_Nm)
      largest_Nm = std::max(largest_Nm, std::abs(torque_Nm));
    return largest_Nm;
  }
  return reference.amplitude_Nm ? *reference.amplitude_Nm : usual_torque_amplitude(sheet);
}

LogSweep::Parameters frequency_sweep(double amplitude_Nm, double duration_s) {
  return {.amplitude = amplitude_Nm, .start_Hz = 1.0, .end_Hz = 40.0, .duration_s = duration_s};
}

std::vector<double> reference_torque(const TorqueReference& reference, const DataSheet& sheet,
                                     std::uint64_t seed) {
  const std::string place = fmt::format("reference {}", name(reference.kind));
  const auto require_value = [&](bool holds, const std::string& what, const std::string& expected,
                                 double found) {
    require<UsageError>(holds, {place, what}, expected, fmt::format("{:.6g}", found));
  };
  if (reference.kind == Kind::replay && reference.recorded_Nm.empty())
    throw UsageError({.place = place, .expected = "a recording with a torque"});
  if (reference.kind == Kind::replay && reference.amplitude_Nm)
    throw UsageError({.place = place, .expected = "no amplitude: the recording has its own"});
  const double amplitude_Nm = amplitude_of(reference, sheet);
  require_value(amplitude_Nm > 0.0 && std::isfinite(amplitude_Nm), "amplitude", "above 0 Nm",
                amplitude_Nm);
  const double duration_s = duration_of(reference);
  require_value(duration_s >= kShortest_s && duration_s <= kLongest_s, "duration",
                fmt::format("{} to {} s", kShortest_s, kLongest_s), duration_s);
  std::vector<double> torque_Nm = values_of(reference, amplitude_Nm, duration_s, seed);
  const double rating_Nm = sheet.rating.torque_Nm.value;
  for (const double value : torque_Nm)
    require_value(std::abs(value) <= rating_Nm, "torque",
                  fmt::format("at most the {} Nm that {} is rated for", rating_Nm, sheet.name),
                  value);
  return torque_Nm;
}

}  // namespace torsio
