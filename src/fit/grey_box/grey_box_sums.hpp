#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "fit/common/regression.hpp"
#include "fit/common/strokes.hpp"
#include "fit/grey_box/bank_choice.hpp"
#include "model/grey_box/grey_box.hpp"
#include "numerics/nnls.hpp"

namespace torsio {

/// Every knot, threshold and time constant that a grey box may take from, and AᵀA, Aᵀy of all of their
/// terms, gathered once: any smaller structure is a projection of them.
struct GreyBoxSums {
  static constexpr std::size_t kFinest = 5;  ///< 2^5 + 1 knots
  static constexpr std::size_t kKnots = (std::size_t{1} << kFinest) + 1;
  static constexpr std::size_t kThresholds = 8;
  static constexpr std::size_t kTimeConstants = 6;

  GreyBoxTerms::Structure all;
  std::vector<std::uint8_t> is_rate;  ///< one per input
  CoefficientSchedule frame;          ///< without values
  std::size_t levels = 1;             ///< levels of the schedule
  std::size_t folds = 1;              ///< 1: levels are held out instead
  bool is_by_record = false;          ///< a fold is some records; else blocks or a span
  bool is_by_span = false;            ///< a fold is a contiguous fifth of the only record
  /// By sequence and sample, its fold: strokes of similar durations; empty: other folds.
  std::vector<std::vector<std::uint8_t>> kinds = {};
  std::vector<NormalEquations> cells;  ///< [level * folds + fold]
  /// For each cell, the samples beyond the first input's range in all other cells; empty unless
  /// folds are records or spans. A guard replaces the model's value there, so these samples are not used to
  /// choose terms.
  std::vector<NormalEquations> beyond;
  /// For each level, the samples next to the borders of blocks, which are fitted to in the end but
  /// are on neither side of a trial; empty: none.
  std::vector<NormalEquations> gap;
  bool is_main_chosen = false;  ///< `all` has the chosen terms of the first input, and finest banks
  bool are_banks_chosen =
      false;  ///< `all` has the finest terms of the first input, and chosen banks
  std::size_t samples = 0;
  std::size_t records = 0;  ///< with samples in use
};

/// Runs once through the data. @param schedule as `groups_by` takes it
/// @param rate_share of a rate's root mean square: where its dry friction has turned
/// @throws Error if the first input does not vary, or there are too few samples.
[[nodiscard]] GreyBoxSums gather(const TrainingData& data, const std::string& schedule,
                                 double rate_share);

/// The same for terms that have been chosen, and every bank that the other inputs may have. Where blocks
/// are held out, a tenth of each block is a gap to the next one.
/// @param chosen without banks
[[nodiscard]] GreyBoxSums gather_banks(const TrainingData& data, const std::string& schedule,
                                       const GreyBoxTerms::Structure& chosen);

/// How often the first input moves from the lower third of its range to the upper one, or back.
[[nodiscard]] std::size_t strokes_of(const TrainingData& data);

/// Sums of one record over terms that have been chosen, without banks, with its contiguous fifths as
/// folds: what they have of another motion than the rest is not in neighbouring blocks.
[[nodiscard]] GreyBoxSums gather_spans(const TrainingData& data,
                                       const GreyBoxTerms::Structure& chosen);

/// Sums over terms that have been chosen, with banks or without, with groups of strokes as folds.
[[nodiscard]] GreyBoxSums gather_strokes(const TrainingData& data,
                                         const GreyBoxTerms::Structure& chosen,
                                         const StrokeKinds& strokes);

/// Sums over every term of the first input, with groups of strokes as folds. @param rate_share as `gather` takes it
[[nodiscard]] GreyBoxSums gather_strokes(const TrainingData& data, double rate_share,
                                         const StrokeKinds& strokes);

/// As `gather`, beside banks that have been chosen, with the gaps of `gather_banks`.
[[nodiscard]] GreyBoxSums gather_beside(const TrainingData& data, const std::string& schedule,
                                        double rate_share, const std::vector<InputBank>& banks);

/// sum += sign * part
void add(NormalEquations& sum, const NormalEquations& part, double sign = 1.0);

}  // namespace torsio
