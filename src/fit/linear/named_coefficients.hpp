#pragma once

#include <span>
#include <string>
#include <vector>

#include "fit/common/regression.hpp"
#include "torsio/fit/common/family_info.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// The parameters of a linear, linear_coulomb or polynomial model with their names and units: "k1
/// (spring_deflection_rad)", Nm/rad. Terms that are left out (0) are not listed; scheduled
/// coefficients are listed at each knot. Empty for other families.
/// @param inputs the expressions of the model's inputs
/// @param errors standard errors of the coefficients, column by column, or none
[[nodiscard]] std::vector<FittedParameter> named_coefficients(
    const AnyModel::Parameters& parameters, std::span<const std::string> inputs,
    const std::string& target, std::span<const double> errors = {});

/// The same as `FamilyInfo::describe` of these families.
[[nodiscard]] ParameterDescription describe_coefficients(const AnyParameters& parameters,
                                                         const EstimatorSettings& settings);

/// The same of a model that was just fitted to a design, with its standard errors unless the
/// coefficients are scheduled.
[[nodiscard]] std::vector<FittedParameter> fitted_coefficients(
    const AnyModel::Parameters& parameters, const Matrix& coefficients, const Design& design,
    const TrainingData& data);

}  // namespace torsio
