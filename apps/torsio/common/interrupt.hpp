#pragma once

/// From now on the first Ctrl-C (SIGINT) or SIGTERM stops running work through the progress that it
/// reports to. Work that has not ended after one second, and a second signal, end the program at
/// once; its temporary files are then removed. Writing beyond the limit of a file's size or to a
/// closed pipe is an error with a message, not a signal.
void catch_interrupts();

[[nodiscard]] bool is_interrupted() noexcept;

/// The work has noticed the signal and ends in order: there is no time limit any more.
void lift_interrupt_deadline() noexcept;

/// Ends the program by the signal that interrupted it, so that a shell gets exit code 130 (Ctrl-C)
/// or 143 and ends its loop, too.
void end_as_interrupted();
