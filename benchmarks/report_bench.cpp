#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "report/document/decimation.hpp"
#include "rows.hpp"
#include "torsio/core/random.hpp"
#include "torsio/report/html/verb_reports.hpp"

namespace torsio::bench {
namespace {

std::vector<double> noisy_sine(std::size_t samples) {
  Random random(1);
  std::vector<double> values(samples);
  for (std::size_t n = 0; n < samples; ++n)
    values[n] = std::sin(1e-3 * static_cast<double>(n)) + 0.01 * random.normal();
  return values;
}

}  // namespace

// Minima and maxima of a channel of ten million samples. Floor: reading it once.
Row report_decimate() {
  constexpr std::size_t kSamples = 10'000'000;
  const std::vector<double> values = noisy_sine(kSamples);
  std::size_t size = 0;
  const double seconds = best_seconds([&] { size = overview_of(values, 400).size(); });
  if (size != 2 * kSamples / 400) throw std::runtime_error("report_decimate: buckets are missing");
  double largest = 0.0;
  const double reading_s = best_seconds([&] { largest += *std::ranges::max_element(values); });
  if (!(largest > 0.0)) throw std::runtime_error("report_decimate: nothing was read");
  return {.value = 1e-6 * kSamples / seconds,
          .unit = "Msamples/s",
          .floor = 1e-6 * kSamples / reading_s};
}

// The page of a recording of a million samples with five channels, from the recording to the text.
Row report_write() {
  constexpr std::size_t kSamples = 1'000'000;
  Recording recording("bench", 1000.0);
  const std::vector<double> values = noisy_sine(kSamples);
  for (const char* channel : {"motor_angle_rad", "joint_angle_rad", "spring_deflection_rad",
                              "motor_current_A", "torque_Nm"})
    recording.add({channel, values});
  std::size_t bytes = 0;
  const double seconds = best_seconds(
      [&] { bytes = report_html(simulation_report(recording, values, "bench")).size(); });
  if (bytes < 100'000) throw std::runtime_error("report_write: the page is incomplete");
  return {.value = 1e3 * seconds, .unit = "ms"};
}

}  // namespace torsio::bench
