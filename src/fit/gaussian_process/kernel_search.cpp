#include "fit/gaussian_process/kernel_search.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "core/report_progress.hpp"

namespace torsio {
namespace {

// For standardised data a prior that allows factors of a million either way is without information.
constexpr double kWidest = 13.8;

}  // namespace

KernelSearch::KernelSearch(const Kernel& kernel, std::size_t max_iterations)
    : iterations(max_iterations) {
  settings.iterations = max_iterations;
  settings.tolerance = 1e-8;
  settings.lowest.assign(kernel.parameter_count() + 1, -kWidest);
  settings.highest.assign(kernel.parameter_count() + 1, kWidest);
  settings.lowest.back() = kLeastLogNoise;
  settings.highest.back() = 2.0;
}

std::vector<double> first_start(const Kernel& kernel) {
  std::vector<double> start = kernel.log_parameters();
  start.push_back(kFirstLogNoise);
  return start;
}

std::vector<double> moved_start(const std::vector<double>& start, Random& random) {
  std::vector<double> moved = start;
  for (double& number : moved) number += random.normal();
  return moved;
}

Differentiable reported(Differentiable f, const FitContext& context, double begin, double end,
                        std::size_t iterations, std::string doing) {
  const auto done = std::make_shared<std::size_t>(0);
  return [=, f = std::move(f), doing = std::move(doing), progress = context.progress](
             std::span<const double> x, std::span<double> gradient) {
    const double share =
        static_cast<double>((*done)++) / (1.2 * static_cast<double>(iterations) + 1.0);
    report_progress(progress, begin + (end - begin) * std::min(1.0, share), doing);
    return f(x, gradient);
  };
}

std::string description_of(const KernelExpression& kernel) {
  std::string text = text_of(kernel) + ':';
  for (const KernelNode& node : kernel.nodes) {
    if (node.length_scales.empty()) continue;
    const KernelExpression alone{{node}};
    text += fmt::format(" {} (length {:.3g}", text_of(alone), fmt::join(node.length_scales, ", "));
    if (node.scaled) text += fmt::format("; amplitude {:.3g}", node.amplitude);
    const auto kind = static_cast<KernelKind>(node.kind);
    if (kind == KernelKind::linear) text += fmt::format("; offset {:.3g}", node.shape);
    if (kind == KernelKind::periodic) text += fmt::format("; period {:.3g}", node.shape);
    if (kind == KernelKind::rational_quadratic) text += fmt::format("; alpha {:.3g}", node.shape);
    text += ')';
  }
  return text;
}

}  // namespace torsio
