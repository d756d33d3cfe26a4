#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "torsio/core/estimate.hpp"

namespace torsio {

/// How the parameters follow an error.
enum class AdaptationRule : std::uint8_t {
  automatic,  ///< nlms for a network, rls for a grey box, em for a mixture
  nlms,       ///< normalised least mean squares; networks and grey boxes
  rls,        ///< recursive least squares with forgetting; networks and grey boxes
  em,         ///< recursive expectation maximisation; mixtures
};
inline constexpr std::array<std::string_view, 4> kAdaptationRules{"auto", "nlms", "rls", "em"};

/// The spelling of `kAdaptationRules`.
[[nodiscard]] constexpr std::string_view name(AdaptationRule rule) noexcept {
  return kAdaptationRules[static_cast<std::size_t>(rule)];
}

/// How a model is adapted, and the guards of the adaptation. Errors, noise and limits of the
/// reference are in the target's unit. `ModelAdapter` accepts the ranges that `visit_options`
/// states.
struct AdaptationSettings {
  AdaptationRule rule = AdaptationRule::automatic;
  double step_size = 0.003;      ///< NLMS: mu; docs/decisions/0015
  double leak = 1e-5;            ///< NLMS: gamma, share of W - W0
  double regularisation = 1e-3;  ///< NLMS: epsilon
  double forgetting = 0.9995;    ///< RLS, EM: lambda
  /// RLS: delta, P starts as delta I. NaN: 0.001 for a network, 0.05 for a grey box.
  double initial_covariance = kNotMeasured;
  double trace_cap = 1.0;               ///< RLS: tr P over that of delta I
  double component_samples = 200.0;     ///< EM: what a component of the base counts for on average
  std::size_t new_components = 32;      ///< EM: at most so many in addition to those of the base
  double sensor_std = 0.0;              ///< one standard deviation of the reference's own noise
  double dead_zone = 3.0;               ///< in `sensor_std`
  double largest_error = kNotMeasured;  ///< NaN: the spread of the model's target
  double oldest_reference_s = 0.0;      ///< an older value is stale; not negative
  double frozen_after_s = 0.2;
  double saturation = kNotMeasured;  ///< limit of |reference|; NaN: no limit
  double largest_change = 0.2;  ///< rho, limit of the change of the parameters; see the adapters
  double comparison_s = 10.0;
  /// Nothing is learned until the reference has followed the frozen model for so long; 0: it is not
  /// checked, only by `largest_error`.
  double confirmation_s = 5.0;

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
                            .help = "rls, em: weight of the past at each update"});
    visit(self.initial_covariance,
          {.name = "initial_covariance",
           .minimum = 1e-12,
           .maximum = 1e12,
           .help = "rls: larger learns faster at first; auto: 0.001 for a network, "
                   "0.05 for a grey box"});
    visit(self.trace_cap, {.name = "trace_cap",
                           .minimum = 1.0,
                           .maximum = 1e12,
                           .help = "rls: how far the covariance may grow"});
    visit(self.component_samples,
          {.name = "component_samples",
           .minimum = 1.0,
           .maximum = 1e9,
           .help = "em: samples that a component of the model counts for on average; about "
                   "1 / (1 - forgetting) or less"});
    visit(self.new_components, {.name = "new_components",
                                .minimum = 0.0,
                                .maximum = 100000.0,
                                .help = "em: components that may be added"});
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
                                       "the spread that the model was trained on"});
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
                                .help = "of the parameters, as a share of them"});
    visit(self.comparison_s, {.name = "comparison_s",
                              .minimum = 1e-3,
                              .maximum = 1e6,
                              .help = "back to the frozen model if it was better over so long; a "
                                      "cycle of the work or more"});
    visit(self.confirmation_s,
          {.name = "confirmation_s",
           .minimum = 0.0,
           .maximum = 1e6,
           .help = "nothing is learned until the reference has followed the model's output for so "
                   "long; 0: not checked"});
  }
};

/// One measurement of the reference sensor, from which a model is adapted.
struct ReferenceSample {
  double value = kNotMeasured;  ///< in the target's unit; NaN where nothing was measured
  double age_s = 0.0;           ///< since it was measured; not 0 for a value that is held
};

/// The result of one reference.
enum class UpdateOutcome : std::uint8_t {
  updated,      ///< the parameters have changed
  limited,      ///< they have changed, limited by `largest_change` or the sign that they must keep
  paused,       ///< by the caller
  warming_up,   ///< filters or hidden state have not settled
  no_estimate,  ///< no step since the last reference, or a guard reported a fault
  reference_not_finite,   ///< NaN or infinite: not measured
  reference_stale,        ///< older than `oldest_reference_s`, or frozen
  reference_saturated,    ///< at the end of the sensor's range
  error_too_large,        ///< beyond `largest_error`: probably a fault of the sensor
  dead_zone,              ///< no more than noise
  rolling_back,           ///< the frozen parameters are being restored, some in each step
  reference_unconfirmed,  ///< not yet compared with the model over enough motion
  reference_dead,         ///< it hardly changes while the model's output does
  reference_opposite,     ///< it falls where the model's output rises
  reference_unrelated,    ///< it does not follow the model's output
  reference_scaled,       ///< it follows with another gain than a changed joint has
  reference_delayed,      ///< it is later than a passive spring's torque can be
  reference_outlier,      ///< it suddenly differs from what it was in relation to the model
};
inline constexpr std::size_t kUpdateOutcomes =
    static_cast<std::size_t>(UpdateOutcome::reference_outlier) + 1;

/// The enumerator's own spelling, for logs and JSON.
[[nodiscard]] std::string_view name(UpdateOutcome outcome) noexcept;

/// Number of references with each result.
struct AdaptationCounts {
  std::array<std::size_t, kUpdateOutcomes> outcomes{};
  std::size_t roll_backs = 0;         ///< to the frozen model, which had the smaller error
  std::size_t covariance_resets = 0;  ///< RLS: P was not valid because of rounding

  [[nodiscard]] std::size_t of(UpdateOutcome outcome) const noexcept {
    return outcomes[static_cast<std::size_t>(outcome)];
  }
  [[nodiscard]] std::size_t updates() const noexcept {
    return of(UpdateOutcome::updated) + of(UpdateOutcome::limited);
  }
  bool operator==(const AdaptationCounts&) const = default;
};

}  // namespace torsio
