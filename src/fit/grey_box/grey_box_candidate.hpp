#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fit/grey_box/grey_box_sums.hpp"
#include "model/grey_box/grey_box.hpp"

namespace torsio {

/// The terms of a grey box: a position in each of these sequences of structures.
struct GreyBoxChoice {
  std::size_t curve = 0;      ///< 2^curve + 1 knots
  std::uint32_t slips = 0;    ///< a bit for each of the finest thresholds, the smallest first
  std::size_t forces = 0;     ///< 0: the same everywhere; else 2^forces + 1 knots
  std::size_t branches = 0;   ///< 0, 3, 6 time constants
  std::size_t smoothing = 2;  ///< λ = 1e-6, 1e-4, 1e-2
  bool is_signed = false;     ///< slip forces of any sign
  bool is_passive = false;    ///< slopes and friction of rates >= 0, too
  bool has_viscous = false;   ///< slopes of rates
  bool has_coulomb = false;   ///< tanh of rates
  std::vector<BankChoice> banks = {};  ///< one for each finest bank of the sums, or none

  static constexpr std::size_t kMaxBranches = 2;  ///< the highest place

  bool operator==(const GreyBoxChoice&) const = default;
};

/// A choice of terms, fitted to sums over the data: one small solve a fold.
class GreyBoxCandidate {
 public:
  /// @param sums must outlive this
  GreyBoxCandidate(const GreyBoxSums& sums, const GreyBoxChoice& choice);

  [[nodiscard]] const GreyBoxTerms::Structure& structure() const noexcept { return structure_; }
  /// Whether the samples suffice for its columns.
  [[nodiscard]] bool is_possible() const noexcept;

  /// Errors on what was held out.
  struct HeldOut {
    double rmse = 0.0;       ///< root mean square of all samples
    double geometric = 0.0;  ///< geometric mean of the folds' root mean squares; of levels: `rmse`
    std::vector<double> of_folds = {};  ///< root mean squares; NaN for one without samples
  };
  [[nodiscard]] HeldOut held_out() const;
  /// Fitted to all data.
  [[nodiscard]] GreyBox::Parameters fitted() const;

  /// The fit to all data, as coefficients of the finest terms, of a single level.
  [[nodiscard]] std::vector<double> finest_coefficients() const;
  /// The same of the fits to all but one fold each; empty: that of a fold without samples.
  [[nodiscard]] std::vector<std::vector<double>> finest_of_folds() const;
  /// A box of these terms. @param coefficients of the finest terms: a function that these terms can represent
  [[nodiscard]] GreyBox::Parameters with(const std::vector<double>& coefficients) const;

 private:
  /// A bank that has terms.
  struct Bank {
    std::size_t place = 0;  ///< among the finest banks
    std::size_t first = 0;  ///< column
  };

  /// As coefficients of the finest terms.
  [[nodiscard]] std::vector<double> finest(const std::vector<double>& own) const;
  [[nodiscard]] std::vector<double> solved(const NormalEquations& equations) const;
  /// Fitted to all samples but those of a fold; empty if it has none, or all.
  [[nodiscard]] std::vector<double> solved_without(const NormalEquations& fold,
                                                   const NormalEquations& all) const;
  [[nodiscard]] std::vector<NormalEquations> projected(
      const std::vector<NormalEquations>& all) const;
  [[nodiscard]] double left_out_levels(const std::vector<NormalEquations>& cells) const;
  [[nodiscard]] HeldOut left_out_folds(const std::vector<NormalEquations>& cells) const;
  /// The terms of the candidate as sums of all terms.
  [[nodiscard]] std::vector<ColumnShare> map() const;
  void add_main_columns(std::vector<ColumnShare>& shares) const;
  /// All samples of a level, those in a gap as well.
  [[nodiscard]] NormalEquations whole_level(const std::vector<NormalEquations>& cells,
                                            const std::vector<NormalEquations>& gap,
                                            std::size_t level) const;
  [[nodiscard]] NormalEquations of_level(const std::vector<NormalEquations>& cells,
                                         std::size_t level) const;

  const GreyBoxSums& sums_;
  GreyBoxChoice choice_;
  GreyBoxTerms::Structure structure_;
  std::vector<Bank> banks_;
};

}  // namespace torsio
