#pragma once

#include <string>
#include <vector>

#include "export/c_inputs.hpp"
#include "export/c_text.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// `NAME_self_test`: triangles of every raw input within the ranges of the training, with a missing sample, a gap and a
/// jump, and what torsio's own estimator made of them.
[[nodiscard]] std::string self_test_text(const CText& c, const ModelFile& model,
                                         const std::vector<CInput>& inputs);

}  // namespace torsio
