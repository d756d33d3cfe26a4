#include "identify/weighted_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace torsio {
namespace {

constexpr int kRepetitions = 6;
constexpr double kRounding = 1e-10;  // share of the targets below which a residual is rounding

/// The normal equations of some rows.
struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd moment;
};

class FitOfWindows {
 public:
  FitOfWindows(const JointEquations& equations, const FitPrior& prior)
      : equations_(equations),
        prior_(prior),
        windows_(equations.motion.size()),
        expected_(equations.target - equations.columns * prior.mean),
        variance_(equations.joints, 1.0),
        correlation_(equations.joints, 1.0) {
    const double mean_square =
        equations.target.squaredNorm() / static_cast<double>(equations.target.size());
    least_variance_ = std::max(kRounding * kRounding * mean_square, 1e-300);
  }

  WeightedFit run() {
    // The first weights are equal, the next ones those of the residuals.
    Eigen::VectorXd offset = solve(all());
    for (int repetition = 0; repetition < kRepetitions; ++repetition) {
      find_weights(offset);
      offset = solve(all());
    }
    WeightedFit fit{.parameters = prior_.mean + offset, .jackknife = {}, .model = {}};
    for (const double variance : variance_) fit.residual_rms.push_back(std::sqrt(variance));
    add_covariances(offset, fit);
    return fit;
  }

 private:
  /// The rows of windows `begin` to `end` - 1.
  [[nodiscard]] NormalEquations normal(std::size_t begin, std::size_t end) const {
    const Eigen::Index size = equations_.columns.cols();
    const Eigen::Index rows = eigen_index((end - begin) * equations_.joints);
    const Eigen::Index first = eigen_index(begin * equations_.joints);
    Eigen::VectorXd weight(rows);
    for (Eigen::Index r = 0; r < rows; ++r) {
      const auto joint = static_cast<std::size_t>(r) % equations_.joints;
      weight(r) = 1.0 / std::sqrt(variance_[joint] * correlation_[joint]);
    }
    const Eigen::MatrixXd scaled = weight.asDiagonal() * equations_.columns.middleRows(first, rows);
    NormalEquations of{.matrix = Eigen::MatrixXd::Zero(size, size), .moment = {}};
    of.matrix.noalias() = scaled.transpose() * scaled;
    of.moment = scaled.transpose() * weight.cwiseProduct(expected_.segment(first, rows));
    return of;
  }
  [[nodiscard]] NormalEquations all() const {
    NormalEquations of = normal(0, windows_);
    of.matrix += prior_.precision;
    return of;
  }
  /// With columns of length 1, so that their units do not matter.
  static Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& matrix) {
    const Eigen::VectorXd scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
    const Eigen::MatrixXd inverse =
        scaled.ldlt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
    return scale.asDiagonal() * inverse * scale.asDiagonal();
  }
  static Eigen::VectorXd solve(const NormalEquations& of) {
    const Eigen::VectorXd scale = of.matrix.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * of.matrix * scale.asDiagonal();
    return scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(of.moment)));
  }

  void find_weights(const Eigen::VectorXd& offset) {
    const Eigen::VectorXd residual = expected_ - equations_.columns * offset;
    for (std::size_t j = 0; j < equations_.joints; ++j) {
      std::vector<double> of(windows_);
      double squares = 0.0;
      for (std::size_t w = 0; w < windows_; ++w) {
        of[w] = residual(eigen_index(w * equations_.joints + j));
        squares += of[w] * of[w];
      }
      variance_[j] = std::max(squares / static_cast<double>(windows_), least_variance_);
      correlation_[j] = correlation_time(of, squares);
    }
  }
  /// 1 + 2 sum r_k up to the first r_k that is not above 0 [windows].
  [[nodiscard]] double correlation_time(const std::vector<double>& residual, double squares) const {
    double time = 1.0;
    if (!(squares > 0.0)) return time;
    for (std::size_t lag = 1; lag < windows_ / 4; ++lag) {
      double sum = 0.0;
      for (std::size_t w = lag; w < windows_; ++w)
        if (equations_.motion[w] == equations_.motion[w - lag])
          sum += residual[w] * residual[w - lag];
      if (!(sum > 0.0)) break;
      time += 2.0 * sum / squares;
    }
    return time;
  }

  void add_covariances(const Eigen::VectorXd& offset, WeightedFit& fit) const {
    const NormalEquations whole = all();
    fit.model = scaled_inverse(whole.matrix);
    fit.jackknife = fit.model * prior_.precision * fit.model;
    const double longest = std::ranges::max(correlation_);
    fit.block_windows =
        std::clamp(static_cast<std::size_t>(std::ceil(2.0 * longest)), std::size_t{1},
                   std::max<std::size_t>(1, windows_ / kLeastFitBlocks));
    std::vector<std::size_t> ends;
    for (std::size_t begin = 0; begin < windows_;) {
      std::size_t end = begin;
      while (end < windows_ && end < begin + fit.block_windows &&
             equations_.motion[end] == equations_.motion[begin])
        ++end;
      ends.push_back(end);
      begin = end;
    }
    fit.blocks = ends.size();
    const auto count = static_cast<double>(fit.blocks);
    std::size_t begin = 0;
    for (const std::size_t end : ends) {
      const NormalEquations block = normal(begin, end);
      const Eigen::VectorXd change =
          solve({whole.matrix - block.matrix, whole.moment - block.moment}) - offset;
      fit.jackknife += (count - 1.0) / count * change * change.transpose();
      begin = end;
    }
    const Eigen::MatrixXd information = fit.model;
    for (std::size_t j = 0; j < equations_.scale_std.size(); ++j) {
      const Eigen::VectorXd change = equations_.scale_std[j] * (information * moment_of_torque(j));
      fit.jackknife += change * change.transpose();
      fit.model += change * change.transpose();
    }
  }
  /// Xᵀ W τ of the rows of one joint.
  [[nodiscard]] Eigen::VectorXd moment_of_torque(std::size_t joint) const {
    Eigen::VectorXd moment = Eigen::VectorXd::Zero(equations_.columns.cols());
    for (std::size_t w = 0; w < windows_; ++w) {
      const Eigen::Index row = eigen_index(w * equations_.joints + joint);
      moment += equations_.torque(row) * equations_.columns.row(row).transpose();
    }
    return moment / (variance_[joint] * correlation_[joint]);
  }

  const JointEquations& equations_;
  const FitPrior& prior_;
  std::size_t windows_;
  Eigen::VectorXd expected_;  ///< y − X μ
  std::vector<double> variance_;
  std::vector<double> correlation_;
  double least_variance_ = 0.0;
};

}  // namespace

double WeightedFit::standard_error(const Eigen::VectorXd& gradient) const {
  return std::sqrt(
      std::max({0.0, gradient.dot(jackknife * gradient), gradient.dot(model * gradient)}));
}

WeightedFit weighted_fit(const JointEquations& equations, const FitPrior& prior) {
  return FitOfWindows(equations, prior).run();
}

}  // namespace torsio
