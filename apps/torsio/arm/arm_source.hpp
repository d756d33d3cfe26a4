#pragma once

#include <CLI/App.hpp>
#include <string>

#include "arm/arm_verbs.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

/// The arm that a verb moves, with the payload and tilt of its flags.
struct ArmSource {
  static constexpr const char* kReady = kReadyArm;

  std::string arm = kReady;
  std::string payload;
  std::string tilt;

  void add(CLI::App& verb);
  [[nodiscard]] torsio::ArmSetup setup(const torsio::Progress& progress) const;
};

/// `torsio arm learn-contacts`
void add_learn_contacts(CLI::App& arm);
