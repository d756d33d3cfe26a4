#pragma once

#include <span>
#include <vector>

#include "export/graph/graph_builder.hpp"
#include "signal/pipeline_listing.hpp"

namespace torsio {

struct GraphFeatures {
  std::vector<Row> rows = {};
  Row all = {};            ///< the same side by side
  Row is_settled = {};     ///< a truth
  Row start_std_dev = {};  ///< that unknown states of `stop` and `dahl` cause
};

/// Adds a pipeline within a scope of the builder. @param slopes of the fallback, for `start_std_dev`
[[nodiscard]] GraphFeatures add_pipeline(GraphBuilder& graph, const PipelineListing& listing,
                                         Row raw, std::span<const double> slopes);

}  // namespace torsio
