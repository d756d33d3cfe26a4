#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {

/// A factor on the friction of a drive, which changes with temperature and wear: a scalar Kalman filter
///
///     phi_k+1 = phi_k + process noise,    m_k = phi_k f_k + noise
///
/// f the friction torque of a model at its reference temperature, m the friction torque that other
/// sources of the torque imply. Its noise is correlated over `correlation_s`, so that a sample counts as
/// dt / correlation_s of an independent one. phi stays within its bounds; it changes by some percent a
/// minute at most, so that it follows the lubricant and not a fault. Form: ours (Kalman 1960).
class FrictionFilter {
 public:
  struct Settings {
    double lowest = 0.5;
    double highest = 2.0;
    double std_dev_at_start = 0.25;
    double drift_per_sqrt_s = 2.5e-3;  ///< 2 % in a minute
    double correlation_s = 0.5;
  };

  /// @throws Error for bounds that do not contain 1, or a number that is not positive.
  FrictionFilter(const Settings& settings, double sample_rate_Hz);

  void reset() noexcept;
  /// @param friction_Nm f
  /// @param implied_Nm m, with its standard deviation; where one is not finite or that is not positive,
  /// phi stays as it is
  void step(double friction_Nm, double implied_Nm, double std_dev_Nm) noexcept TORSIO_REALTIME;

  [[nodiscard]] double factor() const noexcept { return factor_; }
  [[nodiscard]] double std_dev() const noexcept;
  /// A factor from another time, as one that was stored before the joint was switched off.
  void set(double factor, double std_dev) noexcept;

 private:
  Settings settings_;
  double samples_;        ///< samples in a correlation time
  double process_noise_;  ///< a sample
  double factor_ = 1.0;
  double variance_ = 0.0;
};

/// One source of the joint's torque: a model of the torque, and of a drive the friction that is added to it
/// with a factor of its own.
struct SourceModel {
  Estimator torque;
  std::optional<Estimator> friction = {};
  /// The error bar of the models is multiplied by this, from recordings at work.
  double error_bar_factor = 1.0;
};

/// Several estimates of one torque from one row of channels.
///
/// A source with friction gives t + phi f with the variance c² s² + var(phi) f², c the factor of its
/// error bar s; phi follows the mean of the other valid sources (weights 1 / variance).
class TorqueSources {
 public:
  /// @throws Error if there is none, if their sample rates differ, or if a target is not a torque in Nm.
  explicit TorqueSources(std::vector<SourceModel> sources);

  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept { return raw_inputs_; }
  [[nodiscard]] double sample_rate_Hz() const noexcept { return sample_rate_Hz_; }
  [[nodiscard]] std::size_t size() const noexcept { return sources_.size(); }

  /// As the estimators'. @throws UsageError for an unknown channel or a value that is not finite.
  void set_zero(std::string_view channel, double value);
  /// The largest change of a channel from one sample to the next that no source takes for a jump; infinite for
  /// one that they do not read.
  [[nodiscard]] double largest_step(std::string_view channel) const;
  void reset() noexcept;
  /// To prove that a monitor stops: until `reset` this source reports a model without a finite output.
  /// Without effect if there is no such source.
  void fail_model(std::size_t source) noexcept;
  /// The estimates of this tick have this fault: their inputs could not be taken.
  void refuse(Fault fault) noexcept TORSIO_REALTIME;

  /// @param raw one value for each of `raw_inputs()`; NaN for one that was not measured
  /// @returns one estimate a source, valid until the next call
  std::span<const Estimate> step(std::span<const double> raw) noexcept TORSIO_REALTIME;
  [[nodiscard]] std::span<const Estimate> estimates() const noexcept { return estimates_; }

  /// The factor on the friction of this source; 1 for a source without.
  [[nodiscard]] double friction_factor(std::size_t source) const noexcept;
  void set_friction_factor(std::size_t source, double factor, double std_dev) noexcept;

 private:
  /// An estimator that takes its channels from these places of `raw`.
  struct Fed {
    Estimator estimator;
    std::vector<std::size_t> places;
    std::vector<double> values;
    Estimate step(std::span<const double> raw) noexcept TORSIO_REALTIME;
  };
  struct Source {
    Fed torque;
    std::optional<Fed> friction;
    std::optional<FrictionFilter> filter;
    double error_bar_factor = 1.0;
    Estimate without_friction = {};
    double friction_Nm = 0.0;
    bool has_failed = false;  ///< `fail_model`
  };
  [[nodiscard]] Fed fed(Estimator estimator);
  void adapt(std::size_t source) noexcept TORSIO_REALTIME;

  double sample_rate_Hz_ = 0.0;
  std::vector<std::string> raw_inputs_;
  std::vector<Source> sources_;
  std::vector<Estimate> estimates_;
};

}  // namespace torsio
