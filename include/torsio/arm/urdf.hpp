#pragma once

#include <string_view>

#include "torsio/arm/arm_model.hpp"

namespace torsio {

/// Reads a serial arm from the text of a URDF file.
///
/// Read are links with their inertials, and joints that are revolute or fixed with origin, axis and limits. The mass of a
/// link that is fixed to another one is added to it; what is fixed to the base belongs to the base. The frame of the last
/// link in the chain is the flange. Where the chain forks after the last joint, as by a camera, it is the link `flange`,
/// else `tool0` (REP 199 of ROS), else the end of the first of the longest branches. Shapes, colours, transmissions,
/// sensors and extensions of simulators are passed over.
///
/// @param file for messages
/// @throws Error with file and line, what was expected and found: not XML, a document type or an entity, a macro of
/// xacro, a joint or a link without a name or with that of another one, a joint that is neither revolute nor fixed, or
/// follows another one (mimic), a link that does not exist, has two parents or belongs to a loop, several roots, a tree
/// with two moving branches, a moving link without mass, a mass or an inertia that no body has, limits that are missing or
/// contain no angle, a number that is none, an element that is there twice or is misspelt, an unknown attribute of an
/// element that is read, no moving joint or more than `kMaxArmJoints`, more than 1000 links, or a text above 4 MiB.
[[nodiscard]] ArmModel read_urdf(std::string_view text, std::string_view file);

}  // namespace torsio
