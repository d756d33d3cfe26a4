#include "fit/mixture/mixture_em.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "fit/mixture/mixture_em_kernel.hpp"
#include "numerics/parallel.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using mixture_em_kernel::kLanes;
using mixture_em_kernel::kTile;

constexpr std::size_t kTilesPerChunk = 32;

// A component with a smaller effective number of samples is not updated.
constexpr double kDeadCount = 1e-9;

void append_parameters(const GaussianMixture& mixture, std::size_t i,
                       detail::AlignedVector<double>& into) {
  const auto d = static_cast<Eigen::Index>(mixture.dimension());
  const Eigen::LLT<Eigen::MatrixXd> cholesky(
      Eigen::Map<const Eigen::MatrixXd>(mixture.covariances.row(i).data(), d, d));
  const Eigen::MatrixXd whitening =
      cholesky.matrixL().solve(Eigen::MatrixXd::Identity(d, d)) / std::numbers::sqrt2;
  const auto mean = mixture.means.row(i);
  into.insert(into.end(), mean.begin(), mean.end());
  for (Eigen::Index r = 0; r < d; ++r)
    for (Eigen::Index c = 0; c <= r; ++c) into.push_back(whitening(r, c));
  into.push_back(std::log(mixture.weights[i]) -
                 cholesky.matrixLLT().diagonal().array().log().sum() -
                 0.5 * static_cast<double>(d) * std::log(2.0 * std::numbers::pi));
}

void remove_dead(GaussianMixture& mixture, const std::vector<double>& counts) {
  const std::size_t d = mixture.dimension();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] <= kDeadCount) continue;
    mixture.weights[kept] = mixture.weights[i];
    std::copy_n(mixture.means.row(i).begin(), d, mixture.means.row(kept).begin());
    std::copy_n(mixture.covariances.row(i).begin(), d * d, mixture.covariances.row(kept).begin());
    ++kept;
  }
  mixture.weights.resize(kept);
  mixture.means.rows = kept;
  mixture.means.values.resize(kept * d);
  mixture.covariances.rows = kept;
  mixture.covariances.values.resize(kept * d * d);
}

}  // namespace

MixtureEm::MixtureEm(const Matrix& samples, const Standardisation& standardisation, Prior prior)
    : prior_(prior), dimension_(samples.columns), samples_(samples.rows) {
  if (samples_ == 0 || standardisation.centre.size() != dimension_ ||
      standardisation.scale.size() != dimension_)
    throw Error({.place = "expectation maximisation",
                 .expected = "samples of as many quantities as the standardisation",
                 .found = fmt::format("[{} x {}] for {}", samples_, dimension_,
                                      standardisation.centre.size())});
  if (!(prior.count > 0.0) || !(prior.spread > 0.0))
    throw Error({.place = "expectation maximisation",
                 .expected = "a prior with positive count and spread",
                 .found = fmt::format("{} and {}", prior.count, prior.spread)});
  const std::size_t tiles = (samples_ + kTile - 1) / kTile;
  tiles_.assign(tiles * kTile * dimension_, 0.0);
  for (std::size_t k = 0; k < samples_; ++k)
    for (std::size_t j = 0; j < dimension_; ++j)
      tiles_[(k / kTile * dimension_ + j) * kTile + k % kTile] =
          (samples(k, j) - standardisation.centre[j]) / standardisation.scale[j];
}

double MixtureEm::iterate(GaussianMixture& mixture, std::size_t threads) const {
  check(mixture);
  if (mixture.dimension() != dimension_)
    throw Error({.place = "expectation maximisation",
                 .expected = fmt::format("a mixture over {} quantities", dimension_),
                 .found = std::to_string(mixture.dimension())});
  const std::size_t m = mixture.size();
  const std::size_t size = m * mixture_em_kernel::rows(dimension_);
  detail::AlignedVector<double> parameters;
  for (std::size_t i = 0; i < m; ++i) append_parameters(mixture, i, parameters);

  const std::size_t tiles = tiles_.size() / (kTile * dimension_);
  const std::size_t chunks = (tiles + kTilesPerChunk - 1) / kTilesPerChunk;
  std::vector<std::vector<double>> chunk_sums(chunks);
  std::vector<double> log_likelihoods(chunks, 0.0);
  for_each_chunk(chunks, threads, [&](std::size_t chunk) {
    detail::AlignedVector<double> scratch(m * kTile);
    detail::AlignedVector<double> lanes(size * kLanes, 0.0);
    const std::size_t end = std::min(tiles, (chunk + 1) * kTilesPerChunk);
    for (std::size_t tile = chunk * kTilesPerChunk; tile < end; ++tile)
      log_likelihoods[chunk] += mixture_em_kernel::add_tile(
          {.samples = tiles_.data() + tile * kTile * dimension_,
           .valid = std::min(kTile, samples_ - tile * kTile)},
          parameters.data(), m, dimension_, scratch.data(), lanes.data());
    chunk_sums[chunk].resize(size);
    for (std::size_t k = 0; k < size; ++k) {
      const auto first = lanes.begin() + static_cast<std::ptrdiff_t>(k * kLanes);
      chunk_sums[chunk][k] =
          std::accumulate(first, first + static_cast<std::ptrdiff_t>(kLanes), 0.0);
    }
  });

  std::vector<double> sums(size, 0.0);
  for (const std::vector<double>& part : chunk_sums)
    for (std::size_t k = 0; k < size; ++k) sums[k] += part[k];
  maximise(mixture, sums);
  return std::accumulate(log_likelihoods.begin(), log_likelihoods.end(), 0.0) /
         static_cast<double>(samples_);
}

void MixtureEm::maximise(GaussianMixture& mixture, std::span<const double> sums) const {
  const std::size_t stride = mixture_em_kernel::rows(dimension_);
  std::vector<double> counts(mixture.size());
  std::vector<double> moved(dimension_);
  double total = 0.0;
  for (std::size_t i = 0; i < mixture.size(); ++i) {
    const std::span<const double> sum = sums.subspan(i * stride, stride);
    counts[i] = sum[0];
    if (counts[i] <= kDeadCount) continue;
    total += counts[i];
    for (std::size_t j = 0; j < dimension_; ++j) {
      moved[j] = sum[1 + j] / counts[i];
      mixture.means(i, j) += moved[j];
    }
    std::size_t at = 1 + dimension_;
    for (std::size_t r = 0; r < dimension_; ++r)
      for (std::size_t c = 0; c <= r; ++c, ++at) {
        const double scatter = sum[at] - counts[i] * moved[r] * moved[c];
        const double prior = r == c ? prior_.count * prior_.spread * prior_.spread : 0.0;
        const double value = (prior + scatter) / (prior_.count + counts[i]);
        mixture.covariances(i, r * dimension_ + c) = value;
        mixture.covariances(i, c * dimension_ + r) = value;
      }
  }
  for (std::size_t i = 0; i < mixture.size(); ++i) mixture.weights[i] = counts[i] / total;
  remove_dead(mixture, counts);
}

}  // namespace torsio
