#pragma once

#include <string>

#include "data/clock_stamps.hpp"

// Stamps that are not in order: what made them so is found, and refused with the line of a mapping that corrects it.
namespace torsio {

/// @throws ClockError for rows of several joints, one after the other: a channel differs more between two rows of a stamp
/// than from one stamp to the next.
void refuse_several_joints(const Stamps& stamps);

/// @throws ClockError for a counter of the logger that overflows, a second log after the first one, or rows that are late.
void refuse_new_beginning(const Stamps& stamps);

/// @throws ClockError at a stamp that is before the last one.
[[noreturn]] void refuse_backward(const Stamps& stamps, std::size_t at);

/// @throws ClockError for stamps that run backward or are repeated; `advice` is about the repeated ones.
void refuse_not_increasing(const Stamps& stamps, const std::string& advice);

}  // namespace torsio
