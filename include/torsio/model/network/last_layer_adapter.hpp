#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "torsio/core/aligned_vector.hpp"
#include "torsio/core/not_measured.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/network/moving_comparison.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// Normalised least mean squares, or recursive least squares with forgetting.
enum class AdaptationRule : std::uint8_t { nlms, rls };

/// How a last layer is adapted, and the guards of the adaptation. Errors, noise and limits of the
/// reference are in the target's unit. `LastLayerAdapter` accepts the ranges that `visit_options`
/// states.
struct AdaptationSettings {
  AdaptationRule rule = AdaptationRule::nlms;
  double step_size = 0.003;             ///< NLMS: mu; docs/decisions/0015
  double leak = 1e-5;                   ///< NLMS: gamma, share of W - W0
  double regularisation = 1e-3;         ///< NLMS: epsilon
  double forgetting = 0.9995;           ///< RLS: lambda
  double initial_covariance = 1e-3;     ///< RLS: delta, P starts as delta I
  double trace_cap = 1.0;               ///< RLS: tr P over that of delta I
  double sensor_std = 0.0;              ///< one standard deviation of the reference's own noise
  double dead_zone = 3.0;               ///< in `sensor_std`
  double largest_error = kNotMeasured;  ///< NaN: the network's target_scale
  double oldest_reference_s = 0.0;      ///< an older value is stale; not negative
  double frozen_after_s = 0.2;
  double saturation = kNotMeasured;  ///< limit of |reference|; NaN: no limit
  double largest_change = 0.2;       ///< rho, limit of |W - W0| / |W0|
  double comparison_s = 10.0;

  /// The settings that a user gives by name, with range and help. `rule` has a flag of its own, and
  /// a recording's references are never stale.
  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.step_size,
          {.name = "step_size",
           .minimum = 1e-9,
           .maximum = 1.999999,
           .help = "nlms: mu, share of an error that is corrected; about 1 / samples in a cycle of "
                   "the work"});
    visit(self.leak, {.name = "leak",
                      .minimum = 0.0,
                      .maximum = 0.999,
                      .help = "nlms: share of the change that an update takes back"});
    visit(self.regularisation, {.name = "regularisation",
                                .minimum = 1e-12,
                                .maximum = 1e12,
                                .help = "nlms: added to the square of the features"});
    visit(self.forgetting, {.name = "forgetting",
                            .minimum = 0.9,
                            .maximum = 1.0,
                            .help = "rls: weight of the past at each update"});
    visit(self.initial_covariance, {.name = "initial_covariance",
                                    .minimum = 1e-12,
                                    .maximum = 1e12,
                                    .help = "rls: larger learns faster at first"});
    visit(self.trace_cap, {.name = "trace_cap",
                           .minimum = 1.0,
                           .maximum = 1e12,
                           .help = "rls: how far the covariance may grow"});
    visit(self.sensor_std,
          {.name = "sensor_std",
           .minimum = 0.0,
           .maximum = 1e12,
           .help = "noise of the reference, target's unit; nothing is learned from "
                   "errors below dead_zone times that"});
    visit(self.dead_zone,
          {.name = "dead_zone", .minimum = 0.0, .maximum = 1e6, .help = "see sensor_std"});
    visit(self.largest_error, {.name = "largest_error",
                               .minimum = 1e-12,
                               .maximum = 1e300,
                               .help = "nothing is learned from larger ones, target's unit; auto: "
                                       "the spread that the network was trained on"});
    visit(self.frozen_after_s, {.name = "frozen_after_s",
                                .minimum = 0.0,
                                .maximum = 1e6,
                                .help = "a reference that has not changed for so long is stale; 0: "
                                        "it may rest"});
    visit(self.saturation,
          {.name = "saturation",
           .minimum = 1e-12,
           .maximum = 1e300,
           .help = "where the reference sensor ends, target's unit; auto: nowhere"});
    visit(self.largest_change, {.name = "largest_change",
                                .minimum = 1e-9,
                                .maximum = 1e6,
                                .help = "of the weights, as a share of them"});
    visit(self.comparison_s,
          {.name = "comparison_s",
           .minimum = 1e-3,
           .maximum = 1e6,
           .help = "back to the frozen weights if they were better over so long; a "
                   "cycle of the work or more"});
  }
};

/// One measurement of the reference sensor, from which the layer is trained.
struct ReferenceSample {
  double value = kNotMeasured;  ///< in the target's unit; NaN where nothing was measured
  double age_s = 0.0;           ///< since it was measured; not 0 for a value that is held
};

/// The result of one reference.
enum class UpdateOutcome : std::uint8_t {
  updated,      ///< the weights have changed
  limited,      ///< they have changed, limited by `largest_change`
  paused,       ///< by the caller
  warming_up,   ///< filters or hidden state have not settled
  no_estimate,  ///< no step since the last reference, or a guard replaced the model's value
  reference_not_finite,  ///< NaN or infinite: not measured
  reference_stale,       ///< older than `oldest_reference_s`, or frozen
  reference_saturated,   ///< at the end of the sensor's range
  error_too_large,       ///< beyond `largest_error`: probably a fault of the sensor
  dead_zone,             ///< no more than noise
};
inline constexpr std::size_t kUpdateOutcomes =
    static_cast<std::size_t>(UpdateOutcome::dead_zone) + 1;

/// The enumerator's own spelling, for logs and JSON.
[[nodiscard]] std::string_view name(UpdateOutcome outcome) noexcept;

/// Number of references with each result.
struct AdaptationCounts {
  std::array<std::size_t, kUpdateOutcomes> outcomes{};
  std::size_t roll_backs = 0;         ///< to the frozen weights, which had the smaller error
  std::size_t covariance_resets = 0;  ///< RLS: P was not valid because of rounding

  [[nodiscard]] std::size_t of(UpdateOutcome outcome) const noexcept {
    return outcomes[static_cast<std::size_t>(outcome)];
  }
  [[nodiscard]] std::size_t updates() const noexcept {
    return of(UpdateOutcome::updated) + of(UpdateOutcome::limited);
  }
  bool operator==(const AdaptationCounts&) const = default;
};

/// Adapts the last layer of a network to a reference, sample by sample, while the other layers stay
/// constant.
///
/// With features h~ = [h; 1] of the last layer, its frozen weights W0 = [w; b], and the error
/// e = reference - W h~ in standardised units:
///
///     NLMS   W <- (1 - gamma) W + gamma W0 + mu e h~ / (epsilon + |h~|^2)
///     RLS    s = lambda + h~' P h~,   W <- W + P h~ e / s
///            P <- (P - P h~ h~' P / s) min(1 / lambda, cap / tr(P - ...)),   P symmetric as it is stored
///
/// Guards: no update in the dead zone, beyond the largest error, or by a reference that is stale,
/// frozen, saturated or no number; |W - W0| <= rho |W0|, by shrinking the difference; back to W0 when the
/// RMSE over the last `comparison_s` exceeds that of the frozen weights on the same samples. Samples
/// whose reference is beyond the largest error of both do not count there.
///
/// All in double. The stored state is W - W0: without updates the value is the network's, to the
/// bit. Source: paper 004, specification 3.4. Cost for n features: NLMS 5 n multiply-adds; RLS one
/// pass over n^2 / 2 doubles. Nothing is allocated after construction.
class LastLayerAdapter {
 public:
  /// @param last the network's last layer. @param target_scale of its `NetworkScaling`.
  /// @throws Error if a setting is out of range, all weights are 0, or there are more features than
  /// `kMaxRlsFeatures` for RLS.
  LastLayerAdapter(const AdaptationSettings& settings, const DenseLayer& last, double target_scale,
                   double sample_period_s);

  [[nodiscard]] const AdaptationSettings& settings() const noexcept { return settings_; }

  /// Returns to the frozen weights and resets the counters.
  void reset() noexcept TORSIO_REALTIME;

  /// While paused, references are ignored; the adapted weights stay in use.
  void pause() noexcept { paused_ = true; }
  void resume() noexcept { paused_ = false; }
  [[nodiscard]] bool is_paused() const noexcept { return paused_; }

  /// @param features input of the last layer. @param frozen_value the network's output for them, in
  /// the target's unit. @returns the output with the adapted weights, or the frozen
  /// value if something is not finite.
  double step(std::span<const float> features, double frozen_value) noexcept TORSIO_REALTIME;

  /// Trains on the reference of the last step. Call it in every tick, with NaN where there is no
  /// reference.
  UpdateOutcome learn(const ReferenceSample& reference) noexcept TORSIO_REALTIME;
  /// Counts a tick whose estimate was not the model's: `warming_up` or `no_estimate`.
  UpdateOutcome pass_over(UpdateOutcome reason) noexcept TORSIO_REALTIME;

  [[nodiscard]] const AdaptationCounts& counts() const noexcept { return counts_; }
  /// |W - W0| / |W0|
  [[nodiscard]] double relative_change() const noexcept;
  /// The layer with the weights as they are now, rounded to float32.
  [[nodiscard]] DenseLayer adapted() const;

 private:
  [[nodiscard]] UpdateOutcome outcome_of(const ReferenceSample& reference) noexcept;
  /// Why a reference must not be used; `updated` if it may be.
  [[nodiscard]] UpdateOutcome doubt_about(const ReferenceSample& reference) const noexcept;
  void compare(double adapted_error, double frozen_error) noexcept;
  void roll_back() noexcept;
  [[nodiscard]] double nlms(double error) noexcept;
  [[nodiscard]] double rls(double error) noexcept;
  void reset_covariance() noexcept;
  UpdateOutcome counted(UpdateOutcome outcome) noexcept;

  AdaptationSettings settings_;
  DenseLayer frozen_;
  double target_scale_;
  double bound_;  ///< on |W - W0|
  std::size_t frozen_after_ticks_;
  std::size_t features_;  ///< inputs of the last layer, without the 1

  detail::AlignedVector<double> deviation_;  ///< W - W0, the bias after the weights, padded
  double square_ = 0.0;                      ///< its square
  detail::AlignedVector<double> extended_;   ///< h~ of the last step, padded
  double extended_square_ = 0.0;
  double frozen_value_ = 0.0;   ///< at the last step
  double adapted_value_ = 0.0;  ///< at the last step
  bool has_step_ = false;

  // RLS. The last rank-one update waits until the next pass over P, which then costs no more.
  detail::AlignedVector<double> covariance_;  ///< layout: src/model/network/adaptation_kernels.hpp
  detail::AlignedVector<double>
      pending_;  ///< P is pending_scale_ (covariance_ - pending_ pending_')
  detail::AlignedVector<double> product_;  ///< P h~
  double pending_scale_ = 1.0;

  double last_reference_ = kNotMeasured;
  std::size_t unchanged_ticks_ = 0;
  detail::MovingComparison comparison_;
  AdaptationCounts counts_;
  bool paused_ = false;
};

/// More would need over 64 MiB for P.
inline constexpr std::size_t kMaxRlsFeatures = 4000;

}  // namespace torsio
