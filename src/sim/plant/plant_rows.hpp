#pragma once

#include <array>
#include <cstddef>
#include <variant>

#include "core/aligned_vector.hpp"

// Where the kernels of PlantBatch find parameters, state and torques of many plants.

namespace torsio {

inline constexpr std::size_t kPlantLanes = 8;

/// One number of each plant in a block.
struct alignas(64) Row {
  std::array<double, kPlantLanes> lane{};
};

struct MotorRows {
  Row torque_constant, peak_A, supply_V, inverse_resistance, ripple_Nm, ripple_order;
  Row decay;  ///< decay of the current over a step
  Row current_A, torque_Nm;
};

/// LuGreFriction.
struct FrictionRows {
  Row coulomb_Nm, load_factor, viscous;
  Row static_excess;  ///< r − 1
  Row inverse_stribeck_squared;
  Row stiffness;  ///< σ₀
  Row force_Nm, torque_Nm;
};

/// MaxwellSlip.
template <std::size_t kElements>
struct SlipRows {
  Row constant_Nm, load_factor;
  std::array<Row, kElements> share, share_per_rad, force_Nm;
};

struct BoucWenRows {
  Row constant_Nm, load_factor, per_knee;
  Row force_Nm;
};

struct LuGreSlipRows {
  Row constant_Nm, load_factor, static_excess, inverse_stribeck_squared, per_bristle;
  Row force_Nm;
};

/// What every stage leaves for its two bodies.
struct StageRows {
  Row output_Nm, input_Nm;
  Row twist_rad, slope;  ///< twist of this step, and dx / d(input angle)
};

struct GearRows : StageRows {
  Row inverse_ratio, stiffness, damping;
  std::array<Row, 2> in_phase, quadrature;  ///< amplitudes of the kinematic error
  Row error_rad;                            ///< A₂ + A₄
  SlipRows<1> hysteresis;
};

struct ClutchRows : StageRows {
  Row inverse_ratio, stiffness, damping, static_Nm, sliding_Nm;
  Row slip_rad, cable_Nm;
  Row is_slipping;  ///< 0 or 1
};

template <class Friction>
struct SpringRows : StageRows {
  Row stiffness_up, stiffness_down, half_gap_rad, per_half_gap, stage_rad, stage_stiffness;
  Row viscosity;
  Friction friction;
};

struct RubberRows : StageRows {
  Row stiffness, asymmetry, per_blend;  ///< both times the elastic share
  std::array<Row, 3> decay, gain, branch_Nm;
  SlipRows<3> slip;
};

template <bool kBonded>
struct ElastomerRows : StageRows {
  /// The lobes that carry one direction of torque; both directions when bonded.
  struct Lobes {
    std::array<Row, 3> creep_rad;
    Row torque_Nm;
  };
  Row stiffness;
  std::array<Row, 3> relaxed, push, recovery;
  std::array<std::array<Row, 3>, 3> transition;
  Row quadratic, cubic, lowest_Nm, highest_Nm;
  Row per_slip_load;
  Row creep_per_cycle, dead_band_rad;
  SlipRows<3> slip;
  std::array<Lobes, kBonded ? 1 : 2> lobes;
  Row max_measured_load_Nm, glue, glue_after_cycle, last_side, turns;
};

struct BodyRows {
  Row dt_over_inertia, angle_rad, speed_rad_s;
};

/// A chain of three bodies of `kPlantLanes` plants, as Plant has it.
template <class First, class Second>
struct ChainRows {
  MotorRows motor;
  FrictionRows rotor_friction;
  First first;
  FrictionRows middle_friction;
  Second second;
  FrictionRows bearing;
  BodyRows rotor, middle, joint;  ///< the joint's inertia is below
  Row joint_inertia, joint_viscous;
  Row joint_Nm, wall_Nm;

  // What drives it, and the load.
  Row wanted_A, load_inertia, gravity_Nm, external_Nm;
  Row is_rotor_free, is_joint_free;  ///< 0 or 1
  Row wall_angle_rad, wall_stiffness, wall_damping;

  // Its condition.
  Row friction_factor, torque_constant_factor, second_factor, stop_rad, stop_stiffness;
};

using MaxwellChain = ChainRows<GearRows, SpringRows<SlipRows<4>>>;
using BoucWenChain = ChainRows<GearRows, SpringRows<BoucWenRows>>;
using LuGreChain = ChainRows<GearRows, SpringRows<LuGreSlipRows>>;
using BondedChain = ChainRows<GearRows, ElastomerRows<true>>;
using UnbondedChain = ChainRows<GearRows, ElastomerRows<false>>;
using ClutchChain = ChainRows<ClutchRows, RubberRows>;
using GearChain = ChainRows<GearRows, GearRows>;

template <class... Chains>
using BlocksOf = std::variant<detail::AlignedVector<Chains>...>;
using PlantBlocks = BlocksOf<MaxwellChain, BoucWenChain, LuGreChain, BondedChain, UnbondedChain,
                             ClutchChain, GearChain>;

}  // namespace torsio
