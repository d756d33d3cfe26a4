#include "fit/gaussian_process/kernel_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <string_view>
#include <utility>

#include "core/report_progress.hpp"
#include "fit/common/usable_table.hpp"
#include "signal/fit_normaliser.hpp"
#include "torsio/signal/normaliser.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxClustered = 20000;
constexpr std::string_view kClustering = "clustering the samples";

double square_distance(std::span<const double> a, std::span<const double> b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

/// An index with a chance in proportion to its weight.
std::size_t drawn(const std::vector<double>& weights, double total, Random& random) {
  double rest = random.uniform() * total;
  std::size_t last = 0;
  for (std::size_t n = 0; n < weights.size(); ++n) {
    if (weights[n] <= 0.0) continue;
    last = n;
    rest -= weights[n];
    if (rest < 0.0) break;
  }
  return last;
}

Matrix spread_centres(const Matrix& points, std::size_t clusters, Random& random,
                      const Progress& progress) {
  Matrix centres(clusters, points.columns);
  std::vector<double> nearest(points.rows, std::numeric_limits<double>::infinity());
  std::size_t chosen = random.below(points.rows);
  for (std::size_t k = 0; k < clusters; ++k) {
    report_progress(progress, 0.0, kClustering);
    std::ranges::copy(points.row(chosen), centres.row(k).begin());
    for (std::size_t n = 0; n < points.rows; ++n)
      nearest[n] = std::min(nearest[n], square_distance(points.row(n), centres.row(k)));
    const double total = std::accumulate(nearest.begin(), nearest.end(), 0.0);
    if (total <= 0.0) {
      centres.rows = k + 1;
      centres.values.resize(centres.rows * centres.columns);
      break;
    }
    chosen = drawn(nearest, total, random);
  }
  return centres;
}

std::size_t nearest_centre(const Matrix& centres, std::span<const double> point) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < centres.rows; ++k) {
    const double distance = square_distance(centres.row(k), point);
    if (distance < least) {
      least = distance;
      best = k;
    }
  }
  return best;
}

/// Every centre to the mean of its points. @returns whether one has moved.
bool move_centres(Matrix& centres, const Matrix& points) {
  Matrix sums(centres.rows, centres.columns);
  std::vector<double> counts(centres.rows, 0.0);
  for (std::size_t n = 0; n < points.rows; ++n) {
    const std::size_t k = nearest_centre(centres, points.row(n));
    counts[k] += 1.0;
    for (std::size_t i = 0; i < points.columns; ++i) sums(k, i) += points(n, i);
  }
  bool has_moved = false;
  for (std::size_t k = 0; k < centres.rows; ++k) {
    if (counts[k] == 0.0) continue;
    for (std::size_t i = 0; i < centres.columns; ++i) {
      const double mean = sums(k, i) / counts[k];
      has_moved |= mean != centres(k, i);
      centres(k, i) = mean;
    }
  }
  return has_moved;
}

}  // namespace

NetworkScaling scaling_of(const Table& table) {
  Matrix target(table.target.size(), 1);
  target.values = table.target;
  const Normaliser of_target = fit_normaliser(target);
  return {.inputs = fit_normaliser(table.features).parameters(),
          .target_centre = of_target.parameters().centre.front(),
          .target_scale = of_target.parameters().scale.front()};
}

NetworkScaling no_scaling(std::size_t inputs) {
  return {.inputs = {.centre = std::vector(inputs, 0.0), .scale = std::vector(inputs, 1.0)}};
}

Table standardised(const NetworkScaling& scaling, Table table) {
  const Normaliser inputs(scaling.inputs);
  for (std::size_t n = 0; n < table.features.rows; ++n)
    inputs.apply(table.features.row(n), table.features.row(n));
  for (double& target : table.target)
    target = (target - scaling.target_centre) / scaling.target_scale;
  return table;
}

Table thinned(const Table& table, std::size_t most, Random& random) {
  const std::size_t rows = table.features.rows;
  if (most == 0 || rows <= most) return table;
  Table result{Matrix(most, table.features.columns), {}};
  result.target.reserve(most);
  // Each row in turn, with the chance that leaves the rest a fair one.
  for (std::size_t n = 0; n < rows && result.target.size() < most; ++n) {
    if (random.below(rows - n) >= most - result.target.size()) continue;
    std::ranges::copy(table.features.row(n), result.features.row(result.target.size()).begin());
    result.target.push_back(table.target[n]);
  }
  return result;
}

double median_distance(const Matrix& points, Random& random) {
  constexpr std::size_t kMaxPairs = 1000;
  std::vector<double> squares;
  for (std::size_t k = 0; k < kMaxPairs && points.rows > 1; ++k) {
    const std::size_t a = random.below(points.rows);
    const std::size_t b = random.below(points.rows);
    if (a != b) squares.push_back(square_distance(points.row(a), points.row(b)));
  }
  if (squares.empty()) return 1.0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::ranges::nth_element(squares, middle);
  return *middle > 0.0 ? std::sqrt(*middle) : 1.0;
}

void set_start(KernelExpression& kernel, double distance) {
  for (KernelNode& node : kernel.nodes) {
    const auto kind = static_cast<KernelKind>(node.kind);
    const double scale = kind == KernelKind::linear     ? 1.0 / 0.3
                         : kind == KernelKind::periodic ? 1.0
                                                        : distance;
    std::ranges::fill(node.length_scales, scale);
    node.amplitude = 1.0;
    node.shape = kind == KernelKind::periodic             ? 2.0 * distance
                 : kind == KernelKind::rational_quadratic ? 1.0
                                                          : 0.0;
  }
}

Matrix cluster_centres(const Matrix& points, std::size_t clusters, Random& random,
                       const Progress& progress) {
  constexpr int kRounds = 30;
  Matrix centres = spread_centres(points, clusters, random, progress);
  for (int round = 0; round < kRounds; ++round) {
    report_progress(progress, 0.0, kClustering);
    if (!move_centres(centres, points)) break;
  }
  return centres;
}

Matrix training_centres(const Table& table, std::size_t clusters, Random& random,
                        const Progress& progress) {
  return cluster_centres(thinned(table, kMaxClustered, random).features, clusters, random,
                         progress);
}

std::vector<std::string> constant_inputs(const TrainingData& data, const Matrix& features) {
  std::vector<std::string> notes;
  for (std::size_t j = 0; j < features.columns; ++j) {
    bool changes = false;
    for (std::size_t n = 1; n < features.rows && !changes; ++n)
      changes = features(n, j) != features(0, j);
    if (!changes)
      notes.push_back(
          fmt::format("input {} is constant in the training data: nothing is known of it",
                      data.inputs[j].expression));
  }
  return notes;
}

}  // namespace torsio
