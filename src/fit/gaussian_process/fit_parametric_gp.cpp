#include "fit/gaussian_process/fit_parametric_gp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include "core/report_progress.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/least_samples.hpp"
#include "fit/common/memory_check.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/gaussian_process/gp_descent.hpp"
#include "fit/gaussian_process/kernel_data.hpp"
#include "fit/gaussian_process/kernel_search.hpp"
#include "fit/gaussian_process/sparse_posterior.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kFirstNoise = 0.1;  // variance of the standardised target

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

GpDescentSettings settings_of(const ParametricGpOptions& options) {
  GpDescentSettings settings{
      .rate = options.learning_rate, .updates = options.updates, .batch = options.batch};
  if (options.kernel_plain) {
    settings.objective = KernelObjective::none;
    settings.lowest_log_noise = kLeastLogNoiseInUnits;
    return settings;
  }
  settings.objective =
      options.mode == ParametricGpMode::nlml ? KernelObjective::nlml : KernelObjective::elbo;
  settings.widens = options.mode == ParametricGpMode::recommended;
  return settings;
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
  const GpSplit split = split_for_refit(data, context);
  GpStart start = gp_start(data, split.training, !options.kernel_plain, options.inducing_points,
                           random, context.progress);
  if (!options.kernel_plain) set_start(expression, median_distance(start.centres, random));
  const double spread = options.kernel_plain ? scaling_of(start.table).target_scale : 1.0;
  start.noise_variance = kFirstNoise * spread * spread;
  start.kernel = std::move(expression);
  if (options.kernel_plain)
    check_domain(Kernel(start.kernel, data.input_count()), start.centres, start.table.features,
                 *options.kernel_plain);
  return learn(std::move(start), split, settings_of(options), options.refit, random, context)
      .fitted;
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
