#pragma once

#include <complex>
#include <cstddef>
#include <optional>
#include <variant>
#include <vector>

#include "control/controller_systems.hpp"
#include "sim/sensors/sensed_channels.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/control/estimate_correction.hpp"
#include "torsio/control/joint_impedance.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/control/tube_impedance.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/signal/differentiator.hpp"
#include "torsio/sim/closed_loop/impedance_tracking.hpp"

namespace torsio {

/// What an impedance loop on a bench consists of, checked and ready to be built for each run.
struct ImpedancePlan {
  /// An impedance on a torque loop through the spring.
  struct Spring {
    JointImpedance::Gains gains;
    TorqueLoopCore::Settings torque;
    AnyInverse inverse;
  };
  const DataSheet* sheet = nullptr;
  std::variant<TubeImpedance::Settings, Spring> controller;
  std::optional<Estimator> estimator = std::nullopt;  ///< corrects the torque
  EstimateCorrection::Settings correction = {};

  [[nodiscard]] double stiffness_Nm_rad() const;
  [[nodiscard]] double damping_Nms_rad() const;
  [[nodiscard]] std::size_t ticks_per_estimate() const;  ///< 1 without an estimator
  /// The largest stiffness that is passive up to this frequency with the same damping.
  [[nodiscard]] double largest_passive_Nm_rad(double passive_to_Hz) const;
};

/// @throws UsageError as `track_impedance`.
[[nodiscard]] ImpedancePlan impedance_plan(const DataSheet& sheet, const ImpedanceSpec& spec,
                                           const ImpedanceModel* model, const LinearInverse& line);

/// The joint with the loop of a plan, without dry friction. That an estimate is held for several ticks is exact in
/// `is_stable` and approximated in the others (`corrected_feedback`).
class LinearImpedance {
 public:
  explicit LinearImpedance(const ImpedancePlan& plan);

  [[nodiscard]] bool is_stable() const;
  /// [Hz]; 0 if it is unstable.
  [[nodiscard]] double passive_to_Hz() const;
  /// Torque over angle at the output [Nm/rad], with the joint's own inertia and friction.
  [[nodiscard]] std::complex<double> at(double frequency_Hz) const;

 private:
  SeriesElasticJoint joint_;
  std::size_t ticks_per_estimate_;
  std::optional<CorrectedParts> corrected_;  ///< with an estimator
  JointFeedback feedback_;                   ///< with all parts
};

/// The loop of a plan, tick by tick at `kBenchRate_Hz`; its reference is rest at 0 rad.
class ImpedanceLoop {
 public:
  struct Output {
    double current_A = 0.0;
    bool is_limited = false;
  };

  /// @throws Error if the estimator requires a channel that the actuator's sensors do not measure.
  explicit ImpedanceLoop(const ImpedancePlan& plan);

  Output step(double t_s, const Measurement& measured) noexcept;

 private:
  struct Spring {
    JointImpedance impedance;
    TorqueController<AnyInverse> torque;
    Differentiator speed;
  };
  struct Tube {
    TubeImpedance impedance;
    double torque_per_twist_Nm_rad;
  };

  [[nodiscard]] JointSample joint_sample(double t_s, const Measurement& measured) const noexcept;
  Output step(Spring& spring, double t_s, const Measurement& measured) noexcept;
  Output step(Tube& tube, double t_s, const Measurement& measured) noexcept;
  void correct(double wanted_Nm, const Measurement& measured, bool is_limited) noexcept;

  ActuatorFamily family_;
  double inverse_ratio_;
  std::variant<Tube, Spring> controller_;
  std::optional<Estimator> estimator_;
  std::optional<EstimateCorrection> correction_;
  Estimate estimate_;  ///< held between its steps
  std::size_t ticks_per_estimate_ = 1;
  std::size_t tick_ = 0;
  std::vector<SensedChannel> inputs_;
  std::vector<double> raw_;
};

}  // namespace torsio
