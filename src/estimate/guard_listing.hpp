#pragma once

#include <cstddef>
#include <vector>

#include "torsio/model/common/memory.hpp"

namespace torsio {

/// The numbers that an estimator has computed from its settings and its model, as plain data, for what writes them down
/// in another language. The members of `detail::EstimatorCore` and `detail::MemoryError` have the same names.
struct GuardListing {
  struct Range {
    double lowest = 0.0;
    double highest = 0.0;
    double border = 0.0;
    double per_width = 0.0;
    double reach = 0.0;  ///< may be infinite
    double held = 0.0;
  };

  std::vector<Range> ranges = {};  ///< per feature
  std::vector<double> widths = {};
  double first_width = 0.0;
  bool assumes_jumps = false;
  std::size_t longest_gap = 0;
  bool has_memory = false;
  bool resets_model = false;
  bool depends_on_rate = false;
  double largest_output = 0.0;           ///< infinite: no limit
  std::vector<double> jump_limits = {};  ///< per raw input; infinite: no limit
  std::vector<double> raw_slopes = {};
  double longest_stroke = 0.0;  ///< ticks; 0: strokes are not followed
  ModelMemory memory = {};
  std::vector<double> decay = {};  ///< per relaxation
  double warm_up_ticks = 0.0;      ///< NaN: without end
  double negligible = 0.0;
};

}  // namespace torsio
