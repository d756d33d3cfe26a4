#include <algorithm>
#include <cmath>

#include "fit/hysteresis/fit_hysteresis.hpp"
#include "fit/hysteresis/operator_data.hpp"

namespace torsio {
namespace {

/// Columns: powers of z, then what each Bernstein polynomial of the half width adds after its
/// decay, then the other inputs.
class LoadingSearch {
 public:
  LoadingSearch(const OperatorData& data, std::size_t degree)
      : data_(data),
        size_(degree + 1),
        columns_(data.rows(), 2 * size_ + data.inputs()),
        is_free_(columns_.columns, 1) {
    std::fill_n(is_free_.begin() + static_cast<std::ptrdiff_t>(size_), size_, 0);
    for (std::size_t n = 0; n < data.rows(); ++n)
      std::ranges::copy(data.others.row(n),
                        columns_.row(n).begin() + static_cast<std::ptrdiff_t>(2 * size_));
  }

  /// @param theta logarithms of both decays times the half range
  LinearSolution solve(std::span<const double> theta, std::span<double> residuals) {
    const double rising = std::exp(theta[0]) / data_.half_range;
    const double falling = std::exp(theta[1]) / data_.half_range;
    std::vector<double> offset(size_);
    std::vector<double> before(size_);
    std::vector<double> now(size_);
    for (const Stretch& stretch : data_.stretches) {
      std::ranges::fill(offset, 0.0);
      Increment increment;
      for (std::size_t n = 0; n < stretch.x.size(); ++n) {
        const double z = (stretch.x[n] - data_.centre) / data_.half_range;
        const double moved = increment.step(stretch.x[n]);
        bernstein(z, now);
        const double sign = moved > 0.0 ? 1.0 : -1.0;
        const double left = std::exp(-(moved > 0.0 ? rising : falling) * std::abs(moved));
        for (std::size_t j = 0; j < size_ && moved != 0.0; ++j)
          offset[j] = sign * now[j] + (offset[j] - sign * before[j]) * left;
        before = now;
        if (stretch.row[n] == Stretch::kUnused) continue;
        const auto row = columns_.row(stretch.row[n]);
        powers(z, row.first(size_));
        std::ranges::copy(offset, row.begin() + static_cast<std::ptrdiff_t>(size_));
      }
    }
    return solve_linear(columns_, data_.target, is_free_, residuals);
  }

 private:
  const OperatorData& data_;
  std::size_t size_;
  Matrix columns_;
  std::vector<std::uint8_t> is_free_;
};

}  // namespace

Fitted<ExponentialLoading> fit_exponential_loading(const TrainingData& data,
                                                   const ExponentialLoadingOptions& options,
                                                   const Progress& progress) {
  const std::size_t size = options.degree + 1;
  const OperatorData runs =
      operator_data(data, options.rates, 0, kMaxResiduals, 2 + 2 * size + data.input_count());
  LoadingSearch search(runs, options.degree);
  const ResidualProblem problem{
      .residuals = runs.rows(),
      .evaluate = [&](std::span<const double> theta, std::span<double> residuals,
                      std::span<double> /*jacobian*/) {
        search.solve(theta, residuals);
        return true;
      }};
  std::vector<std::vector<double>> starts;
  for (const double decays : {1.0, 3.0, 10.0, 50.0})
    starts.push_back({std::log(decays), std::log(decays)});
  const std::vector<double> typical{1.0, 1.0};
  const SearchResult found = converged_search(problem, starts,
                                              {.max_iterations = options.max_iterations,
                                               .lower = {std::log(1e-2), std::log(1e-2)},
                                               .upper = {std::log(1e4), std::log(1e4)},
                                               .typical = typical,
                                               .progress = progress},
                                              ExponentialLoading::kFamily);
  std::vector<double> residuals(runs.rows());
  const std::vector<double> c = search.solve(found.theta, residuals).coefficients;
  Fitted<ExponentialLoading> fitted{.parameters = {}, .notes = runs.notes};
  ExponentialLoading::Parameters& parameters = fitted.parameters;
  const std::span all(c);
  parameters.curves = {.middle = {c.begin(), c.begin() + static_cast<std::ptrdiff_t>(size)},
                       .half_width = powers_of_bernstein(all.subspan(size, size)),
                       .centre = runs.centre,
                       .half_range = runs.half_range};
  parameters.rising_decay = std::exp(found.theta[0]) / runs.half_range;
  parameters.falling_decay = std::exp(found.theta[1]) / runs.half_range;
  parameters.slopes.assign(c.begin() + static_cast<std::ptrdiff_t>(2 * size), c.end());
  const ParameterUncertainty uncertainty = uncertainty_of(problem, found.theta, typical);
  const std::string unit = runs.x_unit.empty() ? "" : "1/" + runs.x_unit;
  fitted.table = {
      {"b+", unit, parameters.rising_decay, parameters.rising_decay * uncertainty.std_error[0]},
      {"b-", unit, parameters.falling_decay, parameters.falling_decay * uncertainty.std_error[1]}};
  note_null_directions(uncertainty, fitted.table, fitted.notes);
  return fitted;
}

}  // namespace torsio
