#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "check/signal_pair.hpp"

namespace torsio {

/// Correlation below which a torque hardly follows its input.
inline constexpr double kClearCorrelation = 0.5;

/// The torque rises with the input up to a sample and falls with it afterwards, or falls first and
/// then rises.
struct SignFlip {
  std::size_t sample = 0;  ///< the first of the second part
  double before = 0.0;     ///< correlation
  double after = 0.0;
};
/// In each of the two parts input and torque pass through at least 5 % of their range and 5 of
/// their codes: within less, noise and hysteresis determine the correlation.
/// @param input_code, target_code resolution of the sensors
[[nodiscard]] std::optional<SignFlip> find_sign_flip(const Pair& pair, double input_code,
                                                     double target_code);

/// Offset and slope of the torque of each recording at common inputs: all recordings are fitted by
/// one static curve with hysteresis, and by an offset and a slope for each.
struct RecordLine {
  double offset = 0.0;         ///< over its inputs, minus that of the usual (median) recording
  double slope = 1.0;          ///< over that of the usual recording
  double unexplained = 1.0;    ///< share of the variance of all targets
  double without_lines = 1.0;  ///< the same for the common curve alone
};
/// @param references the recordings (indices) among which the usual one is; empty: all
[[nodiscard]] std::vector<RecordLine> compare_records(const std::vector<const Pair*>& pairs,
                                                      std::span<const std::size_t> references = {});

/// A quantity besides motion and load that can change the torque: a temperature, a pressure.
struct OtherInput {
  std::vector<std::vector<double>> values;  ///< one for each recording, at every sample
};
/// Takes out of the targets what other inputs z explain: all recordings are fitted by one static curve with hysteresis
/// over the first input x and by z, x z and, if z has at least `kFewestLevels` values, z^2. Nothing is taken out unless
/// they reduce what remains of the curve's residual to nine tenths.
void take_out(std::span<Pair> pairs, std::span<const OtherInput> others);
inline constexpr std::size_t kFewestLevels = 5;

/// Share of the variance of the target that is explained neither by a curve with hysteresis over the input nor by a line
/// over the other inputs and their magnitudes; empty for too few samples.
[[nodiscard]] std::optional<double> unexplained_share(const Pair& pair,
                                                      std::span<const std::vector<double>> others);

/// The unit mistake that makes a number `ratio` (or 1 / `ratio`) times too large, within 10 %;
/// empty if none does. A torque may be in Ncm, an angle has no unit of 100.
[[nodiscard]] std::string_view unit_mistake(double ratio, bool is_angle);

}  // namespace torsio
