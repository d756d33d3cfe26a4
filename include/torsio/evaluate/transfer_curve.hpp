#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/fit/transfer.hpp"

namespace torsio {

/// A base model on a new joint, by method, beside a model that is fitted to the new data alone.
struct TransferEvaluation {
  struct OfMethod {
    std::string method;                   ///< name of a `TransferMethod`, or "own"
    double held_out_rmse = kNotMeasured;  ///< see `TransferTrial`; NaN for "own"
    Score test;                           ///< on the segments with the role test
  };
  double seconds = 0.0;  ///< measured time of the new data that were used
  TransferResult transfer;
  std::vector<OfMethod> methods = {};
  std::vector<std::string> notes = {};

  [[nodiscard]] const OfMethod* find(std::string_view method) const noexcept;
  /// The chosen method.
  [[nodiscard]] const OfMethod& chosen() const { return methods[transfer.chosen]; }
};

/// Transfers the base with the segments that have the role train, and scores every method on those with the
/// role test. "own" is a model of the base's family and options, fitted to the same new data; it is missing,
/// with a note, where that fit fails.
/// @throws as `transfer_model`; UsageError without segments to score on.
[[nodiscard]] TransferEvaluation evaluate_transfer(const ModelFile& base, const Dataset& dataset,
                                                   const TransferOptions& options,
                                                   std::uint64_t seed,
                                                   const Progress& progress = {});

/// How the errors fall with the time of the new data.
struct TransferCurve {
  struct Point {
    double seconds = 0.0;
    double base_rmse = kNotMeasured;  ///< as it is
    double offset_rmse = kNotMeasured;
    double chosen_rmse = kNotMeasured;
    double own_rmse = kNotMeasured;  ///< NaN: the fit failed
    std::string method;              ///< that was chosen
  };
  std::vector<Point> points;
  /// From here on the own model has no larger error; empty: the base helps in all of them.
  std::optional<double> base_helps_until_s = {};
};

/// `evaluate_transfer` with the first `seconds` of the training segments, for each of them.
/// @throws UsageError unless these are positive, ascending and not longer than the segments.
[[nodiscard]] TransferCurve transfer_curve(const ModelFile& base, const Dataset& dataset,
                                           const std::vector<double>& seconds,
                                           const TransferOptions& options, std::uint64_t seed,
                                           const Progress& progress = {});

/// The first `seconds` of the segments with the role train; what follows of them has no role.
[[nodiscard]] Dataset with_training_time(Dataset dataset, double seconds);

/// The first `seconds` of each recording get the role train, the rest the role test.
/// @throws UsageError for a time that is not positive, Error naming the recording that is too short.
void hold_out_after(Dataset& dataset, double seconds);

}  // namespace torsio
