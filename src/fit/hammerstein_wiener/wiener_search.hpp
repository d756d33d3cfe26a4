#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "fit/hammerstein_wiener/fit_hammerstein_wiener.hpp"
#include "fit/hammerstein_wiener/wiener_error.hpp"
#include "fit/hammerstein_wiener/wiener_start.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

struct WienerFit {
  WienerNumbers numbers;
  double sum_of_squares = 0.0;
  bool has_converged = false;
  std::size_t iterations = 0;
};

/// Relative fall of the sum of squares of one step below which a search has converged.
inline constexpr double kFineTolerance = 1e-9;
/// The same while structures are compared, of which those within 1 % are equally good.
inline constexpr double kCoarseTolerance = 1e-7;

/// How far a search goes.
struct WienerLimits {
  std::size_t iterations = 200;
  double tolerance = kFineTolerance;
};

/// From these numbers to the least simulation error.
[[nodiscard]] WienerFit refined(const WienerData& data, const WienerNumbers& start,
                                const WienerLimits& limits, const Progress& progress = {});

/// The best of all starts of a shape; nothing if none can be run.
[[nodiscard]] std::optional<WienerFit> fit_shape(const WienerData& data, const WienerShape& shape,
                                                 const WienerLimits& limits,
                                                 const Progress& progress = {});

/// As a model: x held where C is monotone, within the trained range widened by itself on both sides.
[[nodiscard]] HammersteinWiener::Parameters parameters_of(const WienerData& data,
                                                          const WienerNumbers& numbers,
                                                          std::size_t inputs);

/// The model's own error over the scored samples, each record from its start.
[[nodiscard]] double held_sum_of_squares(const WienerData& data, const WienerNumbers& numbers);

struct WienerChoice {
  WienerShape shape;
  WienerFit fit;
  std::string note;
};
/// Orders first, then degrees, by the error on held-out blocks.
[[nodiscard]] WienerChoice chosen_shape(const WienerData& data,
                                        const HammersteinWienerOptions& options,
                                        const Progress& progress);
/// As given, or as in paper 003.
[[nodiscard]] WienerShape given_shape(const HammersteinWienerOptions& options);

struct ContinuousFit {
  WienerFit fit;
  std::vector<ContinuousTransfer> sections;  ///< whose product X/W is
};
/// G by Tustin in continuous time and back by an exact first-order hold, section by section; records from
/// rest.
[[nodiscard]] WienerNumbers held_between_samples(const WienerData& data, WienerNumbers numbers);

/// G in continuous time, (a s^2 + b s + c) / (s^2 + d s + e) a section, d, e > 0 by their logarithms, run by
/// an exact first-order hold; from Tustin's form of G and from slow poles.
[[nodiscard]] ContinuousFit refined_in_continuous_time(const WienerData& data,
                                                       const WienerNumbers& numbers,
                                                       std::size_t iterations,
                                                       const Progress& progress);

}  // namespace torsio
