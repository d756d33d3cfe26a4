#pragma once

// Start here to reach a joint over a line of bytes, or to be reached: NDLCom frames over UDP, serial lines and more.

#include "torsio/link/command_guard.hpp"
#include "torsio/link/drive_state.hpp"
#include "torsio/link/frame_counters.hpp"
#include "torsio/link/link_messages.hpp"
#include "torsio/link/ndlcom_frame.hpp"
#include "torsio/link/register_table.hpp"
