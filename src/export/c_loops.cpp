#include "export/c_loops.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "export/c_statements.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {
namespace {

using Settings = JointControllerCore::Settings;
using Actuation = DeflectionController::Actuation;

class LoopWriter {
 public:
  LoopWriter(CText& c, const Settings& settings, const ControllerListing& listing,
             double sample_rate_Hz)
      : c_(c), settings_(settings), list_(listing), rate_Hz_(sample_rate_Hz) {}

  void write() {
    need_lowpass(c_);
    write_difference();
    write_pid();
    write_deflection();
    if (has_observer()) write_observer();
    write_torque();
    write_impedance();
    write_cascade();
  }

 private:
  [[nodiscard]] bool acts_on_speed() const {
    return settings_.torque.deflection.actuation == Actuation::velocity;
  }
  [[nodiscard]] bool has_observer() const {
    return settings_.torque.observer_cutoff_Hz.has_value();
  }
  [[nodiscard]] std::string number(double value) const {
    return c_.number(value, "a number of the controller");
  }
  /// A limit that may be infinite.
  [[nodiscard]] std::string limit(double value) const {
    if (std::isfinite(value)) return number(value);
    return value > 0.0 ? "@BOUNDLESS" : "-@BOUNDLESS";
  }
  [[nodiscard]] std::string gains(const Pid::Gains& gains) const {
    return fmt::format("{{{}, {}, {}}}", number(gains.proportional), number(gains.integral),
                       number(gains.derivative));
  }
  /// The factors of a low-pass as a table. @returns its name
  [[nodiscard]] std::string lowpass(const std::string& name, double cutoff_Hz) {
    const Lowpass::Gains own = Lowpass(cutoff_Hz, rate_Hz_).gains();
    return c_.table(name, std::vector<double>{own.band, own.low, own.high});
  }

  void write_difference() {
    c_.add_struct(
        "difference", "The difference of a signal over one sample, low-passed.",
        {"@real previous", "@real rate", "@filter lowpass", "uint32_t seen", "int is_skipped"});
    c_.add(R"c(
static void @reset_difference(@difference *d) {
  d->rate = (@real)0;
  d->lowpass.is_started = 0;
  d->seen = 0U;
  d->is_skipped = 0;
}
/* The rate of a signal that changed by so much; gains of the low-pass, or 0. */
static @real @changed(@difference *d, @real change, const @real *gains) {
  if (d->seen > 0U && !d->is_skipped) d->rate = change * $RATE$;
  d->is_skipped = 0;
  if (d->seen < 2U) ++d->seen;
  return gains == 0 ? d->rate : @lowpass(&d->lowpass, gains, d->rate);
}
static @real @rate(@difference *d, @real x, const @real *gains) {
  const @real change = x - d->previous;
  d->previous = x;
  return @changed(d, change, gains);
}
/* The step of a command that a change would cause, which decays. */
static @real @decayed(@real *bump, @real keep) {
  const @real now = *bump;
  *bump = @absolute(now) > (@real)1e-30 ? now * keep : (@real)0;
  return now;
}
)c",
           {{"RATE", number(rate_Hz_)}});
  }

  void write_pid() {
    c_.add_struct("gains", "Of a loop: command per error, per its integral and per its rate.",
                  {"@real proportional", "@real integral", "@real derivative"});
    c_.add_struct("pid", "A PID controller: its command, the terms of it, and its memory.",
                  {"@gains gains", "int has_gains", "@difference difference", "@real command",
                   "@real proportional", "@real integral", "@real derivative", "@real transfer",
                   "int is_limited", "@real bump", "@real sum", "@real rate", "@real error",
                   "@real increment", "int is_starting"});
    c_.add(R"c(
typedef struct {
  @gains gains;
  const @real *lowpass; /* of the derivative, or 0 */
  @real largest;        /* command */
  int is_conditional;   /* integration, else back calculation */
} @pid_settings;

static const @gains *@gains_of(const @pid *p, const @pid_settings *k) {
  return p->has_gains ? &p->gains : &k->gains;
}
static @real @tracking_share(const @gains *g) {
  @real time;
  if (!(g->integral > (@real)0)) return (@real)0;
  time = g->proportional / g->integral;
  return $PERIOD$ / (time > $PERIOD$ ? time : $PERIOD$);
}
/* Clears the memory; the next command is this one. */
static void @start_pid(@pid *p, const @pid_settings *k, @real command) {
  @reset_difference(&p->difference);
  p->command = @limited(command, -k->largest, k->largest);
  p->proportional = p->integral = p->derivative = p->transfer = (@real)0;
  p->is_limited = 0;
  p->bump = p->sum = p->rate = p->error = p->increment = (@real)0;
  p->is_starting = 1;
}
static void @reset_pid(@pid *p, const @pid_settings *k) {
  @start_pid(p, k, (@real)0);
  p->is_starting = 0;
}
/* 0 where a value was not finite: the last command is held. */
static int @step_pid(@pid *p, const @pid_settings *k, @real reference, @real measured, @real feed_forward) {
  const @gains *g = @gains_of(p, k);
  const @real error = reference - measured;
  @real terms, wanted, excess;
  if (!@is_finite(error + feed_forward)) {
    p->difference.is_skipped = 1;
    return 0;
  }
  p->rate = @rate(&p->difference, -measured, k->lowpass);
  terms = g->proportional * error + p->sum + g->derivative * p->rate + feed_forward;
  if (p->is_starting) p->bump += p->command - terms;
  wanted = @decayed(&p->bump, $KEEP$);
  p->transfer = wanted;
  wanted += terms;
  if (!@is_finite(wanted)) {
    @start_pid(p, k, p->command);
    p->difference.is_skipped = 1;
    return 0;
  }
  p->is_starting = 0;
  p->proportional = g->proportional * error;
  p->integral = p->sum;
  p->derivative = g->derivative * p->rate;
  p->command = @limited(wanted, -k->largest, k->largest);
  p->is_limited = p->command < wanted || p->command > wanted;
  p->error = error;
  p->increment = $PERIOD$ * g->integral * error;
  excess = wanted - p->command;
  if (k->is_conditional) {
    if (p->increment * excess > (@real)0) p->increment = (@real)0;
    p->sum += p->increment;
  } else {
    p->sum += p->increment - @tracking_share(g) * excess;
  }
  return 1;
}
/* The command that was applied in place of the last one. */
static void @track_pid(@pid *p, const @pid_settings *k, @real applied) {
  const @real excess = p->command - applied;
  if (!@is_finite(applied)) return;
  if (!k->is_conditional) {
    p->sum -= @tracking_share(@gains_of(p, k)) * excess;
  } else if (p->increment * excess > (@real)0) {
    p->sum -= p->increment;
    p->increment = (@real)0;
  }
  p->command = applied;
}
static int @are_gains(const @gains *g) {
  return g->proportional >= (@real)0 && g->integral >= (@real)0 && g->derivative >= (@real)0 &&
         @is_finite(g->proportional + g->integral + g->derivative);
}
static void @change_gains(@pid *p, const @pid_settings *k, const @gains *to) {
  const @gains *from = @gains_of(p, k);
  p->bump += (from->proportional - to->proportional) * p->error + (from->derivative - to->derivative) * p->rate;
  p->gains.proportional = to->proportional;
  p->gains.integral = to->integral;
  p->gains.derivative = to->derivative;
  p->has_gains = 1;
}
)c",
           {{"PERIOD", number(1.0 / rate_Hz_)}, {"KEEP", number(list_.pid_transfer_keep)}});
  }

  void write_deflection() {
    const DeflectionController::Settings& own = settings_.torque.deflection;
    c_.add_struct("deflection", "Deflection control of the spring.",
                  {"@pid pid", "@difference wanted_rate", "@real wanted_rad", "@real command",
                   "int is_limited", "int is_fading", "int fault"});
    const std::string table = lowpass("deflection_rate", own.rate_cutoff_Hz);
    c_.add(R"c(
static const @pid_settings @DEFLECTION = {$GAINS$, $LOWPASS$, $LARGEST$, $IS_CONDITIONAL$};

static void @reset_deflection(@deflection *d) {
  @reset_pid(&d->pid, &@DEFLECTION);
  @reset_difference(&d->wanted_rate);
  d->wanted_rad = (@real)0;
}
/* The command that was applied in place of the last one fades by one tick. */
static @real @fade_deflection(@deflection *d, @real applied) {
  const @real faded = applied * $FAULT_KEEP$;
  @start_pid(&d->pid, &@DEFLECTION, @absolute(faded) > (@real)1e-9 ? faded : (@real)0);
  return d->pid.command;
}
static void @step_deflection(@deflection *d, @real wanted_rad, @real deflection_rad) {
  @real feed_forward;
  d->fault = @NONE;
  d->is_limited = 0;
  d->is_fading = 0;
  if (@is_finite(wanted_rad)) {
    d->wanted_rad = @limited(wanted_rad, -$LARGEST_RAD$, $LARGEST_RAD$);
    d->is_limited = d->wanted_rad < wanted_rad || d->wanted_rad > wanted_rad;
  } else {
    d->fault = @INPUT_NOT_FINITE;
  }
  feed_forward = $FEED_FORWARD$;
  if (!@step_pid(&d->pid, &@DEFLECTION, d->wanted_rad, deflection_rad, feed_forward)) {
    d->command = @fade_deflection(d, d->pid.command);
    d->is_fading = 1;
    d->fault = @INPUT_NOT_FINITE;
    return;
  }
  d->command = d->pid.command;
  d->is_limited = d->is_limited || d->pid.is_limited;
}
)c",
           {{"GAINS", gains(list_.deflection.gains)},
            {"LOWPASS", table},
            {"LARGEST", acts_on_speed() ? "@BOUNDLESS" : number(own.joint.drive.peak_current_A)},
            {"IS_CONDITIONAL", own.anti_windup == Pid::AntiWindup::conditional ? "1" : "0"},
            {"FAULT_KEEP", number(list_.deflection.fault_keep)},
            {"LARGEST_RAD", number(own.largest_deflection_rad)},
            {"FEED_FORWARD",
             acts_on_speed() ? fmt::format("@rate(&d->wanted_rate, d->wanted_rad, {})", table)
                             : number(list_.deflection.feed_forward_A_rad) + " * d->wanted_rad"}});
  }

  void write_observer() {
    const SeriesElasticJoint& joint = settings_.torque.deflection.joint;
    c_.add_struct("observer", "The current that is used up by what is not in the joint's equation.",
                  {"@difference speed", "@difference acceleration", "@filter lowpass"});
    c_.add(R"c(
static void @reset_observer(@observer *o) {
  @reset_difference(&o->speed);
  @reset_difference(&o->acceleration);
  o->lowpass.band = o->lowpass.low = (@real)0;
}
/* The current of the tick before, and by how much the motor side has moved since. */
static @real @observed(@observer *o, @real applied_A, @real moved_rad, @real deflection_rad) {
  const @real speed_rad_s = @changed(&o->speed, moved_rad, 0);
  @real rad_s2;
  if (o->speed.seen < 2U) return (@real)0;
  rad_s2 = @rate(&o->acceleration, speed_rad_s, 0);
  if (o->acceleration.seen < 2U) return (@real)0;
  o->lowpass.is_started = 1;
  return @lowpass(&o->lowpass, $LOWPASS$, applied_A - $INERTIA$ * rad_s2 - $STIFFNESS$ * deflection_rad);
}
)c",
           {{"LOWPASS", lowpass("observer_lowpass", *settings_.torque.observer_cutoff_Hz)},
            {"INERTIA", number(joint.drive.inertia() / joint.drive.torque_per_current())},
            {"STIFFNESS", number(joint.stiffness_Nm_rad / joint.drive.torque_per_current())}});
  }

  void write_torque() {
    const TorqueLoopCore::Settings& own = settings_.torque;
    const Drive& drive = own.deflection.joint.drive;
    std::vector<std::string_view> members{"@deflection deflection",
                                          "@difference wanted_rate",
                                          "@real bump",
                                          "@real wanted_Nm",
                                          "@real added_A",
                                          "@real applied",
                                          "@real current_A",
                                          "@real speed_rad_s",
                                          "int is_refused",
                                          "int is_measured_torque",
                                          "int is_returning",
                                          "int is_limited",
                                          "int fault"};
    if (has_observer()) members.emplace_back("@observer observer");
    c_.add_struct("torque", "Torque through the deflection of the spring.", members);
    std::string terms;
    const std::string per_Nm = number(1.0 / drive.torque_per_current());
    if (own.friction)
      terms += c_.filled(
          "  terms_A += $SHARE$ * ($COULOMB$ * @hyperbolic_tangent(rate_rad_s * $PER_SPEED$) + "
          "$VISCOUS$ * rate_rad_s);\n",
          {{"SHARE", number(own.friction->share / drive.torque_per_current())},
           {"COULOMB", number(drive.coulomb_Nm)},
           {"PER_SPEED", number(1.0 / own.friction->speed_rad_s)},
           {"VISCOUS", number(drive.viscous_Nms_rad)}});
    if (own.feeds_rate_forward)
      terms += c_.filled(
          "  terms_A += @gains_of(&t->deflection.pid, &@DEFLECTION)->derivative * rate_rad_s;\n");
    if (has_observer())
      terms += c_.filled(
          "  terms_A += @observed(&t->observer, t->applied, moved_rad, deflection_rad);\n");
    const std::string result =
        acts_on_speed() ? c_.filled(R"c(  t->current_A = @limited(all_A, -$PEAK$, $PEAK$);
  t->is_limited = t->is_limited || t->current_A < all_A || t->current_A > all_A;
  t->speed_rad_s = t->deflection.command;
  t->applied = t->deflection.command;
)c",
                                    {{"PEAK", number(drive.peak_current_A)}})
                        : c_.filled(R"c(  t->current_A = @limited(all_A, -$PEAK$, $PEAK$);
  if (t->current_A < all_A || t->current_A > all_A) {
    t->is_limited = 1;
    @track_pid(&t->deflection.pid, &@DEFLECTION, t->current_A - t->added_A);
  }
  t->applied = t->current_A;
)c",
                                    {{"PEAK", number(drive.peak_current_A)}});
    c_.add(
        R"c(
static void @reset_torque(@torque *t) {
  @reset_deflection(&t->deflection);
$RESET_OBSERVER$  @reset_difference(&t->wanted_rate);
  t->bump = t->wanted_Nm = t->added_A = t->applied = (@real)0;
  t->is_refused = t->is_measured_torque = t->is_returning = 0;
}
/* A torque that follows from a measurement has no rate of its own. */
static void @accept_torque(@torque *t, @real wanted_Nm, @real largest_Nm, int is_measured) {
  t->is_measured_torque = is_measured;
  t->is_refused = !@is_finite(wanted_Nm);
  if (!t->is_refused) t->wanted_Nm = @limited(wanted_Nm, -largest_Nm, largest_Nm);
}
static void @fade_torque(@torque *t) {
$RESET_OBSERVER$  t->bump = (@real)0;
  t->is_returning = 1;
  t->applied = @fade_deflection(&t->deflection, t->applied);
  t->current_A = $FADED_CURRENT$;
  t->speed_rad_s = $FADED_SPEED$;
  t->is_limited = 0;
  t->fault = @INPUT_NOT_FINITE;
}
/* deflection_rad: NaN where it was not measured. */
static void @step_torque(@torque *t, @real wanted_rad, @real deflection_rad, @real moved_rad) {
  @real rate_rad_s, all_A, terms_A = (@real)0;
  @step_deflection(&t->deflection, wanted_rad, deflection_rad);
  t->is_limited = t->deflection.is_limited;
  t->fault = t->is_refused ? @INPUT_NOT_FINITE : t->deflection.fault;
  t->speed_rad_s = (@real)0;
  if (t->is_measured_torque) @reset_difference(&t->wanted_rate);
  rate_rad_s = @rate(&t->wanted_rate, t->wanted_Nm, $RATE_LOWPASS$) * $PER_STIFFNESS$;
  (void)rate_rad_s;
  (void)moved_rad;
  if (t->deflection.is_fading) {
    @fade_torque(t);
    return;
  }
$TERMS$  if (t->is_returning) t->bump -= terms_A;
  t->is_returning = 0;
  t->added_A = terms_A + @decayed(&t->bump, $KEEP$);
  all_A = $ALL$;
  if (!@is_finite(all_A)) {
    @fade_torque(t);
    return;
  }
$RESULT$}
static void @track_torque(@torque *t, @real applied) {
  @track_pid(&t->deflection.pid, &@DEFLECTION, applied$ADDED$);
}
)c",
        {{"RESET_OBSERVER", has_observer() ? "  @reset_observer(&t->observer);\n" : ""},
         {"FADED_CURRENT", acts_on_speed() ? "(@real)0" : "t->applied"},
         {"FADED_SPEED", acts_on_speed() ? "t->applied" : "(@real)0"},
         {"RATE_LOWPASS", "@deflection_rate"},
         {"PER_STIFFNESS", number(1.0 / own.deflection.joint.stiffness_Nm_rad)},
         {"TERMS", terms},
         {"KEEP", number(list_.torque_transfer_keep)},
         {"ALL", acts_on_speed() ? "t->added_A" : "t->deflection.command + t->added_A"},
         {"RESULT", result},
         {"ADDED", acts_on_speed() ? "" : " - t->added_A"}});
  }

  void write_impedance() {
    c_.add_struct("impedance", "A spring and a damper between the joint and its reference.",
                  {"@real stiffness_Nm_rad", "@real damping_Nms_rad", "@real bump",
                   "@real position_error_rad", "@real speed_error_rad_s", "@real torque_Nm",
                   "int is_returning"});
    c_.add(R"c(
static void @reset_impedance(@impedance *z) {
  z->bump = z->position_error_rad = z->speed_error_rad_s = z->torque_Nm = (@real)0;
  z->is_returning = 0;
}
static @real @fade_impedance(@impedance *z) {
  z->torque_Nm *= $FAULT_KEEP$;
  if (@absolute(z->torque_Nm) < (@real)1e-9) z->torque_Nm = (@real)0;
  z->is_returning = 1;
  return z->torque_Nm;
}
static @real @step_impedance(@impedance *z, const @reference *wanted, @real angle_rad, @real speed_rad_s) {
  const @real error_rad = wanted->position_rad - angle_rad;
  const @real error_rad_s = wanted->velocity_rad_s - speed_rad_s;
  @real terms_Nm;
  z->bump += (z->stiffness_Nm_rad - wanted->stiffness_Nm_rad) * z->position_error_rad +
             (z->damping_Nms_rad - wanted->damping_Nms_rad) * z->speed_error_rad_s;
  z->stiffness_Nm_rad = wanted->stiffness_Nm_rad;
  z->damping_Nms_rad = wanted->damping_Nms_rad;
  terms_Nm = z->stiffness_Nm_rad * error_rad + z->damping_Nms_rad * error_rad_s + wanted->torque_Nm;
  if (!@is_finite(terms_Nm)) return @fade_impedance(z);
  if (z->is_returning) z->bump = z->torque_Nm - terms_Nm;
  terms_Nm += @decayed(&z->bump, $KEEP$);
  if (!@is_finite(terms_Nm)) return @fade_impedance(z);
  z->is_returning = 0;
  z->position_error_rad = error_rad;
  z->speed_error_rad_s = error_rad_s;
  z->torque_Nm = @limited(terms_Nm, -$LARGEST$, $LARGEST$);
  return z->torque_Nm;
}
)c",
           {{"FAULT_KEEP", number(list_.impedance_fault_keep)},
            {"KEEP", number(list_.impedance_transfer_keep)},
            {"LARGEST", limit(list_.largest_torque_Nm)}});
  }

  void write_cascade() {
    const JointCascade::Limits& limits = settings_.limits;
    const ControllerListing::Cascade& own = list_.cascade;
    const Drive& drive = settings_.torque.deflection.joint.drive;
    c_.add_struct(
        "cascade", "Position, speed and current within limits that hold in every mode.",
        {"@pid velocity", "@reference reference", "@real position_1_s", "@real lowest_rad",
         "@real highest_rad", "@real soft_speed_rad_s", "@real bump", "@real load",
         "@real current_A", "@real wanted_velocity_rad_s", "@real transfer_A", "int has_gains",
         "int has_limits", "int is_switching", "int limit", "int fault"});
    const double step_A = limits.current_rate_A_s / rate_Hz_;
    c_.add(
        R"c(
static const @pid_settings @VELOCITY = {$GAINS$, 0, @BOUNDLESS, 0};

static void @reset_cascade(@cascade *s) {
  @reset_pid(&s->velocity, &@VELOCITY);
  s->bump = s->current_A = (@real)0;
  s->reference.mode = @MODE_CURRENT;
  s->reference.current_A = (@real)0;
  s->is_switching = 0;
}
/* The speed from which the joint can stop before a limit. */
static @real @approach(@real room_rad) {
  if (room_rad <= $LINEAR$) return $APPROACH$ * room_rad;
  return @square_root($TWICE_BRAKING$ * (room_rad - $HALF_LINEAR$));
}
static int @is_speed_mode(int mode) { return mode == @MODE_VELOCITY || mode == @MODE_POSITION; }
/* A mode that uses the same loop keeps its integral. */
static void @enter_cascade(@cascade *s, int mode) {
  if (mode == s->reference.mode) return;
  if (@is_speed_mode(mode) != @is_speed_mode(s->reference.mode)) @reset_pid(&s->velocity, &@VELOCITY);
  s->is_switching = 1;
}
static void @track_cascade(@cascade *s, @real applied_A) {
  @real cut_A = applied_A - s->current_A;
  if (!@is_finite(applied_A)) return;
  s->current_A = applied_A;
  if (s->is_switching) return;
  /* What is left of a transfer that points against the cut is dropped first. */
  if (s->bump * cut_A < (@real)0) {
    const @real all_A = @absolute(s->bump), dropped_A = @limited(cut_A, -all_A, all_A);
    s->bump += dropped_A;
    cut_A -= dropped_A;
  }
  if (@is_speed_mode(s->reference.mode)) @track_pid(&s->velocity, &@VELOCITY, s->velocity.command + cut_A);
}
static @real @thermal_limit(const @cascade *s) {
  const @real allowed_A = $RATED$ * @square_root((@real)1 + $FADE$ * ((@real)1 - s->load));
  return s->load > $COLD$ && allowed_A < $PEAK$ ? allowed_A : $PEAK$;
}
static void @warm(@cascade *s) {
  const @real ratio = s->current_A * $PER_RATED$;
  s->load += $THERMAL_SHARE$ * (ratio * ratio - s->load);
}
static void @fade_cascade(@cascade *s) {
  @reset_pid(&s->velocity, &@VELOCITY);
  s->bump = (@real)0;
  s->current_A *= $FAULT_KEEP$;
  if (@absolute(s->current_A) < (@real)1e-9) s->current_A = (@real)0;
  @warm(s);
  s->is_switching = 1;
  s->wanted_velocity_rad_s = s->transfer_A = (@real)0;
  s->limit = @LIMIT_NONE;
  s->fault = @INPUT_NOT_FINITE;
}
static @real @cut(@real current_A, @real lowest_A, @real highest_A, int limit, int *reached) {
  const @real below_A = current_A < highest_A ? current_A : highest_A;
  const @real inside_A = below_A > lowest_A ? below_A : lowest_A;
  if (inside_A < current_A || inside_A > current_A) *reached = limit;
  return inside_A;
}
/* A bound that the velocity may not leave, as a current. */
static @real @holding(@real bound_rad_s, @real speed_rad_s, @real load_A) {
  return $SPEED_GAIN$ * (bound_rad_s - speed_rad_s) + load_A;
}
static void @step_cascade(@cascade *s, const @reference *reference, @real angle_rad, @real speed_rad_s, @real torque_Nm) {
  const @real highest_rad = s->has_limits ? s->highest_rad : $HIGHEST$;
  const @real lowest_rad = s->has_limits ? s->lowest_rad : $LOWEST$;
  const @real soft_rad_s = s->has_limits ? s->soft_speed_rad_s : $SOFT_SPEED$;
  const @real load_A = torque_Nm * $PER_NM$;
  const @real back_emf_V = $BACK_EMF$ * speed_rad_s;
  @real slowest_rad_s, fastest_rad_s, terms_A, wanted_A, current_A, allowed_A;
  s->fault = @NONE;
  s->limit = @LIMIT_NONE;
  s->wanted_velocity_rad_s = (@real)0;
  if (@is_reference(reference)) {
    @enter_cascade(s, reference->mode);
    @copy_reference(&s->reference, reference);
  }
  if (!@is_finite(angle_rad + speed_rad_s + torque_Nm)) {
    @fade_cascade(s);
    return;
  }
  fastest_rad_s = @limited(@approach(highest_rad - $MARGIN$ - angle_rad), -soft_rad_s, soft_rad_s);
  slowest_rad_s = @limited(-@approach(angle_rad - lowest_rad - $MARGIN$), -soft_rad_s, soft_rad_s);
  terms_A = s->reference.current_A;
  if (@is_speed_mode(s->reference.mode)) {
    const @real gain_1_s = s->has_gains ? s->position_1_s : $POSITION$;
    const @real error_rad = s->reference.mode == @MODE_POSITION ? s->reference.position_rad - angle_rad : (@real)0;
    s->wanted_velocity_rad_s = @limited(gain_1_s * error_rad + s->reference.velocity_rad_s, slowest_rad_s, fastest_rad_s);
    terms_A += ($INERTIA$ * s->reference.acceleration_rad_s2 + s->reference.torque_Nm) * $PER_NM$;
    if (!@step_pid(&s->velocity, &@VELOCITY, s->wanted_velocity_rad_s, speed_rad_s, (@real)0)) {
      @fade_cascade(s);
      return;
    }
    terms_A += s->velocity.command;
  }
  if (s->is_switching) s->bump = s->current_A - terms_A;
  s->is_switching = 0;
  s->transfer_A = @decayed(&s->bump, $KEEP$);
  wanted_A = terms_A + s->transfer_A;
  if (@is_speed_mode(s->reference.mode)) s->transfer_A += s->velocity.transfer;
  if (!@is_finite(wanted_A)) {
    @fade_cascade(s);
    return;
  }
  current_A = wanted_A;
$RATE$  {
    const int is_upper = current_A > @holding(fastest_rad_s, speed_rad_s, load_A);
    const @real bound_rad_s = is_upper ? fastest_rad_s : -slowest_rad_s;
    current_A = @cut(current_A, @holding(slowest_rad_s, speed_rad_s, load_A),
                     @holding(fastest_rad_s, speed_rad_s, load_A),
                     bound_rad_s < soft_rad_s ? @LIMIT_POSITION : @LIMIT_SPEED, &s->limit);
  }
  current_A = @cut(current_A, (-$SUPPLY$ - back_emf_V) * $PER_OHM$, ($SUPPLY$ - back_emf_V) * $PER_OHM$,
                   @LIMIT_VOLTAGE, &s->limit);
  allowed_A = @thermal_limit(s);
  current_A = @cut(current_A, -allowed_A, allowed_A, s->load > $COLD$ ? @LIMIT_THERMAL : @LIMIT_CURRENT, &s->limit);
  if (s->limit != @LIMIT_NONE && @is_speed_mode(s->reference.mode))
    @track_pid(&s->velocity, &@VELOCITY, s->velocity.command + current_A - wanted_A);
  s->current_A = current_A;
  @warm(s);
}
)c",
        {{"GAINS", gains(own.velocity)},
         {"LINEAR", number(own.braking_rad_s2 / (own.approach_1_s * own.approach_1_s))},
         {"HALF_LINEAR", number(0.5 * own.braking_rad_s2 / (own.approach_1_s * own.approach_1_s))},
         {"APPROACH", number(own.approach_1_s)},
         {"TWICE_BRAKING", number(2.0 * own.braking_rad_s2)},
         {"RATED", number(drive.rated_current_A)},
         {"PER_RATED", number(1.0 / drive.rated_current_A)},
         {"PEAK", number(drive.peak_current_A)},
         {"FADE", number(own.thermal_fade)},
         {"COLD", number(own.thermal_cold)},
         {"THERMAL_SHARE", number(own.thermal_share)},
         {"FAULT_KEEP", number(own.fault_keep)},
         {"SPEED_GAIN", number(own.speed_gain_A_s_rad)},
         {"HIGHEST", limit(limits.highest_rad)},
         {"LOWEST", limit(limits.lowest_rad)},
         {"SOFT_SPEED", number(own.soft_speed_rad_s)},
         {"MARGIN", number(own.margin_rad)},
         {"PER_NM", number(1.0 / drive.torque_per_current())},
         {"BACK_EMF", number(drive.torque_constant_Nm_A * drive.ratio)},
         {"POSITION", number(own.position_1_s)},
         {"INERTIA", number(drive.inertia())},
         {"KEEP", number(own.transfer_keep)},
         {"RATE", std::isfinite(step_A)
                      ? c_.filled("  current_A = @cut(current_A, s->current_A - $STEP$, "
                                  "s->current_A + $STEP$, @LIMIT_RATE, &s->limit);\n",
                                  {{"STEP", number(step_A)}})
                      : ""},
         {"SUPPLY", number(drive.supply_V)},
         {"PER_OHM", number(1.0 / drive.resistance_Ohm)}});
  }

  CText& c_;
  const Settings& settings_;
  const ControllerListing& list_;
  double rate_Hz_;
};

}  // namespace

void write_loops(CText& c, const JointControllerCore::Settings& settings,
                 const ControllerListing& listing, double sample_rate_Hz) {
  LoopWriter(c, settings, listing, sample_rate_Hz).write();
}

}  // namespace torsio
