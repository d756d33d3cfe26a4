#pragma once

#include <span>
#include <string>
#include <vector>

#include "fit/narx/fit_narx.hpp"
#include "fit/narx/frols.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// The right side of a NARX model that is linear in its coefficients: theta_j times products of
/// regressors r_i / s_i. A linear model is of this kind, too.
struct NarxTerms {
  std::vector<Monomial> terms;
  std::vector<double> scales;  ///< s, one per regressor
  std::vector<double> coefficients;
};

struct Refined {
  std::vector<double> coefficients;
  std::string report;  ///< how the search ended, as text
};

/// The coefficients of least error in free run, from the measured start of every sequence:
///
///     min sum (yhat_k(theta) - y_k)^2,   dyhat_k/dtheta = phi_k + sum_i (df/dy_k-i) dyhat_k-i/dtheta
///
/// The result is not guaranteed to be stable on other data: compare it with the start. Source:
/// specification 3.3.
/// @param regressors `narx_data` of `data`.
/// @throws Error if the derivatives would not fit into memory; Cancelled.
[[nodiscard]] Refined refined_in_free_run(const NarxTerms& f, const TrainingData& data,
                                          const TrainingData& regressors, const NarxLags& lags,
                                          const Progress& progress = {});

/// The note of a fitter about a refinement.
[[nodiscard]] std::string refinement_note(double rmse_before, double rmse_after,
                                          const std::string& report, bool is_validated = false);

}  // namespace torsio
