#include "export/graph/graph_models.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "export/graph/graph_coefficients.hpp"
#include "export/graph/graph_families.hpp"
#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "model/hysteresis/operator_sum.hpp"
#include "model/linear/linear.hpp"
#include "model/linear/linear_coulomb.hpp"
#include "model/linear/polynomial.hpp"
#include "model/viscoelastic/relaxation_step.hpp"
#include "model/viscoelastic/viscoelastic.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/fault.hpp"

namespace torsio {
namespace {

constexpr std::string_view kGraphFamilies =
    "linear, linear_coulomb, polynomial, maxwell_slip, prandtl_ishlinskii, grey_box, mlp, gru, "
    "lstm, parametric_gp, viscoelastic, hammerstein_wiener";

GraphEstimate added_model(GraphBuilder& graph, const Linear::Parameters& p, Row x) {
  const Row c = coefficients(graph, p.coefficients, x);
  return plain_estimate(c.part(0) + dot(c.part(1, c.width() - 1), x));
}

GraphEstimate added_model(GraphBuilder& graph, const LinearCoulomb::Parameters& p, Row x) {
  const Row c = coefficients(graph, p.coefficients, x);
  const std::size_t last = c.width() - 1;
  const Row friction = c.part(last) * tangent(x.part(p.rate_feature) * (1.0 / p.rate_scale));
  return plain_estimate(c.part(0) + dot(c.part(1, last - 1), x) + friction);
}

/// sum_k c_k z^k
Row horner(Row coefficients, Row z) {
  Row value = coefficients.part(coefficients.width() - 1);
  for (std::size_t k = coefficients.width() - 1; k-- > 0;) value = value * z + coefficients.part(k);
  return value;
}

GraphEstimate added_model(GraphBuilder& graph, const Polynomial::Parameters& given, Row x) {
  const Polynomial::Parameters p = Polynomial(given).parameters();  // whose ranges are filled in
  CoefficientSchedule schedule = p.coefficients;
  schedule.values = p.ranges;
  const Row c = coefficients(graph, p.coefficients, x);
  const Row ranges = coefficients(graph, schedule, x);
  const Row z = (x.part(0) - p.centre) * (1.0 / p.half_range);
  Row is_held = graph.truth(false);
  // One of the curves; held more than a border outside its own range.
  const auto branch = [&](std::size_t index, Row is_used) {
    const auto end = [&](std::size_t column) {
      return (ranges.part(column) - p.centre) * (1.0 / p.half_range);
    };
    const Row low = end(2 * index);
    const Row high = end(2 * index + 1);
    const Row border = (high - low) * Polynomial::kBorder;
    const Row held = limited(z, low - border, high + border);
    is_held = either(is_held, both(is_used, either(held < z, z < held)));
    return horner(c.part(index * (p.degree + 1), p.degree + 1), held);
  };
  Row value = graph.constant(0.0);
  if (!p.by_direction) {
    value = branch(0, graph.truth(true));
  } else {
    const Row u = x.part(0);
    const Row is_started = graph.truth_state("direction_is_started");
    const Row before = graph.state("direction");
    const Row lowest = minimum(u, select(is_started, graph.state("lowest_x"), u));
    const Row highest = maximum(u, select(is_started, graph.state("highest_x"), u));
    const Row rises = both(before < 0.5, p.dead_band < u - lowest);
    const Row falls = both(is_not(rises), both(-0.5 < before, p.dead_band < highest - u));
    const Row direction = select(rises, 1.0, select(falls, -1.0, before));
    graph.set_state("direction_is_started", graph.truth(true));
    graph.set_state("direction", direction);
    graph.set_state("lowest_x", select(falls, u, lowest));
    graph.set_state("highest_x", select(rises, u, highest));
    const Row is_up = -0.5 < direction;
    const Row is_down = direction < 0.5;
    const Row share = select(both(is_up, is_down), 0.5, 1.0);
    value =
        (select(is_up, branch(0, is_up), 0.0) + select(is_down, branch(1, is_down), 0.0)) * share;
  }
  const std::size_t inputs = c.width() - p.curve_columns();
  GraphEstimate estimate = plain_estimate(value + dot(c.part(p.curve_columns(), inputs), x));
  estimate.fault = select(is_held, fault_number(Fault::outside_training_range), 0.0);
  return estimate;
}

template <class Operator>
GraphEstimate added_operators(GraphBuilder& graph,
                              const typename OperatorSum<Operator>::Parameters& p, Row x) {
  const Row c = coefficients(graph, p.coefficients, x);
  const std::size_t elements = p.thresholds.size();
  const std::size_t inputs = c.width() - 1 - elements;
  Row value = c.part(0) + dot(c.part(1, inputs), x);
  if (elements > 0) {
    const Row thresholds = graph.constant(p.thresholds);
    const Row u = x.part(0);
    const Row slip = limited(graph.state("slip", elements) + motion(graph, "x", u).change,
                             -thresholds, thresholds);
    graph.set_state("slip", slip);
    // The play operator of an element is what its stop leaves of the input.
    const bool is_play = Operator::of(1.0, 0.0) != 0.0;
    value = value + dot(c.part(1 + inputs, elements), is_play ? u - slip : slip);
  }
  return plain_estimate(value);
}

GraphEstimate added_model(GraphBuilder& graph, const Viscoelastic::Parameters& p, Row x) {
  const RelaxationSpectrum spectrum = relaxation_spectrum(p.network);
  std::vector<double> gain;
  std::vector<double> kept;
  for (const RelaxationBranch& branch : spectrum.branches) {
    gain.push_back(relaxation_step(branch, p.sample_period_s).gain);
    kept.push_back(std::exp(-branch.rate_1_s * p.sample_period_s));
  }
  const Row u = x.part(0);
  const Row change = motion(graph, "x", u).change;
  Row value = u * spectrum.stiffness + change * (spectrum.damping / p.sample_period_s) + p.offset;
  if (!gain.empty()) {
    const Row torque =
        graph.state("torque", gain.size()) * graph.constant(kept) + change * graph.constant(gain);
    graph.set_state("torque", torque);
    value = value + sum(torque);
  }
  GraphEstimate estimate = plain_estimate(value);
  const Row is_usable = is_finite(value);
  estimate.value = select(is_usable, value, p.offset);
  estimate.fault = select(is_usable, 0.0, fault_number(Fault::model_not_finite));
  return estimate;
}

Row curve_row(GraphBuilder& graph, const StaticCurve& curve, Row x) {
  if (curve.knots.empty())
    return horner(graph.constant(curve.values), (x - curve.centre) * (1.0 / curve.half_range));
  Matrix table(curve.values.size(), 1);
  table.values = curve.values;
  return interpolated(x, curve.knots, graph.constant(std::move(table)), false);
}

// In wide numbers: the sections add up small differences.
GraphEstimate added_model(GraphBuilder& graph, const HammersteinWiener::Parameters& p,
                          Row features) {
  graph.use_wide(true);
  const Row x = graph.as_number(features);
  // The states are those less the ones at rest, so that zero is the state after a reset.
  const double rest_in = p.input(p.rest_input);
  double rest_out = rest_in;
  const std::size_t sections = p.sections.rows;
  for (std::size_t i = 0; i < sections; ++i) {
    const auto g = p.sections.row(i);
    rest_out *= (g[0] + g[1] + g[2]) / (1.0 + g[3] + g[4]);
  }
  const double rest_value = p.output(std::clamp(rest_out, p.lowest, p.highest));
  const Row bent = curve_row(graph, p.input, x.part(0));
  const Row is_usable = is_finite(bent);
  Row in = select(is_usable, bent - rest_in, 0.0);
  const Row before = graph.state("section", 2 * sections);
  std::vector<Row> next;
  for (std::size_t i = 0; i < sections; ++i) {
    const auto g = p.sections.row(i);
    const Row y = in * g[0] + before.part(2 * i);
    next.push_back(in * g[1] - y * g[3] + before.part(2 * i + 1));
    next.push_back(in * g[2] - y * g[4]);
    in = y;
  }
  graph.set_state("section", select(is_usable, joined(next), before));
  const Row unlimited = in + rest_out;
  const Row held = limited(unlimited, p.lowest, p.highest);
  const Row last = graph.state("value_from_rest");
  const Row value = select(is_usable, curve_row(graph, p.output, held), last + rest_value);
  graph.set_state("value_from_rest", value - rest_value);
  GraphEstimate estimate = plain_estimate(value);
  const Row is_inside =
      absolute(unlimited - held) <= HammersteinWiener::kBorder * (p.highest - p.lowest);
  estimate.fault =
      select(is_usable, select(is_inside, 0.0, fault_number(Fault::outside_training_range)),
             fault_number(Fault::model_not_finite));
  graph.use_wide(false);
  return {.value = to_real(estimate.value),
          .std_dev = to_real(estimate.std_dev),
          .fault = to_real(estimate.fault)};
}

}  // namespace

std::string_view graph_families() noexcept { return kGraphFamilies; }

double fault_number(Fault fault) noexcept { return static_cast<double>(fault); }

GraphEstimate plain_estimate(Row value) {
  GraphBuilder& graph = *value.graph;
  return {.value = value,
          .std_dev = graph.constant(std::numeric_limits<double>::quiet_NaN()),
          .fault = graph.constant(fault_number(Fault::none))};
}

GraphMotion motion(GraphBuilder& graph, const std::string& name, Row x) {
  const Row has_started = graph.truth_state(name + "_is_started");
  const Row change = select(has_started, x - graph.state(name + "_before"), 0.0);
  graph.set_state(name + "_is_started", graph.truth(true));
  graph.set_state(name + "_before", x);
  return {.change = change, .has_started = has_started};
}

GraphEstimate add_model(GraphBuilder& graph, const AnyModel::Parameters& parameters, Row x) {
  if (const auto* p = parameters.get_if<Linear::Parameters>()) return added_model(graph, *p, x);
  if (const auto* p = parameters.get_if<LinearCoulomb::Parameters>())
    return added_model(graph, *p, x);
  if (const auto* p = parameters.get_if<Polynomial::Parameters>()) return added_model(graph, *p, x);
  if (const auto* p = parameters.get_if<MaxwellSlipModel::Parameters>())
    return added_operators<StopOperator>(graph, *p, x);
  if (const auto* p = parameters.get_if<PrandtlIshlinskii::Parameters>())
    return added_operators<PlayOperator>(graph, *p, x);
  if (const auto* p = parameters.get_if<GreyBox::Parameters>()) return add_grey_box(graph, *p, x);
  if (const auto* p = parameters.get_if<Mlp::Parameters>()) return add_network(graph, *p, x);
  if (const auto* p = parameters.get_if<Gru::Parameters>()) return add_network(graph, *p, x);
  if (const auto* p = parameters.get_if<Lstm::Parameters>()) return add_network(graph, *p, x);
  if (const auto* p = parameters.get_if<ParametricGp::Parameters>())
    return add_parametric_gp(graph, *p, x);
  if (const auto* p = parameters.get_if<Viscoelastic::Parameters>())
    return added_model(graph, *p, x);
  if (const auto* p = parameters.get_if<HammersteinWiener::Parameters>())
    return added_model(graph, *p, x);
  throw UsageError(
      {.place = "the model",
       .expected = "a family of which there is a graph: " + std::string(kGraphFamilies),
       .found = std::string(parameters.family())});
}

}  // namespace torsio
