#pragma once

#include "estimate/guard_listing.hpp"
#include "export/graph/graph_builder.hpp"
#include "export/graph/graph_models.hpp"
#include "export/graph/graph_pipeline.hpp"
#include "torsio/estimate/estimator_settings.hpp"

namespace torsio {

/// How far features have left their ranges: `detail::EstimatorCore::Excursion`.
struct GraphExcursion {
  Row share = {};
  Row first = {};
  Row fallback = {};
  Row is_outside = {};
};

/// The numbers of the guards, and rows of them that several of their rules need.
struct GraphGuards {
  const EstimatorSettings& settings;
  const GuardListing& listing;
};

[[nodiscard]] GraphExcursion add_excursion(GraphBuilder& graph, const GraphGuards& guards,
                                           Row features);

/// The features, limited to where a model with memory may receive them.
[[nodiscard]] Row limited_features(GraphBuilder& graph, const GraphGuards& guards, Row features);

/// What the guards decide of an estimate: `detail::EstimatorCore::apply_guards`.
struct GraphTick {
  const GraphFeatures& features;
  const GraphExcursion& excursion;
  Row is_settled = {};
  Row is_wrong_rate = {};   ///< a truth
  Row memory_is_open = {};  ///< a truth
  Row memory_bound = {};
  Row stroke_std_dev = {};  ///< what a long stroke adds to the error bar; constant: nothing
  Row last_value = {};
};
[[nodiscard]] GraphEstimate guarded(GraphBuilder& graph, const GraphGuards& guards,
                                    const GraphTick& tick, const GraphEstimate& raw);

/// The error bar of a model's estimate: its own, or that of the residuals in the region of its value.
[[nodiscard]] Row model_std_dev(GraphBuilder& graph, const EstimatorSettings& settings,
                                const GraphEstimate& raw);

}  // namespace torsio
