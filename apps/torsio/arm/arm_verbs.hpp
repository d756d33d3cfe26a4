#pragma once

#include <CLI/App.hpp>
#include <string>

#include "torsio/core/progress.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

// The verbs below `torsio arm`, each in a file of its own.

void add_arm_calibrate(CLI::App& arm);
void add_arm_excite(CLI::App& arm);
void add_arm_identify(CLI::App& arm);

/// The arm that comes with torsio.
inline constexpr const char* kReadyArm = "arm6";

/// `arm6`, or the arm of a YAML file.
[[nodiscard]] inline torsio::ArmSetup arm_of(const std::string& arm,
                                             const torsio::Progress& progress) {
  return arm == kReadyArm ? torsio::arm6_setup() : torsio::read_arm(arm, progress);
}
