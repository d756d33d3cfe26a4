#include "fit/gaussian_process/fit_gaussian_process.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/common/least_samples.hpp"
#include "fit/common/memory_check.hpp"
#include "fit/gaussian_process/kernel_data.hpp"
#include "fit/gaussian_process/kernel_search.hpp"
#include "fit/gaussian_process/likelihood_search.hpp"
#include "fit/gaussian_process/marginal_likelihood.hpp"
#include "model/gaussian_process/covariance.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

void check_count(std::size_t samples, bool with_std_dev) {
  const std::size_t most =
      with_std_dev ? GaussianProcess::kMaxPointsWithStdDev : GaussianProcess::kMaxPoints;
  if (samples <= most) return;
  throw UsageError(
      {.place = "option samples",
       .expected = fmt::format("at most {}{}", most, with_std_dev ? " with an error bar" : ""),
       .found = std::to_string(samples),
       .advice = with_std_dev ? "Set samples lower, or std_dev=false." : ""});
}

std::vector<std::string> notes_of(MarginalLikelihood& process, double value, std::size_t all,
                                  std::size_t used, const NetworkScaling& scaling,
                                  const std::string& target) {
  std::vector<std::string> notes;
  if (used < all)
    notes.push_back(
        fmt::format("fitted to {} of {} samples, drawn by chance: set samples", used, all));
  notes.push_back(fmt::format("kernel {}; noise {:.3g} (inputs and target standardised)",
                              description_of(process.kernel().expression()),
                              std::sqrt(process.noise_variance())));
  if (process.jitter() > 0.0)
    notes.push_back(
        fmt::format("the matrix took a jitter of {:.0e} of its mean diagonal", process.jitter()));
  const LeaveOneOut scores = process.leave_one_out();
  notes.push_back(fmt::format(
      "log marginal likelihood {:.6g}; leaving one sample out: RMSE {:.4g} in the unit of {}, mean "
      "log density {:.4g}, {:.1f} % within 95 %",
      -value, scores.rmse * scaling.target_scale, target,
      scores.log_density - std::log(scaling.target_scale), 100.0 * scores.covered_95));
  return notes;
}

}  // namespace

Fitted<GaussianProcess> fit_gaussian_process(const TrainingData& data,
                                             const GaussianProcessOptions& options,
                                             const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting gaussian_process");
  KernelExpression expression = parse_kernel(options.kernel, data.input_count());
  require_samples(data);
  Table table = usable_table(data);
  const std::size_t all = table.target.size();
  const std::size_t used = options.samples == 0 ? all : std::min(all, options.samples);
  check_count(used, options.std_dev);
  require_memory({.what = "the matrix of all samples",
                  .bytes = MarginalLikelihood::bytes(used),
                  .count = used,
                  .counted = "samples",
                  .growth = 2.0,
                  .advice =
                      "Set samples={} or less, or take parametric_gp_variational, which grows "
                      "with N only."});
  Random random(context.seed);
  table = thinned(table, used, random);
  std::vector<std::string> notes = constant_inputs(data, table.features);
  const NetworkScaling scaling = scaling_of(table);
  table = standardised(scaling, std::move(table));
  set_start(expression, median_distance(table.features, random));
  const Kernel kernel(expression, data.input_count());

  MarginalLikelihood process(kernel, table.features, table.target);
  const std::vector<double> numbers = likeliest_numbers(
      process, table, {.restarts = options.restarts, .iterations = options.iterations}, random,
      context);
  const double value = process.fix(numbers);
  if (!std::isfinite(value)) refuse_covariance(GaussianProcess::kFamily);

  GaussianProcess::Parameters parameters{.scaling = scaling,
                                         .kernel = process.kernel().expression(),
                                         .noise_variance = process.noise_variance(),
                                         .points = std::move(table.features),
                                         .weights = process.weights(),
                                         .with_std_dev = options.std_dev};
  for (std::string& note : notes_of(process, value, all, used, scaling, data.target))
    notes.push_back(std::move(note));
  return {std::move(parameters), std::move(notes)};
}

}  // namespace torsio
