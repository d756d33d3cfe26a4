#include "check/hysteresis_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr auto kStops = std::to_array<double>({0.01, 0.04, 0.16, 0.5});  // shares of half the range
constexpr auto kHinges = std::to_array<double>({-0.75, -0.5, -0.25, 0.25, 0.5, 0.75});
constexpr Eigen::Index kPowers = 4;
static_assert(kStaticColumns == kPowers + static_cast<Eigen::Index>(kHinges.size()));

}  // namespace

Eigen::MatrixXd hysteresis_columns(const std::vector<double>& signal,
                                   std::span<const std::size_t> samples, const Extent& extent) {
  const double middle = 0.5 * (extent.lowest + extent.highest);
  const double scale = extent.width() > 0.0 ? 2.0 / extent.width() : 0.0;
  Eigen::MatrixXd columns(static_cast<Eigen::Index>(samples.size()),
                          kStaticColumns + static_cast<Eigen::Index>(kStops.size()));
  std::array<double, kStops.size()> stops{};
  double last = kNotMeasured;
  std::size_t i = 0;
  for (Eigen::Index row = 0; row < columns.rows(); ++row) {
    double z = 0.0;
    for (; i <= samples[static_cast<std::size_t>(row)]; ++i) {
      if (!is_finite(signal[i])) continue;
      z = scale * (signal[i] - middle);
      const double moved = is_finite(last) ? z - last : 0.0;
      last = z;
      for (std::size_t k = 0; k < stops.size(); ++k)
        stops[k] = std::clamp(stops[k] + moved, -kStops[k], kStops[k]);
    }
    columns.row(row).head<kPowers>() << 1.0, z, z * std::abs(z), z * z * z;
    for (std::size_t k = 0; k < kHinges.size(); ++k)
      columns(row, kPowers + static_cast<Eigen::Index>(k)) = std::max(z - kHinges[k], 0.0);
    for (std::size_t k = 0; k < stops.size(); ++k)
      columns(row, kStaticColumns + static_cast<Eigen::Index>(k)) = stops[k];
  }
  return columns;
}

Eigen::MatrixXd relaxation_columns(const std::vector<double>& input,
                                   std::span<const std::size_t> samples, double sample_rate_Hz) {
  constexpr auto kTimeConstants_s = std::to_array<double>({0.02, 0.07, 0.2, 0.7, 2.0, 7.0, 20.0});
  Eigen::MatrixXd columns(static_cast<Eigen::Index>(samples.size()),
                          static_cast<Eigen::Index>(kTimeConstants_s.size()));
  std::array<double, kTimeConstants_s.size()> slow{};
  double last = kNotMeasured;
  std::size_t i = 0;
  for (std::size_t row = 0; row < samples.size(); ++row) {
    for (; i <= samples[row]; ++i) {
      if (!is_finite(input[i])) continue;
      if (!is_finite(last)) slow.fill(input[i]);
      last = input[i];
      for (std::size_t k = 0; k < slow.size(); ++k)
        slow[k] -= std::expm1(-1.0 / (kTimeConstants_s[k] * sample_rate_Hz)) * (last - slow[k]);
    }
    for (std::size_t k = 0; k < slow.size(); ++k)
      columns(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(k)) = last - slow[k];
  }
  return columns;
}

std::vector<std::size_t> samples_for_fit(const std::vector<double>& signal, std::size_t begin,
                                         std::size_t end, std::size_t enough) {
  std::vector<std::size_t> samples;
  if (end <= begin) return samples;
  const std::size_t stride = std::max<std::size_t>(1, (end - begin) / enough);
  for (std::size_t i = begin; i < end; i += stride)
    if (is_finite(signal[i])) samples.push_back(i);
  return samples;
}

std::vector<std::size_t> known_samples(const Pair& pair, std::size_t enough) {
  std::vector<double> known = pair.input;
  for (std::size_t i = 0; i < known.size(); ++i)
    if (!is_finite(pair.target[i])) known[i] = kNotMeasured;
  return samples_for_fit(known, 0, known.size(), enough);
}

Eigen::VectorXd at_samples(const std::vector<double>& values, std::span<const std::size_t> samples,
                           std::ptrdiff_t shift) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(samples.size()));
  for (std::size_t row = 0; row < samples.size(); ++row)
    result(static_cast<Eigen::Index>(row)) =
        values[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(samples[row]) + shift)];
  return result;
}

FixedColumns::FixedColumns(const Eigen::MatrixXd& columns) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  basis_ = qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
}

double FixedColumns::unexplained(const Eigen::VectorXd& values) const {
  const Eigen::VectorXd varying = values.array() - values.mean();
  const double variance = varying.squaredNorm();
  if (!(variance > 0.0)) return 1.0;
  return std::max(0.0, 1.0 - (basis_.transpose() * varying).squaredNorm() / variance);
}

Eigen::VectorXd FixedColumns::residual(const Eigen::VectorXd& values) const {
  return values - basis_ * (basis_.transpose() * values);
}

double share_of_variance(const Eigen::VectorXd& residual, const Eigen::VectorXd& values) {
  const double variance = (values.array() - values.mean()).matrix().squaredNorm();
  return variance > 0.0 ? residual.squaredNorm() / variance : 1.0;
}

double slope_over(const Eigen::VectorXd& z, const Eigen::VectorXd& values) {
  const Eigen::VectorXd varying = z.array() - z.mean();
  const double variance = varying.squaredNorm();
  return variance > 0.0 ? varying.dot(values) / variance : 0.0;
}

}  // namespace torsio
