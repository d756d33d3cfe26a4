#pragma once

#include <cstddef>
#include <string>

#include "torsio/export/warp_kernel.hpp"

namespace torsio {

/// The parts of the generated module that depend on the graph.
struct WarpModuleParts {
  std::string kernel;    ///< statements of the kernel, indented
  std::string table_32;  ///< numbers, separated by commas; empty: there are none
  std::string table_64;
  std::size_t work_32 = 0;  ///< width of the intermediate rows of a joint
  std::size_t work_64 = 0;
  bool has_functions_32 = false;  ///< it calls functions of numbers of 32 bits
  bool has_functions_64 = false;
  bool has_wide_state = false;   ///< inputs and state have 64 bits
  bool has_wide_values = false;  ///< value and error bar have 64 bits
};

/// The text of the module.
std::string warp_module(const StepGraph& graph, const WarpModuleParts& parts,
                        const WarpKernelOptions& options, const std::string& origin);

}  // namespace torsio
