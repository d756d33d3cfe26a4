#pragma once

/// From now on the first Ctrl-C stops running work through the progress that it reports to;
/// a second one ends the program at once.
void catch_interrupts();

[[nodiscard]] bool is_interrupted() noexcept;

/// Ends the program by the signal that interrupted it, so that a shell gets exit code 130 (Ctrl-C)
/// or 143 and ends its loop, too.
void end_as_interrupted();
