#pragma once

#include <cstdint>
#include <vector>

#include "torsio/core/random.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/signal/lowpass.hpp"

// References that excite an actuator, one sample per `step()`. `reset()` restarts with the same
// numbers. Amplitudes are in the unit of the reference (rad, Nm); the first sample is the value at
// time 0. Every constructor throws `UsageError` for a parameter that is not finite or outside its
// stated range, and for a frequency at or above half the sample rate.

namespace torsio {

namespace detail {

/// The time of a streamed signal: counted, so that it does not drift.
class SampleClock {
 public:
  explicit SampleClock(double sample_rate_Hz) : sample_rate_Hz_(sample_rate_Hz) {}
  double next_s() noexcept { return static_cast<double>(sample_++) / sample_rate_Hz_; }
  void reset() noexcept { sample_ = 0; }

 private:
  double sample_rate_Hz_;
  std::uint64_t sample_ = 0;
};

}  // namespace detail

/// A sine whose frequency rises (or falls) linearly from f0 to f1 over the duration T and then
/// stays:
///
///     y(t) = A sin(2 pi (f0 t + (f1 - f0) t^2 / (2 T)))
class Chirp {
 public:
  struct Parameters {
    double amplitude = 1.0;
    double start_Hz = 0.01;
    double end_Hz = 0.3;
    double duration_s = 100.0;
  };
  Chirp(const Parameters& parameters, double sample_rate_Hz);
  double step() noexcept TORSIO_REALTIME;
  void reset() noexcept { clock_.reset(); }

 private:
  Parameters parameters_;
  detail::SampleClock clock_;
};

/// A sine whose frequency grows (or falls) by the same factor in equal times, from f0 to f1 over
/// the duration T, and then stays: every octave has the same length.
///
///     y(t) = A sin(2 pi f0 T (r^(t/T) - 1) / ln r),   r = f1 / f0
class LogSweep {
 public:
  struct Parameters {
    double amplitude = 1.0;
    double start_Hz = 0.1;  ///< > 0
    double end_Hz = 10.0;   ///< > 0
    double duration_s = 60.0;
  };
  LogSweep(const Parameters& parameters, double sample_rate_Hz);
  double step() noexcept TORSIO_REALTIME;
  void reset() noexcept { clock_.reset(); }

 private:
  Parameters parameters_;
  double log_ratio_;
  detail::SampleClock clock_;
};

/// A triangle wave between +A and -A, from 0 upwards.
class Triangle {
 public:
  struct Parameters {
    double amplitude = 1.0;
    double frequency_Hz = 1.0;
  };
  Triangle(const Parameters& parameters, double sample_rate_Hz);
  double step() noexcept TORSIO_REALTIME;
  void reset() noexcept { clock_.reset(); }

 private:
  Parameters parameters_;
  detail::SampleClock clock_;
};

/// A position that moves between +A and -A with a trapezoidal speed: from rest at 0 to +A, then
/// between the ends, never faster than `speed` nor accelerated more than `acceleration` (in a range
/// too short for full speed it is not reached). Specification 4.7, `sweep`.
class TrapezoidSweep {
 public:
  struct Parameters {
    double amplitude = 1.0;     ///< > 0
    double speed = 1.0;         ///< amplitude's unit per s, > 0
    double acceleration = 1.0;  ///< amplitude's unit per s^2, > 0
  };
  TrapezoidSweep(const Parameters& parameters, double sample_rate_Hz);
  double step() noexcept TORSIO_REALTIME;
  void reset() noexcept { clock_.reset(); }

 private:
  /// A move from rest to rest.
  struct Stroke {
    Stroke(double distance, const Parameters& limits);
    [[nodiscard]] double covered(double time_s) const noexcept;

    double length;
    double acceleration;
    double speed;
    double ramp_s;
    double duration_s;
  };
  Stroke first_;  // from 0 to +A
  Stroke next_;   // from end to end
  detail::SampleClock clock_;
};

/// A sum of sines with random phases: y(t) = sum_i A_i sin(2 pi f_i t + phi_i), phi_i uniform in
/// [0, 2 pi) by the seed. Specification 1, 002-24.
class Multisine {
 public:
  struct Parameters {
    std::vector<double> frequencies_Hz;
    std::vector<double> amplitudes;  ///< one per frequency
    std::uint64_t seed = 1;
  };
  Multisine(Parameters parameters, double sample_rate_Hz);
  double step() noexcept TORSIO_REALTIME;
  void reset() noexcept { clock_.reset(); }

 private:
  Parameters parameters_;
  std::vector<double> phases_;
  detail::SampleClock clock_;
};

/// White Gaussian steps through a Butterworth low-pass, scaled to a standard deviation of `rms` in
/// the long run; starts at rest. Specification 4.7.
class BandLimitedNoise {
 public:
  struct Parameters {
    double rms = 1.0;        ///< >= 0
    double cutoff_Hz = 1.0;  ///< as `Lowpass` takes it
    std::uint64_t seed = 1;
  };
  BandLimitedNoise(const Parameters& parameters, double sample_rate_Hz);
  double step() noexcept TORSIO_REALTIME;
  void reset() noexcept;

 private:
  std::uint64_t seed_;
  Lowpass lowpass_;
  double step_std_;
  Random random_;
  double output_ = 0.0;
};

/// A sine of which every period has its own amplitude and length, like the motion of a person who
/// pushes back and forth:
///
///     y = A_n sin(2 pi (t - t_n) / T_n),   t_n <= t < t_n + T_n = t_(n+1)
///     A_n = A (1 + s_A g),   T_n = (1 + s_T g') / f
///
/// g and g' are standard normal, cut off at 3. Starts at 0, without jumps. Specification 4.5,
/// "human torque".
class QuasiPeriodic {
 public:
  struct Parameters {
    double amplitude = 1.0;
    double frequency_Hz = 0.4;
    double amplitude_spread = 0.15;  ///< s_A, 0 to 0.3
    double period_spread = 0.12;     ///< s_T, 0 to 0.3
    std::uint64_t seed = 1;
  };
  QuasiPeriodic(const Parameters& parameters, double sample_rate_Hz);
  double step() noexcept TORSIO_REALTIME;
  void reset() noexcept;

 private:
  void begin_period() noexcept;

  Parameters parameters_;
  double sample_rate_Hz_;
  Random random_;
  double amplitude_ = 0.0;  ///< in this period
  double turns_a_sample_ = 0.0;
  double turns_ = 0.0;  ///< turns of this period that have passed
};

/// Repeats a recording at the loop's own rate, with linear interpolation between the samples. After
/// the last one it stays there, or begins again.
class Replay {
 public:
  struct Parameters {
    std::vector<double> values = {};  ///< at least one
    double recorded_Hz = 1000.0;      ///< rate of the values
    bool repeats = false;
  };
  Replay(Parameters parameters, double sample_rate_Hz);
  double step() noexcept TORSIO_REALTIME;
  void reset() noexcept { clock_.reset(); }

 private:
  Parameters parameters_;
  detail::SampleClock clock_;
};

/// Each level for the hold time, one after the other, and again from the first.
class Steps {
 public:
  struct Parameters {
    std::vector<double> levels;  ///< at least one
    double hold_s = 1.0;         ///< at least one sample
  };
  Steps(Parameters parameters, double sample_rate_Hz);
  double step() noexcept TORSIO_REALTIME;
  void reset() noexcept { sample_ = 0; }

 private:
  std::vector<double> levels_;
  std::uint64_t hold_samples_ = 1;
  std::uint64_t sample_ = 0;
};

}  // namespace torsio
