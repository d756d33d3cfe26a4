#include "export/c_guard_parts.hpp"

namespace torsio {
namespace {

/// `detail::StrokeClock` in C, and what a long stroke adds to the error bar.
class StrokesWriter : private CGuardParts {
 public:
  using CGuardParts::CGuardParts;

  void write() {
    for (const char* const each :
         {"uint32_t stroke_ticks", "uint32_t previous_stroke", "uint32_t since_extreme",
          "@real extreme", "int stroke_direction"})
      c_.member(each);
    c_.add(R"c(
static void @follow_stroke(@state *s, @real x) {
  @real moved;
  if (s->stroke_ticks == 0U) s->extreme = x;
  if (s->stroke_ticks < @MAX_MISSED) ++s->stroke_ticks;
  if (s->since_extreme < @MAX_MISSED) ++s->since_extreme;
  moved = x - s->extreme;
  if (s->stroke_direction == 0) {
    if (!(@absolute(moved) > $DEAD_BAND$)) return;
    s->stroke_direction = moved > (@real)0 ? 1 : -1;
  } else if (moved * (@real)s->stroke_direction < (@real)0) {
    if (!(@absolute(moved) > $DEAD_BAND$)) return;
    s->previous_stroke = s->stroke_ticks - s->since_extreme;
    s->stroke_ticks = s->since_extreme;
    s->stroke_direction = -s->stroke_direction;
  }
  s->extreme = x;
  s->since_extreme = 0U;
}
/* What a stroke that lasts longer than those of the training adds to the error bar. */
static @real @stroke_std_dev(const @state *s) {
  const uint32_t ticks =
      s->stroke_ticks > s->previous_stroke ? s->stroke_ticks : s->previous_stroke;
  const @real share = (@real)ticks * $PER_LONGEST$;
  const @real beyond = share - (@real)1;
  if (!(beyond > (@real)0)) return (@real)0;
  return @smaller(beyond * beyond / share * $GROWTH$, $LIMIT$);
}
)c",
           {{"DEAD_BAND", number(settings_.strokes.dead_band)},
            {"PER_LONGEST", number(1.0 / list_.longest_stroke)},
            {"GROWTH", number(settings_.strokes.growth)},
            {"LIMIT", number(settings_.strokes.limit)}});
  }
};

}  // namespace

void write_strokes(CText& c, const CGuards& guards) { StrokesWriter(c, guards).write(); }

}  // namespace torsio
