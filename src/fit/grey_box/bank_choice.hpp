#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/grey_box/input_bank.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// The terms of a bank: a position in each of these sequences.
struct BankChoice {
  std::size_t slips = 0;        ///< 0, 2, 4, 8 thresholds
  std::size_t forces = 0;       ///< 0: the same everywhere; else 2^forces + 1 knots
  std::size_t curve = 0;        ///< 0: none; else 2^curve + 1 knots
  std::size_t product = 0;      ///< 0: none; else 2^(product - 1) + 1 knots
  std::size_t relaxations = 0;  ///< 0 to 3 time constants
  bool is_negative = false;     ///< slip forces <= 0; else >= 0

  static constexpr std::size_t kMaxSlips = 3;  ///< the highest place, as the others
  static constexpr std::size_t kMaxForces = 2;
  static constexpr std::size_t kMaxCurve = 3;
  static constexpr std::size_t kMaxProduct = 3;
  static constexpr std::size_t kMaxRelaxations = 3;

  [[nodiscard]] bool is_empty() const noexcept {
    return slips == 0 && curve == 0 && product == 0 && relaxations == 0;
  }
  bool operator==(const BankChoice&) const = default;
};

/// A column of the finest terms is, times a factor, a part of a chosen one. With the functions by which
/// Eigen fills a sparse matrix.
struct ColumnShare {
  std::size_t from = 0;
  std::size_t to = 0;
  double factor = 1.0;

  [[nodiscard]] int row() const noexcept { return static_cast<int>(from); }
  [[nodiscard]] int col() const noexcept { return static_cast<int>(to); }
  [[nodiscard]] double value() const noexcept { return factor; }
};

/// Every bank that the inputs of these data may have, with all knots, thresholds and time constants:
/// one for each input but the first, the one that schedules (`excluded`; 0: none) and constant ones.
///
/// The thresholds are shares of half the range that the slips' coordinate covers in the recording in
/// which it moves least: friction of a part that one recording turns often and another hardly at all
/// has to be resolved in the latter.
[[nodiscard]] std::vector<InputBank> finest_banks(const TrainingData& data, std::size_t excluded);

/// What a choice keeps of the finest bank.
[[nodiscard]] InputBank bank_of(const InputBank& finest, const BankChoice& choice);

/// Columns of a chosen bank as sums of those of the finest, slips that are negative with a minus.
void add_bank_columns(std::vector<ColumnShare>& shares, const InputBank& finest,
                      std::size_t finest_first, const InputBank& chosen, std::size_t chosen_first,
                      const BankChoice& choice);

/// Adds coarse hats, expressed by fine ones, at every (from_knots - 1) / (to_knots - 1)-th knot.
/// @param factor of all of them
/// @param inner whether the outermost hats are left out on both sides
void add_hats(std::vector<ColumnShare>& shares, std::size_t from_column, std::size_t from_knots,
              std::size_t to_column, std::size_t to_knots, double factor = 1.0, bool inner = false);

/// "4 negative slip elements over the integral of ..., a curve of 5 knots over ..."
[[nodiscard]] std::string description_of(const InputBank& bank, const BankChoice& choice,
                                         const TrainingData& data);

/// `count` knots over [low, high].
[[nodiscard]] std::vector<double> evenly(double low, double high, std::size_t count);

}  // namespace torsio
