#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "sim/closed_loop/tracking_parts.hpp"
#include "torsio/core/error.hpp"
#include "torsio/signal/lowpass.hpp"
#include "torsio/sim/closed_loop/tracking_score.hpp"

namespace torsio {
namespace {

constexpr double kLowest_Hz = 3.0;
constexpr std::size_t kHalfWaves = 10;
constexpr double kAlike = 1.0 / 3.0;
constexpr double kKeptUp = 0.8;  // the last half wave over the first: less is a motion that decays

/// What is left above `kLowest_Hz`.
class Highpass {
 public:
  explicit Highpass(double sample_rate_Hz) : lowpass_(kLowest_Hz, sample_rate_Hz) {}
  double step(double input) noexcept { return input - lowpass_.step(input); }

 private:
  Lowpass lowpass_;
};

/// Between two changes of the sign.
struct HalfWave {
  double length_s = 0.0;
  double height = 0.0;
  double reference_height = 0.0;
};

std::vector<HalfWave> half_waves(std::span<const double> error, std::span<const double> reference,
                                 double sample_rate_Hz) {
  Highpass of_error(sample_rate_Hz);
  Highpass of_reference(sample_rate_Hz);
  std::vector<HalfWave> waves;
  HalfWave wave;
  double last = 0.0;
  double crossed_s = 0.0;
  for (std::size_t i = 0; i < error.size(); ++i) {
    const double value = of_error.step(error[i]);
    const double wanted = of_reference.step(reference[i]);
    if ((value > 0.0) != (last > 0.0)) {
      // Between the samples: of fast cycles a half wave has but two or three.
      const double share = value != last ? last / (last - value) : 0.0;
      const double now_s = (static_cast<double>(i) - 1.0 + share) / sample_rate_Hz;
      wave.length_s = now_s - std::exchange(crossed_s, now_s);
      waves.push_back(wave);
      wave = {};
    }
    last = value;
    wave.height = std::max(wave.height, std::abs(value));
    wave.reference_height = std::max(wave.reference_height, std::abs(wanted));
  }
  return waves;
}

bool is_alike(double one, double other) { return std::abs(one - other) <= kAlike * other; }

}  // namespace

std::optional<LimitCycle> find_limit_cycle(std::span<const double> error,
                                           std::span<const double> reference,
                                           double least_amplitude, double sample_rate_Hz) {
  if (reference.size() != error.size())
    throw Error({.place = "limit cycle",
                 .expected = fmt::format("a reference of {} samples, as the error", error.size()),
                 .found = fmt::format("{}", reference.size())});
  const std::vector<HalfWave> waves = half_waves(error, reference, sample_rate_Hz);
  std::optional<LimitCycle> found;
  std::size_t run = 0;
  for (std::size_t i = 0; i < waves.size(); ++i) {
    const HalfWave& wave = waves[i];
    const bool counts = wave.height >= least_amplitude &&
                        wave.reference_height < 0.5 * wave.height &&
                        wave.length_s <= 0.5 / kLowest_Hz;
    const bool goes_on = run > 0 && is_alike(wave.length_s, waves[i - 1].length_s) &&
                         is_alike(wave.height, waves[i - 1].height);
    run = !counts ? 0 : goes_on ? run + 1 : 1;
    if (run < kHalfWaves || wave.height < kKeptUp * waves[i + 1 - kHalfWaves].height) continue;
    if (found && found->amplitude >= wave.height) continue;
    double length_s = 0.0;
    for (std::size_t k = i + 1 - kHalfWaves; k <= i; ++k) length_s += waves[k].length_s;
    found = LimitCycle{.frequency_Hz = 0.5 * static_cast<double>(kHalfWaves) / length_s,
                       .amplitude = wave.height};
  }
  return found;
}

}  // namespace torsio
