#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "control/design/frequency_response.hpp"
#include "control/design/loop_design.hpp"
#include "torsio/control/design/linear_system.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr int kGrid = 2000;
constexpr double kLowestShare = 1e-5;  // share of the Nyquist frequency
/// Tolerance above 1 for modes that nothing excites: a joint that remains at its position.
constexpr double kStandingStill = 1e-7;

/// Where `value` changes its sign between two frequencies, by bisection.
template <class Value>
double crossing(double below_rad_s, double above_rad_s, const Value& value) {
  const bool starts_positive = value(below_rad_s) > 0.0;
  for (int n = 0; n < 60; ++n) {
    const double middle_rad_s = std::sqrt(below_rad_s * above_rad_s);
    ((value(middle_rad_s) > 0.0) == starts_positive ? below_rad_s : above_rad_s) = middle_rad_s;
  }
  return std::sqrt(below_rad_s * above_rad_s);
}

/// Between π and −π, of the angle that is left to −1.
double phase_margin(std::complex<double> response) { return std::arg(-response); }

void take_crossover(FrequencyResponse& loop, double frequency_rad_s, Margins& found) {
  const double phase_rad = phase_margin(loop.at(frequency_rad_s));
  if (std::abs(phase_rad) < std::abs(found.phase_rad)) {
    found.phase_rad = phase_rad;
    found.crossover_rad_s = frequency_rad_s;
  }
}

void take_real(FrequencyResponse& loop, double frequency_rad_s, Margins& found) {
  const double real = loop.at(frequency_rad_s).real();
  if (!(real < 0.0)) return;
  const double factor = -1.0 / real;
  if (factor >= 1.0 && factor < found.gain) {
    found.gain = factor;
    found.gain_rad_s = frequency_rad_s;
  } else if (factor < 1.0 && factor > found.least_gain) {
    found.least_gain = factor;
  }
}

}  // namespace

bool is_stable_closed(const LinearSystem& loop) {
  return loop.closed().spectral_radius() <= 1.0 + kStandingStill;
}

Margins margins(const LinearSystem& loop) {
  if (loop.input_count() != 1 || loop.output_count() != 1)
    throw Error({.place = "margins", .expected = "a loop with one input and one output"});
  constexpr double kNone = std::numeric_limits<double>::infinity();
  Margins found = {.is_stable = is_stable_closed(loop), .phase_rad = kNone, .gain = kNone};
  FrequencyResponse response(loop);
  const auto excess = [&](double rad_s) { return std::abs(response.at(rad_s)) - 1.0; };
  const auto imaginary = [&](double rad_s) { return response.at(rad_s).imag(); };
  const double highest_rad_s = std::numbers::pi * loop.sample_rate_Hz();
  const double step = std::pow(kLowestShare, -1.0 / kGrid);
  double last_rad_s = kLowestShare * highest_rad_s;
  std::complex<double> last = response.at(last_rad_s);
  for (int n = 0; n < kGrid; ++n) {
    const double next_rad_s = n + 1 < kGrid ? last_rad_s * step : highest_rad_s;
    const std::complex<double> next = response.at(next_rad_s);
    if ((std::abs(last) > 1.0) != (std::abs(next) > 1.0))
      take_crossover(response, crossing(last_rad_s, next_rad_s, excess), found);
    if ((last.imag() > 0.0) != (next.imag() > 0.0))
      take_real(response, crossing(last_rad_s, next_rad_s, imaginary), found);
    last_rad_s = next_rad_s;
    last = next;
  }
  return found;
}

}  // namespace torsio
