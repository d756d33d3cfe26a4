#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/common/schedule.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// A model that is linear in its coefficients, before they are fitted.
struct Design {
  Matrix columns;              ///< samples x coefficients; zero where a term is left out
  std::vector<double> target;  ///< one per sample
  std::vector<std::string>
      terms;  ///< name of each column, for messages; empty: left out on purpose
};

/// Which samples each row of coefficients is fitted to: all of them, or those at each distinct
/// value of the scheduling input.
struct Groups {
  CoefficientSchedule frame;  ///< without values
  std::string feature;        ///< expression of the scheduling input, empty if not scheduled
  std::vector<std::vector<std::size_t>> samples;
};

/// @param schedule expression of the scheduling input; empty: one group.
/// @param features samples x inputs, as `data` has them.
/// @throws UsageError if no input has that name, Error if it has less than 2 or more than 64
///          distinct values.
[[nodiscard]] Groups groups_by(const std::string& schedule, const TrainingData& data,
                               const Matrix& features);

/// The `frame` of the groups of all usable samples alone. @throws as `groups_by`
[[nodiscard]] CoefficientSchedule schedule_frame(const std::string& schedule,
                                                 const TrainingData& data);

/// The knot whose value the scheduling input has; 0 if nothing is scheduled.
[[nodiscard]] std::size_t knot_at(const CoefficientSchedule& frame,
                                  std::span<const double> features);

struct DesignFit {
  CoefficientSchedule coefficients;
  std::vector<std::string> notes;
};

/// Least squares in every group. Terms that the data of a group cannot distinguish are dropped
/// there, with a note.
/// @param is_free one per column, or empty: coefficients of columns with a 0 are constrained to be
/// >= 0
/// @throws Error if a group has fewer than `kSamplesPerTerm` samples for each term.
[[nodiscard]] DesignFit fit_design(const Design& design, const Groups& groups,
                                   std::span<const std::uint8_t> is_free = {});
inline constexpr std::size_t kSamplesPerTerm = 5;

/// The rows of the design and of the target that belong to `samples`.
[[nodiscard]] Matrix rows_of(const Matrix& matrix, std::span<const std::size_t> samples);
[[nodiscard]] std::vector<double> rows_of(const std::vector<double>& values,
                                          std::span<const std::size_t> samples);

/// Whether input j gets a linear term: it does unless it is the scheduling input or a rate that the
/// family's options do not include.
[[nodiscard]] bool has_slope(const TrainingData& data, std::size_t input, const Groups& groups,
                             bool rates);

/// Appends a note if slopes of the rates, which the design has not, would reduce the RMSE of the training to nine
/// tenths or less. At most `kSamplesOfANote` samples of each group are fitted for it.
/// @param features samples x inputs, the rows of the design
/// @param is_free as for `fit_design`
void note_on_rates(std::vector<std::string>& notes, const Design& design, const Groups& groups,
                   const TrainingData& data, const Matrix& features, std::string_view family,
                   std::span<const std::uint8_t> is_free = {});
inline constexpr std::size_t kSamplesOfANote = 20000;

/// The first input that is a rate. @throws Error that names the family if there is none.
[[nodiscard]] std::size_t first_rate(const TrainingData& data, std::string_view family);

/// Fills the columns `first`... with the inputs that `has_slope`, and names them.
void add_slopes(Design& design, std::size_t first, const TrainingData& data, const Matrix& features,
                const Groups& groups, bool rates);

}  // namespace torsio
