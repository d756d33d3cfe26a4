#include "export/c_guards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "export/c_guard_parts.hpp"
#include "export/c_statements.hpp"
#include "torsio/core/error.hpp"
#include "torsio/estimate/estimator_core.hpp"

namespace torsio {
namespace {

using Range = GuardListing::Range;

/// The guards of `detail::EstimatorCore` in C. A member of the state has the name of the member there; where that one
/// is NaN or infinite after a reset, a flag is added, so that zeros are the state after a reset.
class GuardWriter : private CGuardParts {
 public:
  GuardWriter(CText& c, const CGuards& guards)
      : CGuardParts(c, guards),
        guards_(guards),
        has_zeros_(std::ranges::any_of(inputs_, &CInput::has_zero)) {}

  void write() {
    c_.work(CWork::step);
    c_.work(CWork::input, static_cast<double>(inputs_.size()));
    c_.work(CWork::feature, static_cast<double>(features_));
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      if (inputs_[i].is_counted()) c_.work(CWork::counted);
      if (has_limit(i)) c_.work(inputs_[i].is_counted() ? CWork::counted_jump : CWork::jump);
    }
    // Features and their limited values, raw inputs and interpolated ones.
    c_.local_reals(2 * features_);
    for (const CInput& input : inputs_) {
      if (input.is_counted())
        c_.local_floats(4);  // a count has 8 bytes
      else
        c_.local_reals(2);
    }
    if (list_.depends_on_rate) c_.work(CWork::interpolation);
    if (list_.has_memory) c_.work(CWork::memory);
    for (const char* const each :
         {"uint32_t missed", "int poisoned", "@real last_value", "int is_wrong_rate",
          "int needs_reset", "int has_run", "int in_jump", "int has_previous"})
      c_.member(each);
    if (has_zeros_) c_.member("int zero_changed");
    for (const CInput& input : inputs_)
      c_.member(fmt::format("{} previous_{}", type(input), input.channel));
    write_evidence();
    if (list_.has_memory) has_missed_others_ = write_memory_error(c_, guards_);
    write_jumps(c_, guards_);
    if (has_strokes()) write_strokes(c_, guards_);
    write_excursion();
    write_output();
    write_tick();
    write_run();
  }

 private:
  void write_evidence() {
    c_.add(R"c(
static @real @evidence(@real std_dev) {
  return @is_finite(std_dev) && std_dev > (@real)0 ? std_dev : @not_a_number();
}
)c");
    const ResidualTable& table = settings_.residuals;
    if (table.std_dev.empty()) {
      c_.add(R"c(
static @real @model_std_dev(const @estimate *raw) {
  return @evidence($FACTOR$raw->std_dev);
}
)c",
             {{"FACTOR", number(settings_.output.error_bar_factor) + " * "}});
      return;
    }
    // A region without evidence has NaN, which 0 becomes.
    std::vector<double> std_dev = table.std_dev;
    for (double& each : std_dev)
      if (!std::isfinite(each)) each = 0.0;
    c_.add(R"c(
/* The error bar of the model, or that of the residuals in the region of its value. */
static @real @model_std_dev(const @estimate *raw) {
  const @real own = @evidence($FACTOR$ * raw->std_dev);
  uint32_t region = 0U;
  if (own > (@real)0) return own;
  while (region < $LAST$ && !(raw->value < $EDGES$[region + 1U])) ++region;
  return @evidence($STD_DEV$[region]);
}
)c",
           {{"FACTOR", number(settings_.output.error_bar_factor)},
            {"LAST", counted(std_dev.size() - 1)},
            {"EDGES", c_.table("residual_edges", table.edges)},
            {"STD_DEV", c_.table("residual_std_dev", std_dev)}});
  }

  // Features beyond their ranges.

  [[nodiscard]] bool has_reach() const {
    return std::ranges::any_of(list_.ranges, [](const Range& range) { return range.reach > 0.0; });
  }

  void write_excursion() {
    c_.add(R"c(
/* How far features have left their ranges; above 1 the fallback replaces the model. */
typedef struct {
  @real borders, share, first, fallback;
} @excursion;
)c");
    std::string body;
    for (std::size_t i = 0; i < features_; ++i) {
      const Range& range = list_.ranges[i];
      std::string reached = "left_by";
      if (range.reach > 0.0 && std::isfinite(range.reach))
        reached = fmt::format("(left_by - {})", number(range.reach));
      body += fmt::format(
          "  left_by = @larger({0} - f[{1}], f[{1}] - {2});\n  if (left_by > (@real)0) {{\n",
          number(range.lowest), i, number(range.highest));
      body += fmt::format("    worst->borders = @larger(worst->borders, left_by * {});\n",
                          number(1.0 / range.border));
      if (std::isfinite(range.reach))
        body += fmt::format("    worst->fallback = @larger(worst->fallback, {} * {});\n", reached,
                            number(1.0 / range.border));
      if (range.reach > 0.0) {
        body += fmt::format("    worst->share = @larger(worst->share, left_by * {});\n",
                            number(range.per_width));
        if (i == 0)
          body += fmt::format("    worst->first = left_by * {};\n", number(range.per_width));
      }
      body += "  }\n";
    }
    c_.add(R"c(
static void @find_excursion(const @real *f, @excursion *worst) {
  @real left_by;
  worst->borders = worst->share = worst->first = worst->fallback = (@real)0;
$BODY$}
)c",
           {{"BODY", body}});
  }

  // The output.

  [[nodiscard]] std::string fallback_sum() const {
    std::string sum = number(settings_.fallback.intercept);
    for (std::size_t i = 0; i < features_; ++i)
      if (settings_.fallback.slope[i] != 0.0)
        sum += fmt::format(" + {} * f[{}]", number(settings_.fallback.slope[i]), i);
    return sum;
  }

  /// The term of `SensorUncertainty` in the error bar.
  [[nodiscard]] std::string sensor_term() const {
    const SensorUncertainty& sensor = settings_.target_uncertainty;
    std::string text;
    const auto add = [&](const std::string& term) {
      text += fmt::format("  out.std_dev = @hypotenuse(out.std_dev, {});\n", term);
    };
    if (sensor.constant > 0.0) add(number(sensor.constant));
    if (sensor.relative > 0.0) add(number(sensor.relative) + " * out.value");
    return text;
  }

  void write_output() {
    const double residual = settings_.fallback.residual_std;
    const bool has_residual = std::isfinite(residual) && residual > 0.0;
    const std::string fallback_std = has_residual ? number(residual) : "@not_a_number()";
    std::string settled = "1";
    if (guards_.settling_samples > 0) settled = "s->seen == " + counted(guards_.settling_samples);
    if (guards_.has_unknown_start) settled += " && s->start_std_dev < @BOUNDLESS";
    std::string widen;
    if (list_.has_memory)
      widen += "    if (s->memory_is_open) out.std_dev = @hypotenuse(out.std_dev, s->bound);\n";
    if (guards_.has_unknown_start)
      widen +=
          "    if (s->start_std_dev > (@real)0) out.std_dev = @hypotenuse(out.std_dev, "
          "s->start_std_dev);\n";
    if (has_jumps())
      widen +=
          "    if (s->level_error > (@real)0) out.std_dev = @hypotenuse(out.std_dev, "
          "s->level_error);\n";
    if (has_strokes())
      widen +=
          "    stroke = @stroke_std_dev(s);\n    if (stroke > (@real)0) out.std_dev = "
          "@hypotenuse(out.std_dev, stroke);\n";
    if (has_reach())
      widen += R"c(    if (e->share > (@real)0)
      out.std_dev = @hypotenuse(out.std_dev * ((@real)1 + (@real)2 * e->share),
                                @smaller(e->first, (@real)1) * (out.value - @fallback(s, f)));
)c";
    std::string zeros;
    if (has_zeros_)
      zeros = R"c(  if (@has_unset_zeros(s)) {
    if (!s->is_wrong_rate) out.fault = @ZERO_NOT_SET;
    out.std_dev = @not_a_number();
  }
)c";
    c_.add(R"c(
static int @is_settled(const @state *s) {
  (void)s;
  return $SETTLED$;
}
$UNSET_ZEROS$static @real @fallback(const @state *s, const @real *f) {
  const @real value = $FALLBACK$;
  return @is_finite(value) ? value : s->last_value;
}
static @estimate @held(const @state *s, int fault) {
  @estimate out = @plain(@is_finite(s->last_value) ? s->last_value : (@real)0);
  out.fault = fault;
  return out;
}
/* The first reason why the fallback replaces the model. */
static int @replaced_for(const @state *s, const @excursion *e, const @estimate *raw, @real std_dev) {
  (void)std_dev;
  if (s->is_wrong_rate) return @WRONG_RATE;
  if (e->fallback > (@real)1) return @OUTSIDE_TRAINING_RANGE;
  if (!@is_settled(s)) return @WARMING_UP;
  if (raw->fault != @NONE) return raw->fault;
  if (!@is_finite(raw->value)) return @MODEL_NOT_FINITE;
$RECOVERING$  return @NONE;
}
static @estimate @guarded(@state *s, const @real *f, const @excursion *e, const @estimate *raw) {
  const @real std_dev = @model_std_dev(raw);
  const int is_outside = e->borders > (@real)1 || e->fallback > (@real)1;
$STROKE$  @estimate out = @plain(raw->value);
  out.fault = @replaced_for(s, e, raw, std_dev);
$DIVERGED$  if (out.fault == @NONE) {
    out.std_dev = std_dev;
    if (e->fallback > (@real)0) {
      const @real other = @fallback(s, f), w = e->fallback, apart = raw->value - other;
      const @real of_fallback = $FALLBACK_STD$;
      out.value = raw->value + w * (other - raw->value);
      out.std_dev = @evidence(@square_root(((@real)1 - w) * std_dev * std_dev +
                                           w * of_fallback * of_fallback +
                                           w * ((@real)1 - w) * apart * apart));
    }
$WIDEN$    if (is_outside) out.fault = @OUTSIDE_TRAINING_RANGE;
  } else {
    out.value = @fallback(s, f);
    out.std_dev = !is_outside && !s->is_wrong_rate ? $FALLBACK_STD$ : @not_a_number();
  }
$SENSOR$$ZEROS$  s->last_value = out.value;
  return out;
}
)c",
           {{"SETTLED", settled},
            {"UNSET_ZEROS", unset_zeros()},
            {"FALLBACK", fallback_sum()},
            {"RECOVERING",
             list_.has_memory
                 ? "  if (s->memory_is_open && !(s->bound <= std_dev)) return @RECOVERING;\n"
                 : ""},
            {"DIVERGED", std::isfinite(list_.largest_output)
                             ? fmt::format("  if (out.fault == @NONE && !is_outside && "
                                           "@absolute(raw->value) > {}) out.fault = @DIVERGED;\n",
                                           number(list_.largest_output))
                             : ""},
            {"FALLBACK_STD", fallback_std},
            {"STROKE", has_strokes() ? "  @real stroke;\n" : ""},
            {"WIDEN", widen},
            {"SENSOR", sensor_term()},
            {"ZEROS", zeros}});
  }

  [[nodiscard]] std::string unset_zeros() const {
    if (!has_zeros_) return {};
    std::string all;
    for (const CInput& input : inputs_)
      if (input.has_zero)
        all += (all.empty() ? "!" : " || !") + fmt::format("s->has_zero_{}", input.channel);
    return "static int @has_unset_zeros(const @state *s) { return " + all + "; }\n";
  }

  // One tick.

  /// What the filters and the memory receive where inputs were missed, have jumped or have left their ranges.
  void write_recovery() {
    const double travel = detail::kJumpFactor * settings_.disturbances.largest_travel;
    std::string interrupt;
    if (list_.has_memory) {
      interrupt = std::isfinite(travel) && list_.first_width > 0.0
                      ? fmt::format(
                            "  share = (@real)ticks * {};\n  @interrupt_memory(s, ticks, share < "
                            "(@real)1 ? share : (@real)1, 1);\n",
                            number(travel / list_.first_width))
                      : "  share = (@real)1;\n  @interrupt_memory(s, ticks, share, 1);\n";
      c_.member("@real previous_first");
      c_.member("uint32_t excursion_ticks");
      c_.member("@real excursion_share");
    }
    c_.add(R"c(
/* The first usable tick after missed ones. */
static void @resume(@state *s, @real first) {
  const uint32_t ticks = s->missed;
$DECLARE$  (void)first;
  if (s->has_run) {
$INTERRUPT$    s->needs_reset = $RESETS_MODEL$;
$LEVEL$$DOUBT$  }
  s->missed = 0U;
$CLEAR$}
)c",
           {{"DECLARE", list_.has_memory ? "  @real share;\n" : "  (void)ticks;\n"},
            {"INTERRUPT", list_.has_memory ? interrupt : ""},
            {"RESETS_MODEL", list_.resets_model ? "1" : "0"},
            {"LEVEL", has_jumps()
                          ? "    if (s->level_ticks > 0U && !s->has_returned) @keep_offsets(s);\n"
                          : ""},
            {"DOUBT", doubt_after_jump()},
            {"CLEAR", std::string(has_jumps() ? "  s->level_ticks = 0U;\n" : "") +
                          (has_zeros_ ? "  s->zero_changed = 0;\n" : "")}});
    if (list_.has_memory) write_excursion_memory();
    write_limits();
  }

  [[nodiscard]] std::string doubt_after_jump() const {
    if (!list_.has_memory || (!has_jumps() && !has_zeros_)) return {};
    std::string condition;
    if (has_zeros_) condition = "s->zero_changed";
    if (has_jumps())
      condition += std::string(condition.empty() ? "" : " || ") +
                   "(s->level_ticks > 0U && !s->has_returned)";
    const std::string share =
        list_.first_width > 0.0
            ? fmt::format("s->has_previous ? @absolute(first - s->previous_first) * {} : (@real)1",
                          number(1.0 / list_.first_width))
            : std::string("(@real)1");
    return fmt::format(R"c(    if ({}) {{
      share = {};
      @doubt_memory(s, @ALL_TICKS, share < (@real)1 ? share : (@real)1);
    }}
)c",
                       condition, share);
  }

  /// What the memory may have received in an excursion.
  void write_excursion_memory() {
    const Range& first = list_.ranges.front();
    const bool has_width = list_.first_width > 0.0;
    c_.add(R"c(
/* A motion beyond the range hardly exceeds it by more than its width: beyond, the sensor may be wrong. */
static void @count_excursion(@state *s, @real first) {
  const @real beyond = @larger($LOWEST$ - first, first - $HIGHEST$);
  if (!(beyond > $WIDTH$)) {
    if (s->excursion_share > (@real)0) s->excursion_ticks += 3U;
    return;
  }
$SHARE$  s->excursion_ticks += 1U;
}
static void @end_excursion(@state *s) {
  @doubt_memory(s, 2U * s->excursion_ticks, s->excursion_share);
  if (s->excursion_ticks > 2U) {
    s->excursion_ticks -= 2U;
    return;
  }
  s->excursion_ticks = 0U;
  s->excursion_share = (@real)0;
}
)c",
           {{"LOWEST", number(first.lowest)},
            {"HIGHEST", number(first.highest)},
            {"WIDTH", number(list_.first_width)},
            {"SHARE", has_width ? fmt::format("  s->excursion_share = @larger(s->excursion_share, "
                                              "@smaller((@real)1 + beyond * {}, (@real)2));\n",
                                              number(1.0 / list_.first_width))
                                : ""}});
  }

  void write_limits() {
    std::string limits;
    for (std::size_t i = 0; i < features_; ++i) {
      const Range& range = list_.ranges[i];
      limits += fmt::format("  limited[{0}] = @limited(f[{0}], {1}, {2});\n", i,
                            number(range.lowest - range.held), number(range.highest + range.held));
    }
    std::string memory;
    if (list_.has_memory) {
      memory = fmt::format(
          "  if (!s->has_run) return;\n  @count_excursion(s, f[0]);\n  @interrupt_memory(s, 1U, "
          "{}, 0);\n",
          list_.first_width > 0.0
              ? fmt::format("@smaller((@real)1, @absolute(f[0] - limited[0]) * {})",
                            number(1.0 / list_.first_width))
              : "(@real)1");
      if (has_missed_others_)
        memory += fmt::format(R"c(  {{
    @real missed[{0}];
    uint32_t i;
    for (i = 0U; i < {0}U; ++i) missed[i] = @absolute(f[i] - limited[i]);
    @miss_others(s, missed);
  }}
)c",
                              features_);
    }
    c_.add(
        R"c(
/* A continuous excursion is a motion: the model receives inputs that are limited to their borders. */
static void @limit(@state *s, const @real *f, @real *limited) {
$UNUSED$$LIMITS$$MEMORY$}
)c",
        {{"UNUSED", memory.empty() ? "  (void)s;\n" : ""}, {"LIMITS", limits}, {"MEMORY", memory}});
  }

  void write_tick() {
    write_recovery();
    std::string not_finite;
    for (const CInput& input : inputs_)
      if (!input.is_counted())
        not_finite += (not_finite.empty() ? "!" : " || !") +
                      fmt::format("@is_finite(raw->{})", input.channel);
    std::string features_finite;
    for (std::size_t i = 0; i < features_; ++i)
      features_finite += (i == 0 ? "!" : " || !") + fmt::format("@is_finite(f[{}])", i);
    const std::string previous = over_inputs("", [&](std::size_t i) {
      return fmt::format("  s->previous_{0} = raw->{0};\n", inputs_[i].channel);
    });
    const std::string may_have_jumped =
        list_.assumes_jumps ? (has_zeros_ ? "(s->in_jump || !@has_unset_zeros(s))" : "1")
                            : "s->in_jump";
    const std::string gap = counted(list_.longest_gap);
    c_.add(R"c(
/* The features of one tick, and how far they have left their ranges. */
typedef struct {
  @real f[$FEATURES$], limited[$FEATURES$];
  const @real *x; /* for the model; 0: it is not stepped */
  @excursion e;
} @conditioned;

static void @miss_tick(@state *s) {
  if (s->missed < @MAX_MISSED) ++s->missed;
}
/* A fault: these inputs cannot be used. */
static int @condition(@state *s, const @raw *raw, @conditioned *in) {
  const @real *f = in->f;
  int is_outside$IS_NEW$;
  in->x = f;
$CHECK_INPUTS$$JUMP$  if (s->poisoned || s->missed > $GAP$$LEVEL$) @reset_pipeline(s);
  @pipeline(s, raw, in->f);
  s->poisoned = $NOT_FINITE$;
  if (s->poisoned) {
    @miss_tick(s);
    return @INPUT_NOT_FINITE;
  }
  @find_excursion(f, &in->e);
  is_outside = in->e.borders > (@real)1 || in->e.fallback > (@real)1;
  s->in_jump = $NEW$s->is_wrong_rate || (is_outside && $MAY_HAVE_JUMPED$);
  if (s->in_jump) {
    /* A jump can be an error of a sensor: no memory receives it. */
    s->poisoned = 1;
    @miss_tick(s);
    in->e.fallback = @BOUNDLESS;
$EXCLUDED$    return @NONE;
  }
  if (s->missed > 0U$ZERO_CHANGED$) @resume(s, f[0]);
$FOLLOW$$PREVIOUS$  s->has_previous = 1;
  if (s->needs_reset) @reset_model(s);
  s->needs_reset = 0;
  s->has_run = 1;
  return @NONE;
}
static @estimate @tick(@state *s, const @raw *raw) {
  @conditioned in;
  @estimate own;
  const int fault = @condition(s, raw, &in);
  if (fault != @NONE) return @held(s, fault);
$MODEL$$LOST$  return @guarded(s, in.f, &in.e, &own);
}
)c",
           {{"FEATURES", fmt::format("{}", features_)},
            {"IS_NEW", has_jumps() ? ", is_new" : ""},
            {"CHECK_INPUTS", not_finite.empty() ? ""
                                                : fmt::format(R"c(  if ({}) {{
    @miss_tick(s);
    return @INPUT_NOT_FINITE;
  }}
)c",
                                                              not_finite)},
            {"JUMP", has_jumps() ? fmt::format(R"c(  is_new = @is_new_level(s, raw);
  if (is_new && s->missed < {}) {{
    @miss_tick(s);
    s->in_jump = 1;
    return @OUTSIDE_TRAINING_RANGE;
  }}
)c",
                                               gap)
                                 : ""},
            {"GAP", gap},
            {"LEVEL", has_jumps() ? " || s->level_ticks > 0U" : ""},
            {"NOT_FINITE", features_finite},
            {"NEW", has_jumps() ? "is_new || " : ""},
            {"MAY_HAVE_JUMPED", may_have_jumped},
            {"EXCLUDED", list_.has_memory ? "    in->x = 0;\n" : "    s->has_run = 1;\n"},
            {"ZERO_CHANGED", has_zeros_ ? " || s->zero_changed" : ""},
            {"FOLLOW", follow()},
            {"PREVIOUS", previous + (has_strokes() ? "  @follow_stroke(s, f[0]);\n" : "")},
            {"MODEL", list_.has_memory ? R"c(  if (in.x == 0) {
    own = @plain((@real)0);
    return @guarded(s, in.f, &in.e, &own);
  }
  own = @model(s, in.x);
)c"
                                       : "  own = @model(s, in.x);\n"},
            {"LOST", list_.has_memory ? R"c(  if (!@is_finite(own.value)) @reset_model(s);
  if (!@is_finite(own.value) || own.fault == @MODEL_NOT_FINITE) @lose_memory(s);
)c"
                                      : "  if (!@is_finite(own.value)) @reset_model(s);\n"}});
  }

  [[nodiscard]] std::string follow() const {
    std::string inside;
    if (list_.has_memory)
      inside = R"c( else {
    if (s->excursion_ticks > 0U) @end_excursion(s);
    if (s->memory_is_open) @follow(s, f);
  }
  s->previous_first = f[0];)c";
    return "  if (is_outside) {\n    @limit(s, f, in->limited);\n    in->x = in->limited;\n  }" +
           inside + "\n";
  }

  // Short gaps are filled.

  void write_run() {
    if (!list_.depends_on_rate) {
      c_.add(R"c(
static @estimate @run(@state *s, const @raw *raw) { return @tick(s, raw); }
)c");
      return;
    }
    if (std::ranges::any_of(inputs_, &CInput::is_counted)) need_divided(c_);
    std::string finite;
    std::string between;
    for (const CInput& input : inputs_) {
      if (!input.is_counted()) finite += fmt::format(" || !@is_finite(raw->{})", input.channel);
      between += input.is_counted() ? c_.filled(
                                          "    between.$X$ = s->previous_$X$ + @divided(raw->$X$ - "
                                          "s->previous_$X$, left + 1U);\n",
                                          {{"X", input.channel}})
                                    : fmt::format(
                                          "    between.{0} = s->previous_{0} + (raw->{0} - "
                                          "s->previous_{0}) / (@real)(left + 1U);\n",
                                          input.channel);
    }
    c_.add(
        R"c(
/* How many interpolated ticks, in which filters and model receive what a short gap has left out, come before this one. */
static uint32_t @begin_interpolation(@state *s, const @raw *raw) {
  const uint32_t missed = s->missed;
  if (missed == 0U || missed > $GAP$ || s->poisoned || s->is_wrong_rate || !s->has_run$FINITE$) return 0U;
$JUMPS$  (void)raw;
  s->missed = 0U;
  return missed;
}
static @estimate @run(@state *s, const @raw *raw) {
  uint32_t left;
  for (left = @begin_interpolation(s, raw); left > 0U; --left) {
    @raw between;
$CLEAR$    s->in_jump = 0;
$BETWEEN$    (void)@tick(s, &between);
  }
  return @tick(s, raw);
}
)c",
        {{"GAP", counted(list_.longest_gap)},
         {"FINITE", finite},
         {"JUMPS", has_jumps() ? R"c(  if (@differs_from_previous(s, raw, missed + 1U)) return 0U;
  if (s->level_ticks != 0U && !@differs_from_level(s, raw)) return 0U;
)c"
                               : ""},
         {"CLEAR", has_jumps() ? "    s->level_ticks = 0U;\n" : ""},
         {"BETWEEN", between}});
  }

  const CGuards& guards_;
  bool has_zeros_;
  bool has_missed_others_ = false;
};

}  // namespace

void write_guards(CText& c, const CGuards& guards) { GuardWriter(c, guards).write(); }

}  // namespace torsio
