#include "export/c_statements.hpp"

#include <fmt/format.h>

namespace torsio {

void need_cell(CText& c) {
  if (!c.claim("cell")) return;
  c.add(R"c(
static uint32_t @cell(const @real *knots, uint32_t count, @real x, @real *share) {
  uint32_t left = 0U, right = count - 1U;
  while (right - left > 1U) {
    const uint32_t middle = (left + right) / 2U;
    if (x < knots[middle])
      right = middle;
    else
      left = middle;
  }
  *share = (x - knots[left]) / (knots[right] - knots[left]);
  return left;
}
)c");
}

std::string cleared(CText& c, const std::string& array, std::size_t count) {
  if (c.claim("clear"))
    c.add(R"c(
/* Volatile, so that no compiler makes it a call of memset. */
static void @clear(volatile @real *values, uint32_t count) {
  while (count > 0U) values[--count] = (@real)0;
}
)c");
  return fmt::format("  @clear({}, {});\n", array, counted(count));
}

std::string cleared_floats(CText& c, const std::string& array, std::size_t count) {
  if (c.real() == CReal::single) return cleared(c, array, count);
  if (c.claim("clear_floats"))
    c.add(R"c(
/* Volatile, so that no compiler makes it a call of memset. */
static void @clear_floats(volatile float *values, uint32_t count) {
  while (count > 0U) values[--count] = 0.0F;
}
)c");
  return fmt::format("  @clear_floats({}, {});\n", array, counted(count));
}

std::string counted(std::size_t number) { return fmt::format("{}U", number); }

}  // namespace torsio
