#pragma once

#include <optional>
#include <string>

#include "fit/grey_box/grey_box_search.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// By how much the target is late, and what is left where that is taken out.
struct TargetLag {
  double samples = 0.0;  ///< <= 0: it is not late
  double held_out_error = 0.0;
};

/// The lag at which terms without banks predict best what is held out: the lowest point of the parabola of the squared errors
/// through whole samples, up to 50 ms. Terms that were chosen with the lag compensate a part of it, so that they are chosen
/// again where it is taken out, until it stays the same.
/// @param main the terms to begin with
[[nodiscard]] TargetLag find_target_lag(const TrainingData& data, const std::string& schedule,
                                        double rate_share, const GreyBoxChoice& main,
                                        const Progress& progress);

/// Whether a chosen bank is over a rate.
[[nodiscard]] bool has_bank_over_rate(const GreyBoxTerms::Structure& terms,
                                      const TrainingData& data);

/// A lag of the target that makes banks over rates needless.
struct LateTarget {
  TargetLag lag = {};
  GreyBoxChoice beside =
      {};  ///< the banks that are chosen beside the terms where the lag is taken out
};

/// Compares banks with a lag of the target. A late torque is f(x(t - T)), nearly f(x) - T f'(x) dx/dt: a bank over a rate with
/// a slope that depends on the first input describes it on slow motions, and gives any torque on fast ones. The remedy is
/// latency: of a mapping.
/// @param main the terms, without banks
/// @param chosen banks that were chosen beside `main` in these data
/// @returns empty unless the target is a torque or a force, terms that are chosen without the lag predict at least nearly (3 %)
/// as well as the banks do, and no bank over a rate is added to them.
[[nodiscard]] std::optional<LateTarget> explained_by_lag(
    const TrainingData& data, const std::string& schedule, double rate_share,
    const GreyBoxChoice& main, const GreyBoxSearch::Candidate& chosen, const Progress& progress);

}  // namespace torsio
