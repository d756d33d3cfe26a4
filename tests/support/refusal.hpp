#pragma once

#include <string>

#include "torsio/core/error.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio::test {

/// What `simulate` complains of in a call; "accepted" if it does not.
inline std::string refusal_of(const ExperimentSpec& spec) {
  try {
    static_cast<void>(simulate(spec));
  } catch (const UsageError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace torsio::test
