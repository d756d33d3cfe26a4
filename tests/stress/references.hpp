#pragma once

#include "stress/stress.hpp"

namespace torsio::stress {

/// Adaptation to references that are wrong: of six kinds in seven strengths each, in the loop for 15 s of a
/// lesson of 40 s, and by `adapt_model` for 15 s and for all of it. At most two of the 42 may make the held-out
/// error of a model more than 1.3 times that of the frozen one, or of the one adapted to the sound lesson
/// where that is larger.
Outcome wrong_references(const Settings& settings);

}  // namespace torsio::stress
