#include "fit/redundancy/block_bootstrap.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/running_mean.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxBins = 8192;

/// Sums over neighbouring samples; blocks are runs of bins.
struct Bin {
  Eigen::MatrixXd gram;    ///< Σ q qᵀ
  Eigen::VectorXd moment;  ///< Σ q e
  double residual = 0.0;   ///< mean of e
};

std::vector<Bin> bins_of(const Matrix& basis, std::span<const double> residual,
                         std::size_t samples_a_bin) {
  const auto columns = static_cast<Eigen::Index>(basis.columns);
  std::vector<Bin> bins;
  for (std::size_t begin = 0; begin < residual.size(); begin += samples_a_bin) {
    Bin& bin = bins.emplace_back(
        Bin{Eigen::MatrixXd::Zero(columns, columns), Eigen::VectorXd::Zero(columns)});
    const std::size_t end = std::min(begin + samples_a_bin, residual.size());
    for (std::size_t n = begin; n < end; ++n) {
      const Eigen::Map<const Eigen::VectorXd> row(basis.row(n).data(), columns);
      bin.gram.noalias() += row * row.transpose();
      bin.moment += residual[n] * row;
      bin.residual += residual[n];
    }
    bin.residual /= static_cast<double>(end - begin);
  }
  return bins;
}

/// r_1, r_2, ... of the bins' residuals until the first that is not above 0.
std::vector<double> correlations(const std::vector<Bin>& bins) {
  const auto at_lag = [&](std::size_t lag) {
    double sum = 0.0;
    for (std::size_t n = lag; n < bins.size(); ++n)
      sum += bins[n].residual * bins[n - lag].residual;
    return sum;
  };
  const double power = at_lag(0);
  std::vector<double> all;
  if (!(power > 0.0)) return all;
  for (std::size_t lag = 1; lag < bins.size() / 2; ++lag) {
    const double r = at_lag(lag) / power;
    if (!(r > 0.0)) break;
    all.push_back(r);
  }
  return all;
}

/// Factor of the variance for the covariance between neighbouring blocks, which are drawn apart.
double across_borders(std::span<const double> r, double block_bins) {
  double all = 1.0;
  double within = 1.0;
  for (std::size_t k = 0; k < r.size(); ++k) {
    all += 2.0 * r[k];
    within += 2.0 * r[k] * std::max(0.0, 1.0 - static_cast<double>(k + 1) / block_bins);
  }
  return all / within;
}

/// Records of random blocks. A block that leaves the record continues at its start (circular).
class Resampling {
 public:
  Resampling(const std::vector<Bin>& bins, std::size_t block_bins, std::uint64_t seed)
      : bins_(bins.size()), block_bins_(block_bins), random_(seed) {
    // Sums from the start of the record on, twice around.
    up_to_.push_back({Eigen::MatrixXd::Zero(bins[0].gram.rows(), bins[0].gram.cols()),
                      Eigen::VectorXd::Zero(bins[0].moment.size())});
    for (std::size_t n = 0; n < 2 * bins_; ++n)
      up_to_.push_back({up_to_.back().gram + bins[n % bins_].gram,
                        up_to_.back().moment + bins[n % bins_].moment});
  }

  /// Coordinates of the fit to one such record, less those of the whole record.
  Eigen::VectorXd next() {
    Eigen::MatrixXd gram = up_to_[0].gram;
    Eigen::VectorXd moment = up_to_[0].moment;
    for (std::size_t drawn = 0; drawn < bins_; drawn += block_bins_) {
      const std::size_t start = random_.below(bins_);
      const std::size_t end = start + std::min(block_bins_, bins_ - drawn);
      gram += up_to_[end].gram - up_to_[start].gram;
      moment += up_to_[end].moment - up_to_[start].moment;
    }
    return gram.ldlt().solve(moment);
  }

 private:
  std::size_t bins_;
  std::size_t block_bins_;
  Random random_;
  std::vector<Bin> up_to_;
};

}  // namespace

BlockBootstrap block_bootstrap(const Matrix& basis, std::span<const double> residual,
                               const Matrix& to_coefficients, std::size_t resamples,
                               std::uint64_t seed) {
  const std::size_t samples_a_bin = (residual.size() + kMaxBins - 1) / kMaxBins;
  const std::vector<Bin> bins = bins_of(basis, residual, samples_a_bin);
  const std::vector<double> r = correlations(bins);
  const double correlated = 1.0 + 2.0 * std::accumulate(r.begin(), r.end(), 0.0);
  const auto all = static_cast<double>(bins.size());
  const auto block_bins =
      static_cast<std::size_t>(std::ceil(std::cbrt(0.375 * correlated * correlated * all)));
  const auto mean_square = [](const auto& values, const auto& value) {
    double sum = 0.0;
    for (const auto& each : values) sum += value(each) * value(each);
    return sum / static_cast<double>(values.size());
  };
  const double of_bins = mean_square(bins, [](const Bin& bin) { return bin.residual; });
  const double of_samples = mean_square(residual, [](double each) { return each; });
  // The variance of the mean residual is that of a bin, times `correlated`, over the bins.
  const double effective = of_bins > 0.0 ? of_samples / of_bins * all / correlated
                                         : static_cast<double>(residual.size());
  BlockBootstrap result{.standard_errors = std::vector<double>(to_coefficients.rows, kNotMeasured),
                        .block_samples = block_bins * samples_a_bin,
                        .effective_samples = effective};
  const auto columns = static_cast<double>(basis.columns);
  if (bins.size() < BlockBootstrap::kLeastBlocks * block_bins || effective <= columns)
    return result;
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const RowMajor> to(to_coefficients.values.data(),
                                      static_cast<Eigen::Index>(to_coefficients.rows),
                                      static_cast<Eigen::Index>(to_coefficients.columns));
  std::vector<RunningMean> spread(to_coefficients.rows);
  Resampling resampling(bins, block_bins, seed);
  for (std::size_t k = 0; k < resamples; ++k) {
    const Eigen::VectorXd difference = to * resampling.next();
    for (std::size_t j = 0; j < spread.size(); ++j)
      spread[j].add(difference(static_cast<Eigen::Index>(j)));
  }
  const double correction = std::sqrt(across_borders(r, static_cast<double>(block_bins)) *
                                      effective / (effective - columns));
  for (std::size_t j = 0; j < spread.size(); ++j)
    result.standard_errors[j] = correction * spread[j].std_dev();
  return result;
}

}  // namespace torsio
