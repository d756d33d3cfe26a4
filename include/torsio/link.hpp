#pragma once

// Start here to reach a joint over a line of bytes, or to be reached.
//
//   JointEndpoint    the joint's side: bytes in, calls of a `LinkJoint` and its registers, frames out
//   HostEndpoint     the host's side: messages to frames, bytes to messages, the joint's clock and the sequence of commands
//   JointConnection  the host's side for programs of a person: calls that wait for the reply, by names of registers
//   JointGroup       telemetry of several joints of one line at the same time, without control
//   RegisterTable    parameters and measured values with unit, range and access

#include "torsio/link/can_bus.hpp"
#include "torsio/link/can_simple.hpp"
#include "torsio/link/command_guard.hpp"
#include "torsio/link/drive_state.hpp"
#include "torsio/link/frame_counters.hpp"
#include "torsio/link/host_endpoint.hpp"
#include "torsio/link/hostile_wire.hpp"
#include "torsio/link/joint_connection.hpp"
#include "torsio/link/joint_endpoint.hpp"
#include "torsio/link/joint_group.hpp"
#include "torsio/link/joint_line.hpp"
#include "torsio/link/line_budget.hpp"
#include "torsio/link/link_messages.hpp"
#include "torsio/link/link_transport.hpp"
#include "torsio/link/ndlcom_frame.hpp"
#include "torsio/link/register_table.hpp"
