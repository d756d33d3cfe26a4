#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/options.hpp"
#include "torsio/model/common/adaptation.hpp"
#include "torsio/numerics/metrics.hpp"

namespace torsio {

/// The settings of an adaptation as a user gives them, `name=value`.
[[nodiscard]] std::span<const OptionInfo> adaptation_options();

/// @param method of `kAdaptationRules`. @throws UsageError for another one, or as `Options`.
[[nodiscard]] AdaptationSettings adaptation_settings(
    const std::string& method, const std::map<std::string, std::string>& given);

/// Two sets of parameters on the same samples.
struct AdaptationScore {
  std::string recording;  ///< empty: all together
  Metrics frozen;
  Metrics adapted;
};

/// A model that was adapted by a replay of recordings.
struct AdaptedModel {
  ModelFile file;  ///< with the final parameters and a card that records the adaptation
  AdaptationCounts counts = {};
  double relative_change = 0.0;  ///< as `ModelAdapter` at the end
  /// The error before each update, on the samples of the adaptation (without guarded samples).
  std::vector<AdaptationScore> as_it_ran = {};
  /// After the last update, with the parameters of `file`, on samples that were not used for the
  /// adaptation.
  std::vector<AdaptationScore> held_out = {};
};

/// Streams the recordings through an `AdaptiveEstimator`, in their order, as a robot does: it
/// adapts to the target in segments with the role train. Then both models, the frozen and the
/// adapted, are scored on those with the role test. Error bars by region are recomputed from the
/// samples of the adaptation.
/// @throws UsageError if the family cannot be adapted or there are no segments to adapt to or to
/// score on, Error as `predict`, or if no sample could be used for the adaptation or scored,
/// Cancelled.
[[nodiscard]] AdaptedModel adapt_model(const ModelFile& model, const Dataset& dataset,
                                       const AdaptationSettings& settings,
                                       const Progress& progress = {});

/// Every recording gets the role train, except its last `share`, which gets the role test;
/// `embargo_s` between the two is used in neither.
/// @throws UsageError for an invalid share, Error naming the recording that is too short.
void hold_out_ends(Dataset& dataset, double share, double embargo_s);

}  // namespace torsio
