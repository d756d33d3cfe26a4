#pragma once

#include <CLI/App.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/output.hpp"
#include "common/report_output.hpp"

/// The flags of `torsio track --impedance`, and those that it shares with the torque loop.
struct ImpedanceFlags {
  std::string impedance;  ///< high, zero or a stiffness; empty: the torque loop
  std::string damping;
  std::string torque_gain;
  std::string correction;

  void add(CLI::App& verb);
  /// Refuses flags of the torque loop together with `--impedance`, and flags of the impedance
  /// without it, each with the reason.
  void check(const CLI::App& verb) const;
};

/// What `torsio track` has been given for both loops.
struct SharedTrackFlags {
  std::string actuator;
  std::string amplitude;
  std::string duration;
  std::string bandwidth;
  std::optional<double> loop_damping;
  std::vector<std::string> models;
  std::uint64_t seed = 1;
  std::string record;
  JsonOutput json;
  ReportOutput report;
};

/// Closes the impedance loop and prints, writes and records what it rendered.
void run_impedance(const ImpedanceFlags& flags, const SharedTrackFlags& shared);
