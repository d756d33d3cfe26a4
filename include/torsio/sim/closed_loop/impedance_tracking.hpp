#pragma once

#include <complex>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/control/pid.hpp"
#include "torsio/control/tube_impedance.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// The impedance that a simulated joint is to render at its output, and how it is measured.
struct ImpedanceSpec {
  enum class Kind {
    high,    ///< the gains of paper 004, stable only with the dry friction of the gear
    zero,    ///< the gains of its zero impedance; without a torsion tube, K = D = 0
    wanted,  ///< the stiffness and damping below
  };
  Kind kind = Kind::high;
  double stiffness_Nm_rad = 0.0;
  double damping_Nms_rad = 0.0;
  /// K_tp of `wanted`, only for a torsion tube before a harmonic drive; none: that of the zero
  /// impedance.
  std::optional<double> torque_gain_Nm_rad = {};
  /// Bandwidth of the torque loop through the spring, only without a torsion tube; none: 50 rad/s, or
  /// 100 rad/s with an elastomer coupling.
  std::optional<double> bandwidth_rad_s = {};
  std::optional<double> loop_damping = {};  ///< its damping; none: 0.9
  /// Bandwidth of the correction by an estimate, up to 100 rad/s, only with a model that is an
  /// estimator; none: that of `EstimateCorrection`.
  std::optional<double> correction_rad_s = {};
  /// Amplitude of the sines at the output, up to 50 Nm or the rated torque; none: 20 Nm with a
  /// torsion tube, else a fifth of the rated torque.
  std::optional<double> amplitude_Nm = {};
  double duration_s = 60.0;  ///< duration of the motion of the hand, 10 to 3600
};

/// A learned model in an impedance loop: the inverse of the spring in the torque loop, or, for a
/// model without one and for a torsion tube, an estimator whose torque corrects that of the loop
/// (`EstimateCorrection`).
struct ImpedanceModel {
  std::string name;
  std::variant<AnyInverse, Estimator> use;
  std::string reason = {};  ///< why it is not used as an inverse; empty: it is
};

/// The use that an actuator has for a model. An estimator runs at the rate of its training if the
/// 1 kHz of the loop are a multiple of it, and the loop holds the estimate in between; else at 1 kHz.
/// Zeros that the model requires are 0, those of simulated encoders.
/// @throws Error if the model can do neither, or requires a channel that the bench does not have.
[[nodiscard]] ImpedanceModel impedance_model(std::string name, const ModelFile& model,
                                             const DataSheet& sheet);

/// The linear model of torque over twist for a series-elastic actuator (`sweep_line`), of an
/// elastomer coupling or of rubber (a ramp of torque with the rotor held, fitted to all its samples).
/// @throws UsageError for an actuator with a torsion tube, which needs none; Cancelled.
[[nodiscard]] LinearInverse spring_line(const DataSheet& sheet, std::uint64_t seed,
                                        const Progress& progress = {});

/// The impedance of the joint at one frequency as torque over angle, τ / q [Nm/rad]; divided by jω
/// it is torque over speed.
struct ImpedancePoint {
  double frequency_Hz = 0.0;
  std::complex<double> wanted_Nm_rad;  ///< K + jωD
  /// The linear model without dry friction: jω Z + jω (jω M + d), see `impedance`. M is the
  /// inertia of the output and, through the rigid gear after a tube, of the wave generator.
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
  /// 300 N/m and 12 Ns/m at the lever: an arm that is neither relaxed nor stiff (assumed). For an
  /// actuator of less than `kFullArm_Nm` both are smaller in proportion to its rated torque.
  double arm_stiffness_Nm_rad = 75.0;
  double arm_damping_Nms_rad = 3.0;
  static constexpr double kFullArm_Nm = 50.0;
};

struct ImpedanceRun {
  std::string actuator;  ///< with its serial number, without the variant
  std::string variant;
  ImpedanceSpec spec;
  std::uint64_t seed = 1;
  std::string model;         ///< name of the model; empty with a torsion tube: none
  std::string model_reason;  ///< as `ImpedanceModel::reason`
  std::optional<double> correction_rad_s =
      {};  ///< bandwidth of the correction; none: there is none
  double amplitude_Nm = 0.0;
  std::optional<TubeImpedance::Gains> tube = {};  ///< with a torsion tube
  std::optional<Pid::Gains> deflection = {};      ///< [A/rad], without
  std::optional<double> bandwidth_rad_s = {};     ///< the torque loop's, without
  double stiffness_Nm_rad = 0.0;                  ///< stiffness of these gains at rest
  double damping_Nms_rad = 0.0;
  /// Frequency up to which the joint without dry friction is passive; 0 if it is unstable.
  double passive_to_Hz = 0.0;
  double passive_goal_Hz = kPassiveTo_Hz;  ///< `kPassiveTo_Hz`, or without a tube 1 Hz
  /// The largest stiffness that is passive up to the goal with this damping and these gains, without
  /// a correction by an estimate.
  double largest_passive_Nm_rad = 0.0;
  std::vector<ImpedancePoint> points = {};
  double limited_share = 0.0;  ///< share of all cycles in which the current was limited
  HandForces hand = {};
  Recording record;  ///< the motion of the hand, with the truth channels

  /// The range in which the wanted impedance of a torsion tube must be passive: that of `points`,
  /// and of a person.
  static constexpr double kPassiveTo_Hz = 10.0;
  /// The range for which `largest_passive_Nm_rad` of the others is computed. They must be stable;
  /// the integral of their deflection controller leaves little that is passive without damping.
  static constexpr double kPassiveSpringTo_Hz = 1.0;
};

/// Closes the impedance loop on the simulated bench with its sensors, at 1 kHz: sines of torque at
/// the output, one run for each frequency, and then the hand. Equal arguments give equal results.
/// @param model none: the gains of a torsion tube, or `spring_line`
/// @throws UsageError if a value is out of range or has no effect, the loop is unstable without dry
/// friction, or the wanted or, with an estimate, zero impedance of a torsion tube is not passive up to
/// `kPassiveTo_Hz` (the message states the largest stiffness that is, or the fastest correction); Error if
/// the loop diverges; Cancelled.
[[nodiscard]] ImpedanceRun track_impedance(const DataSheet& sheet, const ImpedanceSpec& spec,
                                           const std::optional<ImpedanceModel>& model,
                                           std::uint64_t seed, const Progress& progress = {});
[[nodiscard]] inline ImpedanceRun track_impedance(const DataSheet& sheet, const ImpedanceSpec& spec,
                                                  std::uint64_t seed,
                                                  const Progress& progress = {}) {
  return track_impedance(sheet, spec, std::nullopt, seed, progress);
}
/// Without a model and then with each of them. @throws as `track_impedance`, before the first run.
[[nodiscard]] std::vector<ImpedanceRun> track_impedances(const DataSheet& sheet,
                                                         const ImpedanceSpec& spec,
                                                         std::span<const ImpedanceModel> models,
                                                         std::uint64_t seed,
                                                         const Progress& progress = {});

}  // namespace torsio
