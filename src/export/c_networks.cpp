#include "export/c_networks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <span>

namespace torsio {
namespace {

void need_dense(CText& c) {
  if (!c.claim("dense")) return;
  c.add(R"c(
static void @dense(const float *weights, const float *bias, uint32_t inputs, uint32_t units,
                   const float *in, float *out) {
  uint32_t unit, j;
  for (unit = 0U; unit < units; ++unit, weights += inputs) {
    float sum = bias[unit];
    for (j = 0U; j < inputs; ++j) sum += weights[j] * in[j];
    out[unit] = sum;
  }
}
)c");
}

/// What an activation makes of `y[j]`; empty for a linear layer.
std::string activated(std::size_t activation) {
  switch (static_cast<Activation>(activation)) {
    case Activation::linear: return {};
    case Activation::relu: return "if (y[j] < 0.0F) y[j] = 0.0F;";
    case Activation::tanh: return "y[j] = @float_tangent(y[j]);";
    case Activation::softsign: return "y[j] /= 1.0F + (y[j] < 0.0F ? -y[j] : y[j]);";
    case Activation::elu: break;
  }
  return "if (y[j] < 0.0F) y[j] = (float)@exponential((@real)y[j]) - 1.0F;";
}

void need_sigmoid(CText& c) {
  if (c.claim("sigmoid"))
    c.add("\nstatic float @sigmoid(float x) { return 0.5F + 0.5F * @float_tangent(0.5F * x); }\n");
}

/// "name_input" and "name_recurrent" with their dimensions.
void add_matrices(CText& c, const std::string& name, const FloatMatrix& input,
                  const FloatMatrix& recurrent) {
  c.work(CWork::weight, static_cast<double>(input.values.size() + recurrent.values.size()));
  c.work(CWork::gate, 2.0 * static_cast<double>(input.rows));  // a product with input and state
  c.float_table(name + "_input", input.values);
  c.float_table(name + "_recurrent", recurrent.values);
  c.member(fmt::format("float {}_hidden[{}]", name, recurrent.columns));
  c.member(fmt::format("float {}_next[{}]", name, recurrent.columns));
  if (c.claim("product"))
    c.add(R"c(
static float @product(const float *row, const float *in, uint32_t count) {
  float sum = 0.0F;
  uint32_t j;
  for (j = 0U; j < count; ++j) sum += row[j] * in[j];
  return sum;
}
)c");
}

std::vector<float> sum_of(std::span<const float> a, std::span<const float> b) {
  std::vector<float> sum(a.size());
  std::ranges::transform(a, b, sum.begin(), std::plus<>{});
  return sum;
}

}  // namespace

void write_dense(CText& c, const std::string& name, const std::vector<DenseLayer>& layers) {
  need_dense(c);
  std::string body;
  std::string in = "in";
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const DenseLayer& layer = layers[i];
    const std::string own = fmt::format("{}_{}", name, i);
    const auto units = static_cast<double>(layer.weights.rows);
    c.work(CWork::weight, static_cast<double>(layer.weights.values.size()));
    c.work(CWork::unit, units);
    if (static_cast<Activation>(layer.activation) == Activation::tanh)
      c.work(CWork::tangent, units);
    if (static_cast<Activation>(layer.activation) == Activation::elu)
      c.work(CWork::exponential, units);
    c.local_floats(layer.weights.rows);
    c.work(CWork::layer);
    c.float_table(own + "_weights", layer.weights.values);
    c.float_table(own + "_bias", layer.bias);
    const std::string out = fmt::format("out_{}", i);
    body += c.filled("  float $OUT$[$UNITS$];\n",
                     {{"OUT", out}, {"UNITS", fmt::format("{}", layer.weights.rows)}});
    body += c.filled("  @dense(@$OWN$_weights, @$OWN$_bias, $INPUTS$U, $UNITS$U, $IN$, $OUT$);\n",
                     {{"OWN", own},
                      {"INPUTS", fmt::format("{}", layer.weights.columns)},
                      {"UNITS", fmt::format("{}", layer.weights.rows)},
                      {"IN", in},
                      {"OUT", out}});
    if (const std::string text = activated(layer.activation); !text.empty())
      body += c.filled(
          "  for (j = 0U, y = $OUT$; j < $UNITS$U; ++j) {\n    $TEXT$\n  }\n",
          {{"OUT", out}, {"UNITS", fmt::format("{}", layer.weights.rows)}, {"TEXT", text}});
    in = out;
  }
  const bool has_loop = body.find("y = ") != std::string::npos;
  c.add(R"c(
static float @$NAME$(const float *in) {
$LOOP$$BODY$  return $LAST$[0];
}
)c",
        {{"NAME", name},
         {"LOOP", has_loop ? "  uint32_t j;\n  float *y;\n" : ""},
         {"BODY", body},
         {"LAST", in}});
}

std::string standardised(CText& c, const std::string& name, const NetworkScaling& scaling,
                         const std::string& from, const std::string& to) {
  std::vector<double> factors;
  for (const double scale : scaling.inputs.scale) factors.push_back(1.0 / scale);
  c.work(CWork::scaled, static_cast<double>(factors.size()));
  const std::string centre = c.table(name + "_centre", scaling.inputs.centre);
  const std::string factor = c.table(name + "_factor", factors);
  return fmt::format("  for (j = 0U; j < {}U; ++j) {}[j] = (float)(({}[j] - {}[j]) * {}[j]);\n",
                     factors.size(), to, from, centre, factor);
}

std::string destandardised(const CText& c, const NetworkScaling& scaling,
                           const std::string& output) {
  return c.filled("$CENTRE$ + $SCALE$ * (@real)$OUTPUT$",
                  {{"CENTRE", c.number(scaling.target_centre)},
                   {"SCALE", c.number(scaling.target_scale)},
                   {"OUTPUT", output}});
}

void write_recurrent(CText& c, const std::string& name, const LstmLayer& layer) {
  add_matrices(c, name, layer.input_weights, layer.recurrent_weights);
  need_sigmoid(c);
  const std::size_t gates = 4 * layer.units();
  c.work(CWork::tangent, 5.0 * static_cast<double>(layer.units()));
  const std::span<const float> bias = layer.bias;
  c.float_table(name + "_bias", layer.keeps_biases_apart()
                                    ? sum_of(bias.first(gates), bias.subspan(gates))
                                    : layer.bias);
  c.member(fmt::format("float {}_cell[{}]", name, layer.units()));
  c.add(R"c(
static float @$NAME$_gate(const @state *s, const float *in, uint32_t row) {
  return @$NAME$_bias[row] + @product(@$NAME$_input + row * $INPUTS$U, in, $INPUTS$U) +
         @product(@$NAME$_recurrent + row * $UNITS$U, s->$NAME$_hidden, $UNITS$U);
}
static void @$NAME$(@state *s, const float *in) {
  uint32_t unit;
  for (unit = 0U; unit < $UNITS$U; ++unit) {
    const float in_gate = @sigmoid(@$NAME$_gate(s, in, unit));
    const float forget = @sigmoid(@$NAME$_gate(s, in, unit + $UNITS$U));
    const float fresh = @float_tangent(@$NAME$_gate(s, in, unit + 2U * $UNITS$U));
    const float out_gate = @sigmoid(@$NAME$_gate(s, in, unit + 3U * $UNITS$U));
    s->$NAME$_cell[unit] = forget * s->$NAME$_cell[unit] + in_gate * fresh;
    s->$NAME$_next[unit] = out_gate * @float_tangent(s->$NAME$_cell[unit]);
  }
  for (unit = 0U; unit < $UNITS$U; ++unit) s->$NAME$_hidden[unit] = s->$NAME$_next[unit];
}
)c",
        {{"NAME", name},
         {"INPUTS", fmt::format("{}", layer.input_weights.columns)},
         {"UNITS", fmt::format("{}", layer.units())}});
}

void write_recurrent(CText& c, const std::string& name, const GruLayer& layer) {
  add_matrices(c, name, layer.input_weights, layer.recurrent_weights);
  need_sigmoid(c);
  const std::size_t units = layer.units();
  c.work(CWork::tangent, 3.0 * static_cast<double>(units));
  // Both biases of r and z are added up; those of n are on either side of r.
  std::vector<float> bias = sum_of(layer.input_bias, layer.recurrent_bias);
  std::copy(layer.input_bias.begin() + static_cast<std::ptrdiff_t>(2 * units),
            layer.input_bias.end(), bias.begin() + static_cast<std::ptrdiff_t>(2 * units));
  c.float_table(name + "_bias", bias);
  c.float_table(name + "_inner_bias", std::span(layer.recurrent_bias).subspan(2 * units));
  c.add(R"c(
static float @$NAME$_from_input(const float *in, uint32_t row) {
  return @$NAME$_bias[row] + @product(@$NAME$_input + row * $INPUTS$U, in, $INPUTS$U);
}
static float @$NAME$_from_hidden(const @state *s, uint32_t row) {
  return @product(@$NAME$_recurrent + row * $UNITS$U, s->$NAME$_hidden, $UNITS$U);
}
static void @$NAME$(@state *s, const float *in) {
  uint32_t unit;
  for (unit = 0U; unit < $UNITS$U; ++unit) {
    const float reset = @sigmoid(@$NAME$_from_input(in, unit) + @$NAME$_from_hidden(s, unit));
    const float keep = @sigmoid(@$NAME$_from_input(in, unit + $UNITS$U) +
                                @$NAME$_from_hidden(s, unit + $UNITS$U));
    const float inner = @$NAME$_from_hidden(s, unit + 2U * $UNITS$U) + @$NAME$_inner_bias[unit];
    const float fresh = @float_tangent(@$NAME$_from_input(in, unit + 2U * $UNITS$U) + reset * inner);
    s->$NAME$_next[unit] = keep * (s->$NAME$_hidden[unit] - fresh) + fresh;
  }
  for (unit = 0U; unit < $UNITS$U; ++unit) s->$NAME$_hidden[unit] = s->$NAME$_next[unit];
}
)c",
        {{"NAME", name},
         {"INPUTS", fmt::format("{}", layer.input_weights.columns)},
         {"UNITS", fmt::format("{}", units)}});
}

}  // namespace torsio
