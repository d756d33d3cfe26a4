#include "export/graph/graph_coefficients.hpp"

#include <utility>
#include <vector>

namespace torsio {

// With t_k, the place within the k-th gap of width h_k between two knots, limited to 0..1, the monotone cubic of
// `ScheduledCoefficients` is
//
//     c = y_0 + sum_k (y_k+1 - y_k) t^2 (3 - 2 t) + h_k m_k t (1 - t)^2 - h_k m_k+1 t^2 (1 - t)
Row coefficients(GraphBuilder& graph, const CoefficientSchedule& schedule, Row x) {
  const Matrix& values = schedule.values;
  if (!schedule.scheduled || values.rows == 1) return graph.constant(values.row(0));
  const std::size_t gaps = values.rows - 1;
  Matrix rises(gaps, values.columns);
  Matrix starts(gaps, values.columns);
  Matrix ends(gaps, values.columns);
  std::vector<double> per_width;
  for (std::size_t k = 0; k < gaps; ++k)
    per_width.push_back(1.0 / (schedule.knots[k + 1] - schedule.knots[k]));
  for (std::size_t j = 0; j < values.columns; ++j) {
    std::vector<double> column;
    for (std::size_t k = 0; k < values.rows; ++k) column.push_back(values(k, j));
    const std::vector<double> slopes = monotone_slopes(schedule.knots, column);
    for (std::size_t k = 0; k < gaps; ++k) {
      rises(k, j) = column[k + 1] - column[k];
      starts(k, j) = slopes[k] / per_width[k];
      ends(k, j) = -slopes[k + 1] / per_width[k];
    }
  }
  const Row knots = graph.constant(std::span(schedule.knots).first(gaps));
  const Row t = limited((x.part(schedule.feature) - knots) * graph.constant(per_width), 0.0, 1.0);
  const Row u = 1.0 - t;
  const Row rise = t * t * (3.0 - t * 2.0);
  return graph.constant(values.row(0)) + product(rise, graph.constant(std::move(rises))) +
         product(t * u * u, graph.constant(std::move(starts))) +
         product(t * t * u, graph.constant(std::move(ends)));
}

}  // namespace torsio
