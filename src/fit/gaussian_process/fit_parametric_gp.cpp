#include "fit/gaussian_process/fit_parametric_gp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string_view>
#include <utility>

#include "core/report_progress.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/folds.hpp"
#include "fit/common/least_samples.hpp"
#include "fit/common/memory_check.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/gaussian_process/kernel_data.hpp"
#include "fit/gaussian_process/kernel_search.hpp"
#include "fit/gaussian_process/parametric_gp_trainer.hpp"
#include "fit/gaussian_process/sparse_posterior.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

// Specification 3.3
constexpr double kPaperStart = 0.3;
constexpr double kPaperRate = 0.1;
constexpr std::size_t kWidenEvery = 1000;
constexpr double kWidenUntil = 0.8;
constexpr std::size_t kMaxClustered = 20000;  // more samples do not move the centres
constexpr double kFirstNoise = 0.1;           // variance of the standardised target

/// Adam (Kingma and Ba 2015) with its usual numbers.
class Adam {
 public:
  Adam(std::size_t size, double rate) : rate_(rate), first_(size, 0.0), second_(size, 0.0) {}

  void move(std::span<const double> gradient, std::vector<double>& numbers) {
    first_share_ *= 0.9;
    second_share_ *= 0.999;
    for (std::size_t p = 0; p < numbers.size(); ++p) {
      first_[p] += 0.1 * (gradient[p] - first_[p]);
      second_[p] += 0.001 * (gradient[p] * gradient[p] - second_[p]);
      const double mean = first_[p] / (1.0 - first_share_);
      const double spread = std::sqrt(second_[p] / (1.0 - second_share_));
      numbers[p] -= rate_ * mean / (spread + 1e-8);
    }
  }

 private:
  double rate_;
  double first_share_ = 1.0;
  double second_share_ = 1.0;
  std::vector<double> first_;
  std::vector<double> second_;
};

/// The training samples, and those on which the refit is evaluated.
struct Split {
  Table training;
  Table evaluation;
  std::string tested_on;
};

void append(Table& table, std::span<const double> features, double target) {
  table.features.columns = features.size();
  table.features.values.insert(table.features.values.end(), features.begin(), features.end());
  ++table.features.rows;
  table.target.push_back(target);
}

Split split_of(const TrainingData& data, const FitContext& context) {
  Table all = usable_table(data);
  if (context.validation != nullptr)
    return {.training = std::move(all),
            .evaluation = usable_table(*context.validation),
            .tested_on = "the validation records"};
  Split split{
      .training = {}, .evaluation = {}, .tested_on = "a fifth of the training samples, held out"};
  for (std::size_t n = 0; n < all.target.size(); ++n)
    append(interleaved_fold(n, all.target.size()) == kFolds - 1 ? split.evaluation : split.training,
           all.features.row(n), all.target[n]);
  return split;
}

/// Starting numbers of a mode, before the search.
KernelExpression started(KernelExpression expression, ParametricGpMode mode, double distance) {
  set_start(expression, distance);
  if (mode != ParametricGpMode::paper) return expression;
  for (KernelNode& node : expression.nodes) {
    const auto kind = static_cast<KernelKind>(node.kind);
    // theta = 0.3 throughout; a linear kernel's theta_3 is 1 / l.
    std::ranges::fill(node.length_scales,
                      kind == KernelKind::linear ? 1.0 / kPaperStart : kPaperStart);
    node.amplitude = kPaperStart;
    if (kind == KernelKind::periodic || kind == KernelKind::rational_quadratic)
      node.shape = kPaperStart;
  }
  if (!expression.nodes.empty() && !expression.nodes.front().length_scales.empty())
    expression.nodes.front().scaled = true;  // theta_1
  return expression;
}

struct Descent {
  ParametricGpTrainer trainer;
  std::string end = {};  ///< why it ended before the last update, in words
};

/// One update of the kernel's numbers from the sums of a batch.
class Learner {
 public:
  Learner(Descent& descent, const ParametricGpOptions& options, std::size_t samples)
      : descent_(descent),
        options_(options),
        numbers_(descent.trainer.parameters()),
        gradient_(numbers_.size()),
        adam_(numbers_.size(), options.learning_rate),
        divergence_share_(1.0 / static_cast<double>(samples)) {}

  /// @returns false if that was the end.
  bool learn(const Table& table, std::span<const std::size_t> batch) {
    ParametricGpTrainer& trainer = descent_.trainer;
    const double share = 1.0 / static_cast<double>(batch.size());
    const bool by_data = options_.mode != ParametricGpMode::nlml && !options_.kernel_plain;
    for (const std::size_t n : batch) {
      const auto predicted = trainer.predict(table.features.row(n));
      // Taken in, it would spoil what was learned.
      if (!std::isfinite(predicted.mean) || !(predicted.variance + trainer.noise_variance() > 0.0))
        return false;
      if (by_data) trainer.add_data_gradient(table.target[n], share);
      trainer.add_noise_gradient(table.target[n], share);
      trainer.take_in(table.target[n]);
    }
    if (!options_.kernel_plain) {
      if (options_.mode == ParametricGpMode::nlml) trainer.add_nlml_gradient();
      if (options_.mode == ParametricGpMode::elbo || options_.mode == ParametricGpMode::recommended)
        trainer.add_divergence_gradient(divergence_share_);
    }
    trainer.take_gradient(gradient_);
    return move();
  }

 private:
  bool move() {
    std::vector<double> moved = numbers_;
    if (options_.mode == ParametricGpMode::paper && !options_.kernel_plain) {
      for (std::size_t p = 0; p < moved.size(); ++p) moved[p] -= kPaperRate * gradient_[p];
    } else {
      adam_.move(gradient_, moved);
    }
    if (options_.kernel_plain) std::copy_n(numbers_.begin(), numbers_.size() - 1, moved.begin());
    moved.back() = std::max(moved.back(), lowest_noise());
    if (options_.kernel_plain) {
      descent_.trainer.set_noise_variance(std::exp(moved.back()));
    } else if (!descent_.trainer.set_parameters(moved)) {
      return false;
    }
    numbers_ = std::move(moved);
    return true;
  }

  [[nodiscard]] double lowest_noise() const {
    return options_.kernel_plain ? kLeastLogNoise - 14.0 : kLeastLogNoise;
  }

  Descent& descent_;
  const ParametricGpOptions& options_;
  std::vector<double> numbers_;
  std::vector<double> gradient_;
  Adam adam_;
  double divergence_share_;
};

void descend(Descent& descent, const Table& table, const ParametricGpOptions& options,
             Random& random, const FitContext& context) {
  Learner learner(descent, options, table.target.size());
  std::vector<std::size_t> batch(std::max<std::size_t>(1, options.batch));
  std::size_t next_widening = kWidenEvery;
  for (std::size_t done = 0; done < options.updates; done += batch.size()) {
    report_progress(context.progress,
                    0.9 * static_cast<double>(done) / static_cast<double>(options.updates),
                    "learning");
    batch.resize(std::min(batch.size(), options.updates - done));
    for (std::size_t& n : batch) n = random.below(table.target.size());
    if (!learner.learn(table, batch)) {
      descent.end = fmt::format(
          "the kernel had no use any more after update {} of {}: what was "
          "learned until then is kept",
          done + batch.size(), options.updates);
      return;
    }
    const bool widens =
        options.mode == ParametricGpMode::recommended && !options.kernel_plain &&
        static_cast<double>(done) < kWidenUntil * static_cast<double>(options.updates);
    if (widens && done + batch.size() >= next_widening) {
      descent.trainer.widen();
      next_widening += kWidenEvery;
    }
  }
}

ParametricGp::Parameters parameters_of(const ParametricGpTrainer& trainer,
                                       const NetworkScaling& scaling) {
  const Eigen::VectorXd weights = trainer.inverse() * trainer.mean();
  const Eigen::MatrixXd product = trainer.inverse() * trainer.covariance() * trainer.inverse();
  ParametricGp::Parameters parameters{.scaling = scaling,
                                      .kernel = trainer.kernel().expression(),
                                      .noise_variance = trainer.noise_variance(),
                                      .inducing_points = trainer.points(),
                                      .weights = {weights.begin(), weights.end()},
                                      .explained = {}};
  const std::size_t size = trainer.points().rows;
  parameters.explained = Matrix(size, size);
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t j = 0; j < size; ++j) {
      const auto k = static_cast<Eigen::Index>(i);
      const auto l = static_cast<Eigen::Index>(j);
      parameters.explained(i, j) = trainer.inverse()(k, l) - 0.5 * (product(k, l) + product(l, k));
    }
  return parameters;
}

ParametricGp::Parameters with_posterior(ParametricGp::Parameters parameters,
                                        SparsePosterior posterior) {
  parameters.weights = std::move(posterior.weights);
  parameters.explained = std::move(posterior.explained);
  return parameters;
}

/// RMSE in the target's unit; infinite where the model's output is not a number.
double rmse_of(const ParametricGp::Parameters& parameters, const Table& table) {
  ParametricGp model(parameters);
  double sum = 0.0;
  for (std::size_t n = 0; n < table.target.size(); ++n) {
    const Estimate predicted = model.step(table.features.row(n));
    if (predicted.fault != Fault::none) return std::numeric_limits<double>::infinity();
    sum += (predicted.value - table.target[n]) * (predicted.value - table.target[n]);
  }
  return std::sqrt(sum / static_cast<double>(table.target.size()));
}

/// @throws Error if a sample lies where the kernel is not.
void check_domain(const Kernel& kernel, const Matrix& centres, const Matrix& samples,
                  const PlainKernel& theta) {
  if (theta[7] > 0.0) return;
  const PackedPoints packed(centres);
  detail::AlignedVector<double> row(packed.padded_size());
  for (std::size_t n = 0; n < samples.rows; ++n) {
    kernel.row(samples.row(n).data(), packed, centres.rows, row.data());
    if (std::ranges::all_of(row, [](double value) { return std::isfinite(value); })) continue;
    double farthest = 0.0;
    for (std::size_t k = 0; k < centres.rows; ++k) {
      double square = 0.0;
      for (std::size_t i = 0; i < centres.columns; ++i)
        square += (samples(n, i) - centres(k, i)) * (samples(n, i) - centres(k, i));
      farthest = std::max(farthest, square);
    }
    throw Error({.place = "option kernel_plain",
                 .problem = "theta_8 is negative, so the kernel ends at a distance",
                 .expected = fmt::format("samples with r^2 below 2 |theta_8| theta_9^2 = {:.5g}",
                                         2.0 * std::abs(theta[7]) * theta[8] * theta[8]),
                 .found = fmt::format("r^2 = {:.5g} between sample {} and a cluster", farthest, n),
                 .advice = "The numbers of paper 002 most likely belong to rad and Nm."});
  }
}

std::vector<std::string> notes_of(const Descent& descent, const ParametricGpOptions& options,
                                  std::size_t points, const NetworkScaling& scaling) {
  std::vector<std::string> notes;
  if (points < options.inducing_points)
    notes.push_back(fmt::format("only {} samples differ: as many clusters instead of {}", points,
                                options.inducing_points));
  if (!descent.end.empty()) notes.push_back(descent.end);
  notes.push_back(fmt::format(
      "kernel {}; noise {:.3g}{}", description_of(descent.trainer.kernel().expression()),
      std::sqrt(descent.trainer.noise_variance()),
      scaling.target_scale == 1.0 ? "" : " (inputs and target standardised)"));
  return notes;
}

void check_memory(const VariationalGpOptions& options, const TrainingData& data) {
  constexpr double kTables = 5.0;  // samples x points that the bound and its gradient take
  const std::size_t all = data.usable_samples();
  const std::size_t used = options.samples == 0 ? all : std::min(all, options.samples);
  require_memory({.what = "the search over all samples and points",
                  .bytes = kTables * sizeof(double) * static_cast<double>(used) *
                           static_cast<double>(std::min(options.inducing_points, used)),
                  .count = used,
                  .counted = "samples",
                  .advice = "Set samples={} or less, or fewer points."});
}

}  // namespace

KernelExpression kernel_plain(const PlainKernel& theta) {
  for (std::size_t j = 0; j < theta.size(); ++j)
    if (!std::isfinite(theta[j]) || (j != 3 && theta[j] == 0.0))
      throw Error({.place = fmt::format("kernel_plain: theta_{}", j + 1),
                   .expected = j == 3 ? "a finite number" : "a finite number that is not 0",
                   .found = fmt::format("{}", theta[j])});
  KernelExpression kernel = parse_kernel("se*(linear+periodic*rq)", 1);
  const auto node = [&](KernelKind kind) -> KernelNode& {
    return *std::ranges::find(kernel.nodes, static_cast<std::size_t>(kind), &KernelNode::kind);
  };
  node(KernelKind::squared_exponential).length_scales = {std::abs(theta[1])};
  node(KernelKind::linear).length_scales = {1.0 / std::abs(theta[0] * theta[2])};
  node(KernelKind::linear).shape = theta[3];
  node(KernelKind::periodic).amplitude = std::abs(theta[0] * theta[4]);
  node(KernelKind::periodic).length_scales = {std::abs(theta[5])};
  node(KernelKind::periodic).shape = std::abs(theta[6]);
  node(KernelKind::rational_quadratic).shape = theta[7];
  node(KernelKind::rational_quadratic).length_scales = {std::abs(theta[8])};
  return kernel;
}

Fitted<ParametricGp> fit_parametric_gp(const TrainingData& data, const ParametricGpOptions& options,
                                       const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting parametric_gp");
  KernelExpression expression = options.kernel_plain
                                    ? kernel_plain(*options.kernel_plain)
                                    : parse_kernel(options.kernel, data.input_count());
  require_samples(data);
  Random random(context.seed);
  const Split split = split_of(data, context);
  std::vector<std::string> notes = constant_inputs(data, split.training.features);
  const NetworkScaling scaling =
      options.kernel_plain ? no_scaling(data.input_count()) : scaling_of(split.training);
  const Table table = standardised(scaling, split.training);

  Matrix centres = cluster_centres(thinned(table, kMaxClustered, random).features,
                                   options.inducing_points, random, context.progress);
  if (!options.kernel_plain)
    expression = started(std::move(expression), options.mode, median_distance(centres, random));
  const Kernel kernel(expression, data.input_count());
  if (options.kernel_plain) check_domain(kernel, centres, table.features, *options.kernel_plain);
  const double variance = options.kernel_plain ? scaling_of(table).target_scale : 1.0;
  Descent descent{ParametricGpTrainer(kernel, centres, kFirstNoise * variance * variance)};
  descend(descent, table, options, random, context);

  ParametricGp::Parameters parameters = parameters_of(descent.trainer, scaling);
  for (std::string& note : notes_of(descent, options, centres.rows, scaling))
    notes.push_back(std::move(note));
  if (!options.refit) return {std::move(parameters), std::move(notes)};
  report_progress(context.progress, 0.9, "fitting at once");
  ParametricGp::Parameters refitted = with_posterior(
      parameters, sparse_posterior(descent.trainer.kernel(), centres,
                                   descent.trainer.noise_variance(), table.features, table.target,
                                   SparseNoise::fitc, share_of(context.progress, 0.9, 1.0)));
  const auto error_of = [&](const ParametricGp::Parameters& of) {
    return context.error_of ? context.error_of(ParametricGp(of)) : rmse_of(of, split.evaluation);
  };
  const double learned_rmse = error_of(parameters);
  const double refitted_rmse = error_of(refitted);
  const bool is_better = refitted_rmse < learned_rmse;
  notes.push_back(fmt::format(
      "RMSE on {}: {:.4g} as learned, {:.4g} by the closed form over all samples, which is {}",
      context.error_of ? "a free run" : split.tested_on, learned_rmse, refitted_rmse,
      is_better ? "kept" : "not kept"));
  return {is_better ? std::move(refitted) : std::move(parameters), std::move(notes)};
}

Fitted<ParametricGp> fit_variational_gp(const TrainingData& data,
                                        const VariationalGpOptions& options,
                                        const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting parametric_gp_variational");
  KernelExpression expression = parse_kernel(options.kernel, data.input_count());
  require_samples(data);
  check_memory(options, data);
  Random random(context.seed);
  Table table = usable_table(data);
  std::vector<std::string> notes = constant_inputs(data, table.features);
  const NetworkScaling scaling = scaling_of(table);
  table = standardised(scaling, std::move(table));
  const Table part = thinned(table, options.samples, random);
  const Matrix points =
      cluster_centres(part.features, options.inducing_points, random, context.progress);
  set_start(expression, median_distance(points, random));
  Kernel kernel(expression, data.input_count());

  CollapsedBound bound(kernel, points, part.features, part.target);
  const KernelSearch search(kernel, options.iterations);
  const LbfgsResult found =
      minimise(reported([&](auto x, auto gradient) { return bound.evaluate(x, gradient); }, context,
                        0.0, 0.9, options.iterations, "fitting"),
               first_start(kernel), search.settings);
  kernel.set_log_parameters(std::span(found.at).first(kernel.parameter_count()));
  const double noise_variance = std::exp(found.at.back());
  report_progress(context.progress, 0.9, "taking in all samples");
  SparsePosterior posterior =
      sparse_posterior(kernel, points, noise_variance, table.features, table.target,
                       SparseNoise::variational, share_of(context.progress, 0.9, 1.0));
  notes.push_back(fmt::format(
      "kernel {}; noise {:.3g} (inputs and target standardised); bound of ln p(y) {:.6g} over {} "
      "of {} samples, {} points",
      description_of(kernel.expression()), std::sqrt(noise_variance), -found.value,
      part.target.size(), table.target.size(), points.rows));
  return {{.scaling = scaling,
           .kernel = kernel.expression(),
           .noise_variance = noise_variance,
           .inducing_points = points,
           .weights = std::move(posterior.weights),
           .explained = std::move(posterior.explained)},
          std::move(notes)};
}

}  // namespace torsio
