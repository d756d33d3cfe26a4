#include "export/c_coefficients.hpp"

#include <fmt/format.h>

#include <utility>
#include <vector>

namespace torsio {

CCoefficients::CCoefficients(CText& c, std::string name, const CoefficientSchedule& schedule)
    : c_(&c),
      name_(std::move(name)),
      feature_(schedule.feature),
      is_scheduled_(schedule.scheduled) {
  const Matrix& values = schedule.values;
  c.table(name_, values.values);
  if (!is_scheduled_) return;
  std::vector<double> slopes(values.values.size());
  for (std::size_t j = 0; j < values.columns; ++j) {
    std::vector<double> column;
    for (std::size_t k = 0; k < values.rows; ++k) column.push_back(values(k, j));
    const std::vector<double> own = monotone_slopes(schedule.knots, column);
    for (std::size_t k = 0; k < values.rows; ++k) slopes[k * values.columns + j] = own[k];
  }
  c.table(name_ + "_slopes", slopes);
  if (c.claim("schedule"))
    c.add(R"c(
/* A place between two rows of coefficients: a monotone cubic between knots, held beyond them. */
typedef struct {
  uint32_t left, right;
  @real weights[4];
} @place;
static @place @located(const @real *knots, uint32_t count, @real x) {
  @place at = {0U, 0U, {(@real)1, (@real)0, (@real)0, (@real)0}};
  @real h, t, u;
  if (!(x > knots[0])) return at;
  while (at.right < count && !(x < knots[at.right])) ++at.right;
  at.left = at.right - 1U;
  if (at.right == count) {
    at.right = at.left;
    return at;
  }
  h = knots[at.right] - knots[at.left];
  t = (x - knots[at.left]) / h;
  u = (@real)1 - t;
  at.weights[0] = ((@real)1 + (@real)2 * t) * u * u;
  at.weights[1] = h * t * u * u;
  at.weights[2] = t * t * ((@real)3 - (@real)2 * t);
  at.weights[3] = -h * t * t * u;
  return at;
}
static @real @interpolated(const @place *at, const @real *values, const @real *slopes,
                           uint32_t columns, uint32_t column) {
  const uint32_t left = at->left * columns + column, right = at->right * columns + column;
  return at->weights[0] * values[left] + at->weights[1] * slopes[left] +
         at->weights[2] * values[right] + at->weights[3] * slopes[right];
}
)c");
  knots_ = schedule.knots;
  if (!c.claim("at " + name_)) return;
  c.add(R"c(
static @real @$NAME$_at(const @place *at, uint32_t column) {
  return @interpolated(at, @$NAME$, @$NAME$_slopes, $COLUMNS$U, column);
}
)c",
        {{"NAME", name_}, {"COLUMNS", fmt::format("{}", values.columns)}});
}

std::string CCoefficients::locate() const {
  if (!is_scheduled_) return {};
  c_->work(CWork::schedule);
  if (c_->claim(name_ + "_knots")) c_->table(name_ + "_knots", knots_);
  return c_->filled("  const @place at = @located(@$NAME$_knots, $COUNT$U, x[$FEATURE$]);\n",
                    {{"NAME", name_},
                     {"COUNT", fmt::format("{}", knots_.size())},
                     {"FEATURE", fmt::format("{}", feature_)}});
}

std::string CCoefficients::at(const std::string& column) const {
  return c_->filled(is_scheduled_ ? "@$NAME$_at(&at, $COLUMN$)" : "@$NAME$[$COLUMN$]",
                    {{"NAME", name_}, {"COLUMN", column}});
}

}  // namespace torsio
