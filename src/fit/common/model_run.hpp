#pragma once

#include <vector>

#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"
#include "torsio/numerics/metrics.hpp"

namespace torsio {

/// One sequence through the model from a reset: the offline path is the loop's own `step`.
[[nodiscard]] std::vector<Estimate> run(AnyModel& model, const Sequence& sequence);

/// The usable samples of all sequences together.
[[nodiscard]] Metrics evaluate(AnyModel model, const TrainingData& data);

}  // namespace torsio
