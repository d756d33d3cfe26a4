#include "fit/common/model_run.hpp"

#include "numerics/metrics_accumulator.hpp"

namespace torsio {

std::vector<Estimate> run(AnyModel& model, const Sequence& sequence) {
  std::vector<Estimate> told(sequence.features.rows);
  model.reset();
  for (std::size_t n = 0; n < told.size(); ++n) {
    if (sequence.has_features(n))
      told[n] = model.step(sequence.features.row(n));
    else
      told[n].fault = Fault::input_not_finite;
  }
  return told;
}

Metrics evaluate(AnyModel model, const TrainingData& data) {
  MetricsAccumulator accumulator;
  for (const Sequence& sequence : data.sequences) {
    const std::vector<Estimate> told = run(model, sequence);
    for (std::size_t n = 0; n < told.size(); ++n)
      if (sequence.use[n] != 0) accumulator.add(told[n].value, sequence.target[n]);
  }
  return accumulator.metrics();
}

}  // namespace torsio
