#include "torsio/evaluate/fit_report.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "numerics/parallel.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {
namespace {

/// Residuals of one recording, sample by sample, NaN where none is scored, and its features.
struct Run {
  std::vector<double> residual;
  Matrix features;
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

std::vector<Run> runs_of(const TrainedModel& model, const Dataset& dataset, Role role) {
  const Estimator estimator = make_estimator(model.file);
  TrainingData data = training_data(dataset, model.file.settings.features, role);
  std::vector<const Recording*> recordings;
  for (const DatasetRecord& record : dataset.records)
    if (record.has_role(role)) recordings.push_back(&record.recording);
  std::vector<Run> runs(recordings.size());
  for_each_chunk(runs.size(), 0, [&](std::size_t r) {
    const Channel& target = recordings[r]->channel(dataset.target);
    const Prediction prediction =
        predict(estimator, *recordings[r], {&target, dataset.initialise_samples});
    Sequence& sequence = data.sequences[r];
    std::vector<double> residual(target.values.size(), kNotMeasured);
    for (std::size_t n = prediction.initialised; n < residual.size(); ++n)
      if (sequence.use[n] != 0 && prediction.estimates[n].fault != Fault::warming_up)
        residual[n] = prediction.estimates[n].value - target.values[n];
    runs[r] = {std::move(residual), std::move(sequence.features)};
  });
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

/// r_k for k = 0, stride, 2 stride, ...
template <class Value>
std::vector<double> correlations(const std::vector<Run>& runs, const Value& value, std::size_t lags,
                                 std::size_t stride) {
  const auto residual = [](const Run& run, std::size_t n) { return run.residual[n]; };
  const double residual_mean = mean_of(runs, residual);
  const double value_mean = mean_of(runs, value);
  std::vector<double> products(lags, 0.0);
  double residual_square = 0.0;
  double value_square = 0.0;
  for (const Run& run : runs) {
    for (std::size_t n = 0; n < run.residual.size(); ++n) {
      const double e = run.residual[n] - residual_mean;
      if (!std::isfinite(e)) continue;
      residual_square += e * e;
      if (const double x = value(run, n) - value_mean; std::isfinite(x)) value_square += x * x;
      for (std::size_t k = 0; k < lags && k * stride <= n; ++k) {
        const double before = value(run, n - k * stride) - value_mean;
        if (std::isfinite(before)) products[k] += e * before;
      }
    }
  }
  const double scale = std::sqrt(residual_square * value_square);
  for (double& product : products) product = scale > 0.0 ? product / scale : 0.0;
  return products;
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
  FitReport report{.split = {}, .samples = 0, .correlations = {}, .table = model.table};
  const std::optional<Role> role = scored_role(dataset);
  if (!role) return report;
  report.split = name(*role);
  const std::vector<Run> runs = runs_of(model, dataset, *role);
  std::size_t longest = 0;
  for (const Run& run : runs) {
    const std::size_t scored = scored_samples(run);
    report.samples += scored;
    longest = std::max(longest, scored);
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
    const auto residual = [](const Run& run, std::size_t n) { return run.residual[n]; };
    const auto input = [k](const Run& run, std::size_t n) { return run.features(n, k - 1); };
    all[k] = k == 0 ? correlations(runs, residual, lags, stride)
                    : correlations(runs, input, lags, stride);
  });
  const std::vector<double>& own = all.front();
  report.correlations.push_back(summary("residual", own, 1, step_s, bound));
  const auto forgotten = std::ranges::find_if(own, [](double r) { return r < std::exp(-1.0); });
  if (forgotten != own.end())
    report.memory_s = static_cast<double>(forgotten - own.begin()) * step_s;
  const auto end = std::ranges::find_if(own, [](double r) { return r <= 0.0; });
  report.effective_samples =
      samples / (1.0 + 2.0 * std::accumulate(own.begin() + 1, std::max(end, own.begin() + 1), 0.0));
  for (std::size_t j = 0; j < inputs.size(); ++j)
    report.correlations.push_back(summary(inputs[j], all[1 + j], 0, step_s, bound));
  const double widening = std::sqrt(samples / report.effective_samples);
  for (FittedParameter& parameter : report.table) parameter.std_error *= widening;
  return report;
}

}  // namespace torsio
