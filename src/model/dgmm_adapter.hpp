#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "model/mixture/dgmm.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/common/model_adapter.hpp"

namespace torsio {

/// Adapts a Gaussian mixture to a reference, sample by sample: means, covariances, weights, and new
/// components where inputs are new.
///
/// The sample x~ = [target; inputs], standardised, is divided among the components by the
/// responsibilities pi_i of the inputs, as in a query. A component of count n_i (samples that it
/// represents) takes its share:
///
///     n <- (1 - pi (1 - lambda)) n + pi,   eta = pi / n,   d = x~ - mu
///     mu <- mu + eta d
///     Sigma <- (1 - eta) (Sigma + eta d d^T) + eta kappa Sigma0,   kappa = 0.02
///
/// (for lambda = 1 and kappa = 0 the weighted moments of all samples; Sigma0 is the covariance at
/// the start, so that a joint at rest makes no covariance singular). A component of the frozen
/// mixture starts with n_i = w_i m `component_samples`. Each coordinate of its mean stays
/// within rho (1 + |mu0|) of its start mu0 (`largest_change`).
///
/// A sample is new if the density of its inputs is below the clamp's p_thin and none of the nearest
/// means is nearer than twice the median radius of the components (root of the mean variance of their
/// inputs). It becomes a component of n = 1, with the covariance of the nearest one. There is room
/// for `new_components`; then the lightest of the new ones is replaced.
///
/// What is approximated: shares below `Limits::least_share`, and those beyond the
/// `Limits::components` largest, are not learned; the largest are found among the components that the
/// query's float32 scan selects. The components that learn take exactly the share that they would
/// take if all did (tested). Queries and `adapted` are exact for the present parameters. The clamp
/// around the linear model is that of the frozen mixture.
///
/// A roll-back restores `Limits::components` components in each step; until all are
/// restored, the frozen estimate is returned and nothing is learned
/// (`UpdateOutcome::rolling_back`).
///
/// Source: paper 000 Algorithm 1 as corrected in specification 3.1, whose update of the nearest mean
/// is replaced by responsibilities of the inputs, since a nearest mean in the joint space
/// is another one as soon as the target has changed. Cost: `operations()`; it does not depend on
/// the number of components, except for the comparison of `MixtureRegression::scanned` numbers.
/// Nothing is allocated after construction.
class DgmmAdapter final : public ModelAdapter {
 public:
  /// How many components learn from one sample.
  struct Limits {
    std::size_t components = 6;
    double least_share = 0.02;
  };
  static constexpr double kLeastCovariance = 0.02;  ///< kappa

  /// @throws Error as `ModelAdapter` and `Dgmm`, or if a limit is 0.
  DgmmAdapter(const AdaptationSettings& settings, const Dgmm::Parameters& base,
              double sample_period_s, const Limits& limits);
  DgmmAdapter(const AdaptationSettings& settings, const Dgmm::Parameters& base,
              double sample_period_s)
      : DgmmAdapter(settings, base, sample_period_s, Limits{}) {}

  [[nodiscard]] std::unique_ptr<ModelAdapter> copy() const override {
    return std::make_unique<DgmmAdapter>(*this);
  }

  Estimate step(const AnyModel& model, Features features,
                const Estimate& frozen) noexcept override TORSIO_REALTIME;
  /// The same without a model around it.
  Estimate step(const Dgmm& model, Features features,
                const Estimate& frozen) noexcept TORSIO_REALTIME;

  /// Root mean square change of the means, weighted as the frozen mixture, in standardised units.
  [[nodiscard]] double relative_change() const noexcept override;
  [[nodiscard]] AnyParameters adapted(AnyParameters base) const override;
  [[nodiscard]] GaussianMixture mixture() const;

  /// Components now.
  [[nodiscard]] std::size_t size() const noexcept { return base_.size() + added_; }
  /// Components that were replaced because there was no room.
  [[nodiscard]] std::size_t replaced() const noexcept { return replaced_; }
  /// Floating-point operations, comparisons included, of the last step and its `learn` beyond the
  /// queries: a count of the algorithm, not a measurement.
  [[nodiscard]] std::size_t operations() const noexcept { return operations_; }
  /// No step takes more.
  [[nodiscard]] std::size_t max_operations() const noexcept;

 private:
  [[nodiscard]] UpdateOutcome update(double error) noexcept override;
  void restore() noexcept override;
  void restore_at_once() noexcept override { restore_some(capacity()); }
  void restore_some(std::size_t most) noexcept;
  /// @returns whether the mean was limited.
  bool move(std::size_t component, double share) noexcept;
  void add(std::size_t like) noexcept;
  void touch(std::size_t component) noexcept;
  [[nodiscard]] std::size_t nearest(std::size_t count, double& square_distance) const noexcept;
  [[nodiscard]] std::size_t capacity() const noexcept { return counts_.size(); }
  [[nodiscard]] bool has_changed() const noexcept { return touched_count_ > 0; }

  GaussianMixture base_;
  double thin_log_density_;
  Limits limits_;
  MixtureRegression regression_;
  double novelty_square_ = 0.0;

  std::vector<double> first_counts_;  ///< n of the components of the base
  double first_total_ = 0.0;
  std::vector<double> counts_;  ///< n, with room for new components
  double total_ = 0.0;
  Matrix means_;
  Matrix covariances_;
  Matrix first_means_;        ///< mu0
  Matrix first_covariances_;  ///< Sigma0
  std::size_t added_ = 0;
  std::size_t replaced_ = 0;

  std::vector<std::uint8_t> is_touched_;
  std::vector<std::size_t> touched_;  ///< components that differ from the base; the first so many
  std::size_t touched_count_ = 0;
  bool is_restoring_ = false;

  double log_density_ = 0.0;  ///< density of the inputs at the last step
  double adapted_value_ = 0.0;
  std::vector<MixtureRegression::Share> shares_;
  std::vector<double> sample_;  ///< x~
  std::vector<double> offset_;  ///< d
  std::size_t operations_ = 0;
};

}  // namespace torsio
