#include "numerics/residual_search.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/all_finite.hpp"
#include "core/report_progress.hpp"
#include "core/row_major_map.hpp"
#include "numerics/levenberg_marquardt.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

double typical_of(std::span<const double> typical, std::span<const double> theta, std::size_t i) {
  if (!typical.empty()) return typical[i];
  return theta[i] != 0.0 ? std::abs(theta[i]) : 1.0;
}

/// J by central differences, one-sided where the other side cannot be computed.
bool differentiate(const ResidualProblem& problem, std::span<const double> theta,
                   std::span<const double> at_theta, std::span<const double> typical,
                   std::span<double> jacobian) {
  std::vector<double> moved(theta.begin(), theta.end());
  std::vector<double> above(problem.residuals);
  std::vector<double> below(problem.residuals);
  const std::size_t columns = theta.size();
  for (std::size_t j = 0; j < columns; ++j) {
    const double step =
        problem.difference * std::max(std::abs(theta[j]), typical_of(typical, theta, j));
    const auto side = [&](double to, std::vector<double>& residuals) {
      moved[j] = to;
      if (problem.evaluate(moved, residuals, {}) && all_finite(residuals)) return to - theta[j];
      std::ranges::copy(at_theta, residuals.begin());
      return 0.0;
    };
    const double width = side(theta[j] + step, above) - side(theta[j] - step, below);
    moved[j] = theta[j];
    if (width == 0.0) return false;
    for (std::size_t n = 0; n < problem.residuals; ++n)
      jacobian[n * columns + j] = (above[n] - below[n]) / width;
  }
  return true;
}

bool evaluate(const ResidualProblem& problem, std::span<const double> theta,
              std::span<const double> typical, std::span<double> residuals,
              std::span<double> jacobian) {
  const bool is_determined =
      problem.evaluate(theta, residuals, problem.has_jacobian ? jacobian : std::span<double>());
  if (!is_determined || !all_finite(residuals)) return false;
  if (jacobian.empty()) return true;
  if (!problem.has_jacobian && !differentiate(problem, theta, residuals, typical, jacobian))
    return false;
  return all_finite(jacobian);
}

/// The start within the bounds. @throws UsageError
std::vector<double> within_bounds(std::vector<double> theta, const SearchOptions& options) {
  for (std::size_t i = 0; i < options.lower.size() && i < options.upper.size(); ++i)
    if (options.lower[i] > options.upper[i])
      throw UsageError({.place = fmt::format("bounds of parameter {}", i),
                        .expected = "lower <= upper",
                        .found = fmt::format("{} and {}", options.lower[i], options.upper[i])});
  for (std::size_t i = 0; i < options.lower.size(); ++i)
    theta[i] = std::max(theta[i], options.lower[i]);
  for (std::size_t i = 0; i < options.upper.size(); ++i)
    theta[i] = std::min(theta[i], options.upper[i]);
  return theta;
}

/// Nothing if r cannot be computed at the start.
std::optional<SearchResult> search(const ResidualProblem& unreported, std::vector<double> theta,
                                   const SearchOptions& options) {
  // Reported in each evaluation, of which an iteration has many.
  double share = 0.0;
  std::string doing = "iteration 0";
  ResidualProblem problem = unreported;
  problem.evaluate = [&](std::span<const double> at, std::span<double> residuals,
                         std::span<double> jacobian) {
    report_progress(options.progress, share, doing);
    return unreported.evaluate(at, residuals, jacobian);
  };
  theta = within_bounds(std::move(theta), options);
  std::vector<double> residuals(problem.residuals);
  if (!evaluate(problem, theta, options.typical, residuals, {})) return std::nullopt;
  const BoxedSquares squares{
      .residuals = problem.residuals,
      .evaluate =
          [&](std::span<const double> at, std::span<double> r, std::span<double> jacobian) {
            return evaluate(problem, at, options.typical, r, jacobian);
          },
      .lower = options.lower,
      .upper = options.upper,
      .max_iterations = options.max_iterations,
      .tolerance = options.tolerance,
      .report =
          [&](std::size_t iteration, double sum_of_squares) {
            share = static_cast<double>(iteration) /
                    static_cast<double>(std::max<std::size_t>(options.max_iterations, 1));
            doing = fmt::format("iteration {}, error {:.4g}", iteration, std::sqrt(sum_of_squares));
            report_progress(options.progress, share, doing);
          }};
  BoxedMinimum found = levenberg_marquardt(squares, std::move(theta));
  return SearchResult{.theta = std::move(found.theta),
                      .sum_of_squares = found.sum_of_squares,
                      .has_converged = found.has_converged,
                      .iterations = found.iterations};
}

[[noreturn]] void refuse_start() {
  throw Error({.problem = "the model diverges at the start of the search",
               .expected = "a start at which it stays finite",
               .advice = "Check units and scale of the inputs."});
}

}  // namespace

SearchResult minimise_squares(const ResidualProblem& problem, std::vector<double> start,
                              const SearchOptions& options) {
  if (auto found = search(problem, std::move(start), options)) return *std::move(found);
  refuse_start();
}

std::vector<SearchResult> minimise_squares_each(const ResidualProblem& problem,
                                                const std::vector<std::vector<double>>& starts,
                                                const SearchOptions& options) {
  std::vector<SearchResult> found;
  for (const std::vector<double>& start : starts)
    if (auto one = search(problem, start, options)) found.push_back(*std::move(one));
  if (found.empty()) refuse_start();
  std::ranges::stable_sort(found, {}, &SearchResult::sum_of_squares);
  return found;
}

SearchResult minimise_squares_from(const ResidualProblem& problem,
                                   const std::vector<std::vector<double>>& starts,
                                   const SearchOptions& options) {
  return std::move(minimise_squares_each(problem, starts, options).front());
}

ParameterUncertainty uncertainty_of(const ResidualProblem& problem, std::span<const double> theta,
                                    std::span<const double> typical) {
  const auto count = static_cast<Eigen::Index>(theta.size());
  const auto residual_count = static_cast<Eigen::Index>(problem.residuals);
  const Eigen::Index samples =
      problem.samples > 0 ? static_cast<Eigen::Index>(problem.samples) : residual_count;
  ParameterUncertainty found{.std_error = std::vector<double>(theta.size(), kNotMeasured),
                             .null_directions = {}};
  std::vector<double> residuals(problem.residuals);
  std::vector<double> values(problem.residuals * theta.size());
  if (samples <= count || !evaluate(problem, theta, typical, residuals, values)) return found;
  Eigen::MatrixXd jacobian = Eigen::Map<const RowMajor>(values.data(), residual_count, count);
  Eigen::VectorXd scale(count);
  for (Eigen::Index j = 0; j < count; ++j)
    scale[j] = typical_of(typical, theta, static_cast<std::size_t>(j));
  jacobian *= scale.asDiagonal();
  const Eigen::MatrixXd triangle = Eigen::HouseholderQR<Eigen::MatrixXd>(jacobian)
                                       .matrixQR()
                                       .topRows(count)
                                       .template triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle, Eigen::ComputeFullV);
  const Eigen::VectorXd& strengths = svd.singularValues();
  const double variance =
      Eigen::Map<const Eigen::VectorXd>(residuals.data(), residual_count).squaredNorm() /
      static_cast<double>(samples - count);
  constexpr double kWeakest = 1e-6;
  constexpr double kPart = 0.05;
  Eigen::VectorXd spread = Eigen::VectorXd::Zero(count);
  Eigen::VectorXd open = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::VectorXd direction = svd.matrixV().col(i);
    if (strengths[i] > kWeakest * strengths[0]) {
      spread += (direction / strengths[i]).array().square().matrix();
    } else {
      open = open.cwiseMax(direction.cwiseAbs());
      found.null_directions.emplace_back(direction.begin(), direction.end());
    }
  }
  for (Eigen::Index j = 0; j < count; ++j)
    if (open[j] < kPart)
      found.std_error[static_cast<std::size_t>(j)] = scale[j] * std::sqrt(variance * spread[j]);
  return found;
}

std::string description_of(std::span<const double> direction, std::span<const std::string> names) {
  constexpr double kPart = 0.05;
  constexpr std::size_t kReadable = 8;
  std::size_t estimate = 0;
  const double largest =
      std::abs(*std::ranges::max_element(direction, {}, [](double x) { return std::abs(x); }));
  std::string text;
  for (std::size_t i = 0; i < direction.size(); ++i) {
    const double part = direction[i] / largest;
    if (std::abs(part) < kPart) continue;
    if (++estimate > kReadable) return text + " + ...";
    const char* sign = part < 0.0 ? "-" : "+";
    const std::string amount =
        std::abs(std::abs(part) - 1.0) < 5e-3 ? "" : fmt::format("{:.2g} ", std::abs(part));
    if (text.empty())
      text = (part < 0.0 ? "-" : "") + amount + names[i];
    else
      text += fmt::format(" {} {}{}", sign, amount, names[i]);
  }
  return text;
}

}  // namespace torsio
