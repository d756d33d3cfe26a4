#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {

/// A torque that a loop is to follow, at the 1 kHz of the benches.
struct TorqueReference {
  enum class Kind : std::uint8_t {
    chirp,        ///< 0.01 to 0.3 Hz over 100 s (specification 4.7)
    random_walk,  ///< noise below 1 Hz, with the RMS of the chirp
    steps,        ///< A, -A, A/2, -A/2, each for 2 s
    sweep,        ///< a logarithmic sweep through the loop's bandwidth, see `frequency_sweep`
    replay,       ///< replays `recorded_Nm`
  };

  Kind kind = Kind::chirp;
  /// None: 13 Nm on dfki-50 and 20 Nm on dfki-120, as specification 6 has it, else a fifth of the
  /// rating. Replay takes none.
  std::optional<double> amplitude_Nm = {};
  std::optional<double> duration_s =
      {};                                ///< none: 100 s, 20 s for steps and sweep, the recording's
  std::vector<double> recorded_Nm = {};  ///< replay
  double recorded_Hz = 1000.0;           ///< replay
};

[[nodiscard]] std::span<const std::string_view> reference_names() noexcept;
[[nodiscard]] std::string_view name(TorqueReference::Kind kind) noexcept;
/// @throws UsageError that lists the names.
[[nodiscard]] TorqueReference::Kind find_reference(std::string_view name);

/// What it asks for; a replay's is its largest.
[[nodiscard]] double amplitude_of(const TorqueReference& reference, const DataSheet& sheet);

/// The sweep of `Kind::sweep`: 1 to 40 Hz.
[[nodiscard]] LogSweep::Parameters frequency_sweep(double amplitude_Nm, double duration_s);

}  // namespace torsio
