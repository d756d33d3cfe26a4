#include "fit/transfer/refit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>

#include "fit/common/model_run.hpp"
#include "fit/common/usable_table.hpp"
#include "model/grey_box/grey_box.hpp"
#include "model/linear/linear.hpp"
#include "model/mixture/dgmm.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "numerics/nnls.hpp"

namespace torsio {
namespace {

constexpr double kWidestFactor = 2.0;  // range of a factor between specimens, not between sizes

/// Consecutive coefficients [begin, end) that make up one part of the torque.
struct Part {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Least squares of coefficients with a prior around those of the base. Specimens differ most in the size of a
/// part (stiffness, friction): the prior is around the base with each part scaled.
class PriorFit {
 public:
  /// @param sizes of the columns, at least
  /// @param is_free one for each; 0: remains >= 0
  /// @param parts that are scaled, in order; none: the prior is around the base
  PriorFit(std::vector<double> base, std::vector<double> sizes, std::vector<std::uint8_t> is_free,
           std::vector<Part> parts = {})
      : base_(std::move(base)),
        is_free_(std::move(is_free)),
        parts_(std::move(parts)),
        largest_(std::move(sizes)),
        equations_(base_.size()) {}

  /// @param error of the base at this sample: measured - estimated
  void add(std::span<const double> row, double error) {
    double own = 0.0;
    for (std::size_t j = 0; j < row.size(); ++j) {
      own += row[j] * base_[j];
      largest_[j] = std::max(largest_[j], std::abs(row[j]));
    }
    equations_.add(row, own + error);
  }

  [[nodiscard]] std::vector<double> solution(double prior) const {
    const std::vector<double> centre = scaled_base(prior);
    NormalEquations equations = equations_;
    for (std::size_t j = 0; j < base_.size(); ++j) {
      const double weight = prior * static_cast<double>(equations.rows) * largest_[j] * largest_[j];
      equations.product(j, j) += weight;
      equations.projection[j] += weight * centre[j];
    }
    return non_negative_least_squares(equations, is_free_).coefficients;
  }

 private:
  /// The output of a part with the base's coefficients, times column k, summed over the samples.
  [[nodiscard]] double product(const Part& part, std::size_t k) const {
    double sum = 0.0;
    for (std::size_t j = part.begin; j < part.end; ++j) sum += base_[j] * equations_.product(j, k);
    return sum;
  }

  [[nodiscard]] double projection(const Part& part) const {
    double sum = 0.0;
    for (std::size_t j = part.begin; j < part.end; ++j) sum += base_[j] * equations_.projection[j];
    return sum;
  }

  /// The base, each part times the factor that the data ask for: least squares with a ridge around 1 that is
  /// relative to the part's own output. The other coefficients remain.
  [[nodiscard]] std::vector<double> scaled_base(double prior) const {
    if (parts_.empty()) return base_;
    NormalEquations equations(parts_.size());
    equations.rows = equations_.rows;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      // The factors less 1, so that the coefficients in no part need no column.
      double remaining = projection(parts_[p]);
      for (std::size_t k = 0; k < base_.size(); ++k) remaining -= base_[k] * product(parts_[p], k);
      equations.projection[p] = remaining;
      for (std::size_t q = 0; q < parts_.size(); ++q)
        for (std::size_t k = parts_[q].begin; k < parts_[q].end; ++k)
          equations.product(p, q) += base_[k] * product(parts_[p], k);
    }
    for (std::size_t p = 0; p < parts_.size(); ++p) equations.product(p, p) *= 1.0 + prior;
    const std::vector<double> changes =
        non_negative_least_squares(equations, std::vector<std::uint8_t>(parts_.size(), 1))
            .coefficients;
    std::vector<double> scaled = base_;
    for (std::size_t p = 0; p < parts_.size(); ++p)
      for (std::size_t j = parts_[p].begin; j < parts_[p].end; ++j)
        scaled[j] *= std::clamp(1.0 + changes[p], 1.0 / kWidestFactor, kWidestFactor);
    return scaled;
  }

  std::vector<double> base_;
  std::vector<std::uint8_t> is_free_;
  std::vector<Part> parts_;
  std::vector<double> largest_;
  NormalEquations equations_;
};

/// Calls use(features, error of the model, last layer's input) at each usable sample, in the order of time.
template <class Step, class Use>
void each_error(const TrainingData& data, AnyModel model, const Step& step, const Use& use) {
  for (const Sequence& sequence : data.sequences) {
    model.reset();
    bool is_first = true;
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (!sequence.has_features(n)) continue;
      const Features features = sequence.features.row(n);
      step(features, is_first);
      is_first = false;
      const Estimate estimate = model.step(features);
      if (sequence.use[n] != 0 && std::isfinite(estimate.value))
        use(features, sequence.target[n] - estimate.value, model.last_layer_input());
    }
  }
}

constexpr auto kNoStep = [](Features, bool) {};

std::vector<double> first_row(const CoefficientSchedule& schedule) {
  const std::span<const double> row = schedule.values.row(0);
  return {row.begin(), row.end()};
}

void set_first_row(CoefficientSchedule& schedule, const std::vector<double>& values) {
  std::ranges::copy(values, schedule.values.row(0).begin());
}

/// Largest size of each input; 1 for one that did not vary.
std::vector<double> sizes_of(const FeatureRanges& ranges) {
  std::vector<double> sizes;
  for (std::size_t i = 0; i < ranges.lowest.size(); ++i) {
    const double size = std::max(std::abs(ranges.lowest[i]), std::abs(ranges.highest[i]));
    sizes.push_back(size > 0.0 ? size : 1.0);
  }
  return sizes;
}

Linear::Parameters refit(Linear::Parameters linear, const FeatureRanges& ranges,
                         const TrainingData& data, double prior) {
  const std::size_t columns = linear.coefficients.values.columns;
  std::vector<double> sizes = sizes_of(ranges);
  sizes.insert(sizes.begin(), 1.0);
  PriorFit fit(first_row(linear.coefficients), sizes, std::vector<std::uint8_t>(columns, 1));
  std::vector<double> row(columns, 1.0);
  each_error(data, AnyModel(linear), kNoStep, [&](Features features, double error, auto /*layer*/) {
    std::ranges::copy(features, row.begin() + 1);
    fit.add(row, error);
  });
  set_first_row(linear.coefficients, fit.solution(prior));
  return linear;
}

GreyBox::Parameters refit(GreyBox::Parameters box, const FeatureRanges& ranges,
                          const TrainingData& data, double prior) {
  const std::vector<double> base = first_row(box.coefficients);
  std::vector<std::uint8_t> is_free(base.size(), 1);
  for (std::size_t j = box.terms.first_slip(); j < box.terms.first_slope(); ++j)
    is_free[j] = base[j] < 0.0 ? 1 : 0;
  // Banks have no sign of their own: u need not be the motion that the torque works on.
  // Friction of a rate that dissipates continues to dissipate.
  for (std::size_t l = 0; l < box.terms.inputs(); ++l)
    if (data.inputs[l].is_rate)
      for (const std::size_t j : {box.terms.first_slope() + l, box.terms.first_coulomb() + l})
        is_free[j] = base[j] < 0.0 ? 1 : 0;
  // Hats, slips and tanh are at most 1; a branch is at most the deflection.
  const std::vector<double> inputs = sizes_of(ranges);
  std::vector<double> sizes(base.size(), 1.0);
  for (std::size_t j = box.terms.first_relaxation(); j < box.terms.first_slope(); ++j)
    sizes[j] = inputs[0];
  std::ranges::copy(inputs, sizes.begin() + static_cast<std::ptrdiff_t>(box.terms.first_slope()));
  std::size_t first = box.terms.first_bank();
  for (const InputBank& bank : box.terms.banks) {
    for (std::size_t j = bank.first_product(); j < bank.columns(); ++j)
      sizes[first + j] = inputs[bank.input];
    first += bank.columns();
  }
  // The elastic curve and the slip elements.
  PriorFit fit(
      base, sizes, is_free,
      {{0, box.terms.first_slip()}, {box.terms.first_slip(), box.terms.first_relaxation()}});
  GreyBoxTerms terms(box.terms);
  std::vector<double> row(base.size());
  const auto move = [&](Features features, bool is_first) {
    if (is_first) terms.reset();
    terms.move(features);
  };
  each_error(data, AnyModel(box), move, [&](Features features, double error, auto /*layer*/) {
    std::ranges::fill(row, 0.0);
    terms.visit(features, [&](std::size_t column, double value) { row[column] += value; });
    fit.add(row, error);
  });
  set_first_row(box.coefficients, fit.solution(prior));
  return box;
}

/// The last layer is linear in its weights, in units of the scaled target.
template <class Parameters>
Parameters refit_layer(Parameters network, std::vector<DenseLayer> Parameters::*layers,
                       const TrainingData& data, double prior) {
  DenseLayer& last = (network.*layers).back();
  const std::size_t inputs = last.weights.columns;
  std::vector<double> base(last.weights.values.begin(), last.weights.values.end());
  base.push_back(static_cast<double>(last.bias.front()));
  PriorFit fit(base, std::vector<double>(base.size(), 1.0),
               std::vector<std::uint8_t>(base.size(), 1));
  std::vector<double> row(base.size(), 1.0);
  each_error(data, AnyModel(network), kNoStep,
             [&](Features /*features*/, double error, std::span<const float> layer) {
               std::copy_n(layer.begin(), inputs, row.begin());
               fit.add(row, error / network.scaling.target_scale);
             });
  const std::vector<double> solution = fit.solution(prior);
  for (std::size_t j = 0; j < inputs; ++j) last.weights.values[j] = static_cast<float>(solution[j]);
  last.bias.front() = static_cast<float>(solution.back());
  return network;
}

/// Moments of the data, in proportion to their share in one component.
struct Moments {
  double count = 0.0;
  Eigen::VectorXd sum;
  Eigen::MatrixXd squares;  ///< about the mean of the base
};

// The prior of a component counts as `prior` samples with its mean and covariance. A component's weight follows
// its count, so that one without new samples fades only against those with many.
Dgmm::Parameters refit(Dgmm::Parameters dgmm, const TrainingData& data, double prior) {
  GaussianMixture& mixture = dgmm.mixture;
  const auto dimension = static_cast<Eigen::Index>(mixture.dimension());
  const std::size_t components = mixture.size();
  const auto mean_of = [&](std::size_t i) {
    return Eigen::Map<Eigen::VectorXd>(mixture.means.row(i).data(), dimension);
  };
  const auto covariance_of = [&](std::size_t i) {
    return Eigen::Map<Eigen::MatrixXd>(mixture.covariances.row(i).data(), dimension, dimension);
  };
  std::vector<Eigen::LLT<Eigen::MatrixXd>> roots;
  std::vector<double> constants;
  for (std::size_t i = 0; i < components; ++i) {
    roots.emplace_back(covariance_of(i));
    const Eigen::MatrixXd lower = roots.back().matrixL();
    constants.push_back(std::log(mixture.weights[i]) - lower.diagonal().array().log().sum());
  }
  std::vector<Moments> moments(components,
                               {.count = 0.0,
                                .sum = Eigen::VectorXd::Zero(dimension),
                                .squares = Eigen::MatrixXd::Zero(dimension, dimension)});
  const Table table = usable_table(data);
  std::vector<double> logs(components);
  Eigen::VectorXd sample(dimension);
  for (std::size_t n = 0; n < table.target.size(); ++n) {
    for (Eigen::Index j = 0; j < dimension; ++j) {
      const auto k = static_cast<std::size_t>(j);
      const double value = j == 0 ? table.target[n] : table.features(n, k - 1);
      sample[j] = (value - mixture.centre[k]) / mixture.scale[k];
    }
    double largest = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < components; ++i) {
      logs[i] = constants[i] - 0.5 * roots[i].matrixL().solve(sample - mean_of(i)).squaredNorm();
      largest = std::max(largest, logs[i]);
    }
    double sum = 0.0;
    for (double& log : logs) sum += log = std::exp(log - largest);
    constexpr double kLeast = 1e-6;
    for (std::size_t i = 0; i < components; ++i) {
      const double share = logs[i] / sum;
      if (share < kLeast) continue;
      const Eigen::VectorXd from_mean = sample - mean_of(i);
      moments[i].count += share;
      moments[i].sum += share * from_mean;
      moments[i].squares += share * from_mean * from_mean.transpose();
    }
  }
  const double prior_samples = prior * static_cast<double>(components);
  double weights = 0.0;
  for (std::size_t i = 0; i < components; ++i) {
    const Moments& of = moments[i];
    const double total = of.count + prior;
    const Eigen::VectorXd shift = of.sum / total;
    const Eigen::MatrixXd covariance =
        (prior * covariance_of(i) + of.squares) / total - shift * shift.transpose();
    mean_of(i) += shift;
    covariance_of(i) = 0.5 * (covariance + covariance.transpose());
    mixture.weights[i] = of.count + prior_samples * mixture.weights[i];
    weights += mixture.weights[i];
  }
  for (double& weight : mixture.weights) weight /= weights;
  return dgmm;
}

}  // namespace

std::vector<double> refit_priors(const AnyModel::Parameters& base) {
  std::vector<double> ridge{1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4};
  if (const auto* const own = base.get_if<Linear::Parameters>())
    return own->coefficients.scheduled ? std::vector<double>{} : ridge;
  if (const auto* const own = base.get_if<GreyBox::Parameters>())
    return own->coefficients.scheduled ? std::vector<double>{} : ridge;
  if (base.get_if<Dgmm::Parameters>() != nullptr) return {64.0, 16.0, 4.0};
  if (base.get_if<Mlp::Parameters>() != nullptr || base.get_if<Lstm::Parameters>() != nullptr ||
      base.get_if<Gru::Parameters>() != nullptr)
    return ridge;
  return {};
}

AnyModel::Parameters refitted(const AnyModel::Parameters& base, const FeatureRanges& ranges,
                              const TrainingData& data, double prior) {
  if (const auto* const own = base.get_if<Linear::Parameters>())
    return refit(*own, ranges, data, prior);
  if (const auto* const own = base.get_if<GreyBox::Parameters>())
    return refit(*own, ranges, data, prior);
  if (const auto* const own = base.get_if<Dgmm::Parameters>()) return refit(*own, data, prior);
  if (const auto* const own = base.get_if<Mlp::Parameters>())
    return refit_layer(*own, &Mlp::Parameters::layers, data, prior);
  if (const auto* const own = base.get_if<Lstm::Parameters>())
    return refit_layer(*own, &Lstm::Parameters::head, data, prior);
  if (const auto* const own = base.get_if<Gru::Parameters>())
    return refit_layer(*own, &Gru::Parameters::head, data, prior);
  return base;
}

}  // namespace torsio
