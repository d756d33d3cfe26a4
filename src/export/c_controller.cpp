#include "export/c_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>

#include "control/controller_listing.hpp"
#include "export/c_inverse.hpp"
#include "export/c_loops.hpp"
#include "export/c_statements.hpp"
#include "torsio/core/error.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {
namespace {

using Actuation = DeflectionController::Actuation;

/// An angle of the sample: SI per count, or none for a real number.
std::optional<double> unit_of(const C99Options& options, std::string_view channel) {
  for (const CCounts& counts : options.counts)
    if (counts.channel == channel) return 2.0 * std::numbers::pi / counts.counts_per_turn;
  return std::nullopt;
}

/// The member of the sample: "gear_counts", "gear_angle_rad".
std::string member_of(const C99Options& options, std::string_view channel) {
  const std::string name(channel.substr(0, channel.find("_angle_rad")));
  return unit_of(options, channel) ? name + "_counts" : name + "_angle_rad";
}

class ControllerWriter {
 public:
  ControllerWriter(CText& c, const std::vector<CInput>& inputs, const C99Options& options)
      : c_(c),
        inputs_(inputs),
        options_(options),
        file_(*options.controller),
        joint_(file_.settings.torque.deflection.joint) {}

  void write(const ModelFile& model, const GuardListing& guards) {
    const JointControllerCore core(file_.settings, file_.sample_rate_Hz);
    listing_ = core.listing();
    c_.work(acts_on_speed() ? CWork::speed_control : CWork::control);
    if (file_.settings.torque.observer_cutoff_Hz) c_.work(CWork::observer);
    if (file_.stop) c_.work(CWork::brake);
    write_reference();
    write_loops(c_, file_.settings, listing_, file_.sample_rate_Hz);
    write_inverse(c_, model, guards, inputs_);
    write_types();
    write_measurement();
    if (file_.stop) write_stop();
    write_control();
  }

 private:
  [[nodiscard]] bool acts_on_speed() const {
    return file_.settings.torque.deflection.actuation == Actuation::velocity;
  }
  [[nodiscard]] std::string number(double value) const {
    return c_.number(value, "a number of the controller");
  }

  void write_reference() {
    c_.add_struct("reference",
                  "What a joint is asked for in one tick. A mode ignores the numbers that are not "
                  "listed for it, but all "
                  "must be\n   finite. position: position, impedance; velocity: velocity, and "
                  "feed-forward in position and impedance; "
                  "acceleration:\n   feed-forward in both; torque: torque, and feed-forward in "
                  "position, velocity and impedance; current: current, and\n"
                  "   feed-forward in every other mode; stiffness and damping, at least 0: "
                  "impedance; deflection: deflection.",
                  {"int mode", "@real position_rad", "@real velocity_rad_s",
                   "@real acceleration_rad_s2", "@real torque_Nm", "@real current_A",
                   "@real stiffness_Nm_rad", "@real damping_Nms_rad", "@real deflection_rad"});
    c_.add(R"c(
static int @is_number(const @reference *r) {
  return @is_finite(r->position_rad + r->velocity_rad_s + r->acceleration_rad_s2 + r->torque_Nm + r->current_A +
                    r->stiffness_Nm_rad + r->damping_Nms_rad + r->deflection_rad);
}
static int @is_reference(const @reference *r) {
  return @is_number(r) && r->mode >= @MODE_CURRENT && r->mode <= @MODE_DEFLECTION &&
         r->stiffness_Nm_rad >= (@real)0 && r->damping_Nms_rad >= (@real)0;
}
static void @clear_reference(@reference *r) {
  r->mode = @MODE_CURRENT;
  r->position_rad = r->velocity_rad_s = r->acceleration_rad_s2 = (@real)0;
  r->torque_Nm = r->current_A = r->stiffness_Nm_rad = (@real)0;
  r->damping_Nms_rad = r->deflection_rad = (@real)0;
}
static void @copy_reference(@reference *to, const @reference *from) {
  to->mode = from->mode;
  to->position_rad = from->position_rad;
  to->velocity_rad_s = from->velocity_rad_s;
  to->acceleration_rad_s2 = from->acceleration_rad_s2;
  to->torque_Nm = from->torque_Nm;
  to->current_A = from->current_A;
  to->stiffness_Nm_rad = from->stiffness_Nm_rad;
  to->damping_Nms_rad = from->damping_Nms_rad;
  to->deflection_rad = from->deflection_rad;
}
)c");
  }

  void write_types() {
    std::vector<std::string> sample;
    sample.reserve(kSampleAngles.size() + 2);
    for (const std::string_view angle : kSampleAngles)
      sample.push_back((unit_of(options_, angle) ? "int32_t " : "@real ") +
                       member_of(options_, angle));
    sample.emplace_back("@real motor_current_A");
    sample.emplace_back("int is_lost");
    const std::vector<std::string_view> members(sample.begin(), sample.end());
    c_.add_struct("sample",
                  "What a joint measures in one tick: the rotor before its gear, the two sides of "
                  "the spring; is_lost: "
                  "nothing was\n   measured.",
                  members);
    std::vector<std::string_view> command{"@real current_A",
                                          "@real wanted_torque_Nm",
                                          "@real wanted_deflection_rad",
                                          "@real wanted_velocity_rad_s",
                                          "@real angle_rad",
                                          "@real speed_rad_s",
                                          "@real spring_Nm",
                                          "@real thermal_load",
                                          "int limit",
                                          "int is_limited",
                                          "int is_reference_refused",
                                          "int inverse_fault",
                                          "int fault"};
    if (file_.stop)
      command.insert(command.end(),
                     {"@real motor_work_J", "int phase", "int is_powered", "int is_brake_open",
                      "int is_drive_at_rest", "int has_escalated"});
    c_.add_struct("command",
                  "What a joint does in one tick: current_A is for the drive. angle, speed: of the "
                  "rotor over the ratio; "
                  "spring: of\n   the linear spring; thermal_load: 1 is as hot as the winding may "
                  "be; limit: the last one that cut.",
                  command);
    if (file_.stop)
      c_.add_struct("stop_state", "A stop on request.",
                    {"int phase", "int category", "int is_triggered", "int has_escalated",
                     "int has_last", "@real since_s", "@real phase_s", "@real start_rad_s",
                     "@real hold_rad", "@real load_Nm", "@real slow_s", "@real work_J",
                     "@real applied_A", "@real last_angle_rad", "@real last_Nm"});
    const bool is_counted = unit_of(options_, kSampleAngles[0]).has_value();
    std::vector<std::string_view> control{"@spring spring",
                                          "@torque torque",
                                          "@cascade cascade",
                                          "@impedance impedance",
                                          "@difference speed",
                                          "@reference reference",
                                          is_counted ? "int32_t last_counts" : "@real last_rad",
                                          "@real angle_rad",
                                          "@real speed_rad_s",
                                          "@real spring_Nm",
                                          "@real deflection_rad",
                                          "@real moved_rad",
                                          "@real largest_Nm",
                                          "int is_measured",
                                          "int has_largest"};
    if (file_.stop) control.emplace_back("@stop_state stop");
    c_.add_struct("control",
                  "The state of a controlled joint; all bytes 0 are the state after a reset.",
                  control);
  }

  /// Statements that compute an angle in rad, times a factor.
  [[nodiscard]] std::string angle(std::string_view channel, double factor) const {
    const auto unit = unit_of(options_, channel);
    return fmt::format("(@real)sample->{} * {}", member_of(options_, channel),
                       number(unit.value_or(1.0) * factor));
  }

  [[nodiscard]] std::string deflection() {
    const auto gear = unit_of(options_, kSampleAngles[1]);
    const auto joint = unit_of(options_, kSampleAngles[2]);
    if (!gear || !joint)
      return fmt::format("{} - {}", angle(kSampleAngles[1], 1.0), angle(kSampleAngles[2], 1.0));
    need_fixed(c_);
    const auto [sum, scale] = whole_sum({{"(int64_t)sample->gear_counts", *gear / kCountParts},
                                         {"(int64_t)sample->joint_counts", -*joint / kCountParts}});
    return fmt::format("@from_fixed({}) * {}", sum, number(scale * kCountParts));
  }

  void write_measurement() {
    const double per_ratio = 1.0 / joint_.drive.ratio;
    const auto motor = unit_of(options_, kSampleAngles[0]);
    const std::string moved =
        motor
            ? c_.filled(
                  R"c(  s->moved_rad = (@real)(int32_t)((uint32_t)sample->motor_counts - (uint32_t)s->last_counts) * $UNIT$;
  s->last_counts = sample->motor_counts;
)c",
                  {{"UNIT", number(*motor * per_ratio)}})
            : c_.filled("  s->moved_rad = angle_rad - s->last_rad;\n  s->last_rad = angle_rad;\n");
    const Lowpass::Gains gains =
        Lowpass(file_.settings.speed_cutoff_Hz, file_.sample_rate_Hz).gains();
    const std::string deflected = deflection();
    c_.add(R"c(
static void @measure(@control *s, const @sample *sample) {
  const @real angle_rad = $ANGLE$;
  const @real deflection_rad = $DEFLECTION$;
  s->is_measured = !sample->is_lost && @is_finite(angle_rad + deflection_rad);
  if (!s->is_measured) {
    s->speed.is_skipped = 1;
    s->angle_rad = s->speed_rad_s = s->spring_Nm = @not_a_number();
    s->moved_rad = (@real)0;
    return;
  }
  s->deflection_rad = deflection_rad;
$MOVED$  s->angle_rad = angle_rad;
  s->speed_rad_s = @changed(&s->speed, s->moved_rad, $LOWPASS$);
  s->spring_Nm = $STIFFNESS$ * deflection_rad;
}
)c",
           {{"ANGLE", angle(kSampleAngles[0], per_ratio)},
            {"DEFLECTION", deflected},
            {"MOVED", moved},
            {"LOWPASS", c_.table("speed_lowpass", std::array{gains.band, gains.low, gains.high})},
            {"STIFFNESS", number(joint_.stiffness_Nm_rad)}});
  }

  void write_stop() {
    const JointStop::Settings& stop = *file_.stop;
    const double period_s = 1.0 / file_.sample_rate_Hz;
    constexpr double kTicksOfACurrent = 2.0;
    constexpr double kReleaseMargin = 2.0;
    const double time_s = kTicksOfACurrent * period_s;
    c_.add(R"c(
static void @begin_phase(@stop_state *p, int phase) {
  if (phase == @PHASE_RAMPING) {
    p->since_s = p->work_J = (@real)0;
    p->has_escalated = 0;
  }
  p->phase = phase;
  p->phase_s = (@real)0;
}
static void @escalate(@stop_state *p) {
  p->has_escalated = 1;
  @begin_phase(p, @PHASE_OFF);
}
static int @is_under_power(const @stop_state *p) {
  return p->phase == @PHASE_RAMPING || p->phase == @PHASE_ENGAGING || p->phase == @PHASE_HOLDING ||
         p->phase == @PHASE_RELEASING;
}
static void @watch(@stop_state *p, @real angle_rad, @real speed_rad_s, @real spring_Nm) {
  if (!@is_finite(angle_rad + speed_rad_s)) {
    p->slow_s = (@real)0;
    p->has_last = 0;
    if (@is_under_power(p)) @escalate(p);
    return;
  }
  p->slow_s = @absolute(speed_rad_s) <= $STANDSTILL$ ? p->slow_s + $PERIOD$ : (@real)0;
  if (p->has_last) p->work_J += $PER_A$ * p->applied_A * (angle_rad - p->last_angle_rad);
  p->last_angle_rad = angle_rad;
  p->has_last = 1;
  if (@is_finite(spring_Nm)) p->last_Nm = spring_Nm;
}
static void @advance_phase(@stop_state *p, @real angle_rad) {
  const int is_lost = !(@absolute(angle_rad - p->hold_rad) <= $HOLD$);
  if (p->phase == @PHASE_RAMPING) {
    if (p->slow_s >= $STANDSTILL_TIME$) {
      p->hold_rad = angle_rad;
      @begin_phase(p, p->category == 2 ? @PHASE_HOLDING : @PHASE_ENGAGING);
    } else if (p->since_s >= $LONGEST$) {
      @escalate(p);
    }
  } else if (p->phase == @PHASE_ENGAGING) {
    if (is_lost)
      @escalate(p);
    else if (p->phase_s >= $ENGAGE$)
      @begin_phase(p, @PHASE_OFF);
  } else if (p->phase == @PHASE_HOLDING) {
    if (is_lost) @escalate(p);
  } else if (p->phase == @PHASE_RELEASING) {
    if (is_lost)
      @escalate(p);
    else if (p->phase_s >= $RELEASED$)
      @begin_phase(p, @PHASE_RUNNING);
  }
}
/* What the controller gets in the place of the reference. */
static void @stop_reference(@control *s, @reference *r) {
  @stop_state *p = &s->stop;
  @watch(p, s->angle_rad, s->speed_rad_s, s->spring_Nm);
  if (p->is_triggered) {
    p->is_triggered = 0;
    @begin_phase(p, @PHASE_RAMPING);
    p->slow_s = (@real)0;
    p->start_rad_s = s->speed_rad_s;
    if (!s->is_measured) @escalate(p);
  }
  @advance_phase(p, s->angle_rad);
  p->since_s += $PERIOD$;
  p->phase_s += $PERIOD$;
  if (p->phase == @PHASE_RUNNING) return;
  @clear_reference(r);
  if (p->phase == @PHASE_OFF) return;
  r->mode = @MODE_VELOCITY;
  if (p->phase == @PHASE_RELEASING) r->torque_Nm = p->load_Nm;
  if (p->phase == @PHASE_RAMPING) {
    const @real left_rad_s = @absolute(p->start_rad_s) - $DECELERATION$ * p->phase_s;
    if (left_rad_s > (@real)0) {
      r->velocity_rad_s = p->start_rad_s < (@real)0 ? -left_rad_s : left_rad_s;
      r->acceleration_rad_s2 = p->start_rad_s < (@real)0 ? $DECELERATION$ : -$DECELERATION$;
    }
  }
}
/* A current of which no work is positive, as far as the rotor moves as predicted while it acts. */
static @real @without_work(const @control *s, @real current_A) {
  const @real torque_Nm = $PER_A$ * current_A;
  const @real spring_Nm = @is_finite(s->spring_Nm) ? s->spring_Nm : (@real)0;
  const @real square_J = torque_Nm * torque_Nm * $TRAVEL$;
  const @real line_J = torque_Nm * (s->speed_rad_s * $TIME$ - spring_Nm * $TRAVEL$);
  const @real budget_J = @larger(-s->stop.work_J, (@real)0);
  @real root_J, share;
  if (!(square_J + line_J > budget_J)) return current_A;
  root_J = @square_root(line_J * line_J + (@real)4 * square_J * budget_J);
  share = line_J > (@real)0 ? (@real)2 * budget_J / (line_J + root_J) : (root_J - line_J) / ((@real)2 * square_J);
  if (!@is_finite(share)) return (@real)0;
  return share < (@real)1 ? current_A * share : current_A;
}
/* Cuts the current of the controller. */
static void @stop_step(@control *s, @command *out) {
  @stop_state *p = &s->stop;
  if (out->fault != @NONE && @is_under_power(p)) @escalate(p);
  if (!@is_finite(out->current_A)) out->current_A = (@real)0;
  out->phase = p->phase;
  out->is_powered = p->phase != @PHASE_OFF;
  out->is_drive_at_rest = p->slow_s >= $STANDSTILL_TIME$;
  out->has_escalated = p->has_escalated;
  if (p->phase == @PHASE_OFF)
    out->current_A = (@real)0;
  else if (p->phase != @PHASE_RUNNING && p->phase != @PHASE_RELEASING)
    out->current_A = @without_work(s, out->current_A);
  out->is_brake_open = p->phase != @PHASE_OFF && p->phase != @PHASE_ENGAGING &&
                       !(p->phase == @PHASE_RELEASING && p->phase_s <= $TAKEOVER$);
  out->motor_work_J = p->phase != @PHASE_RUNNING ? p->work_J : (@real)0;
  p->applied_A = out->current_A;
}

void @trigger_stop(@control *control, int category) {
  @stop_state *p = &control->stop;
  const int is_stopping = p->phase != @PHASE_RUNNING && p->phase != @PHASE_RELEASING;
  if (category < 0) category = 0;
  if (category > 2) category = 2;
  if ((is_stopping || p->is_triggered) && category >= p->category) return;
  p->category = category;
  if (!is_stopping) p->is_triggered = 1;
  if (category == 0) {
    if (!is_stopping) {
      @begin_phase(p, @PHASE_RAMPING);
      p->has_last = 0;
    }
    p->is_triggered = 0;
    @begin_phase(p, @PHASE_OFF);
  } else if (p->phase == @PHASE_HOLDING) {
    @begin_phase(p, @PHASE_ENGAGING);
  }
}

int @release_stop(@control *control) {
  @stop_state *p = &control->stop;
  if ((p->phase != @PHASE_OFF && p->phase != @PHASE_HOLDING) || !(p->slow_s >= $STANDSTILL_TIME$)) return 0;
  @begin_phase(p, p->phase == @PHASE_HOLDING ? @PHASE_RUNNING : @PHASE_RELEASING);
  p->has_escalated = 0;
  p->load_Nm = p->last_Nm;
  p->hold_rad = p->last_angle_rad;
  return 1;
}
)c",
           {{"STANDSTILL_TIME", number(stop.standstill_s)},
            {"STANDSTILL", number(stop.standstill_rad_s)},
            {"PERIOD", number(period_s)},
            {"PER_A", number(stop.drive.torque_per_current())},
            {"HOLD", number(stop.hold_rad)},
            {"LONGEST", number(stop.longest_ramp_s)},
            {"ENGAGE", number(stop.brake_engage_s)},
            {"RELEASED", number(stop.takeover_s + kReleaseMargin * stop.brake_release_s)},
            {"DECELERATION", number(stop.deceleration_rad_s2)},
            {"TRAVEL", number(0.5 * time_s * time_s / stop.drive.inertia())},
            {"TIME", number(time_s)},
            {"TAKEOVER", number(stop.takeover_s)}});
  }

  [[nodiscard]] std::string raw_inputs() const {
    std::string text;
    for (const CInput& input : inputs_) {
      if (input.channel == "torque_Nm") {
        text += c_.filled("  raw.torque_Nm = (@real)0;\n");
      } else if (input.channel == "spring_deflection_rad") {
        text += c_.filled(
            "  raw.spring_deflection_rad = s->is_measured ? s->deflection_rad : "
            "@not_a_number();\n");
      } else if (input.is_counted()) {
        text += fmt::format("  raw.{} = (int64_t)sample->{} * {:.0f};\n", input.channel,
                            member_of(options_, input.channel), kCountParts);
      } else {
        text += fmt::format("  raw.{0} = sample->{0};\n", input.channel);
      }
    }
    return text;
  }

  void write_control() {
    const bool has_stop = file_.stop.has_value();
    const std::string stiffness = number(joint_.stiffness_Nm_rad);
    const double margin = listing_.cascade.margin_rad;
    const JointCascade::Limits& limits = file_.settings.limits;
    c_.add(
        R"c(
static int @uses_spring(int mode) { return mode >= @MODE_TORQUE; }
/* Between two modes of the spring the loop keeps its integral. */
static void @enter_mode(@control *s, int mode) {
  if (mode == s->reference.mode) return;
  if (!@uses_spring(s->reference.mode)) @reset_torque(&s->torque);
  @reset_impedance(&s->impedance);
  s->cascade.is_switching = 1;
}
static @real @wanted_torque(@control *s) {
  const @reference *r = &s->reference;
  if (r->mode == @MODE_TORQUE) return r->torque_Nm;
  if (r->mode == @MODE_IMPEDANCE) return @step_impedance(&s->impedance, r, s->angle_rad, s->speed_rad_s);
  if (r->mode == @MODE_DEFLECTION) return $STIFFNESS$ * r->deflection_rad;
  return $STIFFNESS$ * s->deflection_rad;
}
static void @track_spring(@control *s, @real applied_A) {
  (void)applied_A;
  @track_torque(&s->torque, $TRACKED$);
}
static void @track(@control *s, @real applied_A) {
  @track_cascade(&s->cascade, applied_A);
  if (!@uses_spring(s->reference.mode)) return;
$MOTOR_CURRENT$  @track_spring(s, applied_A);
}
static int @limit_of(const @control *s, int is_spring) {
$SLOWED$  (void)is_spring;
  return s->cascade.limit;
}

void @control_step(@control *control, const @reference *wanted, const @sample *sample, @command *out) {
  @control *s = control;
  @reference r;
  @raw raw;
  const @reference *command;
  int is_number, is_accepted, is_spring;
  @measure(s, sample);
$RAW$  @copy_reference(&r, wanted);
$STOP_REFERENCE$  is_number = @is_number(&r);
  is_accepted = @is_reference(&r);
  if (is_accepted) {
    @enter_mode(s, r.mode);
    @copy_reference(&s->reference, &r);
  }
  is_spring = @uses_spring(s->reference.mode);
  @accept_torque(&s->torque, @wanted_torque(s), s->has_largest ? s->largest_Nm : $LARGEST$,
                 s->reference.mode == @MODE_IMPEDANCE);
  @invert_spring(&s->spring, s->torque.wanted_Nm, &raw, s->is_measured ? s->deflection_rad : @not_a_number(), sample->is_lost);
  out->wanted_torque_Nm = s->torque.wanted_Nm;
  out->wanted_deflection_rad = s->deflection_rad;
  out->inverse_fault = @NONE;
  out->is_limited = 0;
  command = &s->reference;
  if (is_spring) {
    const int is_deflection = s->reference.mode == @MODE_DEFLECTION;
    out->inverse_fault = is_deflection ? @NONE : s->spring.fault;
    @step_torque(&s->torque, is_deflection ? s->torque.wanted_Nm * $PER_STIFFNESS$ : s->spring.wanted_rad,
                 s->is_measured ? s->deflection_rad : @not_a_number(), s->moved_rad);
    out->wanted_deflection_rad = s->torque.deflection.wanted_rad;
    out->is_limited = s->torque.is_limited;
    @clear_reference(&r);
    r.mode = $INNER_MODE$;
    r.velocity_rad_s = s->torque.speed_rad_s;
    r.current_A = s->reference.current_A + s->torque.current_A;
    command = &r;
  }
  @step_cascade(&s->cascade, command, s->angle_rad, s->speed_rad_s, s->spring_Nm);
  out->current_A = s->cascade.current_A;
  out->limit = @limit_of(s, is_spring);
  out->is_limited = out->is_limited || out->limit != @LIMIT_NONE;
  out->is_reference_refused = !is_accepted;
  out->fault = is_number ? s->cascade.fault : @INPUT_NOT_FINITE;
  out->wanted_velocity_rad_s = s->cascade.wanted_velocity_rad_s;
  out->angle_rad = s->angle_rad;
  out->speed_rad_s = s->speed_rad_s;
  out->spring_Nm = s->spring_Nm;
  out->thermal_load = s->cascade.load;
  if (is_spring && s->cascade.fault == @NONE) {
$MOTOR_CURRENT_OUT$    if (out->limit != @LIMIT_NONE) @track_spring(s, out->current_A);
  }
  @follow_spring(&s->spring, out->wanted_deflection_rad);
$STOP_STEP$}

int @set_limits(@control *control, @real lowest_rad, @real highest_rad, @real speed_rad_s, @real torque_Nm) {
  const @real soft_rad_s = speed_rad_s - $SOFTNESS$;
  if (!(speed_rad_s <= $SPEED$ && soft_rad_s > (@real)0 && highest_rad - lowest_rad > $TWICE_MARGIN$ &&
        torque_Nm > (@real)0))
    return 0;
  control->cascade.lowest_rad = lowest_rad;
  control->cascade.highest_rad = highest_rad;
  control->cascade.soft_speed_rad_s = soft_rad_s;
  control->cascade.has_limits = 1;
  control->largest_Nm = torque_Nm;
  control->has_largest = 1;
  return 1;
}

int @set_gains(@control *control, @real position_1_s, const @gains *velocity) {
  if (!(position_1_s >= (@real)0 && @is_finite(position_1_s)) || !@are_gains(velocity)) return 0;
  control->cascade.position_1_s = position_1_s;
  control->cascade.has_gains = 1;
  @change_gains(&control->cascade.velocity, &@VELOCITY, velocity);
  control->cascade.is_switching = 1;
  return 1;
}

void @control_reset(@control *control) {
  @reset_spring(&control->spring);
  @reset_torque(&control->torque);
  @reset_cascade(&control->cascade);
  @reset_impedance(&control->impedance);
  @reset_difference(&control->speed);
  @clear_reference(&control->reference);
  control->deflection_rad = (@real)0;
}
)c",
        {{"STIFFNESS", stiffness},
         {"PER_STIFFNESS", number(1.0 / joint_.stiffness_Nm_rad)},
         {"TRACKED", acts_on_speed()
                         ? "s->speed_rad_s"
                         : "applied_A - s->cascade.transfer_A - s->reference.current_A"},
         {"MOTOR_CURRENT",
          acts_on_speed() ? "" : "  if (@is_finite(applied_A)) s->torque.applied = applied_A;\n"},
         {"MOTOR_CURRENT_OUT", acts_on_speed() ? "" : "    s->torque.applied = out->current_A;\n"},
         {"SLOWED",
          acts_on_speed()
              ? c_.filled(R"c(  const @real applied_rad_s = s->cascade.wanted_velocity_rad_s;
  const @real soft_rad_s = s->cascade.has_limits ? s->cascade.soft_speed_rad_s : $SOFT$;
  if (is_spring && s->cascade.fault == @NONE && s->cascade.limit == @LIMIT_NONE &&
      (applied_rad_s < s->torque.speed_rad_s || applied_rad_s > s->torque.speed_rad_s))
    return @absolute(applied_rad_s) < soft_rad_s ? @LIMIT_POSITION : @LIMIT_SPEED;
)c",
                          {{"SOFT", number(listing_.cascade.soft_speed_rad_s)}})
              : ""},
         {"RAW", raw_inputs()},
         {"STOP_REFERENCE", has_stop ? "  @stop_reference(s, &r);\n" : ""},
         {"LARGEST", std::isfinite(listing_.largest_torque_Nm) ? number(listing_.largest_torque_Nm)
                                                               : "@BOUNDLESS"},
         {"INNER_MODE", acts_on_speed() ? "@MODE_VELOCITY" : "@MODE_CURRENT"},
         {"STOP_STEP", has_stop ? R"c(  {
    const @real before_A = out->current_A;
    @stop_step(s, out);
    if (out->current_A < before_A || out->current_A > before_A) @track(s, out->current_A);
  }
)c"
                                : "  (void)&@track;\n"},
         {"SOFTNESS", number(limits.speed_rad_s - listing_.cascade.soft_speed_rad_s)},
         {"SPEED", number(limits.speed_rad_s)},
         {"TWICE_MARGIN", number(2.0 * margin)}});
  }

  CText& c_;
  const std::vector<CInput>& inputs_;
  const C99Options& options_;
  const ControllerFile& file_;
  const SeriesElasticJoint& joint_;
  ControllerListing listing_ = {};
};

}  // namespace

void write_controller(CText& c, const ModelFile& model, const GuardListing& guards,
                      const std::vector<CInput>& inputs, const C99Options& options) {
  if (options.controller->sample_rate_Hz != model.settings.sample_rate_Hz)
    throw UsageError({.place = "--controller",
                      .expected = fmt::format("a controller at the rate of the model, {:g} Hz",
                                              model.settings.sample_rate_Hz),
                      .found = fmt::format("{:g} Hz", options.controller->sample_rate_Hz)});
  ControllerWriter(c, inputs, options).write(model, guards);
}

std::string controller_header(const C99Options& options) {
  std::string text = R"c(
/* One tick of the joint: after it, out->current_A is for the drive. */
void @control_step(@control *control, const @reference *wanted, const @sample *sample, @command *out);
/* The state as it was before the first step; gains, limits, the temperature of the winding and a stop are kept. */
void @control_reset(@control *control);
/* Limits of the motion and of the wanted torque from the next tick on; 0, and all are kept, if they do not fit. */
int @set_limits(@control *control, @real lowest_rad, @real highest_rad, @real speed_rad_s, @real torque_Nm);
/* Gains of position and velocity from the next tick on, without a jump; 0, and all are kept, if one is negative or not finite. */
int @set_gains(@control *control, @real position_1_s, const @gains *velocity);
)c";
  if (options.controller->stop)
    text +=
        R"c(/* Brings the joint to rest: 0 removes the power at once, 1 after a ramp and once the brake has closed, 2 ramps and holds. */
void @trigger_stop(@control *control, int category);
/* Ends a stop whose drive is at rest; 0, and nothing changes, if it is not. */
int @release_stop(@control *control);
)c";
  return text;
}

}  // namespace torsio
