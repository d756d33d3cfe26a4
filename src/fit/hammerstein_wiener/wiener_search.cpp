#include "fit/hammerstein_wiener/wiener_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "fit/common/folds.hpp"
#include "fit/hammerstein_wiener/wiener_problem.hpp"
#include "numerics/parallel.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxStarts = 64;  // numbers for the states that records start from

WienerShape shape_of(const HammersteinWienerOptions& options, std::size_t zeros, std::size_t poles,
                     std::size_t input_degree, std::size_t output_degree) {
  WienerShape shape{.zeros = options.zeros.value_or(zeros),
                    .poles = options.poles.value_or(poles),
                    .is_piecewise_linear = options.is_piecewise_linear,
                    .input_values = options.input_degree.value_or(input_degree) + 1,
                    .output_values = options.output_degree.value_or(output_degree) + 1};
  if (options.is_piecewise_linear) shape.input_values = shape.output_values = options.knots;
  return shape;
}

std::size_t numbers_of(const WienerShape& shape) {
  return shape.zeros + shape.poles + shape.input_values + shape.output_values;
}

std::string text_of(const WienerShape& shape) {
  const auto many = [](std::size_t n, const char* one, const char* more) {
    return fmt::format("{} {}", n, n == 1 ? one : more);
  };
  const std::string orders =
      many(shape.zeros, "zero", "zeros") + ", " + many(shape.poles, "pole", "poles");
  if (shape.is_piecewise_linear) return fmt::format("{}, {} knots", orders, shape.input_values);
  return fmt::format("{}, degrees {} and {}", orders, shape.input_values - 1,
                     shape.output_values - 1);
}

/// The data with one fold left out, or with nothing else.
WienerData fold_of(WienerData data, std::size_t fold, bool is_held_out) {
  for (WienerRecord& record : data.records)
    for (std::size_t n = 0; n < record.scored.size(); ++n)
      if ((interleaved_fold(n, record.scored.size()) == fold) != is_held_out) record.scored[n] = 0;
  return data;
}

double rmse_of_sum(double sum_of_squares, std::size_t samples) {
  return samples == 0 || !std::isfinite(sum_of_squares)
             ? std::numeric_limits<double>::infinity()
             : std::sqrt(sum_of_squares / static_cast<double>(samples));
}

/// RMSE on the held-out blocks, each search from the numbers that fit all blocks.
double held_out_error(const WienerData& data, const WienerNumbers& numbers,
                      const WienerLimits& limits, const Progress& progress) {
  struct Fold {
    double sum = 0.0;
    std::size_t samples = 0;
  };
  std::array<Fold, kFolds> folds;
  SharedProgress done(progress, 0.0, 1.0, kFolds, "held-out blocks");
  for_each_chunk(kFolds, 0, [&](std::size_t fold) {
    const WienerData rest = fold_of(data, fold, false);
    const WienerData held_out = fold_of(data, fold, true);
    if (rest.scored_samples() > 0 && held_out.scored_samples() > 0)
      folds.at(fold) = {held_sum_of_squares(held_out, refined(rest, numbers, limits).numbers),
                        held_out.scored_samples()};
    done.tick();
  });
  double sum = 0.0;
  std::size_t samples = 0;
  for (const Fold& fold : folds) {
    sum += fold.sum;
    samples += fold.samples;
  }
  return rmse_of_sum(sum, samples);
}

class ShapeSearch {
 public:
  ShapeSearch(const WienerData& data, std::size_t iterations, const Progress& progress)
      : data_(data),
        limits_{.iterations = iterations, .tolerance = kCoarseTolerance},
        progress_(progress) {}

  /// The smallest within 1 % of the best.
  ///
  /// The error L_f on a held-out block f is at least that of the fit to all blocks: from L(all) <= L(rest) and
  /// L_rest(rest) <= L_rest(all) follows L_f(rest) >= L_f(all). So a structure that is worse on all blocks than another
  /// one on held-out ones need not be searched on these.
  const WienerShape& best_of(std::vector<WienerShape> shapes, double begin, double end) {
    std::ranges::stable_sort(shapes, {}, numbers_of);
    shapes.erase(std::unique(shapes.begin(), shapes.end()), shapes.end());
    const double middle = 0.5 * (begin + end);
    const Progress first_half = share_of(progress_, begin, middle);
    ProgressOfParts parts(first_half, shapes.size());
    candidates_.assign(shapes.size(), {});
    for_each_chunk(shapes.size(), 0, [&](std::size_t i) {
      candidates_[i] = fitted_to_all(shapes[i], with_name(parts.part(i), shapes[i]));
    });
    failed_ += static_cast<std::size_t>(std::ranges::count_if(
        candidates_, [](const Candidate& candidate) { return !candidate.fit.has_value(); }));
    tried_ += shapes.size();
    std::vector<std::size_t> order(candidates_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return candidates_[i].fit_error; });
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < order.size(); ++k) {
      Candidate& each = candidates_[order[k]];
      if (!each.fit || each.fit_error > kGood * least) continue;
      const double share = (end - middle) / static_cast<double>(order.size());
      const double from = middle + static_cast<double>(k) * share;
      each.held_out_error =
          held_out_error(data_, each.fit->numbers, limits_,
                         with_name(share_of(progress_, from, from + share), each.shape));
      least = std::min(least, each.held_out_error);
      if (!std::isfinite(each.held_out_error)) ++failed_;
    }
    return best().shape;
  }

  /// The best structure of the last comparison whose search ends to the fine tolerance, too.
  WienerChoice choice(double begin, double end) {
    while (true) {
      Candidate& chosen = best();
      WienerFit fit = refined(data_, chosen.fit->numbers, {.iterations = limits_.iterations},
                              share_of(progress_, begin, end));
      if (fit.has_converged) return {chosen.shape, std::move(fit), note(chosen)};
      chosen.held_out_error = std::numeric_limits<double>::infinity();
      ++failed_;
    }
  }

 private:
  static constexpr double kGood = 1.01;

  struct Candidate {
    WienerShape shape = {};
    std::optional<WienerFit> fit = {};  ///< to all blocks; none: its search did not end
    double fit_error = std::numeric_limits<double>::infinity();
    double held_out_error = std::numeric_limits<double>::infinity();
  };

  [[nodiscard]] Candidate& best() {
    const auto least = std::ranges::min_element(candidates_, {}, &Candidate::held_out_error);
    if (least == candidates_.end() || !std::isfinite(least->held_out_error))
      throw Error(
          {.place = "hammerstein_wiener",
           .problem = "no structure's search converged",
           .advice = "Give zeros, poles and degrees (structure=given) to see why one fails."});
    const double limit = kGood * least->held_out_error;
    return *std::ranges::find_if(
        candidates_, [&](const Candidate& each) { return each.held_out_error <= limit; });
  }

  [[nodiscard]] std::string note(const Candidate& chosen) const {
    return fmt::format(
        "{}: the smallest of {} structures within 1 % of the least error on held-out blocks, "
        "{:.4g} in the target's unit{}",
        text_of(chosen.shape), tried_, chosen.held_out_error,
        failed_ == 0 ? "" : fmt::format("; {} did not converge and were passed over", failed_));
  }

  [[nodiscard]] Candidate fitted_to_all(const WienerShape& shape, const Progress& progress) const {
    Candidate candidate{.shape = shape, .fit = fit_shape(data_, shape, limits_, progress)};
    if (candidate.fit && candidate.fit->has_converged)
      candidate.fit_error = rmse_of_sum(candidate.fit->sum_of_squares, data_.scored_samples());
    else
      candidate.fit.reset();
    return candidate;
  }

  static Progress with_name(Progress progress, const WienerShape& shape) {
    if (!progress) return {};
    return [progress = std::move(progress), text = text_of(shape)](double share,
                                                                   std::string_view doing) {
      return progress(share, fmt::format("{}: {}", text, doing));
    };
  }

  const WienerData& data_;
  WienerLimits limits_;
  const Progress& progress_;
  std::size_t tried_ = 0;
  std::size_t failed_ = 0;
  std::vector<Candidate> candidates_ = {};  ///< those compared last, the smallest first
};

}  // namespace

WienerFit refined(const WienerData& data, const WienerNumbers& start, const WienerLimits& limits,
                  const Progress& progress) {
  const WienerError error(data, start);
  const std::vector<double> theta = stable_start(error, error.pack(start));
  const WienerChart chart = stable_chart(error);
  const ResidualProblem problem = wiener_problem(error, theta.size(), chart);
  SearchOptions options{
      .max_iterations = limits.iterations, .tolerance = limits.tolerance, .progress = progress};
  SearchResult found = minimise_squares(problem, theta, options);
  const std::vector<double> bound = stable_bound(error);
  const auto is_beyond = [](double theta_i, double most) { return std::abs(theta_i) > most; };
  if (!found.has_converged && !std::ranges::equal(found.theta, bound, std::not_fn(is_beyond))) {
    // Along a pole's edge there is no end. Bounds from the beginning would cost every search.
    options.upper = bound;
    options.lower.resize(bound.size());
    std::ranges::transform(bound, options.lower.begin(), std::negate{});
    found = minimise_squares(problem, std::move(found.theta), options);
  }
  std::vector<double> packed(error.size());
  Matrix no_slopes;
  chart(found.theta, packed, no_slopes);
  return {error.unpack(packed), found.sum_of_squares, found.has_converged, found.iterations};
}

std::optional<WienerFit> fit_shape(const WienerData& data, const WienerShape& shape,
                                   const WienerLimits& limits, const Progress& progress) {
  const std::size_t sections = (std::max({shape.zeros, shape.poles, std::size_t{1}}) + 1) / 2;
  const bool has_start = 2 * sections * data.records.size() <= kMaxStarts;
  std::optional<WienerFit> best;
  std::vector<WienerNumbers> starts = wiener_starts(data, shape, has_start);
  // A part of a long record is sufficient to rank the starts.
  constexpr std::size_t kEnough = 10'000;
  if (starts.size() > 1 && data.scored_samples() > 2 * kEnough) {
    const WienerData part = front_of(data, kEnough);
    if (part.scored_samples() > 0) {
      std::vector<WienerFit> tried;
      tried.reserve(starts.size());
      for (const WienerNumbers& start : starts) tried.push_back(refined(part, start, limits));
      starts = {std::ranges::min_element(tried, {}, &WienerFit::sum_of_squares)->numbers};
    }
  }
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const auto begin = static_cast<double>(i) / static_cast<double>(starts.size());
    WienerFit fit =
        refined(data, starts[i], limits,
                share_of(progress, begin, begin + 1.0 / static_cast<double>(starts.size())));
    // A search that ended goes before one that did not, whatever its error.
    if (!best || std::pair(!fit.has_converged, fit.sum_of_squares) <
                     std::pair(!best->has_converged, best->sum_of_squares))
      best = std::move(fit);
  }
  return best;
}

namespace {

/// x of the scored samples.
Interval inner_range(const WienerData& data, const WienerNumbers& numbers) {
  const std::vector<double> x = WienerError(data, numbers).inner(numbers);
  const auto [lowest, highest] = std::ranges::minmax(x);
  return {lowest, highest};
}

}  // namespace

HammersteinWiener::Parameters parameters_of(const WienerData& data, const WienerNumbers& numbers,
                                            std::size_t inputs) {
  HammersteinWiener::Parameters parameters{.inputs = inputs,
                                           .sample_period_s = data.sample_period_s,
                                           .rest_input = data.rest_input,
                                           .input = numbers.input,
                                           .sections = numbers.sections,
                                           .output = numbers.output};
  const double at_rest = parameters.input(data.rest_input);
  if (parameters.input.knots.empty())
    parameters.input.values.front() -= at_rest;
  else
    for (double& value : parameters.input.values) value -= at_rest;
  Interval trained = inner_range(data, numbers);
  if (numbers.start.rows > 0) {
    // A run in the loop begins at rest, wherever the records began.
    WienerNumbers at_rest_first = numbers;
    at_rest_first.start = {};
    const Interval rest = inner_range(data, at_rest_first);
    trained = {std::min(trained.lowest, rest.lowest), std::max(trained.highest, rest.highest)};
  }
  if (!(trained.lowest < trained.highest)) trained = {trained.lowest - 1.0, trained.highest + 1.0};
  const Interval part = monotone_part(numbers.output, trained);
  parameters.lowest = part.lowest;
  parameters.highest = part.highest;
  return parameters;
}

double held_sum_of_squares(const WienerData& data, const WienerNumbers& numbers) {
  HammersteinWiener model(parameters_of(data, numbers, 1));
  double sum = 0.0;
  for (std::size_t r = 0; r < data.records.size(); ++r) {
    const WienerRecord& record = data.records[r];
    model.reset();
    if (numbers.start.rows > 0) model.set_state(numbers.start.row(r));
    for (std::size_t n = 0; n < record.input.size(); ++n) {
      const double value = model.step({&record.input[n], 1}).value;
      if (record.scored[n] != 0) sum += std::pow(value - record.target[n], 2);
    }
  }
  return sum;
}

WienerShape given_shape(const HammersteinWienerOptions& options) {
  return shape_of(options, 1, 2, 2, 3);
}

WienerChoice chosen_shape(const WienerData& data, const HammersteinWienerOptions& options,
                          const Progress& progress) {
  ShapeSearch search(data, options.iterations, progress);
  std::vector<WienerShape> shapes;
  for (const auto& [zeros, poles] :
       {std::pair{0U, 1U}, {1U, 1U}, {1U, 2U}, {2U, 2U}, {2U, 3U}, {3U, 3U}, {3U, 4U}, {4U, 4U}})
    shapes.push_back(shape_of(options, zeros, poles, 1, 3));
  const WienerShape best = search.best_of(shapes, 0.0, 0.5);
  shapes.clear();
  for (const std::size_t input : {1U, 2U, 3U})
    for (const std::size_t output : {1U, 2U, 3U, 5U})
      shapes.push_back(shape_of(options, best.zeros, best.poles, input, output));
  // What was given stays given: only the other order is the search's.
  for (WienerShape& shape : shapes) shape.zeros = best.zeros, shape.poles = best.poles;
  (void)search.best_of(shapes, 0.5, 0.9);
  return search.choice(0.9, 1.0);
}

}  // namespace torsio
