#pragma once

/// From now on the first Ctrl-C asks running work to stop, through the progress that it reports to;
/// a second one ends the program at once.
void catch_interrupts();

[[nodiscard]] bool is_interrupted() noexcept;
