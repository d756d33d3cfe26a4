#include <algorithm>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "export/graph/graph_families.hpp"
#include "model/gaussian_process/kernel.hpp"

namespace torsio {
namespace {

/// One kernel of an expression between a row of inputs and points, whose coordinates are `at(i)`: a constant row of one
/// coordinate of each, or that of the row itself.
template <class At>
Row kernel_leaf(GraphBuilder& graph, const KernelNode& node, Row x, const At& at) {
  const std::size_t inputs = x.width();
  std::vector<double> weights;
  for (const double scale : node.length_scales) weights.push_back(1.0 / (scale * scale));
  if (weights.size() == 1) weights.resize(inputs, weights.front());
  const auto kind = static_cast<KernelKind>(node.kind);
  Row total = graph.constant(0.0);
  for (std::size_t i = 0; i < inputs; ++i) {
    const Row distance = x.part(i) - at(i);
    Row term = distance * distance;
    if (kind == KernelKind::linear) term = (x.part(i) - node.shape) * (at(i) - node.shape);
    if (kind == KernelKind::periodic) {
      const Row angle = distance * (std::numbers::pi / node.shape);
      const Row sine = graph.node(GraphOperation::sine, graph.at(angle.index).type, angle.width(),
                                  {angle.index});
      term = sine * sine;
    }
    total = total + term * weights[i];
  }
  Row value = total;
  switch (kind) {
    case KernelKind::linear: break;
    case KernelKind::periodic: value = exponential(total * -2.0); break;
    case KernelKind::rational_quadratic:
      value = power(total * (0.5 / node.shape) + 1.0, graph.constant(-node.shape));
      break;
    case KernelKind::matern32: {
      const Row root = square_root(total * 3.0);
      value = (root + 1.0) * exponential(-root);
      break;
    }
    case KernelKind::matern52: {
      const Row root = square_root(total * 5.0);
      value = (root + 1.0 + root * root * (1.0 / 3.0)) * exponential(-root);
      break;
    }
    default: value = exponential(total * -0.5);
  }
  return value * (node.amplitude * node.amplitude);
}

template <class At>
Row kernel_row(GraphBuilder& graph, const KernelExpression& kernel, Row x, const At& at) {
  std::vector<Row> operands;
  for (const KernelNode& node : kernel.nodes) {
    const auto kind = static_cast<KernelKind>(node.kind);
    if (kind != KernelKind::sum && kind != KernelKind::product) {
      operands.push_back(kernel_leaf(graph, node, x, at));
      continue;
    }
    const Row right = operands.back();
    operands.pop_back();
    operands.back() = kind == KernelKind::sum ? operands.back() + right : operands.back() * right;
  }
  return operands.back();
}

/// Covariances of a row with the inducing points.
Row covariance_row(GraphBuilder& graph, const ParametricGp::Parameters& p, Row in) {
  return kernel_row(graph, p.kernel, in, [&](std::size_t i) {
    std::vector<double> coordinates;
    for (std::size_t m = 0; m < p.inducing_points.rows; ++m)
      coordinates.push_back(p.inducing_points(m, i));
    return graph.constant(coordinates);
  });
}

}  // namespace

Row gp_mean_row(GraphBuilder& graph, const ParametricGp::Parameters& p, Row features) {
  graph.use_wide(true);
  const Row in = standardised_row(graph, p.scaling, graph.as_number(features));
  const Row mean = dot(covariance_row(graph, p, in), graph.constant(p.weights));
  const Row value = mean * p.scaling.target_scale + p.scaling.target_centre;
  graph.use_wide(false);
  return to_real(value);
}

// In wide numbers: the variance is the difference of two nearly equal ones, and the weights are large.
GraphEstimate add_parametric_gp(GraphBuilder& graph, const ParametricGp::Parameters& p,
                                Row features) {
  graph.use_wide(true);
  const Row x = graph.as_number(features);
  const Row in = standardised_row(graph, p.scaling, x);
  const Row covariance = covariance_row(graph, p, in);
  const Row mean = dot(covariance, graph.constant(p.weights));
  const Row own = kernel_row(graph, p.kernel, in, [&](std::size_t i) { return in.part(i); });
  const Row left = own - dot(covariance, product(covariance, graph.constant(p.explained)));
  const Row std_dev = square_root(maximum(left, 0.0) + p.noise_variance) * p.scaling.target_scale;
  const Row is_usable = is_finite(mean);
  GraphEstimate estimate = plain_estimate(select(is_usable, mean * p.scaling.target_scale, 0.0) +
                                          p.scaling.target_centre);
  estimate.std_dev =
      select(both(is_usable, is_finite(left)), std_dev, std::numeric_limits<double>::quiet_NaN());
  estimate.fault = select(is_usable, 0.0, fault_number(Fault::model_not_finite));
  graph.use_wide(false);
  return {.value = to_real(estimate.value),
          .std_dev = to_real(estimate.std_dev),
          .fault = to_real(estimate.fault)};
}

}  // namespace torsio
