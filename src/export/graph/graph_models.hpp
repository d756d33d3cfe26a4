#pragma once

#include <string_view>

#include "export/graph/graph_builder.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// What a model computes from its features, without guards.
struct GraphEstimate {
  Row value = {};
  Row std_dev = {};  ///< NaN: none
  Row fault = {};
};

/// Adds a model within a scope of the builder. @param x its features
/// @throws UsageError for another family
[[nodiscard]] GraphEstimate add_model(GraphBuilder& graph, const AnyModel::Parameters& parameters,
                                      Row x);

}  // namespace torsio
