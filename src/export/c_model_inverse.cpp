#include "export/c_model_inverse.hpp"

#include <fmt/format.h>

#include <string>

#include "export/c_coefficients.hpp"
#include "export/c_grey_box_inverse.hpp"
#include "export/c_statements.hpp"
#include "model/grey_box/grey_box.hpp"
#include "model/hysteresis/operator_sum.hpp"
#include "model/linear/linear.hpp"
#include "model/linear/linear_coulomb.hpp"
#include "model/linear/polynomial.hpp"
#include "model/viscoelastic/relaxation_step.hpp"
#include "model/viscoelastic/viscoelastic.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// `detail::no_inverse`
void need_no_inverse(CText& c) {
  c.add(R"c(
/* Where a model has no inverse. */
static int @no_inverse(const @real *x, @real *inverse) {
  *inverse = @is_finite(x[0]) ? x[0] : (@real)0;
  return @MODEL_NOT_FINITE;
}
)c");
}

/// Coefficients that depend on the input that is searched.
bool depends_on_first(const CoefficientSchedule& schedule) {
  return schedule.scheduled && schedule.feature == 0;
}

void write_none(CText& c) {
  need_no_inverse(c);
  c.add(R"c(
static int @invert_model(@state *s, @real target, const @real *x, @real *inverse) {
  (void)s;
  (void)target;
  return @no_inverse(x, inverse);
}
)c");
}

/// c_0 + c_1 x_0 + sum of c_(1 + j) x_j + more = target
void write_affine(CText& c, const CCoefficients& own, std::size_t inputs, const std::string& more) {
  need_no_inverse(c);
  c.repeat_in_control({CWork::term, CWork::scheduled}, 1.0);
  c.add(R"c(
static int @invert_model(@state *s, @real target, const @real *x, @real *inverse) {
$LOCATE$  @real rest = target - $BIAS$$MORE$;
  uint32_t j;
  (void)s;
  for (j = 1U; j < $INPUTS$; ++j) rest -= $COEFFICIENT$ * x[j];
  rest /= $SLOPE$;
  if (!@is_finite(rest)) return @no_inverse(x, inverse);
  *inverse = rest;
  return @NONE;
}
)c",
        {{"LOCATE", own.locate()},
         {"BIAS", own.at("0U")},
         {"MORE", more},
         {"INPUTS", counted(inputs)},
         {"COEFFICIENT", own.at("1U + j")},
         {"SLOPE", own.at("1U")}});
}

void write_inverse_of(CText& c, const Linear::Parameters& p) {
  if (depends_on_first(p.coefficients)) return write_none(c);
  write_affine(c, CCoefficients(c, "coefficients", p.coefficients),
               p.coefficients.values.columns - 1, {});
}

void write_inverse_of(CText& c, const LinearCoulomb::Parameters& p) {
  if (depends_on_first(p.coefficients) || p.rate_feature == 0) return write_none(c);
  const CCoefficients own(c, "coefficients", p.coefficients);
  const std::size_t last = p.coefficients.values.columns - 1;
  c.work(CWork::tangent);
  write_affine(c, own, last - 1,
               c.filled(" - $C$ * @hyperbolic_tangent(x[$RATE$] * $FACTOR$)",
                        {{"C", own.at(counted(last))},
                         {"RATE", fmt::format("{}", p.rate_feature)},
                         {"FACTOR", c.number(1.0 / p.rate_scale)}}));
}

void write_inverse_of(CText& c, const Viscoelastic::Parameters& p) {
  need_no_inverse(c);
  c.work(CWork::evaluation);
  const RelaxationSpectrum spectrum = relaxation_spectrum(p.network);
  double moving = spectrum.stiffness + spectrum.damping / p.sample_period_s;
  for (const RelaxationBranch& branch : spectrum.branches)
    moving += relaxation_step(branch, p.sample_period_s).gain;
  std::string others;
  for (std::size_t j = 1; j < p.inputs; ++j)
    others += c.filled(" || !@is_finite(x[$J$])", {{"J", fmt::format("{}", j)}});
  c.add(R"c(
static int @invert_model(@state *s, @real target, const @real *x, @real *inverse) {
  const @real rest = s->model_is_started ? target - s->value_without : target - $OFFSET$;
  const @real value = rest / (s->has_moved ? $MOVING$ : $STIFFNESS$);
  if (!@is_finite(value)$OTHERS$) return @no_inverse(x, inverse);
  *inverse = value;
  return @NONE;
}
)c",
        {{"OFFSET", c.number(p.offset)},
         {"MOVING", c.number(moving)},
         {"STIFFNESS", c.number(spectrum.stiffness)},
         {"OTHERS", others}});
}

void write_inverse_of(CText& c, const Polynomial::Parameters& given) {
  const Polynomial::Parameters p = Polynomial(given).parameters();  // whose ranges are filled in
  if (depends_on_first(p.coefficients)) return write_none(c);
  const CCoefficients own(c, "coefficients", p.coefficients);
  CoefficientSchedule reach = p.coefficients;
  reach.values = p.ranges;
  const CCoefficients ranges(c, "ranges", reach);
  const std::size_t inputs = p.coefficients.values.columns - p.curve_columns();
  const double evaluations = root_evaluations(c.real()).smooth;
  c.work(CWork::evaluation, evaluations);
  c.repeat_in_control({CWork::polynomial, CWork::power, CWork::schedule, CWork::scheduled},
                      evaluations);
  const std::string at = own.is_scheduled() ? "&at, " : "";
  std::string curve = fmt::format("  const @real value = @branch({}0U, z, &is_held);\n", at);
  std::string ends = c.filled(
      "  low = ($LOW$ - $CENTRE$) * $PER_RANGE$;\n  high = ($HIGH$ - $CENTRE$) * $PER_RANGE$;\n",
      {{"LOW", ranges.at("0U")},
       {"HIGH", ranges.at("1U")},
       {"CENTRE", c.number(p.centre)},
       {"PER_RANGE", c.number(1.0 / p.half_range)}});
  if (p.by_direction) {
    curve = fmt::format(R"c(  @real value = (@real)0;
  if (s->direction >= 0) value += @branch({0}0U, z, &is_held);
  if (s->direction <= 0) value += @branch({0}1U, z, &is_held);
  if (s->direction == 0) value *= (@real)0.5;
)c",
                        at);
    ends = c.filled(R"c(  low = (@real)-1;
  high = (@real)1;
  if (s->direction != 0) {
    const uint32_t branch = s->direction > 0 ? 0U : 1U;
    low = ($LOW$ - $CENTRE$) * $PER_RANGE$;
    high = ($HIGH$ - $CENTRE$) * $PER_RANGE$;
  }
)c",
                    {{"LOW", ranges.at("2U * branch")},
                     {"HIGH", ranges.at("2U * branch + 1U")},
                     {"CENTRE", c.number(p.centre)},
                     {"PER_RANGE", c.number(1.0 / p.half_range)}});
  }
  c.add(R"c(
static @real @error_at(const @state *s, const @real *x, @real wanted, @real z) {
$LOCATE$  int is_held = 0;
$CURVE$  (void)s;
  (void)x;
  return value - wanted;
}
)c",
        {{"LOCATE", own.locate()}, {"CURVE", curve}});
  write_root(c);
  c.add(R"c(
static int @invert_model(@state *s, @real target, const @real *x, @real *inverse) {
$LOCATE$  @real low, high, error_low, error_high;
  uint32_t j;
  for (j = 1U; j < $INPUTS$; ++j) target -= $COEFFICIENT$ * x[j];
$ENDS$  error_low = @error_at(s, x, target, low);
  error_high = @error_at(s, x, target, high);
  if (!(error_low * error_high <= (@real)0)) {
    *inverse = $CENTRE$ + $RANGE$ * (@absolute(error_low) < @absolute(error_high) ? low : high);
    return @OUTSIDE_TRAINING_RANGE;
  }
  *inverse = $CENTRE$ + $RANGE$ * @root(s, x, target, low, high, error_low, error_high);
  return @NONE;
}
)c",
        {{"LOCATE", own.locate()},
         {"INPUTS", counted(inputs)},
         {"COEFFICIENT", own.at(fmt::format("{} + j", counted(p.curve_columns())))},
         {"ENDS", ends},
         {"CENTRE", c.number(p.centre)},
         {"RANGE", c.number(p.half_range)}});
}

/// `broken_line_inverse`.
template <class Operator>
void write_inverse_of(CText& c, const typename OperatorSum<Operator>::Parameters& p) {
  if (depends_on_first(p.coefficients)) return write_none(c);
  const CCoefficients own(c, "coefficients", p.coefficients);
  const std::size_t elements = p.thresholds.size();
  const std::size_t inputs = p.coefficients.values.columns - 1 - elements;
  const bool is_play = Operator::of(1.0, 0.0) != 0.0;
  const double evaluations = 3.0 + 2.0 * static_cast<double>(elements);
  c.work(CWork::evaluation, evaluations);
  c.work(CWork::evaluated, evaluations * static_cast<double>(elements));
  c.repeat_in_control({CWork::schedule, CWork::scheduled}, evaluations);
  need_no_inverse(c);
  std::string reach = "  reach = here < (@real)0 ? -here : here > (@real)0 ? here : (@real)1;\n";
  if (elements > 0)
    reach = c.filled("  reach = $R$;\n", {{"R", c.number(4.0 * p.thresholds.back())}});
  c.add(R"c(
/* The part of the output that depends on the first input, if that is z in the next step. */
static @real @curve_at(const @state *s, const @real *x, @real z) {
$LOCATE$  const @real dx = s->model_is_started ? z - s->last_x : (@real)0;
  @real value = $SLOPE$ * z;
  uint32_t i;
  (void)x;
  (void)dx;
  for (i = 0U; i < $ELEMENTS$; ++i) {
    const @real stop = @limited(s->slip[i] + dx, -@thresholds[i], @thresholds[i]);
    value += $WEIGHT$ * $OPERATOR$;
  }
  return value;
}
typedef struct {
  @real x, y;
} @point;
/* A corner of the line brings the two points around the aim together. */
static void @narrow(const @state *s, const @real *x, @real sign, @real aim, @real at, @point *below, @point *above) {
  const @real y = sign * @curve_at(s, x, at);
  if (y <= aim && at > below->x) {
    below->x = at;
    below->y = y;
  }
  if (y >= aim && at < above->x) {
    above->x = at;
    above->y = y;
  }
}
static int @invert_model(@state *s, @real target, const @real *x, @real *inverse) {
$LOCATE$  const @real here = s->model_is_started ? s->last_x : (@real)0;
  @real reach, sign, value;
  @point below, above;
  uint32_t i;
$REACH$  target -= $BIAS$;
  for (i = 1U; i < $INPUTS$; ++i) target -= $COEFFICIENT$ * x[i];
  below.x = here - reach;
  above.x = here + reach;
  below.y = @curve_at(s, x, below.x);
  above.y = @curve_at(s, x, above.x);
  if (!@is_finite(below.y + above.y)) return @no_inverse(x, inverse);
  sign = above.y < below.y ? (@real)-1 : (@real)1;
  below.y *= sign;
  above.y *= sign;
  target *= sign;
  if (!(target >= below.y) || target > above.y) {
    const int is_below = !(target >= below.y);
    const @point *end = is_below ? &below : &above;
    const @real outward = is_below ? -reach : reach;
    const @real slope = sign * @curve_at(s, x, end->x + outward) - end->y;
    value = end->x + outward * (target - end->y) / slope;
    if (slope * outward > (@real)0 && @is_finite(value)) {
      *inverse = value;
      return @NONE;
    }
    if (!(above.y < below.y || above.y > below.y)) return @no_inverse(x, inverse);
    *inverse = end->x;
    return @OUTSIDE_TRAINING_RANGE;
  }
  @narrow(s, x, sign, target, here, &below, &above);
$CORNERS$  value = above.y > below.y ? (target - below.y) / (above.y - below.y) : (@real)0.5;
  value = below.x + value * (above.x - below.x);
  if (!@is_finite(value)) return @no_inverse(x, inverse);
  *inverse = value;
  return @NONE;
}
)c",
        {{"LOCATE", own.locate()},
         {"SLOPE", own.at("1U")},
         {"ELEMENTS", counted(elements)},
         {"WEIGHT", own.at(fmt::format("{} + i", counted(1 + inputs)))},
         {"OPERATOR", is_play ? "(z - stop)" : "stop"},
         {"REACH", reach},
         {"BIAS", own.at("0U")},
         {"INPUTS", counted(inputs)},
         {"COEFFICIENT", own.at("1U + i")},
         {"CORNERS", elements == 0 ? ""
                                   : fmt::format(R"c(  for (i = 0U; i < {}; ++i) {{
    @narrow(s, x, sign, target, here + (@thresholds[i] - s->slip[i]), &below, &above);
    @narrow(s, x, sign, target, here - (@thresholds[i] + s->slip[i]), &below, &above);
  }}
)c",
                                                 counted(elements))}});
}

void write_inverse_of(CText& c, const GreyBox::Parameters& p) {
  if (depends_on_first(p.coefficients)) return write_none(c);
  write_grey_box_inverse(c, p);
}

template <class P>
bool wrote_inverse(CText& c, const AnyModel::Parameters& parameters) {
  const P* own = parameters.get_if<P>();
  if (own != nullptr) write_inverse_of(c, *own);
  return own != nullptr;
}

}  // namespace

void write_root(CText& c) {
  c.add(R"c(
static @real @root(const @state *s, const @real *x, @real wanted, @real low, @real high, @real error_low, @real error_high) {
  const @real narrow = $EPSILON$ * @larger(-low, high);
  @real at = low;
  int stayed = 0, i;
  for (i = 0; i < 100 && high - low > narrow; ++i) {
    const @real secant = (low * error_high - high * error_low) / (error_high - error_low);
    const int is_inside = secant > low && secant < high;
    @real error;
    at = is_inside && i % 8 != 7 ? secant : (@real)0.5 * (low + high);
    error = @error_at(s, x, wanted, at);
    if (!(error < (@real)0 || error > (@real)0)) break;
    if ((error < (@real)0) == (error_low < (@real)0)) {
      low = at;
      error_low = error;
      stayed = stayed > 0 ? stayed + 1 : 1;
      if (stayed > 1) error_high *= (@real)0.5;
    } else {
      high = at;
      error_high = error;
      stayed = stayed < 0 ? stayed - 1 : -1;
      if (stayed < -1) error_low *= (@real)0.5;
    }
  }
  return at;
}
)c",
        {{"EPSILON", c.real() == CReal::single ? "(@real)1.2e-7" : "(@real)2.3e-16"}});
}

void write_model_inverse(CText& c, const AnyModel::Parameters& parameters) {
  const bool is_written = wrote_inverse<Linear::Parameters>(c, parameters) ||
                          wrote_inverse<LinearCoulomb::Parameters>(c, parameters) ||
                          wrote_inverse<Polynomial::Parameters>(c, parameters) ||
                          wrote_inverse<Viscoelastic::Parameters>(c, parameters) ||
                          wrote_inverse<GreyBox::Parameters>(c, parameters);
  if (is_written) return;
  if (const auto* stops = parameters.get_if<MaxwellSlipModel::Parameters>())
    return write_inverse_of<StopOperator>(c, *stops);
  if (const auto* plays = parameters.get_if<PrandtlIshlinskii::Parameters>())
    return write_inverse_of<PlayOperator>(c, *plays);
  throw UsageError({.place = "the model",
                    .expected = "a family with an inverse",
                    .found = std::string(parameters.family()),
                    .advice = "Train one the other way round: --target spring_deflection_rad."});
}

}  // namespace torsio
