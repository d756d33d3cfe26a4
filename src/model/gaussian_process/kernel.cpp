#include "model/gaussian_process/kernel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/checks.hpp"
#include "model/gaussian_process/kernel_kernels.hpp"

namespace torsio {
namespace {

using kernel_kernels::in_groups;
using kernel_kernels::kGroup;

bool is_leaf(const KernelNode& node) {
  return node.kind < static_cast<std::size_t>(KernelKind::sum);
}

bool has_shape(KernelKind kind) {
  return kind == KernelKind::linear || kind == KernelKind::periodic ||
         kind == KernelKind::rational_quadratic;
}

std::string place_of(std::size_t node) { return fmt::format("kernel.nodes.{}", node); }

void check_leaf(const KernelNode& node, std::size_t index, std::size_t inputs) {
  const std::string place = place_of(index);
  const std::size_t scales = node.length_scales.size();
  require(scales == 1 || scales == inputs, {place, "length_scales"},
          fmt::format("1 value, or {}: one per input", inputs), std::to_string(scales));
  // A scale whose square is 0 or infinite would make 0 times infinity of equal points.
  const auto is_scale = [](double value) { return value >= 1e-150 && value <= 1e150; };
  for (const double scale : node.length_scales)
    require(is_scale(scale), {place, "length_scales"}, "positive finite numbers", scale);
  require(is_scale(node.amplitude), {place, "amplitude"}, "a positive finite number",
          node.amplitude);
  const auto kind = static_cast<KernelKind>(node.kind);
  if (kind == KernelKind::linear)
    require(std::isfinite(node.shape), {place, "shape"}, "a finite number", node.shape);
  if (kind == KernelKind::periodic)
    require(is_scale(node.shape), {place, "shape"}, "a positive finite number", node.shape);
  if (kind == KernelKind::rational_quadratic)
    require(is_scale(std::abs(node.shape)), {place, "shape"}, "a finite number that is not 0",
            node.shape);
}

}  // namespace

PackedPoints::PackedPoints(const Matrix& points)
    : size_(points.rows),
      inputs_(points.columns),
      stride_(in_groups(points.rows)),
      values_(points.columns * stride_, 0.0) {
  for (std::size_t n = 0; n < size_; ++n) set(n, points.row(n));
}

void PackedPoints::set(std::size_t index, Features point) noexcept {
  const std::size_t end = index + 1 == size_ ? stride_ : index + 1;
  for (std::size_t i = 0; i < inputs_; ++i)
    std::fill(values_.data() + i * stride_ + index, values_.data() + i * stride_ + end, point[i]);
}

KernelGradient::KernelGradient(std::size_t parameters) : lanes_(parameters * kGroup, 0.0) {}

void KernelGradient::clear() noexcept { std::ranges::fill(lanes_, 0.0); }

double KernelGradient::operator[](std::size_t parameter) const noexcept {
  double sum = 0.0;
  for (std::size_t lane = 0; lane < kGroup; ++lane) sum += lanes_[parameter * kGroup + lane];
  return sum;
}

Kernel::Kernel(KernelExpression expression, std::size_t inputs)
    : expression_(std::move(expression)), inputs_(inputs) {
  if (inputs == 0 || inputs > kMaxInputs)
    throw Error({.place = "kernel",
                 .expected = fmt::format("1 to {} inputs", kMaxInputs),
                 .found = std::to_string(inputs)});
  prepare();
  refresh();
}

void Kernel::prepare() {
  const std::vector<KernelNode>& nodes = expression_.nodes;
  if (nodes.empty() || nodes.size() > kMaxNodes)
    throw Error({.place = "kernel.nodes",
                 .expected = fmt::format("1 to {} nodes", kMaxNodes),
                 .found = std::to_string(nodes.size())});
  std::vector<std::size_t> operands;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const KernelNode& node = nodes[n];
    if (node.kind > static_cast<std::size_t>(KernelKind::product))
      refuse({place_of(n), "kind"}, "a number from 0 to 7", std::to_string(node.kind));
    KernelTerm term{.kind = static_cast<KernelKind>(node.kind),
                    .scaled = node.scaled,
                    .shared_scale = node.length_scales.size() == 1,
                    .first_parameter = parameters_,
                    .first_weight = weights_.size()};
    if (is_leaf(node)) {
      check_leaf(node, n, inputs_);
      parameters_ +=
          (node.scaled ? 1 : 0) + node.length_scales.size() + (has_shape(term.kind) ? 1 : 0);
      weights_.resize(weights_.size() + node.length_scales.size());
      operands.push_back(n);
    } else {
      if (!node.length_scales.empty())
        refuse({place_of(n), "length_scales"}, "none of a sum or product",
               std::to_string(node.length_scales.size()));
      if (operands.size() < 2)
        refuse({place_of(n), "kind"}, "a sum or product of two kernels", "fewer before it");
      operands.pop_back();
      term.left = operands.back();
      operands.back() = n;
    }
    terms_.push_back(term);
  }
  if (operands.size() != 1)
    throw Error({.place = "kernel.nodes",
                 .expected = "one expression",
                 .found = fmt::format("{} side by side", operands.size())});
}

void Kernel::refresh() noexcept {
  for (std::size_t n = 0; n < terms_.size(); ++n) {
    const KernelNode& node = expression_.nodes[n];
    KernelTerm& term = terms_[n];
    term.variance = node.amplitude * node.amplitude;
    term.shape = node.shape;
    for (std::size_t i = 0; i < node.length_scales.size(); ++i)
      weights_[term.first_weight + i] = 1.0 / (node.length_scales[i] * node.length_scales[i]);
  }
}

std::vector<double> Kernel::log_parameters() const {
  std::vector<double> values;
  values.reserve(parameters_);
  for (const KernelNode& node : expression_.nodes) {
    if (!is_leaf(node)) continue;
    const auto kind = static_cast<KernelKind>(node.kind);
    if (node.scaled) values.push_back(std::log(node.amplitude));
    for (const double scale : node.length_scales) values.push_back(std::log(scale));
    if (kind == KernelKind::linear) {
      values.push_back(node.shape);
    } else if (has_shape(kind)) {
      values.push_back(std::log(std::abs(node.shape)));
    }
  }
  return values;
}

void Kernel::set_log_parameters(std::span<const double> values) noexcept {
  auto next = values.begin();
  for (KernelNode& node : expression_.nodes) {
    if (!is_leaf(node)) continue;
    const auto kind = static_cast<KernelKind>(node.kind);
    if (node.scaled) node.amplitude = std::exp(*next++);
    for (double& scale : node.length_scales) scale = std::exp(*next++);
    if (kind == KernelKind::linear) {
      node.shape = *next++;
    } else if (has_shape(kind)) {
      node.shape = std::copysign(std::exp(*next++), node.shape);
    }
  }
  refresh();
}

void Kernel::row(const double* x, const PackedPoints& points, std::size_t count,
                 double* values) const noexcept {
  kernel_kernels::row({terms_.data(), terms_.size(), weights_.data(), inputs_}, x,
                      {points.data(), points.padded_size(), count}, values);
}

void Kernel::add_gradient(const double* x, const PackedPoints& points, std::size_t count,
                          const double* weights, KernelGradient& gradient) const noexcept {
  kernel_kernels::add_gradient({terms_.data(), terms_.size(), weights_.data(), inputs_}, x,
                               {points.data(), points.padded_size(), count}, weights,
                               gradient.lanes());
}

double Kernel::self(const double* x) const noexcept {
  std::array<double, kMaxNodes> values{};
  for (std::size_t n = 0; n < terms_.size(); ++n) {
    const KernelTerm& term = terms_[n];
    switch (term.kind) {
      case KernelKind::sum: values[n] = values[term.left] + values[n - 1]; break;
      case KernelKind::product: values[n] = values[term.left] * values[n - 1]; break;
      case KernelKind::linear: {
        double sum = 0.0;
        for (std::size_t i = 0; i < inputs_; ++i) {
          const double off = x[i] - term.shape;
          sum += off * weights_[term.first_weight + (term.shared_scale ? 0 : i)] * off;
        }
        values[n] = term.variance * sum;
        break;
      }
      default: values[n] = term.variance;
    }
  }
  return values[terms_.size() - 1];
}

}  // namespace torsio
