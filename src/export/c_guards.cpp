#include "export/c_guards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "export/c_statements.hpp"
#include "torsio/core/error.hpp"
#include "torsio/estimate/estimator_core.hpp"

namespace torsio {
namespace {

using Range = GuardListing::Range;

/// The guards of `detail::EstimatorCore` in C. A member of the state has the name of the member there; where that one
/// is NaN or infinite after a reset, a flag is added, so that zeros are the state after a reset.
class GuardWriter {
 public:
  GuardWriter(CText& c, const CGuards& guards)
      : c_(c),
        guards_(guards),
        list_(guards.listing),
        settings_(guards.settings),
        inputs_(guards.inputs),
        features_(guards.settings.features.inputs.size()),
        has_relaxations_(!list_.memory.relaxations.empty()),
        has_zeros_(std::ranges::any_of(inputs_, &CInput::has_zero)) {}

  void write() {
    c_.work(CWork::step);
    c_.work(CWork::input, static_cast<double>(inputs_.size()));
    c_.work(CWork::feature, static_cast<double>(features_));
    if (list_.has_memory) c_.work(CWork::memory);
    for (const char* const each :
         {"uint32_t missed", "int poisoned", "@real last_value", "int is_wrong_rate",
          "int needs_reset", "int has_run", "int in_jump", "int has_previous"})
      c_.member(each);
    if (has_zeros_) c_.member("int zero_changed");
    for (const CInput& input : inputs_)
      c_.member(fmt::format("{} previous_{}", type(input), input.channel));
    write_evidence();
    if (list_.has_memory) write_memory();
    write_jumps();
    write_excursion();
    write_output();
    write_tick();
    write_run();
  }

 private:
  [[nodiscard]] static std::string type(const CInput& input) {
    return input.is_counted() ? "int64_t" : "@real";
  }
  [[nodiscard]] std::string number(double value) const {
    return c_.number(value, "a number of the guards");
  }
  /// Joined over the raw inputs.
  [[nodiscard]] std::string over_inputs(const std::string& separator,
                                        const std::function<std::string(std::size_t)>& text) const {
    std::string all;
    for (std::size_t i = 0; i < inputs_.size(); ++i) all += (i == 0 ? "" : separator) + text(i);
    return all;
  }
  [[nodiscard]] bool has_limit(std::size_t i) const { return std::isfinite(list_.jump_limits[i]); }
  [[nodiscard]] bool has_jumps() const {
    return std::ranges::any_of(list_.jump_limits,
                               [](double limit) { return std::isfinite(limit); });
  }

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

  // What the memory of the model has missed (MemoryError).

  struct Slips {
    std::vector<double> gain;
    std::vector<double> travel;
    std::vector<double> period_s;
    std::vector<std::size_t> input;
  };
  [[nodiscard]] Slips slips(bool of_first) const {
    Slips own;
    for (const SlipMemory& slip : list_.memory.slips) {
      if ((slip.input == 0) != of_first) continue;
      own.gain.push_back(slip.gain);
      own.travel.push_back(slip.travel);
      own.period_s.push_back(slip.period_s);
      own.input.push_back(slip.input);
    }
    return own;
  }

  void write_memory() {
    c_.member("int memory_is_open");  // the bound is not zero
    c_.member("@real bound");
    const bool is_declared = list_.memory.is_declared;
    const Slips first = slips(true);
    const Slips others = slips(false);
    const bool has_warm_up = !is_declared && std::isfinite(list_.warm_up_ticks);
    std::string bound;
    std::string lose;
    std::string advance;
    std::string reset;
    if (has_relaxations_) {
      const std::size_t count = list_.decay.size();
      std::vector<double> gain;
      std::vector<std::size_t> input;
      for (const Relaxation& each : list_.memory.relaxations) {
        gain.push_back(each.gain);
        input.push_back(each.input);
      }
      c_.table("relaxation_gain", gain);
      c_.table("relaxation_decay", list_.decay);
      c_.index_table("relaxation_input", input);
      c_.member(fmt::format("@real share[{}]", count));
      bound +=
          fmt::format("  for (i = 0U; i < {}; ++i) bound += @relaxation_gain[i] * s->share[i];\n",
                      counted(count));
      advance += fmt::format("  for (i = 0U; i < {}; ++i) s->share[i] *= @relaxation_decay[i];\n",
                             counted(count));
      reset += cleared(c_, "s->share", count);
      c_.add(R"c(
/* The error of a relaxation approaches a share for so many ticks; it does not decrease. */
static void @raise_share(@state *s, uint32_t i, @real towards, uint32_t ticks) {
  if (!(s->share[i] < towards)) return;
  s->share[i] = ticks == @ALL_TICKS
                    ? towards
                    : towards - (towards - s->share[i]) * @whole_power(@relaxation_decay[i], ticks);
}
)c");
    }
    if (!first.gain.empty()) {
      c_.table("slip_gain", first.gain);
      std::vector<double> travel;
      for (const double each : first.travel) travel.push_back(std::min(each, list_.first_width));
      c_.table("slip_travel", travel);
      for (const char* const each : {"@real unknown_travel", "@real travel_before", "@real lowest",
                                     "@real highest", "int has_range"})
        c_.member(each);
      bound += fmt::format(R"c(  covered = s->has_range ? s->highest - s->lowest : (@real)0;
  for (i = 0U; i < {}; ++i)
    bound += @slip_gain[i] *
             @larger((@real)0, @smaller(@slip_travel[i], s->unknown_travel) - covered);
)c",
                           counted(first.gain.size()));
      lose += c_.filled(R"c(  if (s->has_range) {
    s->travel_before = @larger((@real)0, s->unknown_travel - (s->highest - s->lowest));
    s->unknown_travel = s->travel_before;
  }
  s->unknown_travel =
      @smaller($WIDTH$, @larger(s->unknown_travel, s->travel_before + share * $WIDTH$));
  s->has_range = 0;
)c",
                        {{"WIDTH", number(list_.first_width)}});
      advance += R"c(  if (!s->has_range || x[0] < s->lowest) s->lowest = x[0];
  if (!s->has_range || x[0] > s->highest) s->highest = x[0];
  s->has_range = 1;
)c";
      reset +=
          "  s->unknown_travel = (@real)0;\n  s->travel_before = (@real)0;\n  s->has_range = 0;\n";
    }
    if (!others.gain.empty()) {
      const std::size_t count = others.gain.size();
      c_.table("travel_gain", others.gain);
      c_.table("travel_limit", others.travel);
      c_.table("travel_period", others.period_s);
      c_.index_table("travel_input", others.input);
      c_.add_type(R"c(
/* How far another input, or its integral, has moved since it was missed. */
typedef struct {
  @real position, lowest, highest, unknown;
  int has_range;
} @travel;
)c");
      c_.member(fmt::format("@travel others[{}]", count));
      c_.add(R"c(
static @real @travel_left(const @travel *of) {
  const @real seen = of->has_range ? of->highest - of->lowest : (@real)0;
  return @larger((@real)0, of->unknown - seen);
}
static void @miss_travel(@travel *of, @real unknown) {
  of->position = (@real)0;
  of->has_range = 0;
  of->unknown = unknown;
}
)c");
      bound += fmt::format(
          "  for (i = 0U; i < {}; ++i) bound += @travel_gain[i] * @travel_left(&s->others[i]);\n",
          counted(count));
      lose += fmt::format(
          "  for (i = 0U; others && i < {}; ++i) @miss_travel(&s->others[i], @travel_limit[i]);\n",
          counted(count));
      advance += fmt::format(R"c(  for (i = 0U; i < {}; ++i) {{
    @travel *of = &s->others[i];
    const @real u = x[@travel_input[i]];
    of->position = @travel_period[i] > (@real)0 ? of->position + @travel_period[i] * u : u;
    if (!of->has_range || of->position < of->lowest) of->lowest = of->position;
    if (!of->has_range || of->position > of->highest) of->highest = of->position;
    of->has_range = 1;
  }}
)c",
                             counted(count));
      reset += fmt::format("  for (i = 0U; i < {}; ++i) @miss_travel(&s->others[i], (@real)0);\n",
                           counted(count));
    }
    if (has_warm_up) {
      c_.member("uint32_t ticks_left");
      lose += fmt::format("  s->ticks_left = {:.0f}U;\n", std::min(list_.warm_up_ticks, 4e9));
      advance += "  if (s->ticks_left > 0U) --s->ticks_left;\n";
      reset += "  s->ticks_left = 0U;\n";
    }
    if (!is_declared)
      bound = has_warm_up ? "  if (s->ticks_left > 0U) bound = @BOUNDLESS;\n"
                          : "  bound = @BOUNDLESS;\n";
    const auto index = [](const std::string& text) {
      return text.find("i = 0U") != std::string::npos || text.find("; others") != std::string::npos;
    };
    c_.add(
        R"c(
static void @update_bound(@state *s) {
  @real bound = (@real)0$COVERED$;
$INDEX$$BOUND$  s->bound = bound;
}
static void @reset_memory(@state *s) {
$RESET_INDEX$$RESET$  s->bound = (@real)0;
  s->memory_is_open = 0;
}
static void @lose_travel(@state *s, @real share, int others) {
$LOSE_INDEX$  (void)share;
  (void)others;
$LOSE$  s->memory_is_open = 1;
  @update_bound(s);
}
/* So many ticks passed without usable inputs; not others: with a limited first input. */
static void @interrupt_memory(@state *s, uint32_t ticks, @real share, int others) {
$INTERRUPT$  @lose_travel(s, share, others);
}
/* In so many ticks the memory received a first input that may have been wrong by this share of its range. */
static void @doubt_memory(@state *s, uint32_t ticks, @real share) {
$DOUBT$  @lose_travel(s, @smaller(share, (@real)1), 1);
}
static void @lose_memory(@state *s) {
$ALL$  @interrupt_memory(s, 1U, (@real)1, 1);
}
/* One tick with usable inputs. */
static void @follow(@state *s, const @real *x) {
$ADVANCE_INDEX$  (void)x;
$ADVANCE$  @update_bound(s);
  if (!(s->bound > $NEGLIGIBLE$)) @reset_memory(s);
}
)c",
        {{"COVERED", bound.find("covered") == std::string::npos ? "" : ", covered"},
         {"INDEX", index(bound) ? "  uint32_t i;\n" : ""},
         {"BOUND", bound},
         {"RESET_INDEX", index(reset) ? "  uint32_t i;\n" : ""},
         {"RESET", reset},
         {"LOSE_INDEX", index(lose) ? "  uint32_t i;\n" : ""},
         {"LOSE", lose},
         {"INTERRUPT",
          has_relaxations_
              ? raise("others ? (@real)1 : @relaxation_input[i] == 0U ? share : (@real)0")
              : "  (void)ticks;\n"},
         {"DOUBT", has_relaxations_
                       ? raise("@relaxation_input[i] == 0U ? share : @smaller(share, (@real)1)")
                       : "  (void)ticks;\n"},
         {"ALL",
          has_relaxations_
              ? fmt::format("  uint32_t i;\n  for (i = 0U; i < {}; ++i) s->share[i] = (@real)1;\n",
                            counted(list_.decay.size()))
              : ""},
         {"ADVANCE_INDEX", index(advance) ? "  uint32_t i;\n" : ""},
         {"ADVANCE", advance},
         {"NEGLIGIBLE", number(list_.negligible)}});
    const bool has_others = !others.gain.empty() || std::ranges::any_of(list_.memory.relaxations,
                                                                        [](const Relaxation& each) {
                                                                          return each.input > 0;
                                                                        });
    if (has_others) write_missed_others(others);
  }

  [[nodiscard]] std::string raise(const std::string& towards) const {
    return fmt::format(
        "  uint32_t i;\n  for (i = 0U; i < {}; ++i) @raise_share(s, i, {}, ticks);\n",
        counted(list_.decay.size()), towards);
  }

  void write_missed_others(const Slips& others) {
    std::string body;
    if (has_relaxations_)
      body += fmt::format(R"c(  for (i = 0U; i < {}; ++i) {{
    const uint32_t input = @relaxation_input[i];
    if (input > 0U && missed[input] > (@real)0)
      s->share[i] = @larger(s->share[i], @smaller((@real)1, missed[input] / @widths[input]));
  }}
)c",
                          counted(list_.decay.size()));
    if (!others.gain.empty())
      body += fmt::format(R"c(  for (i = 0U; i < {}; ++i) {{
    const @real cut_off = missed[@travel_input[i]];
    const @real left = @travel_left(&s->others[i]);
    if (!(cut_off > (@real)0)) continue;
    @miss_travel(&s->others[i],
                 @smaller(@travel_limit[i], @travel_period[i] > (@real)0
                                                ? left + @travel_period[i] * cut_off
                                                : @larger(left, cut_off)));
  }}
)c",
                          counted(others.gain.size()));
    c_.table("widths", list_.widths);
    c_.add(R"c(
/* The memory received limited values of the other inputs. */
static void @miss_others(@state *s, const @real *missed) {
  uint32_t i;
$BODY$  s->memory_is_open = 1;
  @update_bound(s);
}
)c",
           {{"BODY", body}});
    has_missed_others_ = true;
  }

  // Jumps of the raw inputs.

  /// Whether the raw inputs `a` differ from `b` by more than they may change in `ticks`.
  [[nodiscard]] std::string differs(const std::string& a, const std::string& b,
                                    const std::string& ticks) const {
    std::string all;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      if (!has_limit(i)) continue;
      const CInput& input = inputs_[i];
      if (!all.empty()) all += " ||\n         ";
      const std::string change = fmt::format("{0}{2} - {1}{2}", a, b, input.channel);
      if (input.is_counted())
        all += fmt::format(
            "@distance({}) > (int64_t){} * INT64_C({})", change, ticks,
            static_cast<std::int64_t>(list_.jump_limits[i] / std::abs(*input.unit) * kCountParts));
      else
        all += fmt::format("@absolute({}) > (@real){} * {}", change, ticks,
                           number(list_.jump_limits[i]));
    }
    return all;
  }

  /// The change of a raw input in SI.
  [[nodiscard]] std::string change(std::size_t i, const std::string& a,
                                   const std::string& b) const {
    const CInput& input = inputs_[i];
    if (!input.is_counted()) return fmt::format("{0}{2} - {1}{2}", a, b, input.channel);
    return fmt::format("@from_counts({0}{2} - {1}{2}) * {3}", a, b, input.channel,
                       number(*input.unit / kCountParts));
  }

  void write_jumps() {
    if (std::ranges::any_of(inputs_, &CInput::is_counted))
      c_.add(R"c(
static int64_t @distance(int64_t x) { return x < 0 ? -x : x; }
static @real @from_counts(int64_t x) {
  const uint64_t size = x < 0 ? (uint64_t)0 - (uint64_t)x : (uint64_t)x;
  const @real real = (@real)(uint32_t)(size >> 32U) * (@real)4294967296.0 + (@real)(uint32_t)size;
  return x < 0 ? -real : real;
}
)c");
    if (!has_jumps()) return;
    c_.member("uint32_t level_ticks");
    c_.member("int has_returned");
    c_.member("@real level_error");
    for (const CInput& input : inputs_)
      c_.member(fmt::format("{} level_{}", type(input), input.channel));
    c_.member(fmt::format("@real jump[{}]", inputs_.size()));
    c_.member(fmt::format("@real offsets[{}]", inputs_.size()));
    std::string jumps;
    std::string levels;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      jumps +=
          fmt::format("    s->jump[{0}] = s->level_ticks == 0U ? {1} : s->jump[{0}] + ({2});\n", i,
                      change(i, "raw->", "s->previous_"), change(i, "raw->", "s->level_"));
      levels += fmt::format("  s->level_{0} = raw->{0};\n", inputs_[i].channel);
    }
    c_.add(R"c(
static int @differs_from_previous(const @state *s, const @raw *raw, uint32_t ticks) {
  if (!s->has_previous) return 0;
  return $FROM_PREVIOUS$;
}
static int @differs_from_level(const @state *s, const @raw *raw) {
  return $FROM_LEVEL$;
}
/* Whether a raw input has jumped, and its new level has not lasted yet. */
static int @is_new_level(@state *s, const @raw *raw) {
  const int is_explained = !@differs_from_previous(s, raw, s->missed + 1U);
  if (s->level_ticks == 0U && is_explained) return 0;
  if (s->level_ticks == 0U || @differs_from_level(s, raw)) {
$JUMPS$    s->has_returned = is_explained;
    s->level_ticks = s->has_returned && s->missed <= $GAP$ ? 0U : 1U;
  } else {
    ++s->level_ticks;
  }
$LEVELS$  return s->level_ticks > 0U && s->level_ticks <= $GAP$;
}
/* One of two levels is wrong: from now on the error bar contains the torque between them. */
static void @keep_offsets(@state *s) {
  @real torque = (@real)0;
  uint32_t i;
  for (i = 0U; i < $INPUTS$; ++i) {
    s->offsets[i] += s->jump[i];
    if (!(@absolute(s->offsets[i]) > $LIMITS$[i])) s->offsets[i] = (@real)0;
    torque += $SLOPES$[i] * s->offsets[i];
  }
  s->level_error = @absolute(torque);
}
)c",
           {{"FROM_PREVIOUS", differs("raw->", "s->previous_", "ticks")},
            {"FROM_LEVEL", differs("raw->", "s->level_", "1")},
            {"JUMPS", jumps},
            {"LEVELS", levels},
            {"GAP", counted(list_.longest_gap)},
            {"INPUTS", counted(inputs_.size())},
            {"LIMITS", c_.table("jump_limits", finite_limits())},
            {"SLOPES", c_.table("raw_slopes", list_.raw_slopes)}});
  }

  [[nodiscard]] std::vector<double> finite_limits() const {
    constexpr double kNone = 1e30;
    std::vector<double> limits = list_.jump_limits;
    for (double& limit : limits) limit = std::min(limit, kNone);
    return limits;
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
    if (has_reach())
      widen += R"c(    if (e->share > (@real)0)
      out.std_dev = @hypotenuse(out.std_dev * ((@real)1 + (@real)2 * e->share),
                                @smaller(e->first, (@real)1) * (out.value - @fallback(s, f)));
)c";
    std::string zeros;
    if (has_zeros_)
      zeros = R"c(  if (@has_unset_zeros(s)) {
    out.fault = @is_settled(s) ? @ZERO_NOT_SET : @WARMING_UP;
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
$RECOVERING$$DIVERGED$  return @NONE;
}
static @estimate @guarded(@state *s, const @real *f, const @excursion *e, const @estimate *raw) {
  const @real std_dev = @model_std_dev(raw);
  const int is_outside = e->borders > (@real)1 || e->fallback > (@real)1;
  @estimate out = @plain(raw->value);
  out.fault = @replaced_for(s, e, raw, std_dev);
  if (out.fault == @NONE) {
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
$ZEROS$  s->last_value = out.value;
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
                             ? fmt::format("  if (!(e->borders > (@real)1) && "
                                           "@absolute(raw->value) > {}) return @DIVERGED;\n",
                                           number(list_.largest_output))
                             : ""},
            {"FALLBACK_STD", fallback_std},
            {"WIDEN", widen},
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
      return fmt::format("    s->previous_{0} = raw->{0};\n", inputs_[i].channel);
    });
    const std::string may_have_jumped =
        list_.assumes_jumps ? (has_zeros_ ? "(s->in_jump || !@has_unset_zeros(s))" : "1")
                            : "s->in_jump";
    const std::string gap = counted(list_.longest_gap);
    c_.add(R"c(
static void @miss_tick(@state *s) {
  if (s->missed < @MOST_MISSED) ++s->missed;
}
static @estimate @tick(@state *s, const @raw *raw) {
  @real f[$FEATURES$];
$LIMITED$  const @real *x = f;
  @excursion e;
  @estimate own;
  int is_outside$IS_NEW$;
$CHECK_INPUTS$$JUMP$  if (s->poisoned || s->missed > $GAP$$LEVEL$) @reset_pipeline(s);
  @pipeline(s, raw, f);
  s->poisoned = $NOT_FINITE$;
  if (s->poisoned) {
    @miss_tick(s);
    return @held(s, @INPUT_NOT_FINITE);
  }
  @find_excursion(f, &e);
  is_outside = e.borders > (@real)1 || e.fallback > (@real)1;
  s->in_jump = $NEW$s->is_wrong_rate || (is_outside && $MAY_HAVE_JUMPED$);
  if (s->in_jump) {
    /* A jump can be an error of a sensor: no memory receives it. */
    s->poisoned = 1;
    @miss_tick(s);
    e.fallback = @BOUNDLESS;
$EXCLUDED$  } else {
    if (s->missed > 0U$ZERO_CHANGED$) @resume(s, f[0]);
$FOLLOW$$PREVIOUS$    s->has_previous = 1;
    if (s->needs_reset) @reset_model(s);
    s->needs_reset = 0;
    s->has_run = 1;
  }
  own = @model(s, x);
$LOST$  return @guarded(s, f, &e, &own);
}
)c",
           {{"FEATURES", fmt::format("{}", features_)},
            {"LIMITED", fmt::format("  @real limited[{}];\n", features_)},
            {"IS_NEW", has_jumps() ? ", is_new" : ""},
            {"CHECK_INPUTS", not_finite.empty() ? ""
                                                : fmt::format(R"c(  if ({}) {{
    @miss_tick(s);
    return @held(s, @INPUT_NOT_FINITE);
  }}
)c",
                                                              not_finite)},
            {"JUMP", has_jumps() ? fmt::format(R"c(  is_new = @is_new_level(s, raw);
  if (is_new && s->missed < {}) {{
    @miss_tick(s);
    s->in_jump = 1;
    return @held(s, @OUTSIDE_TRAINING_RANGE);
  }}
)c",
                                               gap)
                                 : ""},
            {"GAP", gap},
            {"LEVEL", has_jumps() ? " || s->level_ticks > 0U" : ""},
            {"NOT_FINITE", features_finite},
            {"NEW", has_jumps() ? "is_new || " : ""},
            {"MAY_HAVE_JUMPED", may_have_jumped},
            {"EXCLUDED", list_.has_memory
                             ? "    own = @plain((@real)0);\n    return @guarded(s, f, &e, &own);\n"
                             : "    s->has_run = 1;\n"},
            {"ZERO_CHANGED", has_zeros_ ? " || s->zero_changed" : ""},
            {"FOLLOW", follow()},
            {"PREVIOUS", previous},
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
    return "    if (is_outside) {\n      @limit(s, f, limited);\n      x = limited;\n    }" +
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
    std::string finite;
    std::string between;
    for (const CInput& input : inputs_) {
      if (!input.is_counted()) finite += fmt::format(" || !@is_finite(raw->{})", input.channel);
      between += input.is_counted() ? fmt::format(
                                          "    between.{0} = s->previous_{0} + (raw->{0} - "
                                          "s->previous_{0}) / (int64_t)(left + 1U);\n",
                                          input.channel)
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

  CText& c_;
  const CGuards& guards_;
  const GuardListing& list_;
  const EstimatorSettings& settings_;
  const std::vector<CInput>& inputs_;
  std::size_t features_;
  bool has_relaxations_;
  bool has_zeros_;
  bool has_missed_others_ = false;
};

}  // namespace

void write_guards(CText& c, const CGuards& guards) { GuardWriter(c, guards).write(); }

}  // namespace torsio
