#include "fit/common/model_run.hpp"

namespace torsio {

std::vector<Estimate> run(AnyModel& model, const Sequence& sequence) {
  std::vector<Estimate> estimates(sequence.features.rows);
  model.reset();
  for (std::size_t n = 0; n < estimates.size(); ++n) {
    if (sequence.has_features(n))
      estimates[n] = model.step(sequence.features.row(n));
    else
      estimates[n].fault = Fault::input_not_finite;
  }
  return estimates;
}

Metrics evaluate(AnyModel model, const TrainingData& data) {
  MetricsAccumulator accumulator;
  for (const Sequence& sequence : data.sequences) {
    const std::vector<Estimate> estimates = run(model, sequence);
    for (std::size_t n = 0; n < estimates.size(); ++n)
      if (sequence.use[n] != 0) accumulator.add(estimates[n].value, sequence.target[n]);
  }
  return accumulator.metrics();
}

}  // namespace torsio
