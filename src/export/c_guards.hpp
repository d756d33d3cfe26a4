#pragma once

#include <cstddef>
#include <vector>

#include "estimate/guard_listing.hpp"
#include "export/c_inputs.hpp"
#include "export/c_text.hpp"
#include "torsio/estimate/estimator_settings.hpp"

namespace torsio {

/// What the guards of a program depend on.
struct CGuards {
  const EstimatorSettings& settings;
  const GuardListing& listing;
  const std::vector<CInput>& inputs;
  std::size_t settling_samples = 0;  ///< samples until the pipeline has settled
  bool has_unknown_start = false;
};

/// Writes `NAME_run(state, raw)`, the step of an estimator around `NAME_pipeline` and `NAME_model`, and what it calls.
void write_guards(CText& c, const CGuards& guards);

}  // namespace torsio
