#include "export/c_models.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "export/c_coefficients.hpp"
#include "export/c_grey_box.hpp"
#include "export/c_kernel.hpp"
#include "export/c_networks.hpp"
#include "export/c_statements.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "model/grey_box/grey_box.hpp"
#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "model/hysteresis/operator_sum.hpp"
#include "model/linear/linear.hpp"
#include "model/linear/linear_coulomb.hpp"
#include "model/linear/polynomial.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "model/viscoelastic/relaxation_step.hpp"
#include "model/viscoelastic/viscoelastic.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::string_view kFamilies =
    "linear, linear_coulomb, polynomial, maxwell_slip, prandtl_ishlinskii, grey_box, mlp, gru, "
    "lstm, parametric_gp, "
    "viscoelastic, hammerstein_wiener";

void write_reset(CText& c, const std::string& body) {
  c.add(R"c(
static void @reset_model(@state *s) {
$BODY$}
)c",
        {{"BODY", body.empty() ? "  (void)s;\n" : body}});
}

/// A model whose body computes `value`. @param head declarations @param body statements
void write_value(CText& c, const std::string& head, const std::string& body) {
  const bool uses_state = (head + body).find("s->") != std::string::npos ||
                          (head + body).find("(s, ") != std::string::npos;
  c.add(R"c(
static @estimate @model(@state *s, const @real *x) {
$HEAD$$UNUSED$$BODY$  return @plain(value);
}
)c",
        {{"HEAD", head}, {"UNUSED", uses_state ? "" : "  (void)s;\n"}, {"BODY", body}});
}

/// value += sum of c_(first + j) x_j
std::string weighted_sum(CText& text, const CCoefficients& c, std::size_t first,
                         std::size_t inputs) {
  text.work(c.is_scheduled() ? CWork::scheduled : CWork::term, static_cast<double>(inputs) + 1.0);
  return fmt::format("  for (j = 0U; j < {}; ++j) value += {} * x[j];\n", counted(inputs),
                     c.at(fmt::format("{} + j", counted(first))));
}

void write(CText& c, const Linear::Parameters& p) {
  const CCoefficients own(c, "coefficients", p.coefficients);
  write_reset(c, {});
  write_value(
      c, own.locate() + c.filled("  @real value = $B$;\n  uint32_t j;\n", {{"B", own.at("0U")}}),
      weighted_sum(c, own, 1, p.coefficients.values.columns - 1));
}

void write(CText& c, const LinearCoulomb::Parameters& p) {
  c.work(CWork::tangent);
  const CCoefficients own(c, "coefficients", p.coefficients);
  const std::size_t last = p.coefficients.values.columns - 1;
  write_reset(c, {});
  write_value(
      c, own.locate() + c.filled("  @real value = $B$;\n  uint32_t j;\n", {{"B", own.at("0U")}}),
      weighted_sum(c, own, 1, last - 1) +
          c.filled("  value += $C$ * @hyperbolic_tangent(x[$RATE$] * $FACTOR$);\n",
                   {{"C", own.at(counted(last))},
                    {"RATE", fmt::format("{}", p.rate_feature)},
                    {"FACTOR", c.number(1.0 / p.rate_scale)}}));
}

/// The ranges of a polynomial's curves as a schedule over the knots of its coefficients.
CoefficientSchedule ranges_of(const Polynomial::Parameters& p) {
  CoefficientSchedule schedule = p.coefficients;
  schedule.values = p.ranges;
  return schedule;
}

void write(CText& c, const Polynomial::Parameters& given) {
  const Polynomial::Parameters p = Polynomial(given).parameters();  // whose ranges are filled in
  const CCoefficients own(c, "coefficients", p.coefficients);
  const CCoefficients ranges(c, "ranges", ranges_of(p));
  const std::size_t inputs = p.coefficients.values.columns - p.curve_columns();
  c.work(CWork::polynomial);
  c.work(own.is_scheduled() ? CWork::scheduled : CWork::power, static_cast<double>(p.degree + 1));
  if (own.is_scheduled()) c.work(CWork::scheduled, 2.0);
  if (p.by_direction) c.work(CWork::direction);
  const std::string place = own.is_scheduled() ? "const @place *at, " : "";
  const auto inside = [](std::string text) {  // `at` is a pointer in the function of a branch
    for (std::size_t i = text.find("&at"); i != std::string::npos; i = text.find("&at"))
      text.replace(i, 3, "at");
    return text;
  };
  c.add(R"c(
/* One of the curves; held more than a border outside its own range. */
static @real @branch($PLACE$uint32_t branch, @real z, int *is_held) {
  const @real low = ($LOW$ - $CENTRE$) * $PER_RANGE$;
  const @real high = ($HIGH$ - $CENTRE$) * $PER_RANGE$;
  const @real border = $BORDER$ * (high - low);
  const @real held = @limited(z, low - border, high + border);
  @real value = (@real)0;
  uint32_t i;
  if (held < z || held > z) *is_held = 1;
  for (i = $TERMS$; i > 0U; --i) value = value * held + $COEFFICIENT$;
  return value;
}
)c",
        {{"PLACE", place},
         {"LOW", inside(ranges.at("2U * branch"))},
         {"HIGH", inside(ranges.at("2U * branch + 1U"))},
         {"CENTRE", c.number(p.centre)},
         {"PER_RANGE", c.number(1.0 / p.half_range)},
         {"BORDER", c.number(Polynomial::kBorder)},
         {"TERMS", counted(p.degree + 1)},
         {"COEFFICIENT",
          inside(own.at(fmt::format("branch * {} + i - 1U", counted(p.degree + 1))))}});
  const std::string at = own.is_scheduled() ? "&at, " : "";
  std::string direction;
  std::string curve = fmt::format("  value = @branch({}0U, z, &is_held);\n", at);
  if (p.by_direction) {
    c.member("@real lowest_x");
    c.member("@real highest_x");
    c.member("int direction_is_started");
    c.member("int direction");
    direction = R"c(  if (!s->direction_is_started) s->lowest_x = s->highest_x = x[0];
  s->direction_is_started = 1;
  if (x[0] < s->lowest_x) s->lowest_x = x[0];
  if (x[0] > s->highest_x) s->highest_x = x[0];
  if (s->direction != 1 && x[0] - s->lowest_x > $BAND$) {
    s->direction = 1;
    s->highest_x = x[0];
  } else if (s->direction != -1 && s->highest_x - x[0] > $BAND$) {
    s->direction = -1;
    s->lowest_x = x[0];
  }
)c";
    curve = fmt::format(R"c(  value = (@real)0;
  if (s->direction >= 0) value += @branch({0}0U, z, &is_held);
  if (s->direction <= 0) value += @branch({0}1U, z, &is_held);
  if (s->direction == 0) value *= (@real)0.5;
)c",
                        at);
  }
  write_reset(c, p.by_direction ? "  s->direction_is_started = 0;\n  s->direction = 0;\n" : "");
  c.add(R"c(
static @estimate @model(@state *s, const @real *x) {
$LOCATE$  const @real z = (x[0] - $CENTRE$) * $PER_RANGE$;
  @estimate out;
  @real value;
  int is_held = 0;
  uint32_t j;
$UNUSED$$DIRECTION$$CURVE$$SUM$  out = @plain(value);
  if (is_held) out.fault = @OUTSIDE_TRAINING_RANGE;
  return out;
}
)c",
        {{"LOCATE", own.locate()},
         {"UNUSED", p.by_direction ? "" : "  (void)s;\n"},
         {"DIRECTION", direction},
         {"CURVE", curve},
         {"SUM", weighted_sum(c, own, p.curve_columns(), inputs)},
         {"BAND", c.number(p.dead_band)},
         {"CENTRE", c.number(p.centre)},
         {"PER_RANGE", c.number(1.0 / p.half_range)}});
}

template <class Operator>
void write(CText& c, const typename OperatorSum<Operator>::Parameters& p) {
  const CCoefficients own(c, "coefficients", p.coefficients);
  const std::size_t elements = p.thresholds.size();
  const std::size_t inputs = p.coefficients.values.columns - 1 - elements;
  c.work(CWork::element, static_cast<double>(elements));
  c.work(own.is_scheduled() ? CWork::scheduled : CWork::term, static_cast<double>(elements));
  c.table("thresholds", p.thresholds);
  c.member(fmt::format("@real slip[{}]", std::max<std::size_t>(elements, 1)));
  c.member("@real last_x");
  c.member("int model_is_started");
  write_reset(c, cleared(c, "s->slip", elements) + "  s->model_is_started = 0;\n");
  // The play operator of an element is what its stop leaves of the input.
  const bool is_play = Operator::of(1.0, 0.0) != 0.0;
  write_value(c,
              own.locate() +
                  c.filled(R"c(  const @real dx = s->model_is_started ? x[0] - s->last_x : (@real)0;
  @real value = $B$;
  uint32_t i, j;
)c",
                           {{"B", own.at("0U")}}),
              "  s->last_x = x[0];\n  s->model_is_started = 1;\n" +
                  weighted_sum(c, own, 1, inputs) +
                  fmt::format(R"c(  for (i = 0U; i < {0}; ++i) {{
    s->slip[i] = @limited(s->slip[i] + dx, -@thresholds[i], @thresholds[i]);
    value += {1} * {2};
  }}
)c",
                              counted(elements), own.at(fmt::format("{} + i", counted(1 + inputs))),
                              is_play ? "(x[0] - s->slip[i])" : "s->slip[i]"));
}

void write(CText& c, const Mlp::Parameters& p) {
  const std::string in = standardised(c, "input", p.scaling, "x", "in");
  c.local_floats(p.scaling.inputs.centre.size());
  write_dense(c, "network", p.layers);
  write_reset(c, {});
  write_value(c,
              fmt::format("  float in[{}];\n  @real value;\n  uint32_t j;\n",
                          p.scaling.inputs.centre.size()),
              in + fmt::format("  value = {};\n", destandardised(c, p.scaling, "@network(in)")));
}

template <class Layer>
void write_recurrent_model(CText& c, const RecurrentParameters<Layer>& p) {
  const std::string in = standardised(c, "input", p.scaling, "x", "in");
  c.local_floats(p.scaling.inputs.centre.size());
  std::string steps;
  std::string reset;
  std::string from = "in";
  for (std::size_t i = 0; i < p.layers.size(); ++i) {
    const std::string name = fmt::format("layer_{}", i);
    write_recurrent(c, name, p.layers[i]);
    steps += fmt::format("  @{}(s, {});\n", name, from);
    from = fmt::format("s->{}_hidden", name);
    const bool has_cell = std::is_same_v<Layer, LstmLayer>;
    reset += cleared_floats(c, from, p.layers[i].units());
    if (has_cell) reset += cleared_floats(c, fmt::format("s->{}_cell", name), p.layers[i].units());
  }
  write_dense(c, "head", p.head);
  c.member("uint32_t model_steps");
  write_reset(c, reset + "  s->model_steps = 0U;\n");
  c.add(R"c(
static @estimate @model(@state *s, const @real *x) {
  float in[$INPUTS$];
  @estimate out;
  uint32_t j;
$STANDARDISE$$STEPS$  out = @plain($VALUE$);
  if (s->model_steps < $WARM_UP$) {
    ++s->model_steps;
    out.fault = @WARMING_UP;
  }
  return out;
}
)c",
        {{"INPUTS", fmt::format("{}", p.scaling.inputs.centre.size())},
         {"STANDARDISE", in},
         {"STEPS", steps},
         {"VALUE", destandardised(c, p.scaling, fmt::format("@head({})", from))},
         {"WARM_UP", counted(p.warm_up_samples)}});
}

void write(CText& c, const Viscoelastic::Parameters& p, bool is_inverted) {
  const RelaxationSpectrum spectrum = relaxation_spectrum(p.network);
  std::vector<double> gain;
  std::vector<double> loss;
  for (const RelaxationBranch& branch : spectrum.branches) {
    gain.push_back(relaxation_step(branch, p.sample_period_s).gain);
    loss.push_back(-std::expm1(-branch.rate_1_s * p.sample_period_s));
  }
  const std::size_t branches = gain.size();
  c.work(CWork::relaxation, static_cast<double>(branches));
  c.table("branch_gain", gain);
  c.table("branch_loss", loss);
  if (branches > 0) c.member(fmt::format("@real torque[{}]", branches));
  c.member("@real last_x");
  c.member("int model_is_started");
  if (is_inverted) {
    c.member("@real value_without");
    c.member("int has_moved");
  }
  write_reset(c, (branches == 0 ? "" : cleared(c, "s->torque", branches)) +
                     std::string("  s->model_is_started = 0;\n") +
                     (is_inverted ? "  s->has_moved = 0;\n" : ""));
  double moving = spectrum.stiffness + spectrum.damping / p.sample_period_s;
  for (const double each : gain) moving += each;
  c.add(R"c(
static @estimate @model(@state *s, const @real *x) {
  const @real u = x[0], moved = s->model_is_started ? u - s->last_x : (@real)0;
  @real value = $OFFSET$ + $STIFFNESS$ * u + $SLOPE$ * moved;
  @estimate out;
$BRANCHES$  s->last_x = u;
$INVERTED$  s->model_is_started = 1;
  out = @plain(value);
  if (!@is_finite(value)) {
    @reset_model(s);
    out.value = $OFFSET$;
    out.fault = @MODEL_NOT_FINITE;
  }
  return out;
}
)c",
        {{"BRANCHES", branches == 0 ? ""
                                    : fmt::format(R"c(  uint32_t i;
  for (i = 0U; i < {}; ++i) {{
    s->torque[i] += @branch_gain[i] * moved - @branch_loss[i] * s->torque[i];
    value += s->torque[i];
  }}
)c",
                                                  counted(branches))},
         {"INVERTED", is_inverted ? c.filled(R"c(  s->has_moved = s->model_is_started;
  s->value_without = value - (s->has_moved ? $MOVING$ : $STIFFNESS$) * u;
)c",
                                             {{"MOVING", c.number(moving)},
                                              {"STIFFNESS", c.number(spectrum.stiffness)}})
                                  : ""},
         {"OFFSET", c.number(p.offset)},
         {"STIFFNESS", c.number(spectrum.stiffness)},
         {"SLOPE", c.number(spectrum.damping / p.sample_period_s)}});
}

/// Writes a curve as `real NAME_<name>(real x)`.
void write_curve(CText& c, const std::string& name, const StaticCurve& curve) {
  const std::string values = c.table(name + "_values", curve.values);
  if (curve.knots.empty()) {
    c.work(CWork::power, static_cast<double>(curve.values.size()));
    c.add(R"c(
static @real @$NAME$(@real x) {
  const @real z = (x - $CENTRE$) * $PER_RANGE$;
  @real y = (@real)0;
  uint32_t i;
  for (i = $COUNT$; i > 0U; --i) y = y * z + $VALUES$[i - 1U];
  return y;
}
)c",
          {{"NAME", name},
           {"CENTRE", c.number(curve.centre)},
           {"PER_RANGE", c.number(1.0 / curve.half_range)},
           {"COUNT", counted(curve.values.size())},
           {"VALUES", values}});
    return;
  }
  need_cell(c);
  c.work(CWork::search);
  c.work(CWork::cell, std::log2(static_cast<double>(curve.knots.size())));
  const std::string knots = c.table(name + "_knots", curve.knots);
  c.add(R"c(
static @real @$NAME$(@real x) {
  @real share;
  const uint32_t left = @cell($KNOTS$, $COUNT$, x, &share);
  return $VALUES$[left] + ($VALUES$[left + 1U] - $VALUES$[left]) * share;
}
)c",
        {{"NAME", name},
         {"KNOTS", knots},
         {"COUNT", counted(curve.knots.size())},
         {"VALUES", values}});
}

void write(CText& c, const HammersteinWiener::Parameters& p) {
  write_curve(c, "input_curve", p.input);
  write_curve(c, "output_curve", p.output);
  c.table("sections", p.sections.values);
  const std::size_t sections = p.sections.rows;
  c.work(CWork::section, static_cast<double>(sections));
  // The states are those less the ones at rest, so that zero is the state after a reset.
  const double rest_in = p.input(p.rest_input);
  double rest_out = rest_in;
  for (std::size_t i = 0; i < sections; ++i) {
    const auto g = p.sections.row(i);
    rest_out *= (g[0] + g[1] + g[2]) / (1.0 + g[3] + g[4]);
  }
  const double rest_value = p.output(std::clamp(rest_out, p.lowest, p.highest));
  c.member(fmt::format("@real section[{}]", 2 * sections));
  c.member("@real value_from_rest");
  write_reset(c, cleared(c, "s->section", 2 * sections) + "  s->value_from_rest = (@real)0;\n");
  c.add(R"c(
static @estimate @model(@state *s, const @real *x) {
  @real in = @input_curve(x[0]), held;
  @estimate out;
  uint32_t i;
  if (!(@absolute(in) < @BOUNDLESS)) {
    out = @plain($REST_VALUE$ + s->value_from_rest);
    out.fault = @MODEL_NOT_FINITE;
    return out;
  }
  in -= $REST_IN$;
  for (i = 0U; i < $SECTIONS$; ++i) {
    const @real *g = @sections + 5U * i;
    const @real y = g[0] * in + s->section[2U * i];
    s->section[2U * i] = g[1] * in - g[3] * y + s->section[2U * i + 1U];
    s->section[2U * i + 1U] = g[2] * in - g[4] * y;
    in = y;
  }
  in += $REST_OUT$;
  held = @limited(in, $LOWEST$, $HIGHEST$);
  out = @plain(@output_curve(held));
  s->value_from_rest = out.value - $REST_VALUE$;
  if (!(@absolute(in - held) <= $BORDER$)) out.fault = @OUTSIDE_TRAINING_RANGE;
  return out;
}
)c",
        {{"REST_VALUE", c.number(rest_value)},
         {"REST_IN", c.number(rest_in)},
         {"REST_OUT", c.number(rest_out)},
         {"SECTIONS", counted(sections)},
         {"LOWEST", c.number(p.lowest)},
         {"HIGHEST", c.number(p.highest)},
         {"BORDER", c.number(HammersteinWiener::kBorder * (p.highest - p.lowest))}});
}

void write(CText& c, const GreyBox::Parameters& p) { write_grey_box(c, p); }
void write(CText& c, const ParametricGp::Parameters& p) { write_parametric_gp(c, p); }
void write(CText& c, const Gru::Parameters& p) { write_recurrent_model(c, p); }
void write(CText& c, const Lstm::Parameters& p) { write_recurrent_model(c, p); }

template <class P>
bool written(CText& c, const AnyModel::Parameters& parameters) {
  const P* own = parameters.get_if<P>();
  if (own != nullptr) write(c, *own);
  return own != nullptr;
}

}  // namespace

std::string_view exported_families() noexcept { return kFamilies; }

void write_model(CText& c, const AnyModel::Parameters& parameters, bool is_inverted) {
  if (const auto* network = parameters.get_if<Viscoelastic::Parameters>())
    return write(c, *network, is_inverted);
  const bool is_written =
      written<Linear::Parameters>(c, parameters) ||
      written<LinearCoulomb::Parameters>(c, parameters) ||
      written<Polynomial::Parameters>(c, parameters) ||
      written<GreyBox::Parameters>(c, parameters) || written<Mlp::Parameters>(c, parameters) ||
      written<Gru::Parameters>(c, parameters) || written<Lstm::Parameters>(c, parameters) ||
      written<ParametricGp::Parameters>(c, parameters) ||
      written<HammersteinWiener::Parameters>(c, parameters);
  if (is_written) return;
  if (const auto* stops = parameters.get_if<MaxwellSlipModel::Parameters>())
    return write<StopOperator>(c, *stops);
  if (const auto* plays = parameters.get_if<PrandtlIshlinskii::Parameters>())
    return write<PlayOperator>(c, *plays);
  throw UsageError({.place = "the model",
                    .expected = "a family that can be exported: " + std::string(kFamilies),
                    .found = std::string(parameters.family())});
}

}  // namespace torsio
