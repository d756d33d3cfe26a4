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

void need_lowpass(CText& c) {
  if (!c.claim("lowpass")) return;
  c.add_struct("filter",
               "A Butterworth filter of second order; its first input is its steady state.",
               {"@real band", "@real low", "int is_started"});
  c.add(R"c(
static @real @lowpass(@filter *filter, const @real *gains, @real x) {
  @real high, band, low;
  if (!@is_finite(x)) return x;
  if (!filter->is_started) {
    filter->band = (@real)0;
    filter->low = x;
    filter->is_started = 1;
  }
  high = x - filter->low;
  band = gains[0] * filter->band + gains[1] * high;
  low = filter->low + gains[1] * filter->band + gains[2] * high;
  filter->band = (@real)2 * band - filter->band;
  filter->low = (@real)2 * low - filter->low;
  if (!@is_finite(filter->band) || !@is_finite(filter->low)) filter->is_started = 0;
  return low;
}
)c");
}

void need_fixed(CText& c) {
  c.work(CWork::conversion);
  if (!c.claim("from_fixed")) return;
  c.add(R"c(
/* Both halves are converted by themselves: a processor converts 32 bits at once. */
static @real @from_fixed(int64_t value) {
  const uint64_t size = value < 0 ? (uint64_t)0 - (uint64_t)value : (uint64_t)value;
  const @real real = (@real)(uint32_t)(size >> 32U) * (@real)4294967296.0 + (@real)(uint32_t)size;
  return value < 0 ? -real : real;
}
)c");
}

void need_divided(CText& c) {
  if (!c.claim("divided")) return;
  c.add(R"c(
/* By a number below 65536, rounded towards 0, without the division of 64 bits that a small processor lacks. */
static int64_t @divided(int64_t value, uint32_t by) {
  const uint64_t size = value < 0 ? (uint64_t)0 - (uint64_t)value : (uint64_t)value;
  const uint32_t high = (uint32_t)(size >> 32U), low = (uint32_t)size;
  uint32_t rest, first, second, third, fourth;
  first = high >> 16U;
  rest = first % by;
  first /= by;
  second = (rest << 16U) | (high & 0xFFFFU);
  rest = second % by;
  second /= by;
  third = (rest << 16U) | (low >> 16U);
  rest = third % by;
  third /= by;
  fourth = ((rest << 16U) | (low & 0xFFFFU)) / by;
  {
    const int64_t result = (int64_t)((((uint64_t)((first << 16U) | second)) << 32U) | ((third << 16U) | fourth));
    return value < 0 ? -result : result;
  }
}
)c");
}

std::string counted(std::size_t number) { return fmt::format("{}U", number); }

}  // namespace torsio
