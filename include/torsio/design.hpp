#pragma once

// Start here to design the parts of an elastic joint.
//
//   design_rubber_spring  a ring of rubber for a torque sensor
//   design_spring         a metal spring: rod, tube, coils or disc springs
//   design_clutch         a clutch with rubber inserts
//   design_actuator       motor, gear and spring for a demand of torque, speed and bandwidth
//   DesignReport          what each of them returns for people: figures with units, notes, pictures

#include "torsio/design/actuator.hpp"
#include "torsio/design/clutch.hpp"
#include "torsio/design/report.hpp"
#include "torsio/design/rubber_spring.hpp"
#include "torsio/design/spring.hpp"
