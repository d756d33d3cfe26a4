#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "identify/drive/drive_search.hpp"

namespace torsio {

/// Friction models m1 to m6 of BAM (Duclusaud, Passault et al., "Better actuator models", 2024).
enum class BamModel : std::uint8_t { m1, m2, m3, m4, m5, m6 };
inline constexpr std::size_t kBamModels = 6;

[[nodiscard]] std::string_view name(BamModel model);

/// A number of a BAM file; its row of `DriveLanes` is its place in `bam_parameters`.
struct BamParameter {
  std::string_view key;
  double lowest;
  double highest;
  double typical;
  bool is_positive;  ///< searched for by its logarithm, from a lowest value above 0 on
};
[[nodiscard]] std::span<const BamParameter> bam_parameters();

/// Which of them a model has.
[[nodiscard]] std::vector<std::size_t> bam_rows(BamModel model);

/// What of torsio's friction a model has; its quadratic part is none of it.
[[nodiscard]] DriveTerms terms_of_bam(BamModel model);

/// The equations of BAM with the sample period as its step:
///
///     J q'' = tau_m + tau_e + tau_f,  tau_m = kt / R (u - kt q'), 0 while the power is off
///     tau_f = -clip(J / dt q' + tau_m + tau_e, +-B),  q' += a dt, then q += q' dt + a dt^2 / 2
///     B = base + viscous |q'| [+ S stribeck] [+ load L] [or + |motor tau_m - external tau_e| + S |..|] [+ S Q],
///     S = exp(-|q' / v_s|^alpha), L = |tau_m - tau_e|
void roll_out_bam(BamModel model, const DriveLog& log, const DriveRun& run,
                  const DriveLanes& parameters, double* angle_rad);

/// Free runs of the whole logs start at the first angle, at rest, as BAM's do.
[[nodiscard]] DriveProblem bam_problem(const std::vector<const DriveLog*>& logs, BamModel model);

}  // namespace torsio
