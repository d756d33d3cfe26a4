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

/// How a last layer is adapted, and what keeps that safe. Errors, noise and limits of the reference
/// are in the target's unit.
struct AdaptationSettings {
  AdaptationRule rule = AdaptationRule::nlms;
  double step_size = 0.003;          ///< NLMS: mu, above 0 and below 2; docs/decisions/0015
  double leak = 1e-5;                ///< NLMS: gamma, share of W - W0 that an update takes back
  double regularisation = 1e-3;      ///< NLMS: epsilon, beside the square of the features
  double forgetting = 0.9995;        ///< RLS: lambda, 0.9 to 1
  double initial_covariance = 1e-3;  ///< RLS: delta, P starts as delta I
  double trace_cap = 1.0;            ///< RLS: tr P stays below this many times that of delta I
  double sensor_std = 0.0;           ///< one standard deviation of the reference's own noise
  double dead_zone = 3.0;            ///< errors below this many `sensor_std` teach nothing
  double largest_error =
      kNotMeasured;                 ///< larger ones teach nothing; NaN: the network's target_scale
  double oldest_reference_s = 0.0;  ///< an older value is stale
  double frozen_after_s =
      0.2;  ///< a value that has not changed for so long is stale; 0: it may rest
  double saturation = kNotMeasured;  ///< |reference| that the sensor ends at; NaN: nowhere
  double largest_change = 0.2;       ///< rho: |W - W0| stays within this share of |W0|
  double comparison_s =
      10.0;  ///< over which the adapted model must not be worse than the frozen one
};

/// What the sensor to learn from says at one tick.
struct ReferenceSample {
  double value = kNotMeasured;  ///< in the target's unit; NaN where nothing was measured
  double age_s = 0.0;           ///< since it was measured; not 0 for a value that is held
};

/// What became of one reference.
enum class UpdateOutcome : std::uint8_t {
  updated,               ///< the weights have moved
  limited,               ///< they have, and were drawn back to `largest_change`
  paused,                ///< by the caller
  warming_up,            ///< filters or hidden state have not settled
  no_estimate,           ///< no step since the last reference, or a guard answered for the model
  reference_not_finite,  ///< NaN or infinite: not measured
  reference_stale,       ///< older than `oldest_reference_s`, or frozen
  reference_saturated,   ///< at the end of the sensor's range
  error_too_large,       ///< beyond `largest_error`: rather the sensor's fault than the weights'
  dead_zone,             ///< no more than noise
};
inline constexpr std::size_t kUpdateOutcomes =
    static_cast<std::size_t>(UpdateOutcome::dead_zone) + 1;

/// The enumerator's own spelling, for logs and JSON.
[[nodiscard]] std::string_view name(UpdateOutcome outcome) noexcept;

/// How often each came.
struct AdaptationCounts {
  std::array<std::size_t, kUpdateOutcomes> outcomes{};
  std::size_t roll_backs = 0;         ///< to the frozen weights, which had been better
  std::size_t covariance_resets = 0;  ///< RLS: rounding had spoilt P

  [[nodiscard]] std::size_t of(UpdateOutcome outcome) const noexcept {
    return outcomes[static_cast<std::size_t>(outcome)];
  }
  [[nodiscard]] std::size_t updates() const noexcept {
    return of(UpdateOutcome::updated) + of(UpdateOutcome::limited);
  }
  bool operator==(const AdaptationCounts&) const = default;
};

/// Adapts the last layer of a network to a reference, sample by sample, while the rest of it stays.
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
/// All in double. What is kept is W - W0: without updates the value is the network's, to the bit.
/// Source: paper 004, specification 3.4. Cost for n features: NLMS 5 n multiply-adds; RLS one pass
/// over n^2 / 2 doubles. Nothing is allocated after construction.
class LastLayerAdapter {
 public:
  /// @param last the network's last layer. @param target_scale of its `NetworkScaling`.
  /// @throws Error if a setting is out of range, all weights are 0, or there are more features than
  /// `kMaxRlsFeatures` for RLS.
  LastLayerAdapter(const AdaptationSettings& settings, const DenseLayer& last, double target_scale,
                   double sample_period_s);

  [[nodiscard]] const AdaptationSettings& settings() const noexcept { return settings_; }

  /// Back to the frozen weights; forgets what was learned and counted.
  void reset() noexcept TORSIO_REALTIME;

  /// While paused, references are passed over; what was learned stays in use.
  void pause() noexcept { paused_ = true; }
  void resume() noexcept { paused_ = false; }
  [[nodiscard]] bool is_paused() const noexcept { return paused_; }

  /// @param features what the last layer saw. @param frozen_value what the network made of them, in
  /// the target's unit. @returns what the adapted weights make of them, or the frozen value if
  /// something is not finite.
  double step(std::span<const float> features, double frozen_value) noexcept TORSIO_REALTIME;

  /// Learns from the reference of the last step. Call it once a tick, with NaN where there is none.
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
  /// Why a reference is not to be believed; `updated` if it is.
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
  std::size_t features_;  ///< of the last layer, without the 1

  AlignedVector<double> deviation_;  ///< W - W0, the bias behind the weights, padded
  double square_ = 0.0;              ///< its square
  AlignedVector<double> extended_;   ///< h~ of the last step, padded
  double extended_square_ = 0.0;
  double frozen_value_ = 0.0;   ///< of the last step
  double adapted_value_ = 0.0;  ///< of the last step
  bool has_step_ = false;

  // RLS. The last rank-one update waits until the next pass over P, which then costs no more.
  AlignedVector<double> covariance_;  ///< as src/model/network/adaptation_kernels.hpp says
  AlignedVector<double> pending_;     ///< P is pending_scale_ (covariance_ - pending_ pending_')
  AlignedVector<double> product_;     ///< P h~
  double pending_scale_ = 1.0;

  double last_reference_ = kNotMeasured;
  std::size_t unchanged_ticks_ = 0;
  MovingComparison comparison_;
  AdaptationCounts counts_;
  bool paused_ = false;
};

/// More would need over 64 MiB for P.
inline constexpr std::size_t kMaxRlsFeatures = 4000;

}  // namespace torsio
