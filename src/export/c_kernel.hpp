#pragma once

#include "export/c_text.hpp"
#include "model/gaussian_process/parametric_gp.hpp"

namespace torsio {

/// The functions of `write_model` for a parametric Gaussian process.
void write_parametric_gp(CText& c, const ParametricGp::Parameters& parameters);

/// Writes `real NAME_mean(x)`, the value of the process alone.
void write_gp_mean(CText& c, const ParametricGp::Parameters& parameters);

}  // namespace torsio
