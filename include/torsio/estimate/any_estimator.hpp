#pragma once

#include "torsio/estimate/estimator.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// An estimator around a model whose family is known only at run time, as in model files.
using Estimator = BasicEstimator<AnyModel>;

/// The same, for a joint's sample as input.
using TorqueEstimator = BasicTorqueEstimator<AnyModel>;

}  // namespace torsio
