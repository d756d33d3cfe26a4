#include "export/c_inverse.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "export/c_model_inverse.hpp"
#include "export/c_statements.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

constexpr std::string_view kDeflection = "spring_deflection_rad";

/// TrainedInverse
void write_trained(CText& c, const std::vector<CInput>& inputs) {
  std::string copies;
  for (const CInput& input : inputs)
    copies += fmt::format("  with.{0} = {1};\n", input.channel,
                          input.channel == "torque_Nm" ? "torque_Nm" : "raw->" + input.channel);
  c.add_struct("spring", "The inverse of the spring.",
               {"@state model", "@real wanted_rad", "int fault"});
  c.add(R"c(
static void @reset_spring(@spring *of) { @reset(&of->model); }
static void @follow_spring(@spring *of, @real asked_rad) {
  (void)of;
  (void)asked_rad;
}
/* The deflection for a torque, measured in this tick as raw. */
static void @invert_spring(@spring *of, @real torque_Nm, const @raw *raw, @real deflection_rad, int is_lost) {
  @raw with;
  @estimate own;
  (void)deflection_rad;
  (void)raw;
  if (is_lost) {
    @miss(&of->model, 1U);
    of->fault = @INPUT_NOT_FINITE;
    return;
  }
$COPIES$  own = @run(&of->model, &with);
  of->wanted_rad = own.value;
  of->fault = own.fault;
}
)c",
        {{"COPIES", copies}});
}

/// The largest excursion of an input beyond the first, in borders: `Excursion::rate`.
std::string excursions_of_rates(const CText& c, const GuardListing& guards) {
  std::string text;
  for (std::size_t i = 1; i < guards.ranges.size(); ++i) {
    const GuardListing::Range& range = guards.ranges[i];
    if (!(range.reach > 0.0)) continue;
    text += c.filled(
        "  e.fallback = @larger(e.fallback, @larger($LOWEST$ - in.f[$I$], in.f[$I$] - $HIGHEST$) * "
        "$PER_BORDER$);\n",
        {{"LOWEST", c.number(range.lowest)},
         {"HIGHEST", c.number(range.highest)},
         {"I", fmt::format("{}", i)},
         {"PER_BORDER", c.number(1.0 / range.border)}});
  }
  return text;
}

/// ModelInverse
void write_inverted(CText& c, const ModelFile& model, const GuardListing& guards) {
  const EstimatorSettings& settings = model.settings;
  const LinearFallback& line = settings.fallback;
  const std::size_t features = settings.features.inputs.size();
  const AnyModel own(model.parameters);
  const bool has_state = !own.state().empty();
  c.work(CWork::inversion);
  write_model_inverse(c, model.parameters);
  std::string rest;
  for (std::size_t j = 1; j < features; ++j)
    if (line.slope[j] != 0.0)
      rest += fmt::format("  if (f != 0) rest_Nm -= {} * f[{}];\n", c.number(line.slope[j]), j);
  std::string departure;
  if (std::isfinite(line.residual_std)) {
    const std::string most =
        c.number(ModelInverse::kMaxDeparture * line.residual_std / line.slope.front());
    departure = fmt::format(
        "  of->wanted_rad = @limited(of->wanted_rad, line_rad - {0}, line_rad + {0});\n", most);
  }
  const bool has_zeros = !settings.zeroed_channels.empty();
  if (has_state)
    c.add_struct(
        "spring", "The inverse of the spring.",
        {"@state model", fmt::format("@real asked[{}]", features), "@real zero_rad",
         "@real last_rad", "@real wanted_rad", "int is_asked", "int follows_answer", "int fault"});
  else
    c.add_struct(
        "spring", "The inverse of the spring.",
        {"@state model", "@real zero_rad", "@real last_rad", "@real wanted_rad", "int fault"});
  const std::string store = c.filled(R"c(
static void @store(@state *m, const @real *x) {
  const @estimate own = @model(m, x);
  if (!@is_finite(own.value)) @reset_model(m);
}
)c");
  const bool stores_inputs = !has_state && guards.has_memory;
  c.add(
      R"c(
/* The fallback, solved for the deflection; f: 0 where there are no features. */
static @real @on_the_line(@real torque_Nm, const @real *f) {
  @real rest_Nm = torque_Nm - $INTERCEPT$;
  (void)f;
$REST$  return rest_Nm * $PER_SLOPE$;
}
$STORE$static void @reset_spring(@spring *of) {
  @reset(&of->model);
$RESET$  of->last_rad = (@real)0;
}
/* The deflection that was requested in place of the last result, which the memory of the model receives. */
static void @follow_spring(@spring *of, @real asked_rad) {
$FOLLOW$}
/* The verdict of the estimator, at the deflection that is requested in place of the measured one. */
static void @inverse_at(@spring *of, @real torque_Nm, const @conditioned *measured) {
  @state *m = &of->model;
  @conditioned in;
  @estimate inverted, at_torque;
  @excursion e;
  @real line_rad;
  uint32_t i;
  for (i = 0U; i < $FEATURES$; ++i) in.f[i] = measured->f[i];
  line_rad = @on_the_line(torque_Nm, in.f);
  of->wanted_rad = line_rad;
  of->fault = @OUTSIDE_TRAINING_RANGE;
  if (m->in_jump) return;
  inverted = @plain((@real)0);
  inverted.fault = @invert_model(m, torque_Nm, measured->x, &inverted.value);
  in.f[0] = inverted.fault == @NONE && @is_finite(inverted.value) ? inverted.value : line_rad;
  @find_excursion(in.f, &e);
$RATES$  at_torque = @plain(torque_Nm);
  of->fault = @replaced_for(m, &e, &inverted, @model_std_dev(&at_torque));
  if (of->fault != @NONE) return;
  of->wanted_rad = inverted.value;
$DEPARTURE$  if (e.fallback > (@real)0) of->wanted_rad += e.fallback * (line_rad - of->wanted_rad);
  if (e.borders > (@real)1 || e.fallback > (@real)1) of->fault = @OUTSIDE_TRAINING_RANGE;
}
/* The deflection for a torque, measured in this tick as raw. */
static void @invert_spring(@spring *of, @real torque_Nm, const @raw *raw, @real deflection_rad, int is_lost) {
  @state *m = &of->model;
  @conditioned in;
  int fault;
$BEGIN$  if (is_lost) @miss_tick(m);
  fault = is_lost ? @INPUT_NOT_FINITE : @condition(m, raw, &in);
  if (fault == @OUTSIDE_TRAINING_RANGE && @is_finite(torque_Nm)) {
    of->wanted_rad = @on_the_line(torque_Nm, 0);
    of->fault = fault;
    return;
  }
  if (fault != @NONE || !@is_finite(torque_Nm)) {
    of->wanted_rad = of->last_rad;
    of->fault = fault != @NONE ? fault : @INPUT_NOT_FINITE;
    return;
  }
$STEP$  @inverse_at(of, torque_Nm, &in);
  of->zero_rad = deflection_rad - in.f[0];
$STORED$$ZEROS$  of->wanted_rad += of->zero_rad;
  if (!@is_finite(of->wanted_rad)) {
    of->wanted_rad = of->last_rad;
    of->fault = @MODEL_NOT_FINITE;
    return;
  }
  of->last_rad = of->wanted_rad;
}
)c",
      {{"INTERCEPT", c.number(line.intercept)},
       {"REST", rest},
       {"PER_SLOPE", c.number(1.0 / line.slope.front())},
       {"STORE", has_state || stores_inputs ? store : ""},
       {"RESET", has_state ? "  of->is_asked = of->follows_answer = 0;\n" : ""},
       {"FOLLOW", has_state ? "  if (of->follows_answer) of->asked[0] = asked_rad - of->zero_rad;\n"
                            : "  (void)of;\n  (void)asked_rad;\n"},
       {"FEATURES", counted(features)},
       {"RATES", excursions_of_rates(c, guards)},
       {"DEPARTURE", departure},
       {"BEGIN", has_state ? R"c(  if (of->is_asked) @store(m, of->asked);
  of->is_asked = of->follows_answer = 0;
)c"
                           : ""},
       {"STEP", stores_inputs ? "  if (in.x != 0) @store(m, in.x);\n" : ""},
       {"STORED", has_state ? fmt::format(R"c(  if (in.x != 0) {{
    /* What the loop makes of the answer is not known yet: the memory goes there in the next step. */
    uint32_t i;
    for (i = 0U; i < {}; ++i) of->asked[i] = in.x[i];
    of->follows_answer = of->fault != @WARMING_UP;
    if (of->follows_answer) of->asked[0] = of->wanted_rad;
    of->is_asked = 1;
  }}
)c",
                                          counted(features))
                            : ""},
       {"ZEROS",
        has_zeros
            ? "  if (@has_unset_zeros(m) && of->fault != @WRONG_RATE) of->fault = @ZERO_NOT_SET;\n"
            : ""}});
}

}  // namespace

void write_inverse(CText& c, const ModelFile& model, const GuardListing& guards,
                   const std::vector<CInput>& inputs) {
  static_cast<void>(AnyInverse::of(model.settings, model.parameters));  // what it refuses
  if (model.settings.target == kDeflection)
    write_trained(c, inputs);
  else
    write_inverted(c, model, guards);
}

}  // namespace torsio
