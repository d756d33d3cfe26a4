#include "plant_lanes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <variant>

#include "plant_input.hpp"
#include "plant_kernels.hpp"
#include "stage_lanes.hpp"
#include "torsio/core/dispatch.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kBatch = "plant batch";

/// One plant after another, as in a message.
struct Named {
  std::string operator()(const Gear::Parameters& /*of*/) const { return "gear"; }
  std::string operator()(const SlipClutch::Parameters& /*of*/) const { return "slip clutch"; }
  std::string operator()(const RubberSpring::Parameters& /*of*/) const { return "rubber spring"; }
  std::string operator()(const ElastomerCoupling::Parameters& of) const {
    return of.bonded ? "bonded elastomer" : "unbonded elastomer";
  }
  std::string operator()(const MaxwellSlip<4>::Parameters& /*of*/) const { return "Maxwell-slip"; }
  std::string operator()(const BoucWen::Parameters& /*of*/) const { return "Bouc-Wen"; }
  std::string operator()(const LuGreSlip::Parameters& /*of*/) const { return "LuGre"; }
  std::string operator()(const Spring::Parameters& of) const {
    return std::visit(*this, of.friction) + " spring";
  }
};

std::string kind(const PlantParameters& of) {
  return std::visit(Named{}, of.first) + " + " + std::visit(Named{}, of.second);
}

/// Whether these rows are those of a part.
template <class Rows>
struct Feeds {
  static bool from(const auto& parts) {
    return std::holds_alternative<typename PartOf<Rows>::Type::Parameters>(parts);
  }
};
template <class Friction>
struct Feeds<SpringRows<Friction>> {
  static bool from(const auto& parts) {
    const auto* spring = std::get_if<Spring::Parameters>(&parts);
    return spring != nullptr && Feeds<Friction>::from(spring->friction);
  }
};
template <bool kBonded>
struct Feeds<ElastomerRows<kBonded>> {
  static bool from(const auto& parts) {
    const auto* coupling = std::get_if<ElastomerCoupling::Parameters>(&parts);
    return coupling != nullptr && coupling->bonded == kBonded;
  }
};

template <class Chain>
struct Kernel;
template <class First, class Second>
struct Kernel<ChainRows<First, Second>> {
  static bool takes(const PlantParameters& plant) {
    return Feeds<First>::from(plant.first) && Feeds<Second>::from(plant.second);
  }
};

/// The number of the kernel that steps a plant, which is that of its blocks; their count if none.
template <class... Chains>
std::size_t kernel_of(const BlocksOf<Chains...>& /*blocks*/, const PlantParameters& plant) {
  std::size_t kernel = 0;
  static_cast<void>(((Kernel<Chains>::takes(plant) || (++kernel, false)) || ...));
  return kernel;
}

template <class... Chains>
void make_blocks(BlocksOf<Chains...>& blocks, std::size_t kernel, std::size_t plants) {
  const std::size_t count = (plants + kPlantLanes - 1) / kPlantLanes;
  std::size_t at = 0;
  static_cast<void>(
      ((at++ == kernel && (blocks = detail::AlignedVector<Chains>(count), true)) || ...));
}

void require_no_tables(std::span<const PlantParameters> parameters) {
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto* const spring = std::get_if<Spring::Parameters>(&parameters[i].second);
    if (spring == nullptr || spring->table.empty()) continue;
    throw Error({.place = kBatch,
                 .expected = "springs without a table of their torque curve",
                 .found = fmt::format("a table of {} points at plant {}", spring->table.size(), i),
                 .advice = "step this plant with Plant"});
  }
}

PlantBlocks blocks_for(std::span<const PlantParameters> parameters) {
  if (parameters.empty()) {
    throw Error(
        {.place = kBatch, .problem = "nothing to simulate", .expected = "plants", .found = "none"});
  }
  PlantBlocks blocks;
  const PlantParameters& first = parameters.front();
  require_no_tables(parameters);
  const std::size_t kernel = kernel_of(blocks, first);
  for (std::size_t i = 1; i < parameters.size(); ++i) {
    if (kernel_of(blocks, parameters[i]) == kernel) continue;
    throw Error({.place = kBatch,
                 .problem = "plants of different kinds",
                 .expected = fmt::format("{}, as plant 0 is", kind(first)),
                 .found = fmt::format("{} at plant {}", kind(parameters[i]), i),
                 .advice = "make one batch a kind"});
  }
  if (kernel < std::variant_size_v<PlantBlocks>) {
    make_blocks(blocks, kernel, parameters.size());
    return blocks;
  }
  throw Error({.place = kBatch,
               .problem = "a chain of stages that only Plant takes",
               .expected = "gear + (Maxwell-slip, Bouc-Wen or LuGre spring, bonded or unbonded "
                           "elastomer, gear), or slip clutch + rubber spring",
               .found = kind(first)});
}

template <class Blocks>
auto& block_of(Blocks& blocks, std::size_t lane) noexcept {
  return blocks[lane / kPlantLanes];
}
constexpr Lane lane_of(std::size_t lane) noexcept { return {lane % kPlantLanes}; }

template <class Chain>
void set_input(Chain& rows, Lane lane, const PlantCommand& command, const Load& load) noexcept {
  lane(rows.wanted_A) = command.current_A;
  lane(rows.is_rotor_free) = command.is_motor_held ? 0.0 : 1.0;
  lane(rows.load_inertia) = load.inertia_kg_m2;
  lane(rows.gravity_Nm) = load.gravity_Nm;
  lane(rows.external_Nm) = load.external_torque_Nm;
  lane(rows.is_joint_free) = load.is_locked ? 0.0 : 1.0;
  lane(rows.wall_angle_rad) = load.wall_angle_rad;
  lane(rows.wall_stiffness) = load.wall_stiffness_Nm_rad;
  lane(rows.wall_damping) = load.wall_damping_Nms_rad;
}

template <class Chain>
bool is_finite(const Chain& rows, Lane lane) noexcept {
  return std::isfinite(lane(rows.rotor.angle_rad) + lane(rows.rotor.speed_rad_s) +
                       lane(rows.middle.angle_rad) + lane(rows.middle.speed_rad_s) +
                       lane(rows.joint.angle_rad) + lane(rows.joint.speed_rad_s));
}

/// Steps a block and then takes one lane after the other back to what it was, where it has a fault.
template <class Chain>
void step_around_faults(Chain& block, std::size_t steps, double dt_s,
                        std::span<const Fault> faults) noexcept {
  const Chain before = block;
  plant_kernels::step(&block, 1, steps, dt_s);
  for (std::size_t lane = 0; lane < faults.size(); ++lane) {
    if (faults[lane] == Fault::none) continue;
    for (std::size_t at = lane * sizeof(double); at < sizeof(Chain); at += sizeof(Row)) {
      std::memcpy(reinterpret_cast<std::byte*>(&block) + at,
                  reinterpret_cast<const std::byte*>(&before) + at, sizeof(double));
    }
  }
}

}  // namespace

PlantLanes::PlantLanes(std::span<const PlantParameters> parameters)
    : blocks_(blocks_for(parameters)) {}

std::size_t PlantLanes::padded_size() const noexcept {
  return detail::dispatch(blocks_, [](const auto& blocks) { return blocks.size() * kPlantLanes; });
}

void PlantLanes::set_parts(std::size_t at, const Plant& plant) noexcept {
  detail::dispatch(blocks_, [&](auto& blocks) {
    auto& rows = block_of(blocks, at);
    const Lane lane = lane_of(at);
    const PlantParameters& of = plant.parameters();
    torsio::set_parts(rows.motor, lane, of.motor);
    torsio::set_parts(rows.rotor_friction, lane, of.rotor_friction);
    torsio::set_parts(rows.middle_friction, lane, of.middle_friction);
    torsio::set_parts(rows.bearing, lane, of.bearing);
    torsio::set_parts(rows.first, lane, part<decltype(rows.first)>(plant.first()));
    torsio::set_parts(rows.second, lane, part<decltype(rows.second)>(plant.second()));
    lane(rows.joint_inertia) = of.joint_inertia_kg_m2;
    lane(rows.joint_viscous) = of.joint_viscous_Nms_rad;
  });
}

void PlantLanes::set_period(std::size_t at, const Plant& plant, double dt_s) noexcept {
  detail::dispatch(blocks_, [&](auto& blocks) {
    auto& rows = block_of(blocks, at);
    const Lane lane = lane_of(at);
    const PlantParameters& of = plant.parameters();
    lane(rows.motor.decay) = std::exp(-dt_s / of.motor.current_time_constant_s);
    lane(rows.rotor.dt_over_inertia) = dt_s / of.rotor_inertia_kg_m2;
    lane(rows.middle.dt_over_inertia) = dt_s / of.middle_inertia_kg_m2;
    torsio::set_period(rows.first, lane, part<decltype(rows.first)>(plant.first()), dt_s);
    torsio::set_period(rows.second, lane, part<decltype(rows.second)>(plant.second()), dt_s);
  });
}

void PlantLanes::start(std::size_t at, const Plant& plant) noexcept {
  detail::dispatch(blocks_, [&](auto& blocks) {
    auto& rows = block_of(blocks, at);
    const Lane lane = lane_of(at);
    const PlantState& state = plant.state();
    const PlantTorques& torques = plant.torques();
    lane(rows.rotor.angle_rad) = state.rotor_angle_rad;
    lane(rows.rotor.speed_rad_s) = state.rotor_speed_rad_s;
    lane(rows.middle.angle_rad) = state.middle_angle_rad;
    lane(rows.middle.speed_rad_s) = state.middle_speed_rad_s;
    lane(rows.joint.angle_rad) = state.joint_angle_rad;
    lane(rows.joint.speed_rad_s) = state.joint_speed_rad_s;
    lane(rows.motor.current_A) = plant.current();
    lane(rows.motor.torque_Nm) = torques.motor_Nm;
    for (FrictionRows* friction : {&rows.rotor_friction, &rows.middle_friction, &rows.bearing}) {
      lane(friction->force_Nm) = 0.0;
      lane(friction->torque_Nm) = 0.0;
    }
    lane(rows.first.output_Nm) = torques.first_Nm;
    lane(rows.first.input_Nm) = torques.first_on_rotor_Nm;
    lane(rows.second.output_Nm) = torques.second_Nm;
    lane(rows.second.input_Nm) = torques.second_on_middle_Nm;
    lane(rows.joint_Nm) = torques.joint_Nm;
    lane(rows.wall_Nm) = 0.0;
    const double twist_rad = state.middle_angle_rad - state.joint_angle_rad;
    torsio::start(rows.first, lane, part<decltype(rows.first)>(plant.first()), 0.0);
    torsio::start(rows.second, lane, part<decltype(rows.second)>(plant.second()), twist_rad);
  });
}

void PlantLanes::set_condition(std::size_t at, const PlantCondition& condition) noexcept {
  detail::dispatch(blocks_, [&](auto& blocks) {
    auto& rows = block_of(blocks, at);
    const Lane lane = lane_of(at);
    lane(rows.friction_factor) = condition.friction_factor;
    lane(rows.torque_constant_factor) = condition.torque_constant_factor;
    lane(rows.second_factor) = condition.second_stage_factor;
    lane(rows.stop_rad) = condition.stop_twist_rad;
    lane(rows.stop_stiffness) = condition.stop_stiffness_Nm_rad;
  });
}

bool PlantLanes::step(std::span<const PlantCommand> commands, std::span<const Load> loads,
                      std::size_t steps, double dt_s, std::span<Fault> faults) noexcept {
  constexpr std::size_t kTogether = plant_kernels::kTogether * kPlantLanes;
  return detail::dispatch(blocks_, [&](auto& blocks) {
    bool took_all = true;
    for (std::size_t begin = 0; begin < faults.size(); begin += kTogether) {
      const std::size_t end = std::min(begin + kTogether, faults.size());
      bool is_sound = true;
      for (std::size_t at = begin; at < end; ++at) {
        const double joint_kg_m2 = lane_of(at)(block_of(blocks, at).joint_inertia);
        const bool took =
            is_usable(commands[at], loads[at]) && is_soft_enough(loads[at], joint_kg_m2, dt_s);
        faults[at] = took ? Fault::none : Fault::input_not_finite;
        if (took) set_input(block_of(blocks, at), lane_of(at), commands[at], loads[at]);
        is_sound &= took;
      }
      took_all &= is_sound;
      if (is_sound) {
        const std::size_t count = (end - begin + kPlantLanes - 1) / kPlantLanes;
        plant_kernels::step(&block_of(blocks, begin), count, steps, dt_s);
      } else {
        for (std::size_t at = begin; at < end; at += kPlantLanes) {
          step_around_faults(block_of(blocks, at), steps, dt_s,
                             faults.subspan(at, std::min(kPlantLanes, end - at)));
        }
      }
      for (std::size_t at = begin; at < end; ++at) {
        if (is_finite(block_of(blocks, at), lane_of(at))) continue;
        faults[at] = Fault::model_not_finite;
        took_all = false;
      }
    }
    return took_all;
  });
}

PlantState PlantLanes::state(std::size_t at) const noexcept {
  return detail::dispatch(blocks_, [&](const auto& blocks) -> PlantState {
    const auto& rows = block_of(blocks, at);
    const Lane lane = lane_of(at);
    return {lane(rows.rotor.angle_rad),  lane(rows.rotor.speed_rad_s),
            lane(rows.middle.angle_rad), lane(rows.middle.speed_rad_s),
            lane(rows.joint.angle_rad),  lane(rows.joint.speed_rad_s)};
  });
}

PlantTorques PlantLanes::torques(std::size_t at) const noexcept {
  return detail::dispatch(blocks_, [&](const auto& blocks) -> PlantTorques {
    const auto& rows = block_of(blocks, at);
    const Lane lane = lane_of(at);
    return {.motor_Nm = lane(rows.motor.torque_Nm),
            .rotor_friction_Nm = lane(rows.rotor_friction.torque_Nm),
            .first_Nm = lane(rows.first.output_Nm),
            .first_on_rotor_Nm = lane(rows.first.input_Nm),
            .middle_friction_Nm = lane(rows.middle_friction.torque_Nm),
            .second_Nm = lane(rows.second.output_Nm),
            .second_on_middle_Nm = lane(rows.second.input_Nm),
            .bearing_Nm = lane(rows.bearing.torque_Nm),
            .joint_Nm = lane(rows.joint_Nm),
            .wall_Nm = lane(rows.wall_Nm)};
  });
}

double PlantLanes::current(std::size_t at) const noexcept {
  return detail::dispatch(blocks_, [&](const auto& blocks) {
    return lane_of(at)(block_of(blocks, at).motor.current_A);
  });
}

double PlantLanes::second_twist(std::size_t at) const noexcept {
  return detail::dispatch(blocks_, [&](const auto& blocks) {
    return lane_of(at)(block_of(blocks, at).second.twist_rad);
  });
}

}  // namespace torsio
