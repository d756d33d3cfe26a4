#include "fit/common/guards.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "fit/common/model_run.hpp"
#include "fit/common/strokes.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/common/warm_up.hpp"
#include "numerics/least_squares.hpp"
#include "numerics/parallel.hpp"

namespace torsio {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Residual {
  double value = 0.0;  ///< the model's output
  double error = 0.0;
};

std::vector<Residual> residuals(const AnyModel& model, const TrainingData& data) {
  std::vector<std::vector<Residual>> of_sequences(data.sequences.size());
  for_each_chunk(of_sequences.size(), 0, [&](std::size_t s) {
    const Sequence& sequence = data.sequences[s];
    AnyModel own = model;
    const std::vector<Estimate> estimates = run(own, sequence);
    for (std::size_t n = 0; n < estimates.size(); ++n)
      if (sequence.use[n] != 0 && std::isfinite(estimates[n].value) &&
          estimates[n].fault == Fault::none)
        of_sequences[s].push_back({estimates[n].value, estimates[n].value - sequence.target[n]});
  });
  std::vector<Residual> all;
  for (const std::vector<Residual>& own : of_sequences)
    all.insert(all.end(), own.begin(), own.end());
  return all;
}

/// Upper end of the region that ends before `end`, above all of its outputs but the last.
double edge_at(const std::vector<Residual>& sorted, std::size_t end) {
  if (end == sorted.size()) return sorted.back().value;
  if (sorted[end].value < sorted.back().value) return sorted[end].value;
  // What follows is one output: half way, for a region has a width.
  return std::midpoint(sorted[end - 1].value, sorted[end].value);
}

/// An equation of motion holds beyond the forces that it was fitted to; a linear map from force to
/// displacement does not. The guard adds as much room again on either side for such a model.
void widen_for_physics(FeatureRanges& ranges, const AnyModel& model) {
  if (!model.traits().extrapolates) return;
  for (std::size_t j = 0; j < ranges.lowest.size(); ++j) {
    const double width = ranges.highest[j] - ranges.lowest[j];
    ranges.lowest[j] -= width;
    ranges.highest[j] += width;
  }
}

/// The region of a value.
std::size_t region_of(const ResidualTable& table, double value) {
  const auto inner = std::span(table.edges).subspan(1, table.std_dev.size() - 1);
  return static_cast<std::size_t>(std::ranges::upper_bound(inner, value) - inner.begin());
}

/// The error bar at a value.
double std_dev_at(const ResidualTable& table, double value) {
  return table.std_dev[region_of(table, value)];
}

/// Mean square of the standard errors of a computed target, by region of the table and over all usable samples.
struct TargetErrors {
  std::vector<double> of_regions;
  double of_all = 0.0;
};

TargetErrors target_errors(const ResidualTable& table, const TrainingData& data) {
  const std::size_t regions = std::max<std::size_t>(table.std_dev.size(), 1);
  std::vector<double> squares(regions, 0.0);
  std::vector<double> counts(regions, 0.0);
  for (const Sequence& sequence : data.sequences)
    for (std::size_t n = 0; n < sequence.target_error.size(); ++n) {
      if (sequence.use[n] == 0 || !std::isfinite(sequence.target_error[n])) continue;
      const std::size_t region = table.std_dev.empty() ? 0 : region_of(table, sequence.target[n]);
      squares[region] += sequence.target_error[n] * sequence.target_error[n];
      counts[region] += 1.0;
    }
  TargetErrors errors;
  const double all = std::accumulate(counts.begin(), counts.end(), 0.0);
  if (all > 0.0) errors.of_all = std::accumulate(squares.begin(), squares.end(), 0.0) / all;
  for (std::size_t r = 0; r < regions; ++r)
    errors.of_regions.push_back(counts[r] > 0.0 ? squares[r] / counts[r] : errors.of_all);
  return errors;
}

/// What the residuals do not show: a model that agrees with a wrong target is as wrong as this. The error of a computed
/// target is independent of the model's own; the variances add.
void add_target_errors(EstimatorSettings& settings, const TrainingData& data, double own_std_dev) {
  const TargetErrors errors = target_errors(settings.residuals, data);
  if (!(errors.of_all > 0.0)) return;
  for (std::size_t r = 0; r < settings.residuals.std_dev.size(); ++r)
    settings.residuals.std_dev[r] = std::sqrt(
        settings.residuals.std_dev[r] * settings.residuals.std_dev[r] + errors.of_regions[r]);
  settings.fallback.residual_std =
      std::sqrt(settings.fallback.residual_std * settings.fallback.residual_std + errors.of_all);
  double& factor = settings.output.error_bar_factor;
  if (own_std_dev > 0.0)
    factor = std::sqrt(factor * factor + errors.of_all / (own_std_dev * own_std_dev));
}

}  // namespace

FeatureRanges feature_ranges(const TrainingData& data) {
  FeatureRanges ranges;
  ranges.lowest.assign(data.input_count(), kInfinity);
  ranges.highest.assign(data.input_count(), -kInfinity);
  for_each_usable(data, [&](std::span<const double> features, double) {
    for (std::size_t j = 0; j < features.size(); ++j) {
      ranges.lowest[j] = std::min(ranges.lowest[j], features[j]);
      ranges.highest[j] = std::max(ranges.highest[j], features[j]);
    }
  });
  return ranges;
}

LinearFallback linear_fallback(const TrainingData& data) {
  // The columns of rates stay 0, so that least squares drops them.
  std::vector<double> row(1 + data.input_count(), 0.0);
  row.front() = 1.0;
  const auto take = [&](std::span<const double> features) {
    for (std::size_t j = 0; j < data.input_count(); ++j)
      if (!data.inputs[j].is_rate) row[1 + j] = features[j];
  };
  StreamedLeastSquares equations(row.size());
  std::size_t samples = 0;
  for_each_usable(data, [&](std::span<const double> features, double target) {
    take(features);
    equations.add(row, target);
    ++samples;
  });
  const LeastSquares solved = equations.solve();
  LinearFallback fallback;
  fallback.intercept = solved.coefficients.front();
  fallback.slope.assign(solved.coefficients.begin() + 1, solved.coefficients.end());
  double square_sum = 0.0;
  for_each_usable(data, [&](std::span<const double> features, double target) {
    take(features);
    double error = -target;
    for (std::size_t j = 0; j < row.size(); ++j) error += row[j] * solved.coefficients[j];
    square_sum += error * error;
  });
  const std::size_t terms = row.size() - solved.dropped.size();
  if (samples > terms)
    fallback.residual_std = std::sqrt(square_sum / static_cast<double>(samples - terms));
  return fallback;
}

ResidualTable residual_table(const AnyModel& model, const TrainingData& data) {
  std::vector<Residual> all = residuals(model, data);
  const std::size_t regions = std::min(all.size() / kResidualsPerRegion, kMaxResidualRegions);
  if (regions == 0) return {};
  std::ranges::stable_sort(all, {}, &Residual::value);
  if (!(all.front().value < all.back().value)) return {};  // one output: no regions
  ResidualTable table;
  table.edges.push_back(all.front().value);
  std::size_t begin = 0;
  for (std::size_t region = 1; region <= regions; ++region) {
    std::size_t end = all.size() * region / regions;
    // Equal outputs stay in one region, so that edges ascend.
    while (end < all.size() && all[end].value == all[end - 1].value) ++end;
    if (end < begin + kResidualsPerRegion) continue;
    if (all.size() - end < kResidualsPerRegion) end = all.size();
    double square_sum = 0.0;
    for (std::size_t n = begin; n < end; ++n) square_sum += all[n].error * all[n].error;
    const double rms = std::sqrt(square_sum / static_cast<double>(end - begin));
    table.edges.push_back(edge_at(all, end));
    // Never 0, which would mean certainty: a model may fit its training data exactly.
    table.std_dev.push_back(std::max(rms, std::numeric_limits<double>::min()));
    begin = end;
    if (begin == all.size()) break;
  }
  return table;
}

// The regions have about equally many samples.
void widen_to(ResidualTable& table, double rmse) {
  double sum = 0.0;
  for (const double std_dev : table.std_dev) sum += std_dev * std_dev;
  const double usual = std::sqrt(sum / static_cast<double>(table.std_dev.size()));
  if (!(rmse > usual)) return;
  for (double& std_dev : table.std_dev) std_dev *= rmse / usual;
}

ResidualTable larger_of(const ResidualTable& first, const ResidualTable& second) {
  if (first.std_dev.empty()) return second;
  if (second.std_dev.empty()) return first;
  ResidualTable table;
  std::ranges::set_union(first.edges, second.edges, std::back_inserter(table.edges));
  // Edges that differ by rounding only are one.
  const double least = 1e-9 * (table.edges.back() - table.edges.front());
  const auto last = std::unique(table.edges.begin(), table.edges.end(),
                                [least](double edge, double next) { return next - edge <= least; });
  table.edges.erase(last, table.edges.end());
  for (std::size_t i = 1; i < table.edges.size(); ++i) {
    const double middle = 0.5 * (table.edges[i - 1] + table.edges[i]);
    table.std_dev.push_back(std::max(std_dev_at(first, middle), std_dev_at(second, middle)));
  }
  return table;
}

EstimatorSettings guarded_settings(const FeatureSpec& features, const TrainingData& training,
                                   const AnyModel& model, const TrainingData* validation,
                                   const HeldOutErrors& held_out) {
  EstimatorSettings settings;
  settings.features = features;
  settings.sample_rate_Hz = training.sample_rate_Hz;
  settings.target = training.target;
  settings.ranges = feature_ranges(training);
  widen_for_physics(settings.ranges, model);
  settings.fallback = linear_fallback(training);
  // A force may be switched; the deflection of a spring cannot jump.
  if (model.traits().is_spring) settings.disturbances.largest_step = training.largest_step;
  settings.disturbances.largest_travel = training.largest_travel;
  settings.residuals = residual_table(model, validation != nullptr ? *validation : training);
  settings.output.error_bar_factor = held_out.error_bar_factor;
  if (validation == nullptr) {
    widen_to(settings.residuals, held_out.rmse);
    for (double& std_dev : settings.residuals.std_dev) std_dev *= held_out.factor;
    settings.output.error_bar_factor *= held_out.factor;
  }
  for (double& std_dev : settings.residuals.std_dev)
    std_dev = std::max(std_dev, held_out.least_std_dev);
  if (held_out.own_std_dev > 0.0)
    settings.output.error_bar_factor =
        std::max(settings.output.error_bar_factor, held_out.least_std_dev / held_out.own_std_dev);
  if (held_out.stroke_growth > 0.0)
    settings.strokes = {.longest_s = longest_stroke_s(training),
                        .dead_band = stroke_dead_band(training),
                        .growth = held_out.stroke_growth,
                        .limit = target_std_dev(training)};
  add_target_errors(settings, validation != nullptr ? *validation : training, held_out.own_std_dev);
  settings.output.largest_target = 0.0;
  for_each_usable(training, [&](std::span<const double>, double target) {
    settings.output.largest_target = std::max(settings.output.largest_target, std::abs(target));
  });
  if (!model.memory({settings.ranges.lowest, settings.ranges.highest}).is_declared)
    settings.disturbances.warm_up_s = warm_up_s(model, training, settings.residuals);
  return settings;
}

}  // namespace torsio
