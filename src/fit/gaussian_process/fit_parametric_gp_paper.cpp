#include "fit/gaussian_process/fit_parametric_gp_paper.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/report_progress.hpp"
#include "fit/common/least_samples.hpp"
#include "fit/gaussian_process/gp_descent.hpp"
#include "fit/gaussian_process/kernel_data.hpp"
#include "numerics/shared_progress.hpp"

namespace torsio {
namespace {

constexpr double kLogStart = -1.2039728043259361;  // ln 0.3
constexpr double kPrintedRate = 0.1;

/// The kernel with every theta at ln 0.3, in one of the two readings.
KernelExpression printed_start(KernelExpression expression, ThetaReading reading) {
  const bool is_plain = reading == ThetaReading::plain;
  const double theta = is_plain ? std::abs(kLogStart) : std::exp(kLogStart);
  const double with_sign = is_plain ? kLogStart : theta;
  if (!expression.nodes.empty() && !expression.nodes.front().length_scales.empty())
    expression.nodes.front().scaled = true;  // theta_1
  for (KernelNode& node : expression.nodes) {
    const auto kind = static_cast<KernelKind>(node.kind);
    // theta_3 of a linear kernel is 1 / l.
    std::ranges::fill(node.length_scales, kind == KernelKind::linear ? 1.0 / theta : theta);
    if (node.scaled) node.amplitude = theta;
    if (kind == KernelKind::periodic) node.shape = theta;
    if (kind == KernelKind::linear || kind == KernelKind::rational_quadratic)
      node.shape = with_sign;
  }
  return expression;
}

GpDescentSettings settings_of(const PaperGpOptions& options) {
  GpDescentSettings settings{
      .objective = options.elbo ? KernelObjective::elbo : KernelObjective::sample,
      .step = options.theta == ThetaReading::plain ? ThetaStep::plain : ThetaStep::logarithm,
      .rate = kPrintedRate,
      .updates = options.updates,
      .widens = options.widen,
      .has_printed_moments = options.moments == MomentReading::printed,
      .lowest_log_noise = options.standardise ? kLeastLogNoise : kLeastLogNoiseInUnits};
  if (options.adam) {
    settings.step = ThetaStep::adam;
    settings.rate = GpDescentSettings{}.rate;
  }
  return settings;
}

double sample_variance(const std::vector<double>& values) {
  double mean = 0.0;
  for (const double value : values) mean += value;
  mean /= static_cast<double>(values.size());
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return squares / static_cast<double>(values.size() - 1);
}

}  // namespace

Fitted<ParametricGp> fit_parametric_gp_paper(const TrainingData& data,
                                             const PaperGpOptions& options,
                                             const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting parametric_gp_paper");
  KernelExpression expression =
      printed_start(parse_kernel(options.kernel, data.input_count()), options.theta);
  require_samples(data);
  Random random(context.seed);
  // Without the closed form nothing is held out.
  const GpSplit split =
      options.refit ? split_for_refit(data, context)
                    : GpSplit{.training = usable_table(data), .evaluation = {}, .tested_on = {}};
  GpStart start = gp_start(data, split.training, options.standardise, options.inducing_points,
                           random, context.progress);
  start.noise_variance = options.first_noise * sample_variance(start.table.target);
  start.kernel = std::move(expression);
  LearnedGp learned =
      learn(std::move(start), split, settings_of(options), options.refit, random, context);
  learned.fitted.table = {{.name = std::string(kSamplesTakenIn),
                           .unit = {},
                           .value = static_cast<double>(learned.updates)}};
  return std::move(learned.fitted);
}

}  // namespace torsio
