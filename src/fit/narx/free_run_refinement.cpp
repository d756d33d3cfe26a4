#include "fit/narx/free_run_refinement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/all_finite.hpp"
#include "fit/common/memory_check.hpp"
#include "fit/narx/narx_run.hpp"
#include "numerics/residual_search.hpp"

namespace torsio {
namespace {

/// The error of a free run over one sequence, from the measured start.
class FreeRun {
 public:
  FreeRun(const NarxTerms& f, const Sequence& sequence, const Sequence& rows, const NarxLags& lags)
      : f_(f),
        sequence_(sequence),
        rows_(rows),
        lags_(lags),
        columns_(f.terms.size()),
        first_output_(f.scales.size() - lags.outputs) {}

  [[nodiscard]] std::size_t samples() const noexcept { return sequence_.target.size(); }

  /// @param jacobian samples x terms, or empty.
  /// @returns false where the run diverges.
  bool errors(std::span<const double> theta, std::span<double> residuals,
              std::span<double> jacobian) const {
    const bool with_slopes = !jacobian.empty();
    const std::size_t start = std::max({lags_.inputs, lags_.outputs, kCorrected});
    std::vector<double> past(samples(), 0.0);
    std::vector<double> slopes(with_slopes ? samples() * columns_ : 0, 0.0);
    At at{.regressors = std::vector<double>(f_.scales.size()),
          .terms = std::vector<double>(columns_),
          .by_output = std::vector<double>(lags_.outputs)};
    std::ranges::fill(residuals, 0.0);
    std::ranges::fill(jacobian, 0.0);
    for (std::size_t n = 0; n < samples(); ++n) {
      const auto inputs = rows_.features.row(n).first(first_output_);
      if (n < start || !all_finite(inputs)) {
        const double measured = sequence_.target[n];
        if (std::isfinite(measured))
          past[n] = measured;
        else if (n > 0)
          past[n] = past[n - 1];
        continue;
      }
      for (std::size_t i = 0; i < first_output_; ++i) at.regressors[i] = inputs[i] / f_.scales[i];
      for (std::size_t i = 0; i < lags_.outputs; ++i)
        at.regressors[first_output_ + i] = past[n - 1 - i] / f_.scales[first_output_ + i];
      past[n] = evaluate(theta, at, with_slopes);
      if (!(std::abs(past[n]) < kLargest)) return false;
      const bool is_scored = sequence_.use[n] != 0;
      if (is_scored) residuals[n] = past[n] - sequence_.target[n];
      if (!with_slopes) continue;
      double* slope = slopes.data() + n * columns_;
      std::ranges::copy(at.terms, slope);
      for (std::size_t i = 0; i < lags_.outputs; ++i) {
        if (at.by_output[i] == 0.0) continue;
        const double* before = slopes.data() + (n - 1 - i) * columns_;
        for (std::size_t j = 0; j < columns_; ++j) slope[j] += at.by_output[i] * before[j];
      }
      if (is_scored)
        std::copy_n(slope, columns_, jacobian.begin() + static_cast<std::ptrdiff_t>(n * columns_));
    }
    return true;
  }

 private:
  static constexpr double kLargest = 1e12;

  /// One sample.
  struct At {
    std::vector<double> regressors;  ///< scaled
    std::vector<double> terms;       ///< phi_j
    std::vector<double> by_output;   ///< df/dy_k-i
  };

  double evaluate(std::span<const double> theta, At& at, bool with_slopes) const {
    if (with_slopes) std::ranges::fill(at.by_output, 0.0);
    double value = 0.0;
    for (std::size_t j = 0; j < columns_; ++j) {
      const Monomial& term = f_.terms[j];
      at.terms[j] = product(at, term, term.size());
      value += theta[j] * at.terms[j];
      if (!with_slopes) continue;
      for (std::size_t k = 0; k < term.size(); ++k)
        if (term[k] >= first_output_)
          at.by_output[term[k] - first_output_] +=
              theta[j] * product(at, term, k) / f_.scales[term[k]];
    }
    return value;
  }

  /// @param without factor that is left out.
  static double product(const At& at, const Monomial& term, std::size_t without) {
    double result = 1.0;
    for (std::size_t k = 0; k < term.size(); ++k)
      if (k != without) result *= at.regressors[term[k]];
    return result;
  }

  const NarxTerms& f_;
  const Sequence& sequence_;
  const Sequence& rows_;
  NarxLags lags_;
  std::size_t columns_;
  std::size_t first_output_;
};

void check_memory(const NarxTerms& f, const TrainingData& data) {
  constexpr double kTables = 3.0;  // slopes, and copies in the search
  double samples = 0.0;
  for (const Sequence& sequence : data.sequences)
    samples += static_cast<double>(sequence.target.size());
  require_memory({.what = "the refinement in free run",
                  .bytes = kTables * sizeof(double) * samples * static_cast<double>(f.terms.size()),
                  .count = f.terms.size(),
                  .counted = "terms",
                  .advice = "Take fewer lags, or fit one step ahead only (of arx: refine=false)."});
}

}  // namespace

Refined refined_in_free_run(const NarxTerms& f, const TrainingData& data,
                            const TrainingData& regressors, const NarxLags& lags,
                            const Progress& progress) {
  check_memory(f, data);
  std::vector<FreeRun> runs;
  std::size_t samples = 0;
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    runs.emplace_back(f, data.sequences[s], regressors.sequences[s], lags);
    samples += runs.back().samples();
  }
  const std::size_t columns = f.terms.size();
  const auto errors = [&](std::span<const double> theta, std::span<double> residuals,
                          std::span<double> jacobian) {
    std::size_t first = 0;
    for (const FreeRun& run : runs) {
      const auto slopes =
          jacobian.empty() ? jacobian : jacobian.subspan(first * columns, run.samples() * columns);
      if (!run.errors(theta, residuals.subspan(first, run.samples()), slopes)) return false;
      first += run.samples();
    }
    return true;
  };
  std::vector<double> residuals(samples);
  if (!errors(f.coefficients, residuals, {}))
    return {.coefficients = f.coefficients, .report = "the free run diverges"};
  SearchResult found =
      minimise_squares({.residuals = samples, .evaluate = errors, .has_jacobian = true},
                       f.coefficients, {.progress = progress});
  return {.coefficients = std::move(found.theta),
          .report = fmt::format("output error {} after {} iterations",
                                found.has_converged ? "converged" : "stopped", found.iterations)};
}

std::string refinement_note(double rmse_before, double rmse_after, const std::string& report,
                            bool is_validated) {
  return fmt::format(
      "free run on the {} records: RMSE {:.4g} as fitted one step ahead, {:.4g} refined; {}{}",
      is_validated ? "validation" : "training", rmse_before, rmse_after, report,
      rmse_after < rmse_before ? "" : ": kept as it was");
}

}  // namespace torsio
