#include "fit/second_order/simulation_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/report_progress.hpp"
#include "fit/common/usable_table.hpp"
#include "numerics/residual_search.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::size_t scored_samples(const TrainingData& data, std::size_t horizon) {
  std::size_t scored = 0;
  for (const Sequence& sequence : data.sequences)
    for (std::size_t n = 0; n < std::min(horizon, sequence.target.size()); ++n)
      scored += sequence.use[n];
  return scored;
}

double target_spread(const TrainingData& data) {
  const std::vector<double> target = usable_table(data).target;
  const auto [lowest, highest] = std::ranges::minmax(target);
  return highest - lowest;
}

/// Share of the spread per sample: a speed that is not negligible.
constexpr double kVelocityShare = 0.01;

/// The unknowns, each over its typical size: parameters, then the searched states of each sequence.
class Unknowns {
 public:
  Unknowns(const SimulatedModel& model, const TrainingData& data, std::size_t start_samples)
      : model_(model), data_(data), start_samples_(start_samples), spread_(target_spread(data)) {
    for (const SearchedParameter& each : model.parameters) {
      scale_.push_back(each.typical);
      lower_.push_back(each.lowest / each.typical);
      upper_.push_back(each.highest / each.typical);
    }
    for (const Sequence& sequence : data.sequences) {
      starts_.push_back(measured_start(sequence, data.sample_rate_Hz));
      starts_.back().resize(model.free_states, 0.0);
    }
    if (start_samples == 0 && data.sequences.size() <= kMaxSearchedStarts)
      searched_ = model.free_states;
    for (std::size_t i = 0; i < data.sequences.size(); ++i)
      for (std::size_t j = 0; j < searched_; ++j) {
        scale_.push_back(j == 1 ? spread_ * data.sample_rate_Hz * kVelocityShare : spread_);
        lower_.push_back(-HUGE_VAL);
        upper_.push_back(HUGE_VAL);
      }
  }

  [[nodiscard]] SearchOptions options(std::size_t max_iterations, double tolerance,
                                      Progress progress) const {
    return {.max_iterations = max_iterations,
            .lower = lower_,
            .upper = upper_,
            .typical = std::vector<double>(scale_.size(), 1.0),
            .tolerance = tolerance,
            .progress = std::move(progress)};
  }
  [[nodiscard]] std::vector<double> from(std::span<const double> parameters) const {
    std::vector<double> unknowns(parameters.begin(), parameters.end());
    if (searched_ > 0)
      for (const std::vector<double>& start : starts_)
        unknowns.insert(unknowns.end(), start.begin(), start.end());
    for (std::size_t i = 0; i < unknowns.size(); ++i) unknowns[i] /= scale_[i];
    return unknowns;
  }
  [[nodiscard]] std::vector<double> parameters(std::span<const double> unknowns) const {
    std::vector<double> values(model_.parameters.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = unknowns[i] * scale_[i];
    return values;
  }
  /// Nothing if the first samples do not determine the start.
  [[nodiscard]] std::optional<std::vector<double>> start(std::span<const double> unknowns,
                                                         std::size_t i) const {
    if (start_samples_ > 0)
      return start_by_first(model_, parameters(unknowns), data_.sequences[i], data_.sample_rate_Hz,
                            spread_, start_samples_);
    std::vector<double> state = starts_[i];
    const std::size_t first = model_.parameters.size() + i * searched_;
    for (std::size_t j = 0; j < searched_; ++j) state[j] = unknowns[first + j] * scale_[first + j];
    return state;
  }

  /// Residuals of the first `horizon` samples of each sequence, over the target's spread.
  [[nodiscard]] ResidualProblem problem(std::size_t horizon, double difference) const {
    return {.residuals = scored_samples(data_, horizon),
            .evaluate =
                [this, horizon](std::span<const double> unknowns, std::span<double> residuals,
                                std::span<double> /*jacobian*/) {
                  return evaluate(unknowns, horizon, residuals);
                },
            .difference = difference};
  }

 private:
  bool evaluate(std::span<const double> unknowns, std::size_t horizon,
                std::span<double> residuals) const {
    const std::vector<double> values = parameters(unknowns);
    std::vector<double> output;
    std::size_t next = 0;
    for (std::size_t i = 0; i < data_.sequences.size(); ++i) {
      const Sequence& sequence = data_.sequences[i];
      output.assign(std::min(horizon, sequence.target.size()), 0.0);
      const auto state = start(unknowns, i);
      if (!state || !model_.run(values, *state, sequence, output)) return false;
      for (std::size_t n = 0; n < output.size(); ++n)
        if (sequence.use[n] != 0) residuals[next++] = (output[n] - sequence.target[n]) / spread_;
    }
    return true;
  }

  const SimulatedModel& model_;
  const TrainingData& data_;
  std::size_t start_samples_;
  double spread_;
  std::vector<std::vector<double>> starts_;
  std::vector<double> scale_;
  std::vector<double> lower_;
  std::vector<double> upper_;
  std::size_t searched_ = 0;  ///< states of a start
};

/// What free runs make of the first samples of a sequence.
class FirstSamples {
 public:
  FirstSamples(const SimulatedModel& model, std::span<const double> parameters,
               const Sequence& sequence, std::size_t samples)
      : model_(model),
        parameters_(parameters),
        sequence_(sequence),
        told_(std::min(samples, sequence.target.size())) {}

  /// Nothing if they cannot be computed from that state.
  [[nodiscard]] std::optional<Eigen::VectorXd> misses(std::span<const double> state) {
    if (!model_.run(parameters_, state, sequence_, told_)) return std::nullopt;
    Eigen::VectorXd miss = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(told_.size()));
    for (std::size_t n = 0; n < told_.size(); ++n)
      if (sequence_.use[n] != 0)
        miss[static_cast<Eigen::Index>(n)] = told_[n] - sequence_.target[n];
    return miss;
  }
  /// Derivatives of the residuals by the states, each over its scale: samples x states.
  [[nodiscard]] std::optional<Eigen::MatrixXd> slopes(const std::vector<double>& state,
                                                      const Eigen::VectorXd& scale) {
    constexpr double kDifference = 1e-3;
    Eigen::MatrixXd slopes(told_.size(), state.size());
    for (std::size_t j = 0; j < state.size(); ++j) {
      const auto column = static_cast<Eigen::Index>(j);
      std::vector<double> moved = state;
      moved[j] = state[j] + kDifference * scale[column];
      const auto above = misses(moved);
      moved[j] = state[j] - kDifference * scale[column];
      const auto below = misses(moved);
      if (!above || !below) return std::nullopt;
      slopes.col(column) = (*above - *below) / (2.0 * kDifference);
    }
    return slopes;
  }

 private:
  const SimulatedModel& model_;
  std::span<const double> parameters_;
  const Sequence& sequence_;
  std::vector<double> told_;
};

std::pair<double, double> range_of_input(const Table& table, std::size_t input) {
  double lowest = table.features(0, input);
  double highest = lowest;
  for (std::size_t n = 0; n < table.features.rows; ++n) {
    lowest = std::min(lowest, table.features(n, input));
    highest = std::max(highest, table.features(n, input));
  }
  return {lowest, highest};
}

void add_table(SimulationFit& fit, const SimulatedModel& model, const ResidualProblem& problem,
               std::span<const double> theta) {
  const std::vector<double> ones(theta.size(), 1.0);
  const ParameterUncertainty output = uncertainty_of(problem, theta, ones);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < model.parameters.size(); ++i) {
    const SearchedParameter& each = model.parameters[i];
    fit.table.push_back({.name = each.name,
                         .unit = each.unit,
                         .value = fit.parameters[i],
                         .std_error = output.std_error[i] * each.typical});
    names.push_back(each.name);
  }
  while (names.size() < theta.size()) names.emplace_back("a start");
  constexpr double kPart = 0.05;
  for (const std::vector<double>& direction : output.null_directions) {
    const auto of_parameters = std::span(direction).first(model.parameters.size());
    if (std::ranges::none_of(of_parameters, [](double part) { return std::abs(part) > kPart; }))
      continue;  // starts that leave no trace
    fit.notes.push_back("the data do not determine " + description_of(direction, names) +
                        " (each over its typical size)");
  }
}

}  // namespace

std::size_t longest_sequence(const TrainingData& data) {
  std::size_t longest = 0;
  for (const Sequence& sequence : data.sequences)
    longest = std::max(longest, sequence.target.size());
  return longest;
}

std::vector<double> measured_start(const Sequence& sequence, double sample_rate_Hz) {
  constexpr std::size_t kSamples = 10;
  double n = 0.0;
  double t = 0.0;
  double y = 0.0;
  double tt = 0.0;
  double ty = 0.0;
  for (std::size_t i = 0; i < sequence.target.size() && n < kSamples; ++i) {
    if (!std::isfinite(sequence.target[i])) continue;
    const double time_s = static_cast<double>(i) / sample_rate_Hz;
    n += 1.0;
    t += time_s;
    y += sequence.target[i];
    tt += time_s * time_s;
    ty += time_s * sequence.target[i];
  }
  const double width = n * tt - t * t;
  if (!(width > 0.0)) return {n > 0.0 ? y / n : 0.0, 0.0};
  const double speed = (n * ty - t * y) / width;
  return {(y - speed * t) / n, speed};
}

SimulationFit fit_by_simulation(const SimulatedModel& model, const TrainingData& data,
                                const std::vector<std::vector<double>>& starts,
                                const SimulationFitOptions& options) {
  if (options.first_horizon == 0 || options.growth < 2)
    throw UsageError({.place = "first_horizon, growth",
                      .expected = "a first horizon from 1 sample and a growth from 2",
                      .found = fmt::format("{} and {}", options.first_horizon, options.growth)});
  const Unknowns unknowns(model, data, options.start_samples);
  const std::size_t longest = longest_sequence(data);
  std::vector<std::vector<double>> from;
  from.reserve(starts.size());
  for (const std::vector<double>& start : starts) from.push_back(unknowns.from(start));
  const std::size_t least = 2 * from.front().size();
  if (scored_samples(data, longest) < least)
    throw Error({.problem = "the training records are too short to simulate",
                 .expected = fmt::format("at least {} samples for {} unknowns", least, least / 2),
                 .found = std::to_string(scored_samples(data, longest))});
  std::size_t horizon = std::min(options.first_horizon, longest);
  while (scored_samples(data, horizon) < least) horizon = std::min(2 * horizon, longest);
  SearchResult best;
  for (std::size_t kept = options.kept;; kept = (kept + 1) / 2) {
    const bool is_last = horizon == longest;
    const Progress progress = [&](double fraction, std::string_view doing) {
      report_progress(options.progress, fraction, fmt::format("{} samples, {}", horizon, doing));
      return true;
    };
    constexpr std::size_t kIterationsToRankStarts = 25;
    std::vector<SearchResult> found;
    for (const double difference : model.differences) {
      found = minimise_squares_each(
          unknowns.problem(horizon, difference), from,
          unknowns.options(is_last ? options.max_iterations : kIterationsToRankStarts,
                           options.tolerance, progress));
      from.resize(found.size());
      std::ranges::transform(found, from.begin(), &SearchResult::theta);
    }
    best = found.front();
    if (is_last) break;
    from.resize(std::min(from.size(), kept));
    horizon = std::min(horizon * options.growth, longest);
  }
  if (!best.has_converged)
    throw Error({.problem = fmt::format("no convergence in {} iterations", best.iterations),
                 .advice = "Allow more (--set iterations=...), or check that the input drives the "
                           "target and their units."});
  SimulationFit fit{.parameters = unknowns.parameters(best.theta)};
  const ResidualProblem problem = unknowns.problem(longest, model.differences.back());
  fit.samples = problem.residuals;
  fit.rmse =
      target_spread(data) * std::sqrt(best.sum_of_squares / static_cast<double>(problem.residuals));
  add_table(fit, model, problem, best.theta);
  return fit;
}

std::optional<std::vector<double>> start_by_first(const SimulatedModel& model,
                                                  std::span<const double> parameters,
                                                  const Sequence& sequence, double sample_rate_Hz,
                                                  double spread, std::size_t samples) {
  // Positions and speeds enter the first samples all but linearly: few steps, and many such searches.
  constexpr int kMaxSteps = 5;
  constexpr double kLeftOpen = 1e-12;
  constexpr double kWorthIt = 0.999;
  std::vector<double> state = measured_start(sequence, sample_rate_Hz);
  state.resize(model.free_states, 0.0);
  Eigen::VectorXd scale =
      Eigen::VectorXd::Constant(static_cast<Eigen::Index>(state.size()), spread);
  if (scale.size() > 1) scale[1] *= sample_rate_Hz * kVelocityShare;
  FirstSamples first(model, parameters, sequence, samples);
  std::optional<Eigen::VectorXd> miss = first.misses(state);
  if (!miss) return std::nullopt;
  for (int step = 0; step < kMaxSteps; ++step) {
    const std::optional<Eigen::MatrixXd> slope = first.slopes(state, scale);
    if (!slope) break;
    Eigen::MatrixXd normal = slope->transpose() * *slope;
    normal.diagonal().array() += kLeftOpen * spread * spread;
    const Eigen::VectorXd change =
        normal.ldlt().solve(slope->transpose() * *miss).cwiseProduct(scale);
    std::vector<double> next = state;
    for (std::size_t j = 0; j < state.size(); ++j) next[j] -= change[static_cast<Eigen::Index>(j)];
    std::optional<Eigen::VectorXd> next_miss = first.misses(next);
    if (!next_miss || !(next_miss->squaredNorm() < miss->squaredNorm())) break;
    const bool is_done = next_miss->squaredNorm() > kWorthIt * miss->squaredNorm();
    state = std::move(next);
    miss = std::move(next_miss);
    if (is_done) break;
  }
  return state;
}

double held_out_rmse(const SimulatedModel& model, std::span<const double> parameters,
                     const TrainingData& data, std::size_t initialise) {
  const double spread = target_spread(data);
  double sum = 0.0;
  std::size_t scored = 0;
  for (const Sequence& sequence : data.sequences) {
    const auto start =
        start_by_first(model, parameters, sequence, data.sample_rate_Hz, spread, initialise);
    std::vector<double> output(sequence.target.size(), 0.0);
    if (!start || !model.run(parameters, *start, sequence, output))
      return std::numeric_limits<double>::infinity();
    for (std::size_t n = initialise; n < output.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      sum += (output[n] - sequence.target[n]) * (output[n] - sequence.target[n]);
      ++scored;
    }
  }
  return scored > 0 ? std::sqrt(sum / static_cast<double>(scored))
                    : std::numeric_limits<double>::infinity();
}

void require_excitation(const TrainingData& data) {
  const Table table = usable_table(data);
  const auto [weakest, strongest] = range_of_input(table, 0);
  if (!(weakest < strongest))
    throw Error({.place = data.inputs[0].expression,
                 .expected = "a force that changes: nothing else drives the motion",
                 .found = fmt::format("{} in every training sample", weakest)});
  const auto [lowest, highest] = std::ranges::minmax(table.target);
  if (!(lowest < highest))
    throw Error({.place = data.target,
                 .expected = "a target that moves",
                 .found = fmt::format("{} in every training sample", lowest)});
}

std::vector<SearchedParameter> further_gains(const TrainingData& data) {
  const Table table = usable_table(data);
  const auto size_of = [&](std::size_t input) {
    const auto [lowest, highest] = range_of_input(table, input);
    return std::max(std::abs(lowest), std::abs(highest));
  };
  std::vector<SearchedParameter> gains;
  for (std::size_t j = 1; j < data.input_count(); ++j)
    gains.push_back({.name = "gain of " + data.inputs[j].expression,
                     .unit = "",
                     .typical = size_of(j) > 0.0 ? size_of(0) / size_of(j) : 1.0});
  return gains;
}

TrainingData in_blocks(const TrainingData& data, std::size_t blocks) {
  const std::size_t length = std::max<std::size_t>(data.usable_samples() / blocks, 1);
  TrainingData cut = data;
  cut.sequences.clear();
  for (const Sequence& whole : data.sequences) {
    std::vector<std::size_t> usable;
    for (std::size_t n = 0; n < whole.use.size(); ++n)
      if (whole.use[n] != 0) usable.push_back(n);
    if (usable.empty()) continue;
    const std::size_t parts = std::max<std::size_t>((usable.size() + length / 2) / length, 1);
    std::size_t begin = 0;
    for (std::size_t i = 1; i <= parts; ++i) {
      // A block ends where the next one has its first usable sample, the last one after its own last.
      const std::size_t end = i < parts ? usable[usable.size() * i / parts] : usable.back() + 1;
      const auto first = static_cast<std::ptrdiff_t>(begin);
      const auto last = static_cast<std::ptrdiff_t>(end);
      Sequence& part = cut.sequences.emplace_back(Sequence{
          .recording = whole.recording, .features = Matrix(end - begin, data.input_count())});
      for (std::size_t n = begin; n < end; ++n)
        std::ranges::copy(whole.features.row(n), part.features.row(n - begin).begin());
      part.target.assign(whole.target.begin() + first, whole.target.begin() + last);
      part.use.assign(whole.use.begin() + first, whole.use.begin() + last);
      begin = end;
    }
  }
  return cut;
}

EndStops end_stops(const TrainingData& data) {
  constexpr double kWidths = 5.0;
  const std::vector<double> target = usable_table(data).target;
  const auto [lowest, highest] = std::ranges::minmax(target);
  const double margin = kWidths * (highest - lowest);
  return {.lowest = std::min(lowest, 0.0) - margin, .highest = std::max(highest, 0.0) + margin};
}

}  // namespace torsio
