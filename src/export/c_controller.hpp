#pragma once

#include <string>
#include <vector>

#include "estimate/guard_listing.hpp"
#include "export/c_inputs.hpp"
#include "export/c_text.hpp"
#include "torsio/export/c99.hpp"

namespace torsio {

/// Writes `JointController` with the model's inverse, and `JointStop` if the controller has one: the type `NAME_control`
/// and the functions that `controller_header` declares. After the estimator and `CText::end_state`.
/// @throws UsageError for another rate than the model's, or for an input that no joint measures
void write_controller(CText& c, const ModelFile& model, const GuardListing& guards,
                      const std::vector<CInput>& inputs, const C99Options& options);

/// Declarations for the header.
[[nodiscard]] std::string controller_header(const C99Options& options);

}  // namespace torsio
