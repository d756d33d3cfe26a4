#include "torsio/signal/excitation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <utility>

#include "core/checks.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kMaxHoldSamples = 1e15;  // still counted exactly

void require_finite(std::string_view signal, std::string_view parameter, double value) {
  require<UsageError>(std::isfinite(value), {signal, parameter}, "a finite number", value);
}

void require_positive_number(std::string_view signal, std::string_view parameter, double value) {
  require<UsageError>(value > 0.0 && std::isfinite(value), {signal, parameter}, "a positive number",
                      value);
}

void require_frequency(std::string_view signal, double frequency_Hz, double sample_rate_Hz) {
  require_positive_number(signal, "sample rate", sample_rate_Hz);
  require<UsageError>(
      frequency_Hz >= 0.0 && frequency_Hz < 0.5 * sample_rate_Hz, {signal, "frequency"},
      fmt::format("at least 0 and below {} Hz, half the sample rate", 0.5 * sample_rate_Hz),
      frequency_Hz);
}

}  // namespace

Chirp::Chirp(const Parameters& parameters, double sample_rate_Hz)
    : parameters_(parameters), clock_(sample_rate_Hz) {
  require_finite("chirp", "amplitude", parameters.amplitude);
  require_frequency("chirp", parameters.start_Hz, sample_rate_Hz);
  require_frequency("chirp", parameters.end_Hz, sample_rate_Hz);
  require_positive_number("chirp", "duration", parameters.duration_s);
}

double Chirp::step() noexcept {
  const auto& [amplitude, start_Hz, end_Hz, duration_s] = parameters_;
  const double time_s = clock_.next_s();
  const double swept_s = std::min(time_s, duration_s);
  const double turns = swept_s * (start_Hz + 0.5 * (end_Hz - start_Hz) * swept_s / duration_s) +
                       end_Hz * (time_s - swept_s);
  return amplitude * std::sin(kTurn * turns);
}

LogSweep::LogSweep(const Parameters& parameters, double sample_rate_Hz)
    : parameters_(parameters),
      log_ratio_(std::log(parameters.end_Hz / parameters.start_Hz)),
      clock_(sample_rate_Hz) {
  require_finite("log sweep", "amplitude", parameters.amplitude);
  require_frequency("log sweep", parameters.start_Hz, sample_rate_Hz);
  require_frequency("log sweep", parameters.end_Hz, sample_rate_Hz);
  require_positive_number("log sweep", "start frequency", parameters.start_Hz);
  require_positive_number("log sweep", "end frequency", parameters.end_Hz);
  require_positive_number("log sweep", "duration", parameters.duration_s);
}

double LogSweep::step() noexcept {
  const auto& [amplitude, start_Hz, end_Hz, duration_s] = parameters_;
  const double time_s = clock_.next_s();
  const double swept_s = std::min(time_s, duration_s);
  const double growth = log_ratio_ * swept_s / duration_s;
  // (e^x - 1) / x, which stays 1 where nothing grows.
  const double mean_growth = growth != 0.0 ? std::expm1(growth) / growth : 1.0;
  const double turns = start_Hz * swept_s * mean_growth + end_Hz * (time_s - swept_s);
  return amplitude * std::sin(kTurn * turns);
}

Triangle::Triangle(const Parameters& parameters, double sample_rate_Hz)
    : parameters_(parameters), clock_(sample_rate_Hz) {
  require_finite("triangle", "amplitude", parameters.amplitude);
  require_frequency("triangle", parameters.frequency_Hz, sample_rate_Hz);
}

double Triangle::step() noexcept {
  const double turns = clock_.next_s() * parameters_.frequency_Hz;
  // The signal starts a quarter of a period after its lowest point.
  const double from_lowest = turns + 0.25 - std::floor(turns + 0.25);
  return parameters_.amplitude * (1.0 - std::abs(4.0 * from_lowest - 2.0));
}

TrapezoidSweep::Stroke::Stroke(double distance, const Parameters& limits)
    : length(distance),
      acceleration(limits.acceleration),
      speed(std::min(limits.speed, std::sqrt(distance * acceleration))),
      ramp_s(speed / acceleration),
      duration_s(distance / speed + ramp_s) {}

double TrapezoidSweep::Stroke::covered(double time_s) const noexcept {
  if (time_s < ramp_s) return 0.5 * acceleration * time_s * time_s;
  const double left_s = duration_s - time_s;
  if (left_s < ramp_s) return length - 0.5 * acceleration * left_s * left_s;
  return speed * (time_s - 0.5 * ramp_s);
}

TrapezoidSweep::TrapezoidSweep(const Parameters& parameters, double sample_rate_Hz)
    : first_(parameters.amplitude, parameters),
      next_(2.0 * parameters.amplitude, parameters),
      clock_(sample_rate_Hz) {
  require_positive_number("trapezoid sweep", "sample rate", sample_rate_Hz);
  require_positive_number("trapezoid sweep", "amplitude", parameters.amplitude);
  require_positive_number("trapezoid sweep", "speed", parameters.speed);
  require_positive_number("trapezoid sweep", "acceleration", parameters.acceleration);
}

double TrapezoidSweep::step() noexcept {
  const double time_s = clock_.next_s();
  if (time_s < first_.duration_s) return first_.covered(time_s);
  const double strokes = (time_s - first_.duration_s) / next_.duration_s;
  const double done = std::floor(strokes);
  const double from_middle = next_.covered((strokes - done) * next_.duration_s) - first_.length;
  return std::fmod(done, 2.0) == 0.0 ? -from_middle : from_middle;
}

Multisine::Multisine(Parameters parameters, double sample_rate_Hz)
    : parameters_(std::move(parameters)), clock_(sample_rate_Hz) {
  const auto& [frequencies_Hz, amplitudes, seed] = parameters_;
  if (frequencies_Hz.empty() || frequencies_Hz.size() != amplitudes.size())
    throw UsageError({.place = "multisine",
                      .expected = "at least one frequency, and as many amplitudes",
                      .found = fmt::format("{} frequencies, {} amplitudes", frequencies_Hz.size(),
                                           amplitudes.size())});
  for (const double frequency_Hz : frequencies_Hz)
    require_frequency("multisine", frequency_Hz, sample_rate_Hz);
  for (const double amplitude : amplitudes) require_finite("multisine", "amplitude", amplitude);
  Random random(seed);
  for (std::size_t i = 0; i < frequencies_Hz.size(); ++i)
    phases_.push_back(kTurn * random.uniform());
}

double Multisine::step() noexcept {
  const double time_s = clock_.next_s();
  double sum = 0.0;
  for (std::size_t i = 0; i < phases_.size(); ++i)
    sum += parameters_.amplitudes[i] *
           std::sin(kTurn * parameters_.frequencies_Hz[i] * time_s + phases_[i]);
  return sum;
}

BandLimitedNoise::BandLimitedNoise(const Parameters& parameters, double sample_rate_Hz)
    : seed_(parameters.seed),
      lowpass_(parameters.cutoff_Hz, sample_rate_Hz),
      step_std_(parameters.rms / lowpass_.noise_gain()),
      random_(parameters.seed) {
  require<UsageError>(parameters.rms >= 0.0 && std::isfinite(parameters.rms),
                      {"random walk", "rms"}, "at least 0", parameters.rms);
  reset();
}

double BandLimitedNoise::step() noexcept {
  const double output = output_;
  output_ = lowpass_.step(step_std_ * random_.normal());
  return output;
}

void BandLimitedNoise::reset() noexcept {
  random_ = Random(seed_);
  lowpass_.reset();
  output_ = lowpass_.step(0.0);  // at rest, instead of in the steady state of the first white step
}

QuasiPeriodic::QuasiPeriodic(const Parameters& parameters, double sample_rate_Hz)
    : parameters_(parameters), sample_rate_Hz_(sample_rate_Hz), random_(parameters.seed) {
  require_finite("quasi-periodic", "amplitude", parameters.amplitude);
  const auto require_spread = [](std::string_view name, double spread) {
    require<UsageError>(spread >= 0.0 && spread <= 0.3, {"quasi-periodic", name}, "0 to 0.3",
                        spread);
  };
  require_spread("amplitude spread", parameters.amplitude_spread);
  require_spread("period spread", parameters.period_spread);
  // The frequency of the shortest period: at most three spreads, which leave a tenth of it.
  require_frequency("quasi-periodic",
                    parameters.frequency_Hz / (1.0 - 3.0 * parameters.period_spread),
                    sample_rate_Hz);
  reset();
}

void QuasiPeriodic::reset() noexcept {
  random_ = Random(parameters_.seed);
  turns_ = 0.0;
  begin_period();
}

void QuasiPeriodic::begin_period() noexcept {
  const auto spread = [this](double share) {
    return 1.0 + share * std::clamp(random_.normal(), -3.0, 3.0);
  };
  amplitude_ = parameters_.amplitude * spread(parameters_.amplitude_spread);
  turns_a_sample_ =
      parameters_.frequency_Hz / (sample_rate_Hz_ * spread(parameters_.period_spread));
}

double QuasiPeriodic::step() noexcept {
  const double output = amplitude_ * std::sin(kTurn * turns_);
  turns_ += turns_a_sample_;
  if (turns_ >= 1.0) {
    const double late = (turns_ - 1.0) / turns_a_sample_;  // in samples
    begin_period();
    turns_ = late * turns_a_sample_;
  }
  return output;
}

Replay::Replay(Parameters parameters, double sample_rate_Hz)
    : parameters_(std::move(parameters)), clock_(sample_rate_Hz) {
  require_positive_number("replay", "sample rate", sample_rate_Hz);
  require_positive_number("replay", "rate of the values", parameters_.recorded_Hz);
  if (parameters_.values.empty())
    throw UsageError({.place = "replay", .expected = "at least one value", .found = "none"});
  for (const double value : parameters_.values) require_finite("replay", "values", value);
}

double Replay::step() noexcept {
  const std::vector<double>& values = parameters_.values;
  const auto count = static_cast<double>(values.size());
  double place = clock_.next_s() * parameters_.recorded_Hz;
  if (parameters_.repeats) place = std::fmod(place, count);
  if (!parameters_.repeats && place >= count - 1.0) return values.back();
  const double before = std::floor(place);
  const auto first = static_cast<std::size_t>(before);
  const std::size_t second = first + 1 < values.size() ? first + 1 : 0;
  return std::lerp(values[first], values[second], place - before);
}

Steps::Steps(Parameters parameters, double sample_rate_Hz) : levels_(std::move(parameters.levels)) {
  require_positive_number("steps", "sample rate", sample_rate_Hz);
  if (levels_.empty())
    throw UsageError({.place = "steps", .expected = "at least one level", .found = "none"});
  for (const double level : levels_) require_finite("steps", "level", level);
  const double hold_samples = std::round(parameters.hold_s * sample_rate_Hz);
  require<UsageError>(
      hold_samples >= 1.0 && hold_samples < kMaxHoldSamples, {"steps", "hold time"},
      fmt::format("from one sample ({} s) to {} samples", 1.0 / sample_rate_Hz, kMaxHoldSamples),
      parameters.hold_s);
  hold_samples_ = static_cast<std::uint64_t>(hold_samples);
}

double Steps::step() noexcept {
  return levels_[static_cast<std::size_t>((sample_++ / hold_samples_) % levels_.size())];
}

}  // namespace torsio
