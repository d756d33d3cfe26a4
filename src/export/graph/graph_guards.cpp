#include "export/graph/graph_guards.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "export/graph/graph_families.hpp"

namespace torsio {
namespace {

/// An error bar outside of the ranges, per width by which they are left (`detail::EstimatorCore::widened`).
constexpr double kExcursionGain = 2.0;

template <class Of>
Row row_of_ranges(GraphBuilder& graph, const GuardListing& listing, const Of& of) {
  std::vector<double> values;
  for (const GuardListing::Range& range : listing.ranges) values.push_back(of(range));
  return graph.constant(values);
}

/// An error bar that is positive and finite; NaN for any other.
Row evidence(Row std_dev) {
  return select(both(0.0 < std_dev, is_finite(std_dev)), std_dev, kNotMeasured);
}

Row fallback_value(GraphBuilder& graph, const LinearFallback& fallback, const GraphTick& tick) {
  const Row value = dot(tick.features.all, graph.constant(fallback.slope)) + fallback.intercept;
  return select(is_finite(value), value, tick.last_value);
}

}  // namespace

GraphExcursion add_excursion(GraphBuilder& graph, const GraphGuards& guards, Row features) {
  using Range = GuardListing::Range;
  const GuardListing& list = guards.listing;
  const Row lowest = row_of_ranges(graph, list, [](const Range& range) { return range.lowest; });
  const Row highest = row_of_ranges(graph, list, [](const Range& range) { return range.highest; });
  const Row per_border =
      row_of_ranges(graph, list, [](const Range& range) { return 1.0 / range.border; });
  const Row left_by = maximum(maximum(lowest - features, features - highest), 0.0);
  const Row borders = largest(left_by * per_border);
  GraphExcursion excursion{
      .share = graph.constant(0.0), .first = graph.constant(0.0), .fallback = borders};
  if (std::ranges::any_of(list.ranges, [](const Range& range) { return range.reach > 0.0; })) {
    // Beyond an infinite reach there is nothing.
    const Row per_beyond = row_of_ranges(graph, list, [](const Range& range) {
      return std::isfinite(range.reach) ? 1.0 / range.border : 0.0;
    });
    const Row reach = row_of_ranges(graph, list, [](const Range& range) {
      return std::isfinite(range.reach) ? range.reach : 0.0;
    });
    const Row per_width = row_of_ranges(
        graph, list, [](const Range& range) { return range.reach > 0.0 ? range.per_width : 0.0; });
    excursion.fallback = maximum(largest((left_by - reach) * per_beyond), 0.0);
    const Row shares = left_by * per_width;
    excursion.share = largest(shares);
    excursion.first = shares.part(0);
  }
  excursion.is_outside = either(1.0 < borders, 1.0 < excursion.fallback);
  return excursion;
}

Row limited_features(GraphBuilder& graph, const GraphGuards& guards, Row features) {
  using Range = GuardListing::Range;
  return limited(features,
                 row_of_ranges(graph, guards.listing,
                               [](const Range& range) { return range.lowest - range.held; }),
                 row_of_ranges(graph, guards.listing,
                               [](const Range& range) { return range.highest + range.held; }));
}

Row model_std_dev(GraphBuilder& graph, const EstimatorSettings& settings,
                  const GraphEstimate& raw) {
  const Row own = evidence(raw.std_dev * settings.output.error_bar_factor);
  const ResidualTable& table = settings.residuals;
  if (table.std_dev.empty()) return own;
  // A region without evidence has NaN, which 0 becomes.
  Matrix std_dev(table.std_dev.size(), 1);
  std::ranges::transform(table.std_dev, std_dev.values.begin(),
                         [](double each) { return std::isfinite(each) ? each : 0.0; });
  Row of_region = graph.constant(std_dev(0, 0));
  if (table.std_dev.size() > 1) {
    const auto inner = std::span(table.edges).subspan(1, table.std_dev.size() - 1);
    // 1 for each edge below the value; the differences are 1 in its region only.
    const Row above = to_real(is_not(raw.value < graph.constant(inner)));
    const std::vector<Row> from{graph.constant(1.0), above};
    const std::vector<Row> to{above, graph.constant(0.0)};
    of_region = product(joined(from) - joined(to), graph.constant(std::move(std_dev)));
  }
  const Row residual = evidence(of_region);
  return raw.std_dev.is_constant() ? residual : select(0.0 < own, own, residual);
}

GraphEstimate guarded(GraphBuilder& graph, const GraphGuards& guards, const GraphTick& tick,
                      const GraphEstimate& raw) {
  const EstimatorSettings& settings = guards.settings;
  const GraphExcursion& e = tick.excursion;
  const Row std_dev = model_std_dev(graph, settings, raw);
  const Row other = fallback_value(graph, settings.fallback, tick);
  const double fallback_std = settings.fallback.residual_std;
  const Row of_fallback = graph.constant(
      std::isfinite(fallback_std) && fallback_std > 0.0 ? fallback_std : kNotMeasured);
  // The first reason why the fallback replaces the model, the last one here first.
  Row fault = graph.constant(fault_number(Fault::none));
  if (std::isfinite(guards.listing.largest_output))
    fault = select(both(is_not(e.is_outside), guards.listing.largest_output < absolute(raw.value)),
                   fault_number(Fault::diverged), fault);
  if (guards.listing.has_memory)
    fault = select(both(tick.memory_is_open, is_not(tick.memory_bound <= std_dev)),
                   fault_number(Fault::recovering), fault);
  fault = select(is_finite(raw.value), fault, fault_number(Fault::model_not_finite));
  fault = select(0.5 < raw.fault, raw.fault, fault);
  fault = select(tick.is_settled, fault, fault_number(Fault::warming_up));
  fault = select(1.0 < e.fallback, fault_number(Fault::outside_training_range), fault);
  fault = select(tick.is_wrong_rate, fault_number(Fault::wrong_rate), fault);
  const Row is_used = fault < 0.5;

  const Row w = limited(e.fallback, 0.0, 1.0);
  const Row apart = raw.value - other;
  const Row value = raw.value - w * apart;
  const Row blends = 0.0 < e.fallback;
  const Row spread =
      (1.0 - w) * std_dev * std_dev + w * of_fallback * of_fallback + w * (1.0 - w) * apart * apart;
  Row widened_std_dev = select(blends, evidence(square_root(spread)), std_dev);
  if (guards.listing.has_memory)
    widened_std_dev = select(tick.memory_is_open, hypotenuse(widened_std_dev, tick.memory_bound),
                             widened_std_dev);
  if (!tick.features.start_std_dev.is_constant())
    widened_std_dev =
        select(0.0 < tick.features.start_std_dev,
               hypotenuse(widened_std_dev, tick.features.start_std_dev), widened_std_dev);
  if (!tick.stroke_std_dev.is_constant())
    widened_std_dev = select(0.0 < tick.stroke_std_dev,
                             hypotenuse(widened_std_dev, tick.stroke_std_dev), widened_std_dev);
  if (!e.share.is_constant())
    widened_std_dev = select(0.0 < e.share,
                             hypotenuse(widened_std_dev * (e.share * kExcursionGain + 1.0),
                                        minimum(e.first, 1.0) * (value - other)),
                             widened_std_dev);
  GraphEstimate out;
  out.value = select(is_used, value, other);
  out.std_dev = select(is_used, widened_std_dev,
                       select(either(e.is_outside, tick.is_wrong_rate), kNotMeasured, of_fallback));
  const SensorUncertainty& sensor = settings.target_uncertainty;
  if (sensor.constant > 0.0) out.std_dev = hypotenuse(out.std_dev, graph.constant(sensor.constant));
  if (sensor.relative > 0.0) out.std_dev = hypotenuse(out.std_dev, out.value * sensor.relative);
  out.fault =
      select(both(is_used, e.is_outside), fault_number(Fault::outside_training_range), fault);
  return out;
}

}  // namespace torsio
