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
#include "torsio/model/network/last_layer_adapter.hpp"
#include "torsio/numerics/metrics.hpp"

namespace torsio {

/// The settings of an adaptation as a user gives them, `name=value`.
[[nodiscard]] std::span<const OptionInfo> adaptation_options();

/// @param method "nlms" or "rls". @throws UsageError for another one, or as `Options`.
[[nodiscard]] AdaptationSettings adaptation_settings(
    const std::string& method, const std::map<std::string, std::string>& given);

/// Two sets of weights on the same samples.
struct AdaptationScore {
  std::string recording;  ///< empty: all together
  Metrics frozen;
  Metrics adapted;
};

/// A network that was adapted by a replay of recordings.
struct AdaptedModel {
  ModelFile file;  ///< with the final weights and a card that records the adaptation
  AdaptationCounts counts = {};
  double relative_change = 0.0;  ///< |W - W0| / |W0| at the end
  /// The error before each update, on the samples that were learned from (guards passed over).
  std::vector<AdaptationScore> as_it_ran = {};
  /// After the last update, with the weights of `file`, on samples that nothing was learned from.
  std::vector<AdaptationScore> held_out = {};
};

/// Streams the records through an `AdaptiveEstimator`, in their order, as a robot would: it learns
/// from the target in segments with the role train. Then both networks, the frozen and the adapted,
/// are scored on those with the role test. Error bars by region are taken anew on what was learned
/// from.
/// @throws UsageError if the family has no last layer or there are no segments to learn from or to
/// score on, Error as `predict`, or if no sample could be used for the adaptation or scored,
/// Cancelled.
[[nodiscard]] AdaptedModel adapt_model(const ModelFile& model, const Dataset& dataset,
                                       const AdaptationSettings& settings,
                                       const Progress& progress = {});

/// Every record is to be learned from, but its last `share`, which is to be scored on; `embargo_s`
/// between the two are used for nothing.
/// @throws UsageError for a share that is none, Error naming the record that is too short.
void hold_out_ends(Dataset& dataset, double share, double embargo_s);

}  // namespace torsio
