#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "export/c_guard_parts.hpp"
#include "export/c_statements.hpp"

namespace torsio {
namespace {

class JumpsWriter : private CGuardParts {
 public:
  using CGuardParts::CGuardParts;

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
};

}  // namespace

void write_jumps(CText& c, const CGuards& guards) { JumpsWriter(c, guards).write_jumps(); }

}  // namespace torsio
