#include "torsio/sim/arm/arm_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "arm/vector3.hpp"
#include "core/report_progress.hpp"
#include "sim/arm/arm_log.hpp"
#include "sim/arm/arm_session.hpp"
#include "sim/arm/contact_watch.hpp"
#include "sim/arm/path_motion.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kSlowDown_s = 0.2;     // time constant of a hold after a free motion
constexpr double kLongestStop_s = 5.0;  // from a stop to rest
constexpr double kAfterContact_s = 1.0;

/// The reference of a program, tick by tick.
class ProgramReference {
 public:
  ProgramReference(const ArmProgram& program, const ArmSetup& setup)
      : program_(program), setup_(setup), last_rad_(program.start_rad) {}

  [[nodiscard]] bool is_done() const { return step_ == program_.steps.size(); }
  /// Whether the links are to be at the angles of the reference.
  [[nodiscard]] bool is_position() const { return reference_.mode == ArmMode::position; }

  /// @param angle_rad measured, one per joint
  const ArmReference& next(std::span<const double> angle_rad, std::span<const double> speed_rad_s,
                           const ArmDynamics& dynamics) {
    const ArmStep& step = program_.steps[step_];
    if (tick_ == 0) begin(step, angle_rad, speed_rad_s, dynamics);
    if (step.task == ArmTask::hold) slow_down();
    if (step.task == ArmTask::move) {
      const ArmMove::Output moved = move_->step();
      reference_.position_rad = moved.position_rad;
      reference_.velocity_rad_s = moved.velocity_rad_s;
      reference_.acceleration_rad_s2 = moved.acceleration_rad_s2;
    } else if (step.task == ArmTask::follow) {
      follow(step.path_rad);
    }
    return reference_;
  }
  [[nodiscard]] const ArmReference& current() const { return reference_; }
  /// The plate of a step that begins.
  [[nodiscard]] const std::optional<ArmPlate>& plate() const {
    static const std::optional<ArmPlate> kNone;
    return tick_ == 0 ? program_.steps[step_].plate : kNone;
  }
  /// The pushes at this tick of the step, or at a later one.
  [[nodiscard]] ArmLoad load(std::size_t ticks_later = 0) const {
    ArmLoad load;
    for (const ArmPush& push : program_.steps[step_].pushes) {
      const double time_s = static_cast<double>(tick_ + ticks_later) * kArmTick_s;
      if (time_s < push.start_s || time_s >= push.start_s + push.duration_s) continue;
      load.force_N = load.force_N + push.force_N;
      load.moment_Nm = load.moment_Nm + push.moment_Nm;
      for (std::size_t j = 0; j < push.torque_Nm.size(); ++j)
        load.torque_Nm[j] += push.torque_Nm[j];
    }
    return load;
  }
  void advance() {
    ++tick_;
    if (static_cast<double>(tick_) * kArmTick_s < duration_s_) return;
    tick_ = 0;
    ++step_;
  }

 private:
  void begin(const ArmStep& step, std::span<const double> angle_rad,
             std::span<const double> speed_rad_s, const ArmDynamics& dynamics) {
    reference_ = {};
    duration_s_ = step.duration_s;
    start_rad_s_.assign(last_rad_.size(), 0.0);
    // A task that lets the arm go elsewhere is followed by a hold or a move from there.
    if (was_free_) {
      last_rad_.assign(angle_rad.begin(), angle_rad.end());
      if (step.task == ArmTask::hold) start_rad_s_.assign(speed_rad_s.begin(), speed_rad_s.end());
    }
    was_free_ = false;
    std::ranges::copy(last_rad_, reference_.position_rad.begin());
    switch (step.task) {
      case ArmTask::move:
        move_ = std::make_unique<ArmMove>(std::vector{inside(last_rad_), step.to_rad}, setup_.moves,
                                          kBenchRate_Hz);
        duration_s_ = move_->duration_s() + kArmTick_s;
        last_rad_ = step.to_rad;
        return;
      case ArmTask::follow:
        duration_s_ = static_cast<double>(step.path_rad.front().size()) * kArmTick_s;
        for (std::size_t j = 0; j < last_rad_.size(); ++j) last_rad_[j] = step.path_rad[j].back();
        return;
      case ArmTask::hold: return;
      case ArmTask::guide: reference_.mode = ArmMode::guiding; break;
      case ArmTask::cartesian:
        reference_.mode = ArmMode::cartesian;
        reference_.flange = dynamics.flange(angle_rad);
        break;
      case ArmTask::impedance:
        reference_.mode = ArmMode::impedance;
        std::ranges::copy(step.stiffness_Nm_rad, reference_.stiffness_Nm_rad.begin());
        std::ranges::copy(step.damping_Nms_rad, reference_.damping_Nms_rad.begin());
        break;
    }
    was_free_ = true;
  }
  /// An arm that still moves comes to rest: q = q₀ + q̇₀ τ (1 − exp(−t / τ)).
  void slow_down() {
    const double left = std::exp(-static_cast<double>(tick_) * kArmTick_s / kSlowDown_s);
    for (std::size_t j = 0; j < last_rad_.size(); ++j) {
      reference_.position_rad[j] = last_rad_[j] + start_rad_s_[j] * kSlowDown_s * (1.0 - left);
      reference_.velocity_rad_s[j] = start_rad_s_[j] * left;
      reference_.acceleration_rad_s2[j] = -start_rad_s_[j] * left / kSlowDown_s;
    }
    if (tick_ + 1 >= static_cast<std::size_t>(duration_s_ / kArmTick_s))
      std::copy_n(reference_.position_rad.begin(), last_rad_.size(), last_rad_.begin());
  }
  /// A hand may have left the arm a little outside.
  [[nodiscard]] std::vector<double> inside(std::vector<double> angle_rad) const {
    for (std::size_t j = 0; j < angle_rad.size(); ++j)
      angle_rad[j] =
          std::clamp(angle_rad[j], setup_.moves[j].lowest_rad, setup_.moves[j].highest_rad);
    return angle_rad;
  }
  void follow(const std::vector<std::vector<double>>& path_rad) {
    for (std::size_t j = 0; j < path_rad.size(); ++j) {
      const std::vector<double>& q = path_rad[j];
      reference_.position_rad[j] = q[tick_];
      reference_.velocity_rad_s[j] = path_speed(q, tick_);
      reference_.acceleration_rad_s2[j] = path_acceleration(q, tick_);
    }
  }

  const ArmProgram& program_;
  const ArmSetup& setup_;
  std::vector<double> last_rad_;
  std::vector<double> start_rad_s_;
  std::size_t step_ = 0;
  std::size_t tick_ = 0;
  double duration_s_ = 0.0;
  bool was_free_ = false;
  std::unique_ptr<ArmMove> move_;
  ArmReference reference_;
};

bool is_pushing(const ArmLoad& load) {
  double sum = 0.0;
  for (const double torque_Nm : load.torque_Nm) sum += std::abs(torque_Nm);
  for (std::size_t i = 0; i < 3; ++i)
    sum += std::abs(load.force_N[i]) + std::abs(load.moment_Nm[i]);
  return sum > 0.0;
}

ArmController::Settings controller_settings(const ArmSetup& setup, const ArmRunSpec& spec) {
  ArmController::Settings settings = arm_controller_settings(setup, spec.program.cartesian);
  settings.contacts = spec.contacts;
  settings.reaction = spec.program.reaction;
  return settings;
}

bool has_plate(const ArmProgram& program) {
  return std::ranges::any_of(program.steps,
                             [](const ArmStep& step) { return step.plate.has_value(); });
}

/// The program on bench and controller, tick by tick.
class Runner {
 public:
  Runner(const ArmSetup& setup, const ArmRunSpec& spec)
      : setup_(setup),
        session_(setup, controller_settings(setup, spec),
                 spec.has_gear_stage ? FirstStageForm::elastic : FirstStageForm::rigid, spec.faults,
                 spec.seed, spec.program.start_rad),
        reference_(spec.program, setup),
        log_(setup, spec.with_truth, has_plate(spec.program)) {
    session_.open_brakes();
  }

  ArmRun run(const Progress& progress) {
    ArmRun run{.record = Recording(setup_.arm.name, kBenchRate_Hz)};
    while (!reference_.is_done()) {
      if (log_.size() % 1000 == 0)
        report_progress(progress, 0.0, fmt::format("the arm moves: {:.0f} s", session_.time_s()));
      const bool is_stopping = run.cause != ArmStopCause::none;
      const ArmController::Output& output = tick(run, is_stopping || is_reacting());
      if (is_reacting()) {
        ++since_contact_;
        if (static_cast<double>(since_contact_) * kArmTick_s > kAfterContact_s &&
            (!is_stopping || has_ended(run, output)))
          break;
      }
      if (is_stopping) {
        if (has_ended(run, output)) break;
      } else if (output.cause != ArmStopCause::none) {
        run.cause = output.cause;
        run.stopped_joint = setup_.arm.joints[output.joint].name;
        run.stop_reason = session_.stop_reason(output);
        run.stopped_s = session_.time_s();
        stopped_at_m_ = session_.controller().dynamics().flange(session_.angle_rad()).position_m;
      }
    }
    run.duration_s = session_.time_s();
    run.refused_s = static_cast<double>(refused_ticks_) * kArmTick_s;
    run.refused_from_s = refused_from_s_;
    std::move(watch_).finish(run);
    std::move(log_).finish(run);
    return run;
  }

 private:
  [[nodiscard]] bool is_reacting() const { return has_reacted_; }

  /// Control, log and motion. @param is_over the program does not continue
  const ArmController::Output& tick(const ArmRun& run, bool is_over) {
    ArmBench& bench = session_.bench();
    const ArmController& controller = session_.controller();
    if (!is_over && reference_.plate()) bench.use(*reference_.plate());
    const ArmReference& wanted =
        is_over
            ? reference_.current()
            : reference_.next(session_.angle_rad(), session_.speed_rad_s(), controller.dynamics());
    const ArmLoad load = has_reacted_                      ? reference_.load(since_contact_)
                         : run.cause != ArmStopCause::none ? ArmLoad{}
                                                           : reference_.load();
    const ArmController::Output& output = session_.control(wanted);
    if (!is_over && output.is_reference_refused && refused_ticks_++ == 0)
      refused_from_s_ = session_.time_s();
    watch_.see(output, setup_.arm, session_.time_s(), is_pushing(load));
    log_.see(bench);
    session_.act(load);
    log_.add(bench, output, wanted, !is_over && reference_.is_position());
    const double plate_N = bench.take_largest_plate_N();
    log_.add_plate(plate_N);
    watch_.measure(plate_N, session_.time_s());
    if (!is_over) reference_.advance();
    has_reacted_ = has_reacted_ || output.contact.reaction != ContactReaction::none;
    return output;
  }
  /// Whether a stopped arm is at rest, or has had its time.
  bool has_ended(ArmRun& run, const ArmController::Output& output) {
    const Vector3 moved = session_.bench().flange_m() - stopped_at_m_;
    run.largest_drop_m = std::max(run.largest_drop_m, std::sqrt(dot(moved, moved)));
    const double since_s = session_.time_s() - run.stopped_s;
    if (output.is_at_rest && !run.at_rest_s) run.at_rest_s = since_s;
    const bool is_watched =
        has_reacted_ && static_cast<double>(since_contact_) * kArmTick_s <= kAfterContact_s;
    return (output.is_at_rest && !is_watched) || since_s > kLongestStop_s;
  }

  const ArmSetup& setup_;
  ArmSession session_;
  ProgramReference reference_;
  ArmLog log_;
  ContactWatch watch_;
  Vector3 stopped_at_m_ = {};
  std::size_t since_contact_ = 0;  ///< ticks since a reaction began
  bool has_reacted_ = false;
  std::size_t refused_ticks_ = 0;
  double refused_from_s_ = 0.0;
};

}  // namespace

ArmRun run_arm(const ArmSetup& setup, const ArmRunSpec& spec, const Progress& progress) {
  require_possible(spec.program, setup);
  if (spec.program.reaction != ContactReaction::none && !spec.contacts)
    throw UsageError({.place = setup.arm.name,
                      .problem = fmt::format("the program reacts to contacts ('{}'), but none are "
                                             "looked for",
                                             name(spec.program.reaction)),
                      .expected = "thresholds of contacts (--contacts FILE)",
                      .found = "none",
                      .advice = "Learn them with torsio arm learn-contacts."});
  Runner runner(setup, spec);
  return runner.run(progress);
}

std::string_view name(ArmTask task) noexcept {
  switch (task) {
    case ArmTask::move: return "move";
    case ArmTask::follow: return "follow";
    case ArmTask::hold: return "hold";
    case ArmTask::guide: return "guide";
    case ArmTask::impedance: return "impedance";
    case ArmTask::cartesian: return "cartesian";
  }
  return "unknown";
}

}  // namespace torsio
