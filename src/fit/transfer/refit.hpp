#pragma once

#include <vector>

#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// The weights of the base that a refit of this family is tried with, the largest first; empty: it has no refit.
[[nodiscard]] std::vector<double> refit_priors(const AnyModel::Parameters& base);

/// The coefficients that explain the data, close to those of the base: see `transfer_model`.
/// @param ranges of the inputs in the training of the base: the sizes of its columns
[[nodiscard]] AnyModel::Parameters refitted(const AnyModel::Parameters& base,
                                            const FeatureRanges& ranges, const TrainingData& data,
                                            double prior);

}  // namespace torsio
