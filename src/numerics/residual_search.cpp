#include "numerics/residual_search.hpp"

#include <ceres/cost_function.h>
#include <ceres/iteration_callback.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>

#include "core/all_finite.hpp"
#include "core/report_progress.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/not_measured.hpp"

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

class Residuals : public ceres::CostFunction {
 public:
  Residuals(const ResidualProblem& problem, std::size_t parameters, std::span<const double> typical)
      : problem_(problem), typical_(typical), parameters_(parameters) {
    mutable_parameter_block_sizes()->push_back(static_cast<int>(parameters));
    set_num_residuals(static_cast<int>(problem.residuals));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    std::span<double> jacobian;
    if (jacobians != nullptr && jacobians[0] != nullptr)
      jacobian = {jacobians[0], problem_.residuals * parameters_};
    return evaluate(problem_, {parameters[0], parameters_}, typical_,
                    {residuals, problem_.residuals}, jacobian);
  }

 private:
  const ResidualProblem& problem_;
  std::span<const double> typical_;
  std::size_t parameters_;
};

/// Reports each iteration to `Progress`, and each evaluation, of which an iteration has many; its
/// exceptions are thrown again after Ceres has returned.
class Reporter : public ceres::IterationCallback {
 public:
  explicit Reporter(const SearchOptions& options) : options_(options) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& at) override {
    share_ = static_cast<double>(at.iteration) /
             static_cast<double>(std::max<std::size_t>(options_.max_iterations, 1));
    doing_ = fmt::format("iteration {}, error {:.4g}", at.iteration, std::sqrt(2.0 * at.cost));
    return continues() ? ceres::SOLVER_CONTINUE : ceres::SOLVER_ABORT;
  }
  /// The same problem, which can no longer be evaluated once the listener asks to stop.
  [[nodiscard]] ResidualProblem reported(ResidualProblem problem) {
    problem.evaluate = [this, evaluate = std::move(problem.evaluate)](std::span<const double> theta,
                                                                      std::span<double> residuals,
                                                                      std::span<double> jacobian) {
      return continues() && evaluate(theta, residuals, jacobian);
    };
    return problem;
  }
  void rethrow() const {
    if (thrown_) std::rethrow_exception(thrown_);
  }

 private:
  bool continues() {
    if (thrown_) return false;
    try {
      report_progress(options_.progress, share_, doing_);
    } catch (...) {
      thrown_ = std::current_exception();
    }
    return !thrown_;
  }

  const SearchOptions& options_;
  double share_ = 0.0;
  std::string doing_ = "iteration 0";
  std::exception_ptr thrown_;
};

void set_bounds(ceres::Problem& problem, std::vector<double>& theta, const SearchOptions& options) {
  const auto clamp_to = [&](std::span<const double> bound, bool is_lower) {
    if (bound.empty()) return;
    for (std::size_t i = 0; i < theta.size(); ++i) {
      const auto index = static_cast<int>(i);
      if (!std::isfinite(bound[i])) continue;
      if (is_lower) {
        problem.SetParameterLowerBound(theta.data(), index, bound[i]);
        theta[i] = std::max(theta[i], bound[i]);
      } else {
        problem.SetParameterUpperBound(theta.data(), index, bound[i]);
        theta[i] = std::min(theta[i], bound[i]);
      }
    }
  };
  for (std::size_t i = 0; i < options.lower.size() && i < options.upper.size(); ++i)
    if (options.lower[i] > options.upper[i])
      throw UsageError({.place = fmt::format("bounds of parameter {}", i),
                        .expected = "lower <= upper",
                        .found = fmt::format("{} and {}", options.lower[i], options.upper[i])});
  clamp_to(options.lower, true);
  clamp_to(options.upper, false);
}

std::vector<int> on_bounds(const std::vector<double>& theta, const SearchOptions& options) {
  std::vector<int> held;
  for (std::size_t i = 0; i < theta.size(); ++i)
    if ((!options.lower.empty() && theta[i] <= options.lower[i]) ||
        (!options.upper.empty() && theta[i] >= options.upper[i]))
      held.push_back(static_cast<int>(i));
  return held;
}

/// The messages of a search are in its summary; Ceres would also print them to the terminal. glog
/// has one level for the program, which is restored after the last of the searches that run.
class SilentCeres {
 public:
  SilentCeres() {
    const std::scoped_lock lock(mutex);
    if (searches++ == 0) before = std::exchange(FLAGS_minloglevel, google::GLOG_FATAL);
  }
  ~SilentCeres() {
    const std::scoped_lock lock(mutex);
    if (--searches == 0) FLAGS_minloglevel = before;
  }
  SilentCeres(const SilentCeres&) = delete;
  SilentCeres& operator=(const SilentCeres&) = delete;

 private:
  static inline std::mutex mutex;
  static inline std::size_t searches = 0;
  static inline int before = 0;
};

/// Nothing if r cannot be computed at the start.
std::optional<SearchResult> search(const ResidualProblem& unreported, std::vector<double> theta,
                                   const SearchOptions& options) {
  Reporter reporter(options);
  const ResidualProblem problem = reporter.reported(unreported);
  ceres::Problem ceres_problem;
  ceres_problem.AddResidualBlock(
      new Residuals(problem, theta.size(), options.typical),  // the problem owns it
      nullptr, theta.data());
  set_bounds(ceres_problem, theta, options);
  std::vector<double> residuals(problem.residuals);
  const bool can_start = evaluate(problem, theta, options.typical, residuals, {});
  reporter.rethrow();
  if (!can_start) return std::nullopt;
  ceres::Solver::Options settings;
  settings.linear_solver_type = ceres::DENSE_QR;
  settings.max_num_iterations = static_cast<int>(options.max_iterations);
  settings.function_tolerance = options.tolerance;
  settings.parameter_tolerance = 1e-10;
  settings.num_threads = 1;
  settings.logging_type = ceres::SILENT;
  settings.callbacks.push_back(&reporter);
  ceres::Solver::Summary summary;
  const SilentCeres silent;
  ceres::Solve(settings, &ceres_problem, &summary);
  reporter.rethrow();
  // Steps that a bound shortens end the search early: parameters on a bound are held, and the
  // search continues with the others.
  if (const std::vector<int> held = on_bounds(theta, options);
      !held.empty() && held.size() < theta.size()) {
    ceres_problem.SetManifold(theta.data(),
                              new ceres::SubsetManifold(static_cast<int>(theta.size()), held));
    ceres::Solve(settings, &ceres_problem, &summary);
    reporter.rethrow();
  }
  return SearchResult{.theta = std::move(theta),
                      .sum_of_squares = 2.0 * summary.final_cost,
                      .has_converged = summary.termination_type == ceres::CONVERGENCE,
                      .iterations = summary.iterations.size()};
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
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
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
