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
#include "sim/arm/arm_bench.hpp"
#include "sim/arm/arm_log.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kSlowDown_s = 0.2;      // time constant of a hold after a free motion
constexpr double kLongestStart_s = 5.0;  // until the brakes are open
constexpr double kLongestStop_s = 5.0;   // from a stop to rest

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
  [[nodiscard]] ArmLoad load() const {
    ArmLoad load;
    for (const ArmPush& push : program_.steps[step_].pushes) {
      const double time_s = static_cast<double>(tick_) * kArmTick_s;
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
      const std::size_t before = tick_ == 0 ? 0 : tick_ - 1;
      const std::size_t after = std::min(tick_ + 1, q.size() - 1);
      const double width_s = static_cast<double>(after - before) * kArmTick_s;
      reference_.position_rad[j] = q[tick_];
      reference_.velocity_rad_s[j] = width_s > 0.0 ? (q[after] - q[before]) / width_s : 0.0;
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

/// Bench and controller, tick by tick.
class Runner {
 public:
  Runner(const ArmSetup& setup, const ArmRunSpec& spec)
      : setup_(setup),
        bench_(setup, spec.has_gear_stage ? FirstStageForm::elastic : FirstStageForm::rigid,
               spec.faults, spec.seed, spec.program.start_rad),
        controller_(arm_controller_settings(setup, spec.program.cartesian), kBenchRate_Hz),
        reference_(spec.program, setup),
        log_(setup, spec.with_truth),
        commands_(setup.joints.size()),
        angle_rad_(spec.program.start_rad),
        speed_rad_s_(setup.joints.size(), 0.0) {}

  void open_brakes() {
    ArmReference hold;
    std::ranges::copy(angle_rad_, hold.position_rad.begin());
    bool is_released = false;
    for (bool is_ready = false; !is_ready;) {
      const auto& output = tick(hold, {});
      is_ready = output.is_ready;
      if (is_released && output.cause != ArmStopCause::none)
        throw Error(
            {.place = fmt::format("joint '{}'", setup_.arm.joints[output.joint].name),
             .problem = "the arm was stopped before it was ready: " + stop_reason(output),
             .advice = output.cause == ArmStopCause::monitor
                           ? "Calibrate its monitor with recordings of this joint in this arm."
                           : ""});
      if (bench_.time_s() > kLongestStart_s)
        throw Error(
            {.place = setup_.arm.name,
             .problem = fmt::format("the joints did not take over their loads within {:g} s "
                                    "after the start",
                                    kLongestStart_s)});
      if (!is_released) is_released = controller_.release();
    }
    bench_.start_clock();
  }

  ArmRun run(const Progress& progress) {
    ArmRun run{.record = Recording(setup_.arm.name, kBenchRate_Hz)};
    double stop_s = 0.0;
    Vector3 stopped_at_m = {};
    while (!reference_.is_done()) {
      if (log_.size() % 1000 == 0)
        report_progress(progress, 0.0, fmt::format("the arm moves: {:.0f} s", bench_.time_s()));
      const bool is_stopping = run.cause != ArmStopCause::none;
      const ArmReference& wanted =
          is_stopping ? reference_.current()
                      : reference_.next(angle_rad_, speed_rad_s_, controller_.dynamics());
      const ArmLoad load = is_stopping ? ArmLoad{} : reference_.load();
      const auto& output = tick(wanted, load);
      log_.add(bench_, output, wanted, !is_stopping && reference_.is_position());
      if (!is_stopping) {
        reference_.advance();
        if (output.cause == ArmStopCause::none) continue;
        run.cause = output.cause;
        run.stopped_joint = setup_.arm.joints[output.joint].name;
        run.stop_reason = stop_reason(output);
        run.stopped_s = stop_s = bench_.time_s();
        stopped_at_m = controller_.dynamics().flange(angle_rad_).position_m;
        continue;
      }
      const Vector3 moved = true_flange() - stopped_at_m;
      run.largest_drop_m = std::max(run.largest_drop_m, std::sqrt(dot(moved, moved)));
      if (output.is_at_rest) {
        run.at_rest_s = bench_.time_s() - stop_s;
        break;
      }
      if (bench_.time_s() - stop_s > kLongestStop_s) break;
    }
    run.duration_s = bench_.time_s();
    std::move(log_).finish(run);
    return run;
  }

 private:
  [[nodiscard]] Vector3 true_flange() const {
    std::vector<double> angle_rad;
    for (std::size_t j = 0; j < setup_.joints.size(); ++j)
      angle_rad.push_back(bench_.plant().state(j).joint_angle_rad);
    return controller_.dynamics().flange(angle_rad).position_m;
  }
  [[nodiscard]] std::string stop_reason(const ArmController::Output& output) const {
    if (output.cause != ArmStopCause::monitor) return std::string(name(output.cause));
    const Monitor& monitor = controller_.monitored(output.joint)->monitor();
    if (monitor.state() != Monitor::State::stopped)
      return "its monitor is not ready; while the arm holds, its sources differ or are not settled";
    return describe(monitor.reason(), monitor.settings());
  }
  const ArmController::Output& tick(const ArmReference& wanted, const ArmLoad& load) {
    bench_.sense();
    for (std::size_t j = 0; j < angle_rad_.size(); ++j)
      if (std::isfinite(bench_.samples()[j].joint_angle_rad))
        angle_rad_[j] = bench_.samples()[j].joint_angle_rad;
    const auto& output = controller_.step(wanted, bench_.samples());
    for (std::size_t j = 0; j < commands_.size(); ++j) {
      const ArmController::JointOutput& joint = output.joints[j];
      commands_[j] = {joint.current_A, joint.is_powered, joint.is_brake_open};
      speed_rad_s_[j] = joint.speed_rad_s;
    }
    log_.see(bench_);
    bench_.act(commands_, load);
    return output;
  }

  const ArmSetup& setup_;
  ArmBench bench_;
  ArmController controller_;
  ProgramReference reference_;
  ArmLog log_;
  std::vector<ArmBench::Command> commands_;
  std::vector<double> angle_rad_;
  std::vector<double> speed_rad_s_;
};

}  // namespace

ArmRun run_arm(const ArmSetup& setup, const ArmRunSpec& spec, const Progress& progress) {
  require_possible(spec.program, setup);
  Runner runner(setup, spec);
  runner.open_brakes();
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
