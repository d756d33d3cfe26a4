#include "torsio/train/fit_viscoelastic.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "train/excited_band.hpp"
#include "train/network_order.hpp"
#include "train/residual_search.hpp"
#include "train/viscoelastic_error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMostJudged = 30'000;
constexpr double kFloor = 1e-4;  // of the scale
constexpr double kCeiling = 1e6;
constexpr std::size_t kFirstIterations = 12;
constexpr std::size_t kMostIterations = 300;
constexpr std::size_t kFinalists = 3;

std::vector<const NetworkNode*> elements_of(const SpringDashpotNetwork& network) {
  std::vector<const NetworkNode*> elements;
  for (const NetworkNode& node : network.nodes)
    if (node.is_leaf()) elements.push_back(&node);
  return elements;
}

/// theta = (q_1 ... q_n, b) of a network on training data.
class Search {
 public:
  Search(const TrainingData& data, SpringDashpotNetwork network)
      : network_(std::move(network)), error_(data, kMostJudged) {
    if (!(error_.input_deviation() > 0.0) || !(error_.target_deviation() > 0.0))
      throw Error({.problem = "a network of springs needs a deflection and a target that vary",
                   .found = (error_.input_deviation() > 0.0 ? data.target
                                                            : data.inputs.front().expression) +
                            " is constant in the training data"});
    const double stiffness = error_.target_deviation() / error_.input_deviation();
    const double time_s = std::sqrt(error_.period_s() * error_.longest_s());
    for (const NetworkNode* element : elements_of(network_)) {
      scale_.push_back(element->is(NetworkKind::spring) ? stiffness : stiffness * time_s);
      start_.push_back(std::isfinite(element->value) ? element->value : scale_.back());
    }
  }

  [[nodiscard]] const ViscoelasticError& error() const { return error_; }
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
              error_.evaluate(relaxation_spectrum(network_at(values)), theta.back(),
                              residuals.first(error_.residuals()));
              if (pull > 0.0)
                for (std::size_t j = 0; j < values.size(); ++j)
                  residuals[error_.residuals() + j] = pull * std::log(values[j] / start_[j]);
              return true;
            }};
  }

  /// The same in the values themselves.
  [[nodiscard]] ResidualProblem problem_in_values() const {
    return {.residuals = error_.residuals(),
            .evaluate = [this](std::span<const double> theta, std::span<double> residuals,
                               std::span<double> /*jacobian*/) {
              std::vector<double> values(theta.begin(), theta.end() - 1);
              error_.evaluate(relaxation_spectrum(network_at(values)), theta.back(), residuals);
              return true;
            }};
  }

  [[nodiscard]] SearchOptions options(std::size_t most_iterations, Progress progress) const {
    SearchOptions options{.most_iterations = most_iterations,
                          .typical = std::vector<double>(elements(), 1.0),
                          .progress = std::move(progress)};
    options.typical.push_back(error_.target_deviation());
    for (const double scale : scale_) {
      options.lower.push_back(std::log(1e-3 * kFloor * scale));
      options.upper.push_back(std::log(kCeiling * scale));
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
  ViscoelasticError error_;
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
        search.options(kMostIterations,
                       part_of(context.progress, starts.size() + i, starts.size() + last)));
  std::ranges::stable_sort(found, {}, &SearchResult::sum_of_squares);
  return found;
}

void require_converged(const SearchResult& found) {
  if (found.has_converged) return;
  throw Error(
      {.problem = fmt::format("the search did not converge within {} iterations", kMostIterations),
       .advice = "Give start values (k1=300), a prior, or a network of fewer elements."});
}

/// "Nm/rad" of torque_Nm and spring_deflection_rad; empty where the names do not tell.
std::string stiffness_unit(const TrainingData& data) {
  const std::string& input = data.inputs.front().expression;
  const bool is_sum = input.find_first_of("*/^(.") == std::string::npos;
  const std::string above = unit_label(data.target);
  const std::string below = is_sum ? unit_label(input) : std::string();
  return above.empty() || below.empty() ? std::string() : fmt::format("{}/{}", above, below);
}

std::vector<FittedParameter> table_of(const SpringDashpotNetwork& network, double offset,
                                      const std::vector<double>& std_error,
                                      const TrainingData& data) {
  const std::string unit = stiffness_unit(data);
  const std::size_t slash = unit.find('/');
  const std::string damping_unit =
      unit.empty() ? unit : unit.substr(0, slash) + " s" + unit.substr(slash);
  std::vector<FittedParameter> table;
  for (const NetworkNode* element : elements_of(network))
    table.push_back({.name = element->name(),
                     .unit = element->is(NetworkKind::spring) ? unit : damping_unit,
                     .value = element->value,
                     .std_error = std_error[table.size()]});
  table.push_back({.name = "offset",
                   .unit = unit_label(data.target),
                   .value = offset,
                   .std_error = std_error.back()});
  return table;
}

/// Elements that a branch's rate hangs on: |d ln p / d ln value| of a fifth or more.
std::vector<std::string> elements_behind(const SpringDashpotNetwork& network, std::size_t branch) {
  constexpr double kMoved = 1.01;
  constexpr double kShare = 0.2;
  const RelaxationSpectrum spectrum = relaxation_spectrum(network);
  const std::vector<double> values = network.values();
  const std::vector<std::string> names = network.names();
  std::vector<std::string> behind;
  for (std::size_t j = 0; j < values.size(); ++j) {
    std::vector<double> moved = values;
    moved[j] *= kMoved;
    SpringDashpotNetwork other = network;
    other.set_values(moved);
    const auto branches = relaxation_spectrum(other).branches;
    if (branch >= branches.size()) continue;
    const double change = std::log(branches[branch].rate_1_s / spectrum.branches[branch].rate_1_s);
    if (std::abs(change) >= kShare * std::log(kMoved)) behind.push_back(names[j]);
  }
  return behind;
}

void note_relaxation(std::vector<std::string>& notes, const SpringDashpotNetwork& network,
                     const TrainingData& data) {
  const auto branches = relaxation_spectrum(network).branches;
  if (branches.empty()) return;
  std::vector<std::string> times;
  for (const RelaxationBranch& branch : branches)
    times.push_back(fmt::format("{:.3g} s", 1.0 / branch.rate_1_s));
  notes.push_back(fmt::format("relaxes within {}", fmt::join(times, ", ")));
  const ExcitedBand band = excited_band(data);
  for (std::size_t i = 0; i < branches.size(); ++i) {
    const double frequency_Hz = branches[i].rate_1_s / (2.0 * std::acos(-1.0));
    const bool is_below = frequency_Hz < 0.5 * band.lowest_Hz;
    if (!is_below && frequency_Hz <= 2.0 * band.highest_Hz) continue;
    notes.push_back(fmt::format(
        "relaxation {} ({:.2g} Hz) lies {} the {:.2g} to {:.2g} Hz that the records excite, which "
        "see "
        "only its tail: {} may be far off; add a {} record, or a prior",
        times[i], frequency_Hz, is_below ? "below" : "above", band.lowest_Hz, band.highest_Hz,
        fmt::join(elements_behind(network, i), ", "), is_below ? "slow" : "fast"));
  }
}

void note_uncertainty(std::vector<std::string>& notes, const ParameterUncertainty& uncertainty,
                      const std::vector<FittedParameter>& table) {
  std::vector<std::string> names;
  for (const FittedParameter& each : table) names.push_back(each.name);
  for (const auto& direction : uncertainty.null_directions)
    notes.push_back(fmt::format("the data cannot tell {} (relative changes)",
                                description_of(direction, names)));
  constexpr double kHardly = 0.5;
  for (std::size_t j = 0; j + 1 < table.size(); ++j)
    if (table[j].std_error > kHardly * table[j].value)
      notes.push_back(fmt::format("the data hardly tell {}: {:.3g} +- {:.2g} {}", table[j].name,
                                  table[j].value, table[j].std_error, table[j].unit));
}

void note_unused(std::vector<std::string>& notes, const TrainingData& data) {
  if (data.input_count() == 1) return;
  std::vector<std::string> names;
  for (std::size_t j = 1; j < data.input_count(); ++j) names.push_back(data.inputs[j].expression);
  notes.push_back(fmt::format("{} not used: the network is between both sides of {} alone",
                              fmt::join(names, ", "), data.inputs.front().expression));
}

void check(const ViscoelasticOptions& options) {
  if (options.starts < 1)
    throw UsageError({.place = "option starts", .expected = "1 or more", .found = "0"});
  if (!(options.prior >= 0.0))
    throw UsageError({.place = "option prior",
                      .expected = "0 or more",
                      .found = fmt::format("{}", options.prior)});
}

}  // namespace

Fitted<Viscoelastic> fit_viscoelastic(const TrainingData& data, const ViscoelasticOptions& options,
                                      const FitContext& context) {
  check(options);
  const Search search(data, parse_network(options.network));
  const ResidualProblem problem = search.problem(0.0);
  std::vector<SearchResult> found = finalists(search, problem, options, context);
  std::vector<std::string> errors;
  for (const SearchResult& each : found)
    errors.push_back(fmt::format("{:.4g}", rmse_of(each, problem)));
  SearchResult best = found.front();
  if (options.prior > 0.0)
    best = minimise_squares(search.problem(rmse_of(best, problem) / options.prior), best.theta,
                            search.options(kMostIterations, context.progress));
  require_converged(best);

  Fitted<Viscoelastic> fitted;
  const double offset = best.theta.back();
  const SpringDashpotNetwork network =
      fastest_first(search.network_at(search.values_of(best.theta)));
  fitted.parameters = {.network = network,
                       .offset = offset,
                       .sample_period_s = search.error().period_s(),
                       .inputs = data.input_count()};
  std::vector<double> theta = network.values();
  theta.push_back(offset);
  std::vector<double> typical = network.values();
  typical.push_back(search.error().target_deviation());
  const ParameterUncertainty uncertainty =
      uncertainty_of(search.problem_in_values(), theta, typical);
  fitted.table = table_of(network, offset, uncertainty.std_error, data);
  fitted.notes.push_back(text_of(network, 4));
  fitted.notes.push_back(fmt::format("RMSE of the {} best of {} starts: {}", found.size(),
                                     options.starts, fmt::join(errors, ", ")));
  note_unused(fitted.notes, data);
  note_relaxation(fitted.notes, network, data);
  note_uncertainty(fitted.notes, uncertainty, fitted.table);
  return fitted;
}

}  // namespace torsio
