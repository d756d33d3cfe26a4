#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/signal/differentiator.hpp"

namespace torsio::detail {

/// The step of the command that a change of gains or of mode would cause, which decays
/// exponentially:
///
///     h[n] = h₀ exp(−n T / T_h)
///
/// Added to a command, it makes the command continue from its value before the change.
class BumplessTransfer {
 public:
  /// Both are positive.
  BumplessTransfer(double time_s, double sample_rate_Hz) noexcept
      : keep_(std::exp(-1.0 / (time_s * sample_rate_Hz))) {}

  void reset() noexcept { bump_ = 0.0; }
  /// Adds `bump` to the part that has not decayed yet.
  void add(double bump) noexcept { bump_ += bump; }
  /// @returns the part that the next `step` adds
  [[nodiscard]] double pending() const noexcept { return bump_; }
  /// @returns the share that remains from one tick to the next
  [[nodiscard]] double keep() const noexcept { return keep_; }
  /// @returns the part that is added in this tick
  double step() noexcept TORSIO_REALTIME {
    const double now = bump_;
    // Far below the last bit of any command: no denormal numbers at the end of the decay.
    bump_ = std::abs(bump_) > 1e-100 ? bump_ * keep_ : 0.0;
    return now;
  }

 private:
  double keep_;
  double bump_ = 0.0;
};

}  // namespace torsio::detail

namespace torsio {

/// A PID controller whose command may be cut, moved slowly, or taken over by another loop.
///
///     e = r − y
///     u = K_p e + I + K_d D[−y] + f + h,    v = u cut to its limits and to its rate
///     I[n+1] = I[n] + T K_i e               back calculation: + T / T_t (v − u)
///                                           conditional: only if v = u, or e leads back to the limits
///
/// D is the backward difference, low-passed (of e instead of −y if requested), f the feed-forward,
/// h the bumpless transfer: the step that a change of gains or a start from a given command would
/// cause, which decays with a time constant of its own. The integral is in the unit of the command,
/// so that a new K_i does not change it. Source: Åström & Hägglund, Advanced PID Control (2006),
/// chapter 3.
class Pid {
 public:
  enum class AntiWindup { back_calculation, conditional };
  enum class DerivativeOf { measurement, error };

  /// In units of the command over units of the measurement.
  struct Gains {
    double proportional = 0.0;
    double integral = 0.0;    ///< K_i, per second
    double derivative = 0.0;  ///< K_d, in seconds
  };
  struct Limits {
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    double rate_per_s = std::numeric_limits<double>::infinity();  ///< rate limit of the command
  };
  struct Settings {
    Gains gains = {};
    Limits limits = {};
    AntiWindup anti_windup = AntiWindup::back_calculation;
    DerivativeOf derivative_of = DerivativeOf::measurement;
    std::optional<double> derivative_cutoff_Hz = std::nullopt;
    /// T_t of the back calculation; none: K_p / K_i, the integral's own time
    std::optional<double> tracking_s = std::nullopt;
    double transfer_s = 0.1;
  };

  struct Output {
    double command = 0.0;  ///< v
    double proportional = 0.0;
    double integral = 0.0;
    double derivative = 0.0;
    double feed_forward = 0.0;
    double transfer = 0.0;
    bool is_limited = false;  ///< v is not the sum of the terms
    Fault fault = Fault::none;
  };

  /// @throws Error if a gain is negative or not finite, the limits leave nothing between them, or a
  /// rate or time is not positive.
  Pid(const Settings& settings, double sample_rate_Hz);

  /// No memory; the rate limit starts from the command 0, or the limit next to it.
  void reset() noexcept;
  /// Clears the memory. The next command is this one (cut to the limits), whatever the terms are.
  void start(double command) noexcept;

  /// A value that is not finite is `Fault::input_not_finite`: the last command is held, and no
  /// state changes: the derivative continues with its last rate, without a jump over the gap. The
  /// same applies to finite values that are too large for the terms.
  Output step(double reference, double measurement,
              double feed_forward = 0.0) noexcept TORSIO_REALTIME;

  /// The command that was applied in place of the last one, where a limit after the controller cut
  /// it or another loop took over. Call it after every `step` while that is the case: the integral
  /// does not wind up, and the rate limit continues from there. A number that is not finite changes
  /// nothing.
  void track(double applied) noexcept TORSIO_REALTIME;

  /// All gains at once, from the next step on; the command continues without a jump.
  /// @returns false, and all stay as they are, if one is negative or not finite
  [[nodiscard]] bool set_gains(const Gains& gains) noexcept TORSIO_REALTIME;
  [[nodiscard]] const Gains& gains() const noexcept { return gains_; }
  /// @returns the last command, or the one applied in its place according to `track`
  [[nodiscard]] double command() const noexcept { return last_.command; }
  [[nodiscard]] static bool is_valid(const Gains& gains) noexcept;
  /// @returns the share of a bumpless transfer that remains from one tick to the next
  [[nodiscard]] double transfer_keep() const noexcept { return transfer_.keep(); }

 private:
  void set_tracking_share() noexcept;
  void integrate(double wanted) noexcept;
  Output hold() noexcept;
  [[nodiscard]] double limited(double command) const noexcept;

  Gains gains_;
  Limits limits_;
  AntiWindup anti_windup_;
  DerivativeOf derivative_of_;
  std::optional<double> tracking_s_;
  double period_s_;
  double step_limit_;            ///< largest change of the command per tick
  double tracking_share_ = 0.0;  ///< T / T_t
  Differentiator differentiator_;
  detail::BumplessTransfer transfer_;
  Output last_;
  double integral_ = 0.0;
  double rate_ = 0.0;       ///< D at the last step
  double error_ = 0.0;      ///< at the last step
  double increment_ = 0.0;  ///< integral's change at the last step
  bool is_starting_ = false;
};

}  // namespace torsio
