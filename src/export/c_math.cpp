#include "export/c_math.hpp"

#include <array>

namespace torsio {
namespace {

// A comparison with a NaN is false.

constexpr std::string_view kIsFinite = R"c(
static int @is_finite(@real x) { return x - x == (@real)0; }
)c";
constexpr std::string_view kAbsolute = R"c(
static @real @absolute(@real x) { return x < (@real)0 ? -x : x; }
)c";
constexpr std::string_view kSmaller = R"c(
static @real @smaller(@real a, @real b) { return b < a ? b : a; }
)c";
constexpr std::string_view kLarger = R"c(
static @real @larger(@real a, @real b) { return a < b ? b : a; }
)c";
constexpr std::string_view kLimited = R"c(
static @real @limited(@real x, @real low, @real high) {
  if (x < low) return low;
  return x > high ? high : x;
}
)c";
constexpr std::string_view kHypotenuse = R"c(
static @real @hypotenuse(@real a, @real b) { return @square_root(a * a + b * b); }
)c";
constexpr std::string_view kWholePower = R"c(
static @real @whole_power(@real base, uint32_t exponent) {
  @real result = (@real)1;
  for (; exponent > 0U; exponent >>= 1U) {
    if ((exponent & 1U) != 0U) result *= base;
    base *= base;
  }
  return result;
}
)c";
constexpr std::string_view kPower = R"c(
static @real @power(@real base, @real exponent) {
  if (exponent == (@real)0) return (@real)1;
  if (base > (@real)0) return @exponential(exponent * @logarithm(base));
  if (base == (@real)0 && exponent > (@real)0) return (@real)0;
  return @not_a_number();
}
)c";
constexpr std::string_view kFloatTangent = R"c(
/* The hyperbolic tangent, x P(x^2) / Q(x^2): relative error 2.1e-8 before rounding. */
static float @float_tangent(float x) {
  float square, above, below;
  if (x > 9.0F) x = 9.0F;
  if (x < -9.0F) x = -9.0F;
  square = x * x;
  above = 1.33547570e-08F;
  above = above * square + 2.06091563e-05F;
  above = above * square + 3.49559281e-03F;
  above = above * square + 1.33810296e-01F;
  above = above * square + 9.99999979e-01F;
  below = 7.77659893e-07F;
  below = below * square + 3.28564235e-04F;
  below = below * square + 2.58770002e-02F;
  below = below * square + 4.67143452e-01F;
  below = below * square + 1.0F;
  return x * above / below;
}
)c";
constexpr std::string_view kCosine = R"c(
static @real @cosine(@real x) { return @sine_from(x, 1); }
)c";
constexpr std::string_view kSingleNotANumber = R"c(
static @real @not_a_number(void) {
  union { uint32_t bits; float value; } number;
  number.bits = 0x7FC00000U;
  return number.value;
}
)c";
constexpr std::string_view kSingleSquareRoot = R"c(
static @real @square_root(@real x) {
  union { float value; uint32_t bits; } guess;
  float y;
  if (x < 0.0F) return @not_a_number();
  if (!(x > 0.0F && x < 3.0e38F)) return x;
  guess.value = x;
  guess.bits = 0x5F375A86U - (guess.bits >> 1U);
  y = guess.value;
  y *= 1.5F - 0.5F * x * y * y;
  y *= 1.5F - 0.5F * x * y * y;
  y *= x;
  return 0.5F * (y + x / y);
}
)c";
constexpr std::string_view kSingleExponential = R"c(
static @real @exponential(@real x) {
  union { uint32_t bits; float value; } scale;
  float rest, sum;
  int32_t whole;
  if (!(x < 88.0F)) return x > 88.0F ? 3.0e38F : x;
  if (x < -87.0F) return 0.0F;
  whole = (int32_t)(x * 1.44269504F + (x < 0.0F ? -0.5F : 0.5F));
  rest = x - (float)whole * 0.693359375F + (float)whole * 2.12194440e-4F;
  sum = 1.98412698e-4F;
  sum = sum * rest + 1.38888889e-3F;
  sum = sum * rest + 8.33333333e-3F;
  sum = sum * rest + 4.16666667e-2F;
  sum = sum * rest + 1.66666667e-1F;
  sum = sum * rest + 0.5F;
  sum = sum * rest + 1.0F;
  sum = sum * rest + 1.0F;
  scale.bits = (uint32_t)(whole + 127) << 23U;
  return sum * scale.value;
}
)c";
constexpr std::string_view kSingleLogarithm = R"c(
/* Of a positive number that is not denormal. */
static @real @logarithm(@real x) {
  union { float value; uint32_t bits; } number;
  float s, square, sum;
  int32_t exponent;
  number.value = x;
  exponent = (int32_t)(number.bits >> 23U) - 127;
  number.bits = (number.bits & 0x007FFFFFU) | 0x3F800000U;
  if (number.value > 1.41421356F) {
    number.value *= 0.5F;
    ++exponent;
  }
  s = (number.value - 1.0F) / (number.value + 1.0F);
  square = s * s;
  sum = 0.222222222F;
  sum = sum * square + 0.285714286F;
  sum = sum * square + 0.4F;
  sum = sum * square + 0.666666667F;
  sum = sum * square + 2.0F;
  return s * sum + (float)exponent * 0.693147181F;
}
)c";
constexpr std::string_view kSingleHyperbolicTangent = R"c(
static @real @hyperbolic_tangent(@real x) { return @float_tangent(x); }
)c";
constexpr std::string_view kSingleSine = R"c(
/* The sine of x and of so many quarters of a turn more; |x| up to 1e4. */
static @real @sine_from(@real x, int32_t quarters) {
  float rest, square, sum;
  int32_t turns;
  if (!(x > -1.0e4F && x < 1.0e4F)) return @not_a_number();
  turns = (int32_t)(x * 0.636619772F + (x < 0.0F ? -0.5F : 0.5F));
  rest = x - (float)turns * 1.5703125F;
  rest -= (float)turns * 4.83751297e-4F;
  rest -= (float)turns * 7.54978995e-8F;
  square = rest * rest;
  quarters += turns;
  if ((quarters & 1) != 0) {
    sum = 2.48015873e-5F;
    sum = sum * square - 1.38888889e-3F;
    sum = sum * square + 4.16666667e-2F;
    sum = sum * square - 0.5F;
    sum = sum * square + 1.0F;
  } else {
    sum = 2.75573192e-6F;
    sum = sum * square - 1.98412698e-4F;
    sum = sum * square + 8.33333333e-3F;
    sum = sum * square - 1.66666667e-1F;
    sum = (sum * square + 1.0F) * rest;
  }
  return (quarters & 2) != 0 ? -sum : sum;
}
static @real @sine(@real x) { return @sine_from(x, 0); }
)c";
constexpr std::string_view kSingleArcTangent = R"c(
static @real @arc_tangent(@real x) {
  const float size = x < 0.0F ? -x : x;
  float base = 0.0F, t = size, square, sum;
  if (size > 2.41421356F) {
    base = 1.57079633F;
    t = -1.0F / size;
  } else if (size > 0.414213562F) {
    base = 0.785398163F;
    t = (size - 1.0F) / (size + 1.0F);
  }
  square = t * t;
  sum = 8.05374449e-2F;
  sum = sum * square - 1.38776856e-1F;
  sum = sum * square + 1.99777106e-1F;
  sum = sum * square - 3.33329491e-1F;
  sum = base + (sum * square + 1.0F) * t;
  return x < 0.0F ? -sum : sum;
}
)c";
constexpr std::string_view kDoubleNotANumber = R"c(
static @real @not_a_number(void) {
  union { uint64_t bits; double value; } number;
  number.bits = UINT64_C(0x7FF8000000000000);
  return number.value;
}
)c";
constexpr std::string_view kDoubleSquareRoot = R"c(
static @real @square_root(@real x) {
  union { double value; uint64_t bits; } guess;
  double y;
  if (x < 0.0) return @not_a_number();
  if (!(x > 0.0 && x < 1.0e308)) return x;
  guess.value = x;
  guess.bits = UINT64_C(0x5FE6EB50C7B537A9) - (guess.bits >> 1U);
  y = guess.value;
  y *= 1.5 - 0.5 * x * y * y;
  y *= 1.5 - 0.5 * x * y * y;
  y *= 1.5 - 0.5 * x * y * y;
  y *= x;
  return 0.5 * (y + x / y);
}
)c";
constexpr std::string_view kDoubleExponential = R"c(
static @real @exponential(@real x) {
  union { uint64_t bits; double value; } scale;
  double rest, sum;
  int32_t whole, term;
  if (!(x < 709.0)) return x > 709.0 ? 1.0e308 : x;
  if (x < -708.0) return 0.0;
  whole = (int32_t)(x * 1.4426950408889634 + (x < 0.0 ? -0.5 : 0.5));
  rest = x - (double)whole * 0.693145751953125 - (double)whole * 1.4286068203094172e-6;
  sum = 1.0;
  for (term = 14; term > 0; --term) sum = 1.0 + sum * rest / (double)term;
  scale.bits = (uint64_t)(whole + 1023) << 52U;
  return sum * scale.value;
}
)c";
constexpr std::string_view kDoubleLogarithm = R"c(
/* Of a positive number that is not denormal. */
static @real @logarithm(@real x) {
  union { double value; uint64_t bits; } number;
  double s, square, sum = 0.0;
  int32_t exponent, term;
  number.value = x;
  exponent = (int32_t)(number.bits >> 52U) - 1023;
  number.bits = (number.bits & UINT64_C(0x000FFFFFFFFFFFFF)) | UINT64_C(0x3FF0000000000000);
  if (number.value > 1.4142135623730951) {
    number.value *= 0.5;
    ++exponent;
  }
  s = (number.value - 1.0) / (number.value + 1.0);
  square = s * s;
  for (term = 21; term > 0; term -= 2) sum = sum * square + 2.0 / (double)term;
  return s * sum + (double)exponent * 0.6931471805599453;
}
)c";
constexpr std::string_view kDoubleHyperbolicTangent = R"c(
/* x P(x^2) / Q(x^2): relative error 2.1e-8. */
static @real @hyperbolic_tangent(@real x) {
  double square, above, below;
  if (x > 9.0) x = 9.0;
  if (x < -9.0) x = -9.0;
  square = x * x;
  above = 1.33547570e-08;
  above = above * square + 2.06091563e-05;
  above = above * square + 3.49559281e-03;
  above = above * square + 1.33810296e-01;
  above = above * square + 9.99999979e-01;
  below = 7.77659893e-07;
  below = below * square + 3.28564235e-04;
  below = below * square + 2.58770002e-02;
  below = below * square + 4.67143452e-01;
  below = below * square + 1.0;
  return x * above / below;
}
)c";
constexpr std::string_view kDoubleSine = R"c(
/* The sine of x and of so many quarters of a turn more; |x| up to 1e6. */
static @real @sine_from(@real x, int32_t quarters) {
  double rest, square, sum = 1.0;
  int32_t turns, term;
  if (!(x > -1.0e6 && x < 1.0e6)) return @not_a_number();
  turns = (int32_t)(x * 0.63661977236758134 + (x < 0.0 ? -0.5 : 0.5));
  rest = x - (double)turns * 1.5707963267341256 - (double)turns * 6.0771005065061922e-11;
  square = rest * rest;
  quarters += turns;
  if ((quarters & 1) != 0) {
    for (term = 16; term > 0; term -= 2) sum = 1.0 - sum * square / (double)(term * (term - 1));
  } else {
    for (term = 17; term > 1; term -= 2) sum = 1.0 - sum * square / (double)(term * (term - 1));
    sum *= rest;
  }
  return (quarters & 2) != 0 ? -sum : sum;
}
static @real @sine(@real x) { return @sine_from(x, 0); }
)c";
constexpr std::string_view kDoubleArcTangent = R"c(
static @real @arc_tangent(@real x) {
  const double size = x < 0.0 ? -x : x;
  double base = 0.0, t = size, square, sum = 0.0;
  int32_t term;
  if (size > 2.4142135623730950) {
    base = 1.5707963267948966;
    t = -1.0 / size;
  } else if (size > 0.41421356237309503) {
    base = 0.78539816339744831;
    t = (size - 1.0) / (size + 1.0);
  }
  square = t * t;
  for (term = 41; term > 0; term -= 2) sum = 1.0 / (double)term - sum * square;
  sum = base + sum * t;
  return x < 0.0 ? -sum : sum;
}
)c";

constexpr std::array kSingleLibrary =
    std::to_array<CMathFunction>({{"@not_a_number(", kSingleNotANumber},
                                  {"@is_finite(", kIsFinite},
                                  {"@absolute(", kAbsolute},
                                  {"@smaller(", kSmaller},
                                  {"@larger(", kLarger},
                                  {"@limited(", kLimited},
                                  {"@square_root(", kSingleSquareRoot},
                                  {"@hypotenuse(", kHypotenuse},
                                  {"@whole_power(", kWholePower},
                                  {"@exponential(", kSingleExponential},
                                  {"@logarithm(", kSingleLogarithm},
                                  {"@power(", kPower},
                                  {"@float_tangent(", kFloatTangent},
                                  {"@hyperbolic_tangent(", kSingleHyperbolicTangent},
                                  {"@sine", kSingleSine},
                                  {"@cosine(", kCosine},
                                  {"@arc_tangent(", kSingleArcTangent}});
constexpr std::array kDoubleLibrary =
    std::to_array<CMathFunction>({{"@not_a_number(", kDoubleNotANumber},
                                  {"@is_finite(", kIsFinite},
                                  {"@absolute(", kAbsolute},
                                  {"@smaller(", kSmaller},
                                  {"@larger(", kLarger},
                                  {"@limited(", kLimited},
                                  {"@square_root(", kDoubleSquareRoot},
                                  {"@hypotenuse(", kHypotenuse},
                                  {"@whole_power(", kWholePower},
                                  {"@exponential(", kDoubleExponential},
                                  {"@logarithm(", kDoubleLogarithm},
                                  {"@power(", kPower},
                                  {"@float_tangent(", kFloatTangent},
                                  {"@hyperbolic_tangent(", kDoubleHyperbolicTangent},
                                  {"@sine", kDoubleSine},
                                  {"@cosine(", kCosine},
                                  {"@arc_tangent(", kDoubleArcTangent}});

}  // namespace

std::span<const CMathFunction> c_math(CReal real) {
  if (real == CReal::single) return kSingleLibrary;
  return kDoubleLibrary;
}

}  // namespace torsio
