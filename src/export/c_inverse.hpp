#pragma once

#include <string>
#include <vector>

#include "estimate/guard_listing.hpp"
#include "export/c_inputs.hpp"
#include "export/c_text.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// Writes `NAME_invert_spring` and `NAME_follow_spring`, the inverse of the
/// spring that a controller uses, with the type `NAME_spring` of its state: a `TrainedInverse` if the model's target is the
/// deflection, else a `ModelInverse`.
/// @throws Error as `AnyInverse::of`.
void write_inverse(CText& c, const ModelFile& model, const GuardListing& guards,
                   const std::vector<CInput>& inputs);

}  // namespace torsio
