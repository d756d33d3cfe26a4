#include "torsio/evaluate/fit_report.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "numerics/parallel.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {
namespace {

/// Residuals of one recording, sample by sample, NaN where none is scored, and its features.
struct Run {
  std::vector<double> residual;
  const Matrix* features;
};

std::size_t scored_samples(const Run& run) {
  return static_cast<std::size_t>(
      std::ranges::count_if(run.residual, [](double e) { return std::isfinite(e); }));
}

std::optional<Role> scored_role(const Dataset& dataset) {
  for (const Role role : {Role::test, Role::validation, Role::train})
    if (dataset.has_role(role)) return role;
  return std::nullopt;
}

/// @param data of that role
std::vector<Run> runs_of(const std::vector<ScoredRun>& scored, const TrainingData& data,
                         Role role) {
  std::vector<Run> runs;
  for (const ScoredRun& of : scored) {
    if (!of.record->has_role(role)) continue;
    const Sequence& sequence = data.sequences[runs.size()];
    std::vector<double> residual(sequence.use.size(), kNotMeasured);
    for (std::size_t n = 0; n < residual.size(); ++n)
      if (sequence.use[n] != 0) residual[n] = of.residual(n);
    runs.push_back({std::move(residual), &sequence.features});
  }
  return runs;
}

/// The usual distance between scored samples: repeated values of a slow load cell and samples
/// outside of the split's segments are not scored.
std::size_t stride_of(const std::vector<Run>& runs) {
  std::vector<std::size_t> steps;
  for (const Run& run : runs) {
    std::optional<std::size_t> last;
    for (std::size_t n = 0; n < run.residual.size(); ++n) {
      if (!std::isfinite(run.residual[n])) continue;
      if (last) steps.push_back(n - *last);
      last = n;
    }
  }
  if (steps.empty()) return 1;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  return *middle;
}

template <class Value>
double mean_of(const std::vector<Run>& runs, const Value& value) {
  double sum = 0.0;
  double count = 0.0;
  for (const Run& run : runs)
    for (std::size_t n = 0; n < run.residual.size(); ++n)
      if (std::isfinite(run.residual[n]) && std::isfinite(value(run, n))) {
        sum += value(run, n);
        ++count;
      }
  return count > 0.0 ? sum / count : 0.0;
}

/// Values in an order in which those of n, n - stride, n - 2 stride, ... are neighbours; 0, which
/// adds nothing to a sum, where a value is not finite.
class PastValues {
 public:
  PastValues(const std::vector<double>& values, std::size_t stride)
      : stride_(stride), columns_(stride) {
    for (std::size_t n = values.size(); n-- > 0;)
      columns_[n % stride].push_back(std::isfinite(values[n]) ? values[n] : 0.0);
  }

  [[nodiscard]] std::span<const double> from(std::size_t n) const {
    const std::vector<double>& column = columns_[n % stride_];
    return std::span(column).last(n / stride_ + 1);
  }

 private:
  std::size_t stride_;
  std::vector<std::vector<double>> columns_;
};

double residual_of(const Run& run, std::size_t n) { return run.residual[n]; }

/// r_k for k = 0, stride, 2 stride, ... @param every of so many scored samples one is used
template <class Value>
std::vector<double> correlations(const std::vector<Run>& runs, const Value& value, std::size_t lags,
                                 std::size_t stride, std::size_t every = 1) {
  const double residual_mean = mean_of(runs, residual_of);
  const double value_mean = mean_of(runs, value);
  std::vector<double> products(lags, 0.0);
  double residual_square = 0.0;
  double value_square = 0.0;
  for (const Run& run : runs) {
    std::vector<double> x(run.residual.size());
    for (std::size_t n = 0; n < x.size(); ++n) x[n] = value(run, n) - value_mean;
    const PastValues past(x, stride);
    std::size_t scored = 0;
    for (std::size_t n = 0; n < x.size(); ++n) {
      const double e = run.residual[n] - residual_mean;
      if (!std::isfinite(e) || scored++ % every != 0) continue;
      residual_square += e * e;
      const std::span<const double> before = past.from(n);
      value_square += before.front() * before.front();
      const std::size_t count = std::min(lags, before.size());
      for (std::size_t k = 0; k < count; ++k) products[k] += e * before[k];
    }
  }
  const double scale = std::sqrt(residual_square * value_square);
  for (double& product : products) product = scale > 0.0 ? product / scale : 0.0;
  return products;
}

/// How the autocorrelation decays, from lags that are added in any steps: between two of them r is linear.
struct Decay {
  double lags_to_1e = kNotMeasured;  ///< the first lag below 1/e; NaN if there is none
  double sum = 0.0;                  ///< over the lags from 1 on, up to the first r_k <= 0
  std::size_t last_lag = 0;
  double last = 1.0;

  /// @returns false from the first r <= 0 on, which is not added
  bool add(std::size_t lag, double r) {
    const auto steps = static_cast<double>(lag - last_lag);
    if (std::isnan(lags_to_1e) && r < std::exp(-1.0)) lags_to_1e = static_cast<double>(lag);
    if (!(r > 0.0)) return false;
    // The sum of r at `steps` lags on a line from `last` to r, without the first.
    sum += 0.5 * steps * (last + r) + 0.5 * (r - last);
    last_lag = lag;
    last = r;
    return true;
  }
};

/// @param own r_k of the first lags. Where they do not reach 0, longer lags follow, up to a tenth of the longest recording,
/// in wider steps and from as many fewer samples.
Decay decay_of(const std::vector<Run>& runs, std::vector<double> own, std::size_t stride,
               std::size_t longest) {
  Decay decay;
  for (std::size_t step = 1;; step *= 4) {
    if (step > 1)
      own = correlations(runs, residual_of, std::min(kMaxLags, longest / 10 / step + 1),
                         step * stride, step);
    for (std::size_t k = decay.last_lag / step + 1; k < own.size(); ++k)
      if (!decay.add(k * step, own[k])) return decay;
    if (decay.last_lag + step >= longest / 10) return decay;
  }
}

ResidualCorrelation summary(std::string with, const std::vector<double>& r, std::size_t first,
                            double step_s, double bound) {
  ResidualCorrelation found{.with = std::move(with), .bound = bound};
  std::size_t outside = 0;
  for (std::size_t k = first; k < r.size(); ++k) {
    if (std::abs(r[k]) > bound) ++outside;
    if (std::abs(r[k]) <= std::abs(found.strongest)) continue;
    found.strongest = r[k];
    found.lag_s = static_cast<double>(k) * step_s;
  }
  if (r.size() > first)
    found.share_outside = static_cast<double>(outside) / static_cast<double>(r.size() - first);
  return found;
}

}  // namespace

FitReport fit_report(const TrainedModel& model, const Dataset& dataset) {
  return fit_report(model, dataset, scored_runs(make_estimator(model.file), dataset), nullptr);
}

FitReport fit_report(const TrainedModel& model, const Dataset& dataset,
                     const std::vector<ScoredRun>& scored, const LearningData* data) {
  FitReport report{.split = {}, .samples = 0, .correlations = {}, .table = model.table};
  const std::optional<Role> role = scored_role(dataset);
  if (!role) return report;
  report.split = name(*role);
  const TrainingData* of_role = data == nullptr ? nullptr : data->of(*role);
  TrainingData made;
  if (of_role == nullptr) {
    made = training_data(dataset, model.file.settings.features, *role);
    of_role = &made;
  }
  const std::vector<Run> runs = runs_of(scored, *of_role, *role);
  std::size_t longest = 0;
  for (const Run& run : runs) {
    const std::size_t count = scored_samples(run);
    report.samples += count;
    longest = std::max(longest, count);
  }
  const std::size_t stride = stride_of(runs);
  const std::size_t lags = std::min(kMaxLags, longest / 10 + 1);
  if (report.samples < 2 || lags < 2) return report;
  constexpr double kQuantile = 2.576;  // 99 % quantile of |x|, standard normal
  const auto samples = static_cast<double>(report.samples);
  const double bound = kQuantile / std::sqrt(samples);
  const double step_s = static_cast<double>(stride) / model.file.settings.sample_rate_Hz;

  // First the autocorrelation, then the correlation with each input.
  const std::vector<std::string>& inputs = model.file.settings.features.inputs;
  std::vector<std::vector<double>> all(1 + inputs.size());
  for_each_chunk(all.size(), 0, [&](std::size_t k) {
    const auto input = [k](const Run& run, std::size_t n) { return (*run.features)(n, k - 1); };
    all[k] = k == 0 ? correlations(runs, residual_of, lags, stride)
                    : correlations(runs, input, lags, stride);
  });
  const std::vector<double>& own = all.front();
  report.correlations.push_back(summary("residual", own, 1, step_s, bound));
  const Decay decay = decay_of(runs, own, stride, longest);
  report.memory_s = decay.lags_to_1e * step_s;
  report.effective_samples = samples / (1.0 + 2.0 * decay.sum);
  for (std::size_t j = 0; j < inputs.size(); ++j)
    report.correlations.push_back(summary(inputs[j], all[1 + j], 0, step_s, bound));
  const double widening = std::sqrt(samples / report.effective_samples);
  for (FittedParameter& parameter : report.table) parameter.std_error *= widening;
  return report;
}

ReportedFit fit_and_report(const Dataset& dataset, const FitCheck& check, const ModelChoice& choice,
                           const FitContext& context) {
  ReportedFit fit{.trained = check.data ? train_model(dataset, *check.data, choice, context)
                                        : train_model(dataset, choice, context),
                  .runs = {},
                  .results = {},
                  .report = {}};
  fit.runs = scored_runs(make_estimator(fit.trained.file, dataset.sample_rate_Hz()), dataset,
                         context.progress);
  fit.results = evaluate_model(fit.trained.file, dataset, fit.runs);
  mark_divergence_in_training(fit.results.rows);
  note_held_out_scores(fit.trained.file.card, fit.results.rows);
  fit.report = fit_report(fit.trained, dataset, fit.runs, check.data ? &*check.data : nullptr);
  return fit;
}

}  // namespace torsio
