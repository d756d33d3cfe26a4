#pragma once

#include <string>

#include "torsio/export/step_graph.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

struct WarpKernelOptions {
  std::string name = "joint_warp";  ///< name of the Python module, an identifier
  GraphPrecision precision = GraphPrecision::mixed;
};

/// A tick of the estimator as a Python module with a kernel of NVIDIA Warp, one thread for each joint, for MuJoCo-Warp and
/// Newton. Numbers that are not whole are data, not code: Warp rounds those in code to 32 bits.
/// @param origin the model's file, for the description
/// @throws UsageError for a name that Python cannot import, or a family of which there is no `StepGraph`
[[nodiscard]] std::string warp_kernel_text(const ModelFile& model, const WarpKernelOptions& options,
                                           const std::string& origin);

}  // namespace torsio
