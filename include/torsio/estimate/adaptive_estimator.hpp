#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/model/adaptive_model.hpp"

namespace torsio {
namespace detail {

/// Whether a reference can be the torque of the joint, whatever that has become: its relation to the output of
/// the frozen model over the last stretch of time. With the reference r, the frozen value f and the first
/// feature x, by convention the deflection,
///
///     r = a + g f + e,   r = a' + g' f + h' (f - f_d) + e',   r = a" + g" x + h" (x - x_d) + e"
///
/// are fitted, d being 40 ms earlier. It is refused while r varies by less than a quarter of f, while r and f have
/// a correlation below 0.8, or with g outside 0.69 to 1.45: temperature and specimens change g by up to 1.4
/// (docs/robot/adaptation.md). It is late if h' explains it by at least 10 ms and h" has the sign of a spring
/// that generates energy.
///
/// Once it is confirmed, a reference that differs from a + g f by more than four standard deviations of e is an
/// outlier, and once most are, it has to be confirmed again. Since a joint does not change within seconds, g
/// has to be within a fifth of its mean over a minute, and e at most twice as large as before. Nothing is
/// allocated after construction.
class ReferenceCheck {
 public:
  /// @param least_spread standard deviation of f from which on its motion shows anything
  ReferenceCheck(const AdaptationSettings& settings, double least_spread, double sample_period_s);

  void reset() noexcept TORSIO_REALTIME;

  /// One tick. @param reference NaN where there is none.
  /// @returns `updated` if the reference may be used, or the reason against it
  UpdateOutcome step(double frozen, double first, double reference) noexcept TORSIO_REALTIME;
  /// One tick without a value of the model.
  void pass() noexcept TORSIO_REALTIME;

 private:
  enum Variable : std::size_t {
    frozen_value,
    frozen_change,
    first_feature,
    first_change,
    reference_value,
    variable_count
  };
  using Sample = std::array<double, variable_count>;

  /// Sums over the samples of a block of time.
  struct Sums {
    double count = 0.0;
    Sample sums{};
    std::array<Sample, variable_count> products{};

    void add(const Sample& sample) noexcept;
    void add(const Sums& other) noexcept;
    [[nodiscard]] double covariance(std::size_t a, std::size_t b) const noexcept;
  };
  struct Block {
    Sums all;
    Sums inliers;

    void add(const Block& other) noexcept {
      all.add(other.all);
      inliers.add(other.inliers);
    }
  };
  /// r = a + g f with residuals of this standard deviation.
  struct Line {
    double offset = 0.0;
    double gain = 0.0;
    double std_dev = 0.0;
  };
  /// How late r is against a variable, and the share of the residual's variance that remains with it.
  struct Delay {
    double delay_s = 0.0;
    double remaining = 1.0;
  };

  void advance() noexcept;
  void clear() noexcept;
  void end_block(const Block& ended) noexcept;
  [[nodiscard]] UpdateOutcome verdict(const Sums& total) const noexcept;
  [[nodiscard]] static Line line(const Sums& total) noexcept;
  /// Whether the line can have become this one.
  [[nodiscard]] UpdateOutcome change_to(const Line& found) const noexcept;
  [[nodiscard]] Delay delay(const Sums& total, Variable variable, Variable change) const noexcept;
  [[nodiscard]] bool is_outlier(const Sample& sample) noexcept;

  bool is_on_;
  double least_spread_;
  double change_time_s_;
  double gain_share_;   ///< with which a block changes the usual gain
  double share_decay_;  ///< factor of `outlier_share_` in a tick
  std::size_t confirmation_blocks_;
  std::vector<double> past_;  ///< f and x of the last 40 ms
  std::size_t past_next_ = 0;
  std::size_t past_filled_ = 0;
  MovingSums<Block> blocks_;
  std::size_t confirming_ = 0;  ///< blocks with references since the last `clear`
  Sample origin_{};             ///< first sample, subtracted from all
  bool has_origin_ = false;
  bool is_confirmed_ = false;
  double usual_gain_ = 0.0;  ///< 0: not confirmed since the reset
  UpdateOutcome verdict_ = UpdateOutcome::reference_unconfirmed;
  Line line_;
  double outlier_share_ = 0.0;
  std::size_t silent_ticks_ = 0;  ///< since the last reference
};

}  // namespace detail

/// An `Estimator` around a model that is trained further during operation (the last layer of a
/// network, a mixture, the coefficients of a grey box), from a reference sensor as long as there is
/// one. Each tick:
///
///     const Estimate torque = estimator.step(raw);         // before this tick's reference
///     estimator.learn({.value = load_cell_Nm, .age_s = age_s});
///
/// Where the estimate comes from a guard and not from the model (`fault` is not `none`), nothing
/// is learned. Nothing is learned either from a reference that cannot be the torque of the joint: it is dead,
/// has the opposite sign or another scale, is late, or does not follow the frozen model's output. This is
/// checked over the last `comparison_s`, and learning begins after `confirmation_s`. The error bar is not below
/// the RMSE before each update. Nothing is allocated after construction.
class AdaptiveEstimator {
 public:
  /// @param base of a model file (`ModelFile::parameters`). @throws Error as `Estimator` and
  /// `AdaptiveModel`.
  AdaptiveEstimator(const EstimatorSettings& settings, const AnyModel::Parameters& base,
                    const AdaptationSettings& adaptation);

  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept {
    return estimator_.raw_inputs();
  }
  [[nodiscard]] const EstimatorSettings& settings() const noexcept { return estimator_.settings(); }
  /// As for the estimator.
  void set_zero(std::string_view channel, double value) { estimator_.set_zero(channel, value); }

  /// Resets filters and the state of the model; what was learned is kept. The reference has to be confirmed
  /// again.
  void reset() noexcept;
  /// Returns to the frozen model.
  void forget() noexcept;
  void pause() noexcept { estimator_.model().adapter().pause(); }
  void resume() noexcept { estimator_.model().adapter().resume(); }

  Estimate step(std::span<const double> raw) noexcept TORSIO_REALTIME;
  /// @param reference measured at the tick of the last `step`, with the zeros and unit of the
  /// model's target.
  UpdateOutcome learn(const ReferenceSample& reference) noexcept TORSIO_REALTIME;

  [[nodiscard]] const ModelAdapter& adapter() const noexcept {
    return estimator_.model().adapter();
  }
  /// The model as it is now, for a model file.
  [[nodiscard]] AnyModel::Parameters adapted() const { return estimator_.model().adapted(); }

 private:
  BasicEstimator<AdaptiveModel> estimator_;
  detail::ReferenceCheck check_;
  Fault last_fault_ = Fault::warming_up;
};

}  // namespace torsio
