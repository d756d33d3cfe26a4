#pragma once

#include "torsio/estimate/estimator.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// An estimator around a model whose family is known only at run time, as model files hold them.
using Estimator = BasicEstimator<AnyModel>;

/// The same, fed with a joint's sample.
using TorqueEstimator = BasicTorqueEstimator<AnyModel>;

}  // namespace torsio
