#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "numerics/nnls.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// Sums over a part of a recording, from which any fit of a quick model and its error on this part
/// follow without the samples.
struct BlockSums {
  NormalEquations sums;
  double target_sum = 0.0;

  explicit BlockSums(std::size_t columns) : sums(columns) {}
  [[nodiscard]] std::size_t samples() const noexcept { return sums.rows; }
};

/// A condition that is constant in each recording.
struct ConditionValues {
  std::string name;
  std::vector<double> of_recording;  ///< in the order of `TrainingData::sequences`
};

/// A model of the target that is linear in its parameters, so that hundreds of fits take less than
/// a second: elastic curve, slip elements, relaxation and slopes over the other inputs,
///
///     y = b + k z + sum k_i max(z - z_i, 0) + sum c_j s_j (1 + m_j |z|) + sum d_l (z - P_l z)
///         + sum (a_m u_m + b_m tanh u_m) + sum (e_q + f_q z) c_q
///
/// z is the first input by its range, s_j a stop operator (`SlipBank`), P_l a first-order low-pass,
/// u_m another input by its root mean square, c_q a condition. c_j, d_l and m_j are at least 0. It
/// shows where data are missing; it is not a family.
class QuickModel {
 public:
  /// @param lowest, highest of the first input: z is -1 and 1 there
  QuickModel(const TrainingData& data, const std::vector<ConditionValues>& conditions,
             double lowest, double highest);

  [[nodiscard]] std::size_t columns() const noexcept { return is_free_.size(); }

  /// The sums over the usable samples of each block of a sequence.
  /// @param ends first sample after each block, in order; the last is the sequence's length
  [[nodiscard]] std::vector<BlockSums> blocks(const TrainingData& data, std::size_t sequence,
                                              const std::vector<std::size_t>& ends) const;

  using Coefficients = std::vector<double>;
  [[nodiscard]] Coefficients fit(const NormalEquations& sums) const;
  /// Only b, k z and the inputs that are not rates: the fallback of a guard (`linear_fallback`).
  [[nodiscard]] Coefficients fit_linear(const NormalEquations& sums) const;

 private:
  class Rows;

  [[nodiscard]] Coefficients solve(const NormalEquations& sums,
                                   const std::vector<std::uint8_t>& used) const;

  const std::vector<ConditionValues>& conditions_;
  double middle_ = 0.0;
  double half_range_ = 1.0;
  std::vector<double> input_rms_;
  std::vector<double> condition_middle_;
  std::vector<double> condition_half_range_;
  std::vector<std::uint8_t> is_free_;
  std::vector<std::uint8_t> is_linear_;
};

/// Adds the sums of `more`.
void add_sums(NormalEquations& sums, const NormalEquations& more) noexcept;

}  // namespace torsio
