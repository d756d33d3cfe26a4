#pragma once

// Start here for the thread of a loop.
//
//   RealtimeLoop  calls a step on absolute times of a monotonic clock
//   LoopOptions   period, priority, locked memory, core
//   LoopReport    why the loop ended, overruns, quantiles of lateness and duration
//   Mailbox       the newest value from another thread, without a lock
//   Recorder      writes rows of a loop to a file from a thread of its own

#include "torsio/realtime/mailbox.hpp"
#include "torsio/realtime/realtime_loop.hpp"
#include "torsio/realtime/recorder.hpp"
