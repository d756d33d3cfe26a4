#include <cmath>
#include <cstdint>
#include <vector>

#include "fit/common/model_run.hpp"
#include "fit/hammerstein_wiener/fit_hammerstein_wiener.hpp"
#include "fit/hammerstein_wiener/wiener_start.hpp"
#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "rows.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio::bench {
namespace {

constexpr std::size_t kSamples = 40'000;
const HammersteinWienerOptions kPaperShape{
    .zeros = 1, .poles = 2, .input_degree = 2, .output_degree = 3, .is_searched = false};

/// Slow and fast turns of the coupling of paper 003 in discrete form, with noise on the torque.
TrainingData samples() {
  Random random(11);
  HammersteinWiener model(hammerstein_wiener_of(Paper003::discrete));
  TrainingData data{.inputs = {{"spring_deflection_rad"}},
                    .target = "torque_Nm",
                    .sample_rate_Hz = 200.0,
                    .sequences = {}};
  Sequence sequence{.recording = "made",
                    .features = Matrix(kSamples, 1),
                    .target = std::vector<double>(kSamples),
                    .use = std::vector<std::uint8_t>(kSamples, 1)};
  double fast = 0.0;
  double slow = 0.0;
  for (std::size_t n = 0; n < kSamples; ++n) {
    fast = 0.9 * fast + 0.004 * random.normal();
    slow = 0.998 * slow + 0.002 * random.normal();
    const double u = fast + slow;
    sequence.features(n, 0) = u;
    sequence.target[n] = model.step({&u, 1}).value + 0.05 * random.normal();
  }
  data.sequences.push_back(std::move(sequence));
  return data;
}

}  // namespace

Row hw_fit_40k() {
  const TrainingData data = samples();
  return {.value = best_seconds([&] { (void)fit_hammerstein_wiener(data, kPaperShape); }, 1.0, 3),
          .unit = "s"};
}

Row hw_step() {
  constexpr std::size_t kTimed = 1000;
  HammersteinWiener model(hammerstein_wiener_of(Paper003::discrete));
  const TrainingData data = samples();
  volatile double sink = 0.0;
  const double seconds = best_seconds([&] {
    for (std::size_t n = 0; n < kTimed; ++n)
      sink = model.step(data.sequences.front().features.row(n)).value;
  });
  return {.value = seconds / kTimed * 1e9, .unit = "ns"};
}

/// Input and output as scaled in our search, its start values, and its final error.
void write_hw_40k() {
  const TrainingData data = samples();
  const WienerData own = wiener_data(data);
  const WienerShape shape;
  const WienerNumbers start = wiener_starts(own, shape, false).front();
  const Sections& g = start.sections;
  if (g.rows != 1 || g(0, 0) != 1.0 || start.input.values[1] != 1.0)
    throw Error({.problem = "the start has not the form that the peer expects"});
  write_doubles("input.f64", own.records.front().input);
  write_doubles("target.f64", own.records.front().target);
  write_doubles("frame.f64", {start.input.centre, start.input.half_range, own.rest_input,
                              start.output.centre, start.output.half_range});
  write_doubles("start.f64",
                {start.input.values[2], g(0, 1), g(0, 3), g(0, 4), start.output.values[0],
                 start.output.values[1], start.output.values[2], start.output.values[3]});
  const HammersteinWiener fitted(fit_hammerstein_wiener(data, kPaperShape).parameters);
  write_doubles("answer.f64", {evaluate(AnyModel(fitted), data).rmse});
}

}  // namespace torsio::bench
