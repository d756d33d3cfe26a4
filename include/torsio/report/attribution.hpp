#pragma once

#include <string>

#include "torsio/evaluate/attribution.hpp"

namespace torsio {

/// The subject of an attribution.
struct AttributionSubject {
  std::string model;  ///< the model file's name
  std::string family;
  std::string target;
  double sample_rate_Hz = 0.0;
};

/// `{"model","family","target","unit","window_samples",...,"results":[{"input","mean_abs_shapley",
/// "share","rmse_increase","rmse_increase_std"}],"explained":[...],"caveat"}`; ends with a line
/// feed.
[[nodiscard]] std::string attribution_json(const Attribution& attribution,
                                           const AttributionSubject& subject);

/// One line per input in descending order, then the method and the caveat.
[[nodiscard]] std::string attribution_text(const Attribution& attribution,
                                           const AttributionSubject& subject);

}  // namespace torsio
