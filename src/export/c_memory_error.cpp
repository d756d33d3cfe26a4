#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "export/c_guard_parts.hpp"
#include "export/c_statements.hpp"

namespace torsio {
namespace {

class MemoryWriter : private CGuardParts {
 public:
  using CGuardParts::CGuardParts;

  /// @returns whether `NAME_miss_others` was written
  bool write() {
    write_memory();
    return has_missed_others_;
  }

 private:
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
      c_.add_struct(
          "travel", "How far another input, or its integral, has moved since it was missed.",
          {"@real position", "@real lowest", "@real highest", "@real unknown", "int has_range"});
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

  bool has_relaxations_ = !list_.memory.relaxations.empty();
  bool has_missed_others_ = false;
};

}  // namespace

bool write_memory_error(CText& c, const CGuards& guards) { return MemoryWriter(c, guards).write(); }

}  // namespace torsio
