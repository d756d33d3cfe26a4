#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {

/// A move of a joint from waypoint to waypoint along fifth-order polynomials in time, within its
/// limits of speed and acceleration; it ends at rest at the last one and stays there.
///
///     q(s) = q₀ + Σ c_k s^k,   s = (t − t₀) / T,   q̈ = 0 at every waypoint
///
/// A move that stops at each waypoint is the one of least jerk between them, q₀ + d (10 s³ − 15 s⁴
/// + 6 s⁵), as fast as the limits allow: T = max(15 d / 8 v, √(10 d / (√3 a))). In a move without
/// stops the speed at a waypoint is the mean of the two neighbouring speeds, or zero where the
/// direction changes, and the times of all its parts are scaled together until the limits hold.
/// Flash & Hogan (1985).
class JointMove {
 public:
  enum class Through { stop, pass };
  struct Parameters {
    std::vector<double> waypoints_rad = {};  ///< at least one, the start; equal neighbours are one
    double speed_rad_s = 1.0;                ///< > 0
    double acceleration_rad_s2 = 1.0;        ///< > 0
    Through through = Through::stop;
  };
  struct Output {
    double position_rad = 0.0;
    double velocity_rad_s = 0.0;
    double acceleration_rad_s2 = 0.0;
    bool is_done = false;
  };

  /// @throws UsageError if there is no waypoint, or a number is not finite or out of its range.
  JointMove(const Parameters& parameters, double sample_rate_Hz);

  Output step() noexcept TORSIO_REALTIME;
  void reset() noexcept;
  [[nodiscard]] double duration_s() const noexcept { return duration_s_; }

 private:
  struct Part {
    double start_s = 0.0;
    double duration_s = 0.0;
    std::array<double, 6> coefficients{};  ///< s^0 to s^5
  };
  [[nodiscard]] static Part part(double from_rad, double to_rad, double from_rad_s, double to_rad_s,
                                 double duration_s);
  [[nodiscard]] static double excess(const Part& part, const Parameters& limits);

  std::vector<Part> parts_;
  double last_rad_;
  double duration_s_ = 0.0;
  std::size_t part_ = 0;
  detail::SampleClock clock_;
};

}  // namespace torsio
