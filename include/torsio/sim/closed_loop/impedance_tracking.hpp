#pragma once

#include <complex>
#include <cstdint>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/control/tube_impedance.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// The impedance that an actuator with a torsion tube before its harmonic drive is to render at its
/// output, and how it is measured.
struct ImpedanceSpec {
  enum class Kind {
    high,    ///< the gains of paper 004, stable only with the dry friction of the gear
    zero,    ///< the gains of its zero impedance
    wanted,  ///< the stiffness and damping below
  };
  Kind kind = Kind::high;
  double stiffness_Nm_rad = 0.0;
  double damping_Nms_rad = 0.0;
  double torque_gain_Nm_rad = TubeImpedance::kZero.torque_Nm_rad;  ///< K_tp of `wanted`
  double amplitude_Nm = 20.0;  ///< amplitude of the sines at the output, up to 50
  double duration_s = 60.0;    ///< duration of the motion of the hand, 10 to 3600
};

/// The impedance of the joint at one frequency as torque over angle, τ / q [Nm/rad]; divided by jω
/// it is torque over speed.
struct ImpedancePoint {
  double frequency_Hz = 0.0;
  std::complex<double> wanted_Nm_rad;  ///< K + jωD
  /// The linear model without dry friction: jω Z + jω (jω M + d), see `impedance`. M is the
  /// inertia of the output and, through the rigid gear, of the wave generator.
  std::complex<double> linear_Nm_rad;
  std::complex<double> rendered_Nm_rad;  ///< first harmonics of the simulated torque and angle
};

/// A hand that moves to and fro and is coupled to the output by the arm's stiffness and damping.
struct HandForces {
  double rms_Nm = 0.0;  ///< torque of the hand at the joint
  double max_Nm = 0.0;
  double rms_N = 0.0;  ///< force at `kLever_m`
  double max_N = 0.0;
  double hand_range_deg = 0.0;   ///< range of the hand's motion
  double joint_range_deg = 0.0;  ///< range of the motion of the joint
  double mean_power_W = 0.0;     ///< from the hand into the joint
  /// RMS of the torque less that of the wanted impedance at the same motion, K q + D q̇.
  double rms_to_wanted_Nm = 0.0;

  static constexpr double kLever_m = 0.5;
  static constexpr double kAmplitude_rad = 0.2;  ///< amplitude of the hand's motion, which varies
  static constexpr double kFrequency_Hz = 0.4;   ///< specification 4.5
  /// 300 N/m and 12 Ns/m at the lever: an arm that is neither relaxed nor stiff (assumed).
  static constexpr double kArmStiffness_Nm_rad = 75.0;
  static constexpr double kArmDamping_Nms_rad = 3.0;
};

struct ImpedanceRun {
  std::string actuator;  ///< with its serial number, without the variant
  std::string variant;
  ImpedanceSpec spec;
  std::uint64_t seed = 1;
  TubeImpedance::Gains gains;
  double stiffness_Nm_rad = 0.0;  ///< stiffness of these gains at rest
  double damping_Nms_rad = 0.0;
  /// Frequency up to which the joint without dry friction is passive; 0 if it is unstable.
  double passive_to_Hz = 0.0;
  /// The largest stiffness that is passive up to `kPassiveTo_Hz` with this damping and K_tp.
  double largest_passive_Nm_rad = 0.0;
  std::vector<ImpedancePoint> points = {};
  double limited_share = 0.0;  ///< share of all cycles in which the current was limited
  HandForces hand = {};
  Recording record;  ///< the motion of the hand, with the truth channels

  /// The range in which a wanted impedance must be passive: that of `points`, and of a person.
  static constexpr double kPassiveTo_Hz = 10.0;
};

/// Settings of the controller. @throws UsageError unless the actuator has a torsion tube before a
/// harmonic drive, and the wanted impedance is passive up to `kPassiveTo_Hz`; the message states
/// the largest stiffness that is.
[[nodiscard]] TubeImpedance::Settings impedance_settings(const DataSheet& sheet,
                                                         const ImpedanceSpec& spec);

/// Closes the impedance loop on the simulated bench with its sensors, at 1 kHz: sines of torque at
/// the output, one run for each frequency, and then the hand. Equal arguments give equal results.
/// @throws UsageError as `impedance_settings`, or if amplitude or duration is out of range; Error if
/// the loop diverges; Cancelled.
[[nodiscard]] ImpedanceRun track_impedance(const DataSheet& sheet, const ImpedanceSpec& spec,
                                           std::uint64_t seed, const Progress& progress = {});

}  // namespace torsio
