#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "torsio/estimate/estimator_settings.hpp"

// What the settings of an estimator have to be; each throws Error with the name of the setting in the model file.
namespace torsio::detail {

void check_finite(const char* place, std::span<const double> values);
void check_settings(const EstimatorSettings& settings, std::size_t model_input_count);
void check_disturbances(const DisturbanceGuards& guards, std::size_t raw_inputs);
void check_zeroed(const std::vector<std::string>& channels,
                  const std::vector<std::string>& raw_inputs);

}  // namespace torsio::detail
