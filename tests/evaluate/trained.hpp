#pragma once

#include <string>

#include "torsio/data/dataset.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio::test {

/// With the default inputs of a dataset and the first seed.
inline TrainedModel trained(const Dataset& dataset, const std::string& family) {
  return train_model(dataset, {.family = family, .features = resolve_inputs(dataset, {})}, 1);
}

}  // namespace torsio::test
