#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// Coefficients of a model that may depend on one of its inputs, as plain data.
///
/// Not scheduled: one row of values and no knots. Scheduled: row k holds for the knot k of the
/// scheduling feature, between the knots each column is interpolated, outside it is held.
struct CoefficientSchedule {
  bool scheduled = false;
  std::size_t feature = 0;         ///< which input schedules; read only if `scheduled`
  std::vector<double> knots = {};  ///< strictly ascending, in the feature's unit
  Matrix values = {};              ///< knots (or 1) x coefficients

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("scheduled", self.scheduled);
    visit("feature", self.feature);
    visit("knots", self.knots);
    visit("values", self.values);
  }
  bool operator==(const CoefficientSchedule&) const = default;
};

/// The same, ready to be evaluated in the loop: a monotone cubic of the scheduling feature s,
///
///     c(s) = h00 y_k + h10 h m_k + h01 y_k+1 + h11 h m_k+1,   t = (s - s_k) / h,  h = s_k+1 - s_k
///
/// with the Hermite basis h00 = (1 + 2t)(1 - t)^2, h10 = t (1 - t)^2, h01 = t^2 (3 - 2t),
/// h11 = t^2 (t - 1) and slopes m by weighted harmonic means, so that no column overshoots its
/// knots. Source: Fritsch & Butland 1984 (the rule known as PCHIP). Nothing here allocates after
/// construction.
class ScheduledCoefficients {
 public:
  /// @param place what the error messages name, usually the family.
  /// @throws Error unless there is one row for each knot (one in all if not scheduled), everything
  /// is finite, the knots ascend and the scheduling feature is one of the `input_count` inputs.
  ScheduledCoefficients(CoefficientSchedule schedule, std::size_t input_count,
                        std::string_view place);

  [[nodiscard]] const CoefficientSchedule& schedule() const noexcept { return schedule_; }
  [[nodiscard]] std::size_t size() const noexcept { return schedule_.values.columns; }

  /// Position of the features between the knots; computed once per tick for all coefficients.
  struct Position {
    std::size_t left = 0;                       ///< row of the knot below
    std::size_t right = 0;                      ///< row of the knot above
    std::array<double, 4> weights{1, 0, 0, 0};  ///< weights of y_left, m_left, y_right, m_right
  };
  [[nodiscard]] Position locate(Features features) const noexcept TORSIO_REALTIME;

  [[nodiscard]] double coefficient(const Position& at, std::size_t column) const noexcept {
    return at.weights[0] * schedule_.values(at.left, column) +
           at.weights[1] * slopes_(at.left, column) +
           at.weights[2] * schedule_.values(at.right, column) +
           at.weights[3] * slopes_(at.right, column);
  }

  /// All coefficients at once. @param out `size()` values.
  void evaluate(Features features, std::span<double> out) const noexcept TORSIO_REALTIME;

  /// sum_j c_(first + j) x_j over j = `from` and above
  [[nodiscard]] double weighted_sum(const Position& at, std::size_t first, Features features,
                                    std::size_t from = 0) const noexcept TORSIO_REALTIME;

  /// Largest absolute value of a coefficient over the schedule.
  [[nodiscard]] double largest(std::size_t column) const noexcept;

  /// Number of fitted parameters: a column that is zero at every knot has no term and is not
  /// counted.
  [[nodiscard]] std::size_t fitted_count() const noexcept;

 private:
  CoefficientSchedule schedule_;
  Matrix slopes_;  ///< knots x coefficients, per unit of the scheduling feature
};

/// Slopes of the monotone cubic through (knots, values), by the rule above; one value has slope 0.
[[nodiscard]] std::vector<double> monotone_slopes(std::span<const double> knots,
                                                  std::span<const double> values);

}  // namespace torsio
