#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/model/grey_box.hpp"
#include "train/design.hpp"
#include "train/nnls.hpp"

namespace torsio {

/// Which of all possible terms a grey box has: a place on each of these ladders.
struct GreyBoxChoice {
  std::size_t curve = 0;      ///< 2^curve + 1 knots
  std::size_t slips = 0;      ///< 0, 1, 2, 4, 8 thresholds
  std::size_t forces = 0;     ///< 0: the same everywhere; else 2^forces + 1 knots
  std::size_t branches = 0;   ///< 0, 3, 6 time constants
  std::size_t smoothing = 2;  ///< λ = 1e-6, 1e-4, 1e-2
  bool is_signed = false;     ///< slip forces of any sign
  bool has_viscous = false;   ///< slopes of rates
  bool has_coulomb = false;   ///< tanh of rates

  bool operator==(const GreyBoxChoice&) const = default;
};

/// Everything that a choice may take from, and the sums over the data that tell how good it is.
class GreyBoxSearch {
 public:
  /// Runs once through the data. @param schedule as `groups_by` takes it
  GreyBoxSearch(const TrainingData& data, const std::string& schedule);

  struct Candidate {
    GreyBoxChoice choice;
    double held_out_error = 0.0;  ///< root mean square
  };
  /// @param passive never signed
  [[nodiscard]] Candidate choose(bool passive, const Progress& progress) const;

  /// Root mean square error on what was held out.
  [[nodiscard]] double held_out_error(const GreyBoxChoice& choice) const;

  /// Fitted to all data. Thresholds and time constants without force are left out.
  [[nodiscard]] GreyBox::Parameters fitted(const GreyBoxChoice& choice) const;

  /// "17 knots, 4 slip elements with 5 knots, ..."
  [[nodiscard]] std::string description_of(const GreyBoxChoice& choice) const;
  [[nodiscard]] const char* what_was_held_out() const;

 private:
  [[nodiscard]] GreyBoxTerms::Structure structure_of(const GreyBoxChoice& choice) const;
  [[nodiscard]] bool is_possible(const GreyBoxChoice& choice) const;
  [[nodiscard]] std::vector<double> solved(const GreyBoxChoice& choice,
                                           const NormalEquations& equations) const;
  [[nodiscard]] std::vector<NormalEquations> projected(const GreyBoxChoice& choice) const;
  [[nodiscard]] double left_out_levels(const GreyBoxChoice& choice,
                                       const std::vector<NormalEquations>& cells) const;
  [[nodiscard]] double left_out_folds(const GreyBoxChoice& choice,
                                      const std::vector<NormalEquations>& cells) const;

  GreyBoxTerms::Structure all_;  ///< every knot, threshold and time constant
  std::vector<std::uint8_t> is_rate_;
  CoefficientSchedule frame_;  ///< without values
  std::size_t levels_ = 1;
  std::size_t folds_ = 1;
  bool is_by_record_ = false;
  std::vector<NormalEquations> cells_;  ///< [level * folds + fold], of all terms
  std::size_t samples_ = 0;
};

}  // namespace torsio
