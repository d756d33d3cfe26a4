#include "sim/plant/steepest_slopes.hpp"

#include <variant>

#include "sim/plant/stages.hpp"

namespace torsio {
namespace {

/// @param slope of a stage
template <class Slope>
ChainSlopes slopes_of(const PlantParameters& parameters, const Slope& slope) {
  const auto ratio_of = [](const auto& of) { return ratio(make_stage(of)); };
  const auto slope_of = [&](const auto& of) { return slope(make_stage(of)); };
  return {.first_ratio = std::visit(ratio_of, parameters.first),
          .second_ratio = std::visit(ratio_of, parameters.second),
          .first = std::visit(slope_of, parameters.first),
          .second = std::visit(slope_of, parameters.second)};
}

}  // namespace

ChainSlopes steepest_slopes(const PlantParameters& parameters) {
  ChainSlopes slopes = slopes_of(
      parameters, [&](const auto& stage) { return steepest(stage, parameters.rated_torque_Nm); });
  slopes.on_rotor = LuGreFriction(parameters.rotor_friction).steepest();
  slopes.on_middle = LuGreFriction(parameters.middle_friction).steepest();
  slopes.on_joint = LuGreFriction(parameters.bearing).steepest();
  return slopes;
}

ChainSlopes viscous_slopes(const PlantParameters& parameters) {
  ChainSlopes slopes =
      slopes_of(parameters, [](const auto& stage) { return strongest_damping(stage); });
  slopes.on_rotor = parameters.rotor_friction.viscous_Nms_rad;
  slopes.on_middle = parameters.middle_friction.viscous_Nms_rad;
  slopes.on_joint = parameters.bearing.viscous_Nms_rad;
  return slopes;
}

}  // namespace torsio
