#include "torsio/export/c99.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "estimate/guard_listing.hpp"
#include "export/c_controller.hpp"
#include "export/c_guards.hpp"
#include "export/c_inputs.hpp"
#include "export/c_models.hpp"
#include "export/c_pipeline.hpp"
#include "export/c_self_test.hpp"
#include "export/c_text.hpp"
#include "signal/pipeline_listing.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/version.hpp"
#include "torsio/estimate/estimator_core.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {
namespace {

void check_name(const std::string& name) {
  static constexpr std::array kReserved{
      "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else",
      "enum", "extern", "float", "for", "goto", "if", "inline", "int", "long", "register",
      "restrict", "return", "short", "signed", "sizeof", "static", "struct", "switch", "typedef",
      "union", "unsigned", "void", "volatile", "while", "class", "namespace", "template", "this",
      "new", "delete",
      // NAME.h would hide them.
      "assert", "ctype", "errno", "limits", "math", "stdbool", "stddef", "stdint", "stdio",
      "stdlib", "string", "time"};
  const auto is_part = [](unsigned char letter) {
    return std::isalnum(letter) != 0 || letter == '_';
  };
  const bool is_identifier = !name.empty() && std::ranges::all_of(name, is_part) &&
                             std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
                             name.size() <= 48;
  if (!is_identifier || std::ranges::find(kReserved, name) != kReserved.end())
    throw UsageError(
        {.place = "the name of the program",
         .expected = "a C identifier of at most 48 letters, digits and _ that begins with a letter "
                     "and is neither a keyword nor the name of a standard header",
         .found = '"' + name + '"'});
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char letter) { return std::toupper(letter); });
  return text;
}

/// The text without what would end a comment.
std::string comment(std::string text) {
  for (std::size_t at = text.find("*/"); at != std::string::npos; at = text.find("*/"))
    text[at] = '+';
  for (std::size_t at = text.find("/*"); at != std::string::npos; at = text.find("/*"))
    text[at] = '+';
  for (char& letter : text)
    if (static_cast<unsigned char>(letter) < ' ' || letter == '\\') letter = ' ';
  return text;
}

std::string card_text(const ModelFile& model, const std::string& origin, const CText& c) {
  std::string text = fmt::format("   Written by torsio {} from {}.\n   Model: {}", kVersion,
                                 comment(origin), comment(model.card.fitted_as));
  for (const auto& [name, value] : model.card.options)
    text += fmt::format(", {}={}", comment(name), comment(value));
  text += fmt::format("; {} numbers. Output: {}, at {:g} Hz.\n   Features:\n",
                      c.real() == CReal::single ? "float" : "double",
                      comment(model.settings.target), model.settings.sample_rate_Hz);
  for (const std::string& input : model.settings.features.inputs)
    text += "     " + comment(input) + '\n';
  for (const ChannelDefinition& each : model.settings.features.definitions)
    text += fmt::format("     where {} = {}\n", comment(each.name), comment(each.expression));
  if (!model.card.metrics.empty() && !model.card.held_out.empty()) {
    text += fmt::format("   On {}:", comment(model.card.held_out));
    for (const auto& [name, value] : model.card.metrics)
      text += fmt::format(" {} {:.4g}", comment(name), value);
    text += '\n';
  }
  if (!model.card.device_serial.empty())
    text += fmt::format("   Only for the device {}.\n", comment(model.card.device_serial));
  return text;
}

std::string parameters_text(const std::vector<CInput>& inputs) {
  std::string text;
  for (const CInput& input : inputs)
    text += fmt::format(", {} {}", input.is_counted() ? "int32_t" : "@real",
                        input.is_counted()
                            ? input.channel.substr(0, input.channel.size() - 4) + "_counts"
                            : input.channel);
  return text;
}

std::string arguments_text(const std::vector<CInput>& inputs) {
  std::string text;
  for (const CInput& input : inputs) {
    const std::string counts =
        input.channel.substr(
            0, input.channel.size() - std::min<std::size_t>(4, input.channel.size())) +
        "_counts";
    text += input.is_counted() ? fmt::format("  raw.{} = (int64_t){} * {:.0f};\n", input.channel,
                                             counts, kCountParts)
                               : fmt::format("  raw.{0} = {0};\n", input.channel);
  }
  return text;
}

/// How to give inputs, and what was not measured.
std::string inputs_text(const std::vector<CInput>& inputs, const C99Options& options) {
  std::string text;
  bool has_number = false;
  for (const CInput& input : inputs) {
    const auto counts = std::ranges::find(options.counts, input.channel, &CCounts::channel);
    if (counts == options.counts.end()) {
      has_number = true;
      continue;
    }
    text += fmt::format("\n   {}: {} counts in a turn of the joint{}.", input.channel,
                        std::abs(counts->counts_per_turn),
                        counts->counts_per_turn < 0.0 ? ", which rise where the angle falls" : "");
  }
  if (has_number) text.insert(0, " NaN for an input that was not measured.");
  if (!options.counts.empty())
    text += "\n   A tick in which counts were not measured is reported by @miss instead.";
  return text;
}

std::string faults_text(const std::string& prefix) {
  std::string text;
  for (std::size_t i = 0; i < kFaultCount; ++i)
    text += fmt::format("  {}{} = {}{}\n", prefix, upper(std::string(name(static_cast<Fault>(i)))),
                        i, i + 1 == kFaultCount ? "" : ",");
  return text;
}

/// An enumeration for the header, of names that count from 0.
template <class Enumerator>
std::string enumeration(const char* comment, const char* prefix, std::size_t count) {
  std::string text = fmt::format("\n/* {} */\nenum {{\n", comment);
  for (std::size_t i = 0; i < count; ++i)
    text += fmt::format("  @{}_{} = {}{}\n", prefix,
                        upper(std::string(name(static_cast<Enumerator>(i)))), i,
                        i + 1 == count ? "" : ",");
  return text + "};\n";
}

std::string modes_text(const ControllerFile& controller) {
  std::string text =
      enumeration<JointMode>("What a joint follows.", "MODE",
                             static_cast<std::size_t>(JointMode::deflection) + 1) +
      enumeration<JointCascade::Limit>("What cut a command.", "LIMIT",
                                       static_cast<std::size_t>(JointCascade::Limit::voltage) + 1);
  if (controller.stop)
    text += enumeration<JointStop::Phase>(
        "Where a stop is.", "PHASE", static_cast<std::size_t>(JointStop::Phase::releasing) + 1);
  return text;
}

std::string zeros_header(const std::vector<CInput>& inputs) {
  std::string text;
  for (const CInput& input : inputs)
    if (input.has_zero)
      text += fmt::format(
          "/* The zero of {0}, in {1}; until it is set each step reports ZERO_NOT_SET. */\n"
          "void @set_zero_{0}(@state *state, {2} zero);\n",
          input.channel, input.is_counted() ? "counts" : "SI",
          input.is_counted() ? "int32_t" : "@real");
  return text;
}

void write_zeros(CText& c, const std::vector<CInput>& inputs) {
  for (const CInput& input : inputs) {
    if (!input.has_zero) continue;
    c.member(fmt::format("{} zero_{}", input.is_counted() ? "int64_t" : "@real", input.channel));
    c.member(fmt::format("int has_zero_{}", input.channel));
  }
}

std::string zeros_source(const std::vector<CInput>& inputs, bool has_jumps) {
  std::string offsets;
  for (std::size_t i = 0; i < inputs.size(); ++i)
    offsets += fmt::format("    state->offsets[{}] = (@real)0;\n", i);
  offsets += "    state->level_error = (@real)0;\n";
  std::string text;
  for (const CInput& input : inputs)
    if (input.has_zero)
      text += fmt::format(
          R"c(
void @set_zero_{0}(@state *state, {1} zero) {{
  const {2} value = {3};
  if (value != state->zero_{0}) {{
    state->zero_changed = state->has_run;
    state->poisoned = state->poisoned || state->has_run;
{4}  }}
  state->zero_{0} = value;
  state->has_zero_{0} = 1;
}}
)c",
          input.channel, input.is_counted() ? "int32_t" : "@real",
          input.is_counted() ? "int64_t" : "@real",
          input.is_counted() ? fmt::format("(int64_t)zero * {:.0f}", kCountParts) : "zero",
          has_jumps ? offsets : "");
  return text;
}

/// What a reset keeps: the zeros.
std::string kept(const std::vector<CInput>& inputs) {
  std::string text;
  for (const CInput& input : inputs)
    if (input.has_zero)
      text += fmt::format(
          "  const {1} zero_{0} = state->zero_{0};\n  const int has_zero_{0} = "
          "state->has_zero_{0};\n",
          input.channel, input.is_counted() ? "int64_t" : "@real");
  return text;
}
std::string restored(const std::vector<CInput>& inputs) {
  std::string text;
  for (const CInput& input : inputs)
    if (input.has_zero)
      text += fmt::format("  state->zero_{0} = zero_{0};\n  state->has_zero_{0} = has_zero_{0};\n",
                          input.channel);
  return text;
}

}  // namespace

C99Program c99_program(const ModelFile& model, const C99Options& options,
                       const std::string& origin) {
  check_name(options.name);
  const AnyModel own(model.parameters);
  const detail::EstimatorCore core(model.settings, own);
  const FeaturePipeline pipeline(model.settings.features, model.settings.sample_rate_Hz);
  const PipelineListing listing = pipeline.listing();
  const GuardListing guards = core.listing();
  const std::vector<CInput> inputs = c_inputs(listing.raw_inputs, model.settings, options);
  CText c(options.name, options.real);
  c.add(R"c(
static @estimate @plain(@real value) {
  @estimate out;
  out.value = value;
  out.std_dev = @not_a_number();
  out.fault = @NONE;
  return out;
}
)c");
  write_zeros(c, inputs);
  write_pipeline(c, listing, inputs, model.settings.fallback.slope);
  write_model(c, model.parameters, options.controller.has_value());
  write_guards(c, {.settings = model.settings,
                   .listing = guards,
                   .inputs = inputs,
                   .settling_samples = listing.settling_samples,
                   .has_unknown_start = has_unknown_start(listing)});
  c.end_state();
  if (options.controller) {
    c.begin_control();
    write_controller(c, model, guards, inputs, options);
  }
  const bool has_jumps =
      std::ranges::any_of(guards.jump_limits, [](double limit) { return std::isfinite(limit); });
  const std::string upper_name = upper(options.name);
  const std::string real = options.real == CReal::single ? "float" : "double";
  std::string raw;
  for (const CInput& input : inputs)
    raw += fmt::format("  {} {};\n", input.is_counted() ? "int64_t" : "@real", input.channel);
  C99Program program;
  program.header =
      c.filled(R"c(/* $NAME$.h: an estimator of $TARGET$$CONTROLS$.
$CARD$   One struct for each joint: `static $NAME$_state joint;` is ready, since all bytes 0 are the state after a reset. A copy of
   the struct is a copy of the state. Nothing here uses a heap, a lock or a library. */
#ifndef $GUARD$_H
#define $GUARD$_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef $REAL$ @real;

/* Why the value must not be used as the model's. */
enum {
$FAULTS$};

/* value: in the unit of $TARGET$, always finite. std_dev: its error bar, NaN where there is no evidence. */
typedef struct {
  @real value, std_dev;
  int fault;
} @estimate;
$MODES$$TYPES$
/* The state as it was before the first step; zeros are kept. */
void @reset(@state *state);
$ZEROS$/* So many ticks did not take place: for the next step they are a gap. */
void @miss(@state *state, uint32_t ticks);
/* From now on the ticks do not come at $RATE$ Hz (1), or do again (0). */
void @set_wrong_rate(@state *state, int is_wrong);
/* One tick, $RATE$ of them per second.$NOT_MEASURED$ */
@estimate @step(@state *state$PARAMETERS$);
$CONTROLLER$
#ifdef $GUARD$_SELF_TEST
/* The largest difference from torsio over recorded ticks, as a share of the torque's range; 1000 where a fault differs. */
@real @self_test(void);
#endif

#ifdef __cplusplus
}
#endif

#endif
)c",
               {{"NAME", options.name},
                {"CONTROLS", options.controller ? ", and the controller of its joint" : ""},
                {"CARD", card_text(model, origin, c)},
                {"GUARD", upper_name},
                {"REAL", real},
                {"FAULTS", faults_text("@")},
                {"TARGET", comment(model.settings.target)},
                {"MODES", options.controller ? modes_text(*options.controller) : ""},
                {"TYPES", c.types()},
                {"CONTROLLER", options.controller ? controller_header(options) : ""},
                {"ZEROS", zeros_header(inputs)},
                {"RATE", fmt::format("{:g}", model.settings.sample_rate_Hz)},
                {"NOT_MEASURED", inputs_text(inputs, options)},
                {"PARAMETERS", parameters_text(inputs)}});
  program.source = c.filled(
      R"c(/* $NAME$.c: see $NAME$.h. */
#include "$NAME$.h"

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "Compile this file without -ffast-math and -ffinite-math-only: they hide values that are not numbers."
#endif

#define @BOUNDLESS ((@real)1e30)
#define @ALL_TICKS 0xFFFFFFFFU
#define @MAX_MISSED 1000000000U

/* The raw inputs of one tick; those of encoders in parts of a count. */
typedef struct {
$RAW$} @raw;

$TABLES$$FUNCTIONS$
void @reset(@state *state) {
$KEPT$  volatile unsigned char *bytes = (volatile unsigned char *)state;
  uint32_t i;
  for (i = 0U; i < sizeof *state; ++i) bytes[i] = 0U;
$RESTORED$}
$SET_ZEROS$
void @miss(@state *state, uint32_t ticks) {
  const uint32_t room = @MAX_MISSED - state->missed;
  state->missed += ticks < room ? ticks : room;
}

void @set_wrong_rate(@state *state, int is_wrong) {
$WRONG_RATE$}

@estimate @step(@state *state$PARAMETERS$) {
  @raw raw;
$ARGUMENTS$  return @run(state, &raw);
}
$SELF_TEST$)c",
      {{"NAME", options.name},
       {"RAW", raw},
       {"TABLES", c.tables()},
       {"FUNCTIONS", c.functions()},
       {"KEPT", kept(inputs)},
       {"RESTORED", restored(inputs)},
       {"SET_ZEROS", zeros_source(inputs, has_jumps)},
       {"WRONG_RATE", guards.depends_on_rate ? "  state->is_wrong_rate = is_wrong != 0;\n"
                                             : "  (void)state;\n  (void)is_wrong;\n"},
       {"PARAMETERS", parameters_text(inputs)},
       {"ARGUMENTS", arguments_text(inputs)},
       {"SELF_TEST", c.filled(self_test_text(c, model, inputs), {{"GUARD", upper_name}})}});
  program.table_bytes = c.table_bytes();
  program.state_bytes = options.controller ? c.size_of("control") : c.size_of("state");
  program.local_bytes = c.local_bytes();
  program.code = c_code(c.functions());
  program.work = c.work();
  program.control_work = c.control_work();
  return program;
}

}  // namespace torsio
