#include "fit/viscoelastic/viscoelastic_search.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr double kFloor = 1e-4;  // share of the scale
constexpr double kCeiling = 1e6;
constexpr std::size_t kFirstIterations = 12;
constexpr std::size_t kMaxIterations = 300;
constexpr std::size_t kFinalists = 3;

/// theta = (q_1 ... q_n, b) of a network on training data.
class Search {
 public:
  Search(const ViscoelasticError& error, SpringDashpotNetwork network)
      : network_(std::move(network)), error_(error) {
    const double stiffness = error_.target_deviation() / error_.input_deviation();
    const double time_s = std::sqrt(error_.period_s() * error_.longest_s());
    for (const NetworkNode* element : elements_of(network_)) {
      scale_.push_back(element->is(NetworkKind::spring) ? stiffness : stiffness * time_s);
      start_.push_back(std::isfinite(element->value) ? element->value : scale_.back());
    }
  }

  [[nodiscard]] std::size_t elements() const { return scale_.size(); }

  [[nodiscard]] std::vector<double> values_of(std::span<const double> theta) const {
    std::vector<double> values(elements());
    for (std::size_t j = 0; j < values.size(); ++j)
      values[j] = kFloor * scale_[j] + std::exp(theta[j]);
    return values;
  }
  [[nodiscard]] SpringDashpotNetwork network_at(const std::vector<double>& values) const {
    SpringDashpotNetwork network = network_;
    network.set_values(values);
    return network;
  }

  /// The given values where there are some, then random ones.
  [[nodiscard]] std::vector<std::vector<double>> starts(std::size_t count,
                                                        std::uint64_t seed) const {
    std::vector<std::vector<double>> starts{theta_of(start_)};
    Random random(seed);
    const double stiffness = error_.target_deviation() / error_.input_deviation();
    const double shortest_s = 2.0 * error_.period_s();
    const double longest_s = std::max(0.25 * error_.longest_s(), 2.0 * shortest_s);
    const auto all = elements_of(network_);
    while (starts.size() < count) {
      std::vector<double> values;
      for (const NetworkNode* element : all) {
        const double time_s = shortest_s * std::pow(longest_s / shortest_s, random.uniform());
        values.push_back(stiffness * std::exp(0.7 * random.normal()) *
                         (element->is(NetworkKind::spring) ? 1.0 : time_s));
      }
      starts.push_back(theta_of(values));
    }
    return starts;
  }

  /// @param pull of the prior on each q, in the target's unit; 0: none
  [[nodiscard]] ResidualProblem problem(double pull) const {
    const std::size_t extra = pull > 0.0 ? elements() : 0;
    return {.residuals = error_.residuals() + extra,
            .evaluate = [this, pull](std::span<const double> theta, std::span<double> residuals,
                                     std::span<double> /*jacobian*/) {
              const std::vector<double> values = values_of(theta);
              try {
                error_.evaluate(relaxation_spectrum(network_at(values)), theta.back(),
                                residuals.first(error_.residuals()));
              } catch (const Error&) {
                return false;  // values out of all bounds: the search turns back
              }
              if (pull > 0.0)
                for (std::size_t j = 0; j < values.size(); ++j)
                  residuals[error_.residuals() + j] = pull * std::log(values[j] / start_[j]);
              return true;
            }};
  }

  [[nodiscard]] SearchOptions options(std::size_t max_iterations, Progress progress) const {
    SearchOptions options{.max_iterations = max_iterations,
                          .typical = std::vector<double>(elements(), 1.0),
                          .progress = std::move(progress)};
    options.typical.push_back(error_.target_deviation());
    for (const double scale : scale_) {
      options.lower.push_back(std::log(1e-3 * kFloor * scale));
      options.upper.push_back(std::log(std::min(kCeiling * scale, 0.5 * kLargestElement)));
    }
    options.lower.push_back(-HUGE_VAL);
    options.upper.push_back(HUGE_VAL);
    return options;
  }

 private:
  [[nodiscard]] std::vector<double> theta_of(const std::vector<double>& values) const {
    std::vector<double> theta;
    for (std::size_t j = 0; j < values.size(); ++j)
      theta.push_back(
          std::log(std::max(values[j] - kFloor * scale_[j], 1e-3 * kFloor * scale_[j])));
    theta.push_back(0.0);
    return theta;
  }

  SpringDashpotNetwork network_;
  const ViscoelasticError& error_;
  std::vector<double> scale_;
  std::vector<double> start_;  ///< values given, or the scale
};

double rmse_of(const SearchResult& found, const ResidualProblem& problem) {
  return std::sqrt(found.sum_of_squares / static_cast<double>(problem.residuals));
}

Progress part_of(const Progress& progress, std::size_t n, std::size_t count) {
  if (!progress) return {};
  return [&progress, n, count](double share, std::string_view doing) {
    return progress((static_cast<double>(n) + share) / static_cast<double>(count),
                    fmt::format("start {} of {}: {}", n + 1, count, doing));
  };
}

/// Every start a little, the best to the end, best first.
std::vector<SearchResult> finalists(const Search& search, const ResidualProblem& problem,
                                    const ViscoelasticOptions& options, const FitContext& context) {
  const auto starts = search.starts(options.starts, context.seed);
  const std::size_t last = std::min(kFinalists, starts.size());
  std::vector<SearchResult> found;
  for (std::size_t i = 0; i < starts.size(); ++i)
    found.push_back(minimise_squares(
        problem, starts[i],
        search.options(kFirstIterations, part_of(context.progress, i, starts.size() + last))));
  std::ranges::stable_sort(found, {}, &SearchResult::sum_of_squares);
  found.resize(last);
  for (std::size_t i = 0; i < last; ++i)
    found[i] = minimise_squares(
        problem, found[i].theta,
        search.options(kMaxIterations,
                       part_of(context.progress, starts.size() + i, starts.size() + last)));
  std::ranges::stable_sort(found, {}, &SearchResult::sum_of_squares);
  return found;
}

void require_converged(const SearchResult& found) {
  if (found.has_converged) return;
  throw Error(
      {.problem = fmt::format("the search did not converge within {} iterations", kMaxIterations),
       .advice = "Give start values (k1=300), a prior, or a network of fewer elements."});
}

/// theta = (values, b)
ResidualProblem problem_in_values(const ViscoelasticError& error,
                                  const SpringDashpotNetwork& network) {
  return {.residuals = error.residuals(),
          .evaluate = [&error, own = network](std::span<const double> theta,
                                              std::span<double> residuals,
                                              std::span<double> /*jacobian*/) mutable {
            own.set_values({theta.begin(), theta.end() - 1});
            error.evaluate(relaxation_spectrum(own), theta.back(), residuals);
            return true;
          }};
}

}  // namespace

ViscoelasticFit search_network(const ViscoelasticError& error, const SpringDashpotNetwork& network,
                               const ViscoelasticOptions& options, const FitContext& context) {
  const Search search(error, network);
  const ResidualProblem problem = search.problem(0.0);
  const std::vector<SearchResult> found = finalists(search, problem, options, context);
  std::vector<std::string> errors;
  for (const SearchResult& each : found)
    errors.push_back(fmt::format("{:.4g}", rmse_of(each, problem)));
  SearchResult best = found.front();
  if (options.prior > 0.0) {
    // Networks may have several optima that only the prior distinguishes: the one near the start
    // values must be among those tried.
    std::vector<std::vector<double>> from = search.starts(1, context.seed);
    for (const SearchResult& each : found) from.push_back(each.theta);
    best = minimise_squares_from(search.problem(rmse_of(best, problem) / options.prior), from,
                                 search.options(kMaxIterations, context.progress));
  }
  require_converged(best);
  return {.network = search.network_at(search.values_of(best.theta)),
          .offset = best.theta.back(),
          .notes = {fmt::format("RMSE of the {} best of {} starts: {}", found.size(),
                                options.starts, fmt::join(errors, ", "))}};
}

ViscoelasticFit offset_of_network(const ViscoelasticError& error,
                                  const SpringDashpotNetwork& network) {
  for (const NetworkNode* element : elements_of(network))
    if (!std::isfinite(element->value))
      throw UsageError({.place = "option network",
                        .expected = fmt::format("a value for {0}, like {0}=1, since refine=false",
                                                element->name()),
                        .found = "none"});
  // The residuals are linear in the offset.
  const RelaxationSpectrum spectrum = relaxation_spectrum(network);
  std::vector<double> without(error.residuals());
  std::vector<double> change(error.residuals());
  error.evaluate(spectrum, 0.0, without);
  error.evaluate(spectrum, 1.0, change);
  for (std::size_t n = 0; n < change.size(); ++n) change[n] -= without[n];
  const double squares = std::inner_product(change.begin(), change.end(), change.begin(), 0.0);
  const double product = std::inner_product(change.begin(), change.end(), without.begin(), 0.0);
  return {.network = network,
          .offset = squares > 0.0 ? -product / squares : 0.0,
          .notes = {"values as given, the offset alone fitted"}};
}

ParameterUncertainty uncertainty_of(const ViscoelasticError& error, const ViscoelasticFit& fit) {
  std::vector<double> theta = fit.network.values();
  std::vector<double> typical = theta;
  theta.push_back(fit.offset);
  typical.push_back(error.target_deviation());
  return uncertainty_of(problem_in_values(error, fit.network), theta, typical);
}

std::vector<const NetworkNode*> elements_of(const SpringDashpotNetwork& network) {
  std::vector<const NetworkNode*> elements;
  for (const NetworkNode& node : network.nodes)
    if (node.is_leaf()) elements.push_back(&node);
  return elements;
}

}  // namespace torsio
