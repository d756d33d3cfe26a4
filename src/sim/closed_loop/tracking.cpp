#include "torsio/sim/closed_loop/tracking.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "control/design/loop_design.hpp"
#include "core/report_progress.hpp"
#include "evaluate/fit_and_score.hpp"
#include "sim/bench/bench.hpp"
#include "sim/closed_loop/tracking_parts.hpp"
#include "sim/experiments/torque_references.hpp"
#include "sim/sensors/bench_log.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "track";
constexpr double kTurnedRound_rad = rad_from_deg(200.0);
constexpr double kMaxTorque = 10.0;  // over the rating
constexpr double kSweep_s = 20.0;

Load load_of(const TrackingSpec& spec) {
  if (spec.output == JointOutput::locked) return {.is_locked = true};
  return lever(kLeverMass_kg, spec.lever_m);
}

/// What no sensor measures, and what the spring may carry, of the torque at rated current.
constexpr double kUnmeasuredShare = 0.05;
constexpr double kMeasuredShare = 0.6;
/// Fast, so that dry friction makes little difference to the speed at a limit.
constexpr double kOverride_rad_s = 100.0;

double velocity_rad_s(const TrackingSpec& spec) {
  return spec.velocity_rad_s.value_or(
      JointControllerCore::velocity_bandwidth(spec.bandwidth_rad_s, kBenchRate_Hz));
}

TorqueLoopCore::Settings loop_settings(const DataSheet& sheet, const TrackingSpec& spec,
                                       const Load& load) {
  SeriesElasticJoint joint = series_elastic_joint(sheet);
  joint.joint_inertia_kg_m2 += load.inertia_kg_m2;
  return {.deflection = {.joint = joint,
                         .actuation = spec.actuation,
                         .bandwidth_rad_s = spec.bandwidth_rad_s,
                         .damping = spec.damping},
          .largest_torque_Nm = sheet.rating.torque_Nm.value,
          .friction = spec.friction,
          .observer_cutoff_Hz = spec.observer_cutoff_Hz,
          .feeds_rate_forward = spec.feeds_rate_forward};
}

JointControllerCore::Settings joint_settings(const DataSheet& sheet, const TrackingSpec& spec,
                                             const Load& load) {
  const TorqueLoopCore::Settings torque = loop_settings(sheet, spec, load);
  const Drive& drive = torque.deflection.joint.drive;
  const double rated_Nm = drive.rated_current_A * drive.torque_per_current();
  const DriveLimits limits = spec.limits.value_or(DriveLimits{});
  const JointCascade::Gains gains = JointCascade::gains_for(
      drive, spec.actuation == DeflectionController::Actuation::velocity ? velocity_rad_s(spec)
                                                                         : kOverride_rad_s);
  return {.torque = torque,
          .limits = {.lowest_rad = limits.lowest_rad,
                     .highest_rad = limits.highest_rad,
                     .speed_rad_s = std::min(limits.speed_rad_s, sheet.rating.speed_rad_s.value),
                     .max_unmeasured_load_Nm = kUnmeasuredShare * rated_Nm,
                     .max_measured_load_Nm = kMeasuredShare * rated_Nm},
          .override_rad_s = kOverride_rad_s,
          .gains = gains};
}

void check_limits(const DataSheet& sheet, const TrackingSpec& spec) {
  const double rated_rad_s = sheet.rating.speed_rad_s.value;
  if (spec.limits && std::isfinite(spec.limits->speed_rad_s) &&
      spec.limits->speed_rad_s > rated_rad_s)
    throw UsageError({.place = fmt::format("{} limits", kPlace),
                      .expected = fmt::format("a speed up to the rated {:.4g} rad/s", rated_rad_s),
                      .found = fmt::format("{:g} rad/s", spec.limits->speed_rad_s)});
  if (spec.velocity_rad_s && *spec.velocity_rad_s > TrackingSpec::kMaxVelocity_rad_s)
    throw UsageError({.place = fmt::format("{} velocity loop", kPlace),
                      .expected = fmt::format("a bandwidth up to {:g} rad/s, a fifth of the sample "
                                              "rate",
                                              TrackingSpec::kMaxVelocity_rad_s),
                      .found = fmt::format("{:.4g} rad/s", *spec.velocity_rad_s)});
}

/// The torque loop alone, or as a part of the controller that keeps the limits.
class Controller {
 public:
  Controller(const DataSheet& sheet, const TrackingSpec& spec, const AnyInverse& inverse,
             const Load& load) {
    const bool is_plain =
        !spec.limits && spec.actuation == DeflectionController::Actuation::current;
    if (is_plain)
      plain_.emplace(inverse, loop_settings(sheet, spec, load), kBenchRate_Hz);
    else
      limited_.emplace(inverse, joint_settings(sheet, spec, load), kBenchRate_Hz);
  }

  [[nodiscard]] bool has_limits() const { return limited_.has_value(); }

  struct Output {
    TorqueLoopCore::Output loop;
    double limit = 0.0;
  };
  Output step(double wanted_Nm, const JointSample& sample) {
    if (plain_) return {plain_->step(wanted_Nm, sample)};
    const auto joint = limited_->step({.mode = JointMode::torque, .torque_Nm = wanted_Nm}, sample);
    TorqueLoopCore::Output loop = joint.torque;
    // In the cascade, the current of the torque loop is a feed-forward.
    loop.proportional_A += joint.cascade.proportional_A;
    loop.integral_A += joint.cascade.integral_A;
    loop.derivative_A += joint.cascade.derivative_A;
    loop.transfer_A += joint.cascade.transfer_A;
    loop.current_A = joint.current_A;
    loop.is_limited = joint.is_limited;
    loop.fault = joint.fault;
    return {loop, static_cast<double>(joint.limit)};
  }

 private:
  std::optional<TorqueController<AnyInverse>> plain_;
  std::optional<JointController<AnyInverse>> limited_;
};

/// Outputs of the controller in each tick, as channels.
class LoopLog {
 public:
  LoopLog(std::size_t ticks, bool has_limits)
      : columns_count_(has_limits ? kNames.size() : kNames.size() - 2) {
    for (auto& values : columns_) values.reserve(ticks);
  }

  void add(double wanted_Nm, const Controller::Output& controller) {
    const TorqueLoopCore::Output& out = controller.loop;
    const double terms_A = out.proportional_A + out.integral_A + out.derivative_A +
                           out.feed_forward_A + out.rate_feed_forward_A + out.friction_A +
                           out.observer_A + out.transfer_A;
    const std::array<double, kNames.size()> row{wanted_Nm,
                                                out.wanted_torque_Nm,
                                                out.wanted_deflection_rad,
                                                out.proportional_A,
                                                out.integral_A,
                                                out.derivative_A,
                                                out.feed_forward_A,
                                                out.rate_feed_forward_A,
                                                out.friction_A,
                                                out.observer_A,
                                                out.transfer_A,
                                                out.current_A - terms_A,
                                                out.current_A,
                                                out.is_limited ? 1.0 : 0.0,
                                                static_cast<double>(out.inverse),
                                                static_cast<double>(out.fault),
                                                out.speed_rad_s,
                                                controller.limit};
    for (std::size_t i = 0; i < columns_count_; ++i) columns_[i].push_back(row[i]);
  }
  void add_to(Recording& recording) && {
    for (std::size_t i = 0; i < columns_count_; ++i)
      recording.add({.name = kNames[i], .values = std::move(columns_[i])});
  }

 private:
  static constexpr std::array kNames{"wanted_torque_Nm",       "limited_torque_Nm",
                                     "wanted_deflection_rad",  "proportional_current_A",
                                     "integral_current_A",     "derivative_current_A",
                                     "feed_forward_current_A", "rate_feed_forward_current_A",
                                     "friction_current_A",     "observer_current_A",
                                     "transfer_current_A",     "rest_current_A",
                                     "command_current_A",      "is_limited_1",
                                     "inverse_fault_1",        "fault_1",
                                     "wanted_speed_rad_s",     "limit_1"};
  std::size_t columns_count_;  ///< the last two belong to a controller with limits
  std::array<std::vector<double>, kNames.size()> columns_;
};

/// A run that is ready for its first step.
class Loop {
 public:
  Loop(const DataSheet& sheet, const TrackingSpec& spec, const AnyInverse& inverse,
       std::uint64_t seed)
      : name_(fmt::format("{} {} seed {}", full_name(sheet), name(spec.reference.kind), seed)),
        reference_Nm_(reference_torque(spec.reference, sheet, seed)),
        load_(load_of(spec)),
        bench_(sheet,
               {.name = kPlace,
                .duration_s = static_cast<double>(reference_Nm_.size()) / kBenchRate_Hz,
                .seed = seed,
                .conditions = spec.conditions,
                .faults = spec.faults},
               {.start = load_, .next = {}}),
        bench_log_(sheet, reference_Nm_.size(), true),
        controller_(sheet, spec, inverse, load_),
        loop_log_(reference_Nm_.size(), controller_.has_limits()),
        inverse_ratio_(1.0 / drive_of(sheet).ratio),
        stiffness_Nm_rad_(series_elastic_joint(sheet).stiffness_Nm_rad),
        max_Nm_(kMaxTorque * sheet.rating.torque_Nm.value) {
    const Drive drive = drive_of(sheet);
    range_.allowed_spring_Nm = kMeasuredShare * drive.rated_current_A * drive.torque_per_current();
    if (load_.is_locked) return;
    check_swing(
        {.place = kPlace,
         .load = load_,
         .duration_s = static_cast<double>(reference_Nm_.size()) / kBenchRate_Hz,
         .reference = [this, tick = std::size_t{0}]() mutable { return reference_Nm_[tick++]; }},
        sheet);
  }

  /// @returns whether it stayed within bounds
  bool run(const Progress& progress) {
    const std::size_t ticks = reference_Nm_.size();
    for (std::size_t tick = 0; tick < ticks; ++tick) {
      if (tick % 1000 == 0)
        report_progress(progress, static_cast<double>(tick) / static_cast<double>(ticks),
                        "tracking");
      const Measurement measured = bench_.sense();
      const BenchTruth truth = bench_.truth();
      bench_log_.add(measured, truth);
      observe(truth.plant.state());
      const Controller::Output out =
          controller_.step(reference_Nm_[tick], {.t_s = bench_.time_s(),
                                                 .motor_angle_rad = measured.motor_angle_rad,
                                                 .gear_angle_rad = measured.middle_angle_rad,
                                                 .joint_angle_rad = measured.joint_angle_rad,
                                                 .motor_current_A = measured.motor_current_A});
      loop_log_.add(reference_Nm_[tick], out);
      if (out.limit != 0.0) range_.limited_s += 1.0 / kBenchRate_Hz;
      if (!(std::abs(truth.plant.state().joint_angle_rad) < kTurnedRound_rad &&
            std::abs(truth.load_cell_Nm) < max_Nm_))
        return false;
      bench_.act({.command = {.current_A = out.loop.current_A}, .load = load_});
    }
    return true;
  }
  [[nodiscard]] const DriveRange& drive() const { return range_; }
  Recording finish() && {
    Recording record = bench_log_.finish(name_);
    std::move(loop_log_).add_to(record);
    return record;
  }

 private:
  void observe(const PlantState& state) {
    const double angle_rad = state.rotor_angle_rad * inverse_ratio_;
    range_.lowest_rad = std::min(range_.lowest_rad, angle_rad);
    range_.highest_rad = std::max(range_.highest_rad, angle_rad);
    range_.fastest_rad_s =
        std::max(range_.fastest_rad_s, std::abs(state.rotor_speed_rad_s) * inverse_ratio_);
    range_.largest_spring_Nm =
        std::max(range_.largest_spring_Nm,
                 stiffness_Nm_rad_ * std::abs(state.middle_angle_rad - state.joint_angle_rad));
  }

  std::string name_;
  std::vector<double> reference_Nm_;
  Load load_;
  Bench bench_;
  BenchLog bench_log_;
  Controller controller_;
  LoopLog loop_log_;
  double inverse_ratio_;
  double stiffness_Nm_rad_;
  DriveRange range_;
  double max_Nm_;
};

/// The reference's amplitude, through the frequencies of the loop.
std::optional<double> measured_bandwidth(const DataSheet& sheet, TrackingSpec spec,
                                         const AnyInverse& inverse, std::uint64_t seed,
                                         const Progress& progress) {
  const double amplitude_Nm = amplitude_of(spec.reference, sheet);
  spec.reference = {
      .kind = TorqueReference::Kind::sweep, .amplitude_Nm = amplitude_Nm, .duration_s = kSweep_s};
  spec.faults = {};
  Loop loop(sheet, spec, inverse, seed);
  if (!loop.run(progress)) return std::nullopt;
  const Recording record = std::move(loop).finish();
  return bandwidth(record.channel("truth_torque_Nm").values,
                   frequency_sweep(amplitude_Nm, kSweep_s), kBenchRate_Hz);
}

Recording run_without_faults(const DataSheet& sheet, TrackingSpec spec, const AnyInverse& inverse,
                             std::uint64_t seed, const Progress& progress) {
  spec.faults = {};
  Loop loop(sheet, spec, inverse, seed);
  (void)loop.run(progress);
  return std::move(loop).finish();
}

TrackingRow row_of(const DataSheet& sheet, const TrackingSpec& spec, const std::string& model,
                   std::uint64_t seed) {
  return {.actuator = sheet.serial ? fmt::format("{}#{:02}", sheet.name, *sheet.serial)
                                   : std::string(sheet.name),
          .variant = std::string(sheet.variant),
          .output = spec.output,
          .reference = std::string(name(spec.reference.kind)),
          .amplitude_Nm = amplitude_of(spec.reference, sheet),
          .model = model,
          .seed = seed,
          .actuation = spec.actuation,
          .bandwidth_rad_s = spec.bandwidth_rad_s,
          .velocity_rad_s = spec.actuation == DeflectionController::Actuation::velocity
                                ? std::optional(velocity_rad_s(spec))
                                : std::nullopt,
          .limits = spec.limits};
}

void run_into(TrackingRow& row, const DataSheet& sheet, const TrackingSpec& spec,
              const AnyInverse& inverse, const Progress& progress) {
  try {
    const TrackingRun run = track(sheet, spec, inverse, row.seed, progress);
    row.score = run.score;
    row.bandwidth_Hz = run.bandwidth_Hz;
    row.faults = run.faults;
    if (spec.limits) row.drive = run.drive;
    if (!run.has_diverged) return;
    row.status = "diverged";
    row.reason = fmt::format("stopped after {:.3g} s",
                             static_cast<double>(run.record.size()) / kBenchRate_Hz);
  } catch (const UsageError&) {
    throw;
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    row.status = "failed";
    row.reason = error.what();
  }
}

}  // namespace

LinearSystem open_torque_loop(const DataSheet& nominal, const TrackingSpec& spec) {
  if (spec.actuation != DeflectionController::Actuation::current)
    throw UsageError({.place = kPlace,
                      .expected = "a deflection controller that acts on the current",
                      .found = "one that acts on the speed"});
  const TorqueLoopCore core(loop_settings(nominal, spec, load_of(spec)), kBenchRate_Hz);
  return open_loop(core.deflection().settings().joint, core.feedback(), spec.output);
}

void check_tracking(const DataSheet& nominal, const TrackingSpec& spec, std::uint64_t seed) {
  if (nominal.family != ActuatorFamily::series_elastic)
    throw UsageError({.place = kPlace,
                      .expected = "a series-elastic actuator, dfki-28 to dfki-300",
                      .found = std::string(nominal.name)});
  check(spec.conditions);
  check_limits(nominal, spec);
  const DataSheet sheet = aged(nominal, spec.conditions.age);
  (void)Loop(sheet, spec, LinearInverse(1.0), seed);
}

TrackingRun track(const DataSheet& nominal, const TrackingSpec& spec, const AnyInverse& inverse,
                  std::uint64_t seed, const Progress& progress) {
  check_tracking(nominal, spec, seed);
  const DataSheet sheet = aged(nominal, spec.conditions.age);
  Loop loop(sheet, spec, inverse, seed);
  const bool has_held = loop.run(progress);
  TrackingRun done{.score = {},
                   .has_diverged = !has_held,
                   .drive = loop.drive(),
                   .record = std::move(loop).finish()};
  if (!spec.faults.faults.empty())
    done.faults = fault_detections(spec.faults, sheet, done.record,
                                   run_without_faults(sheet, spec, inverse, seed, progress));
  if (!has_held) return done;
  done.score = tracking_score(done.record, amplitude_of(spec.reference, sheet),
                              spec.reference.kind == TorqueReference::Kind::steps);
  if (spec.measures_bandwidth)
    done.bandwidth_Hz = measured_bandwidth(sheet, spec, inverse, seed, progress);
  return done;
}

AnyInverse inverse_of(const ModelFile& model) {
  const Estimator estimator = make_estimator(model, kBenchRate_Hz);
  EstimatorSettings settings = estimator.settings();
  settings.zeroed_channels.clear();  // The zeros of simulated encoders are 0.
  return AnyInverse::of(settings, estimator.model().parameters());
}

LinearInverse sweep_line(const DataSheet& sheet, std::uint64_t seed, const Progress& progress) {
  const Dataset sweeps = sweep_dataset(sheet, seed, progress);
  // Whatever the family, its fallback is the line; this family is the quickest to fit.
  const TrainedModel trained = train_model(
      sweeps, {.family = "linear", .features = resolve_inputs(sweeps, {"spring_deflection_rad"})},
      seed);
  const LinearFallback& line = trained.file.settings.fallback;
  return LinearInverse(line.slope.front(), line.intercept);
}

std::vector<TrackingRow> track_models(const DataSheet& sheet, const TrackingSpec& spec,
                                      const LinearInverse& linear,
                                      std::span<const NamedInverse> models,
                                      std::span<const std::uint64_t> seeds,
                                      const Progress& progress) {
  for (const std::uint64_t seed : seeds) check_tracking(sheet, spec, seed);
  const std::string line_name(kSweepLineName);
  std::vector<TrackingRow> rows;
  const std::size_t runs = seeds.size() * (models.size() + 1);
  const auto part = [&](const std::string& doing) {
    return part_of(progress, rows.size(), runs, doing);
  };
  for (const std::uint64_t seed : seeds) {
    TrackingRow line = row_of(sheet, spec, line_name, seed);
    run_into(line, sheet, spec, linear, part(line_name));
    rows.push_back(line);
    for (const NamedInverse& model : models) {
      TrackingRow row = row_of(sheet, spec, model.name, seed);
      run_into(row, sheet, spec, model.inverse, part(model.name));
      if (row.status == "ok" && line.status == "ok")
        row.mad_to_linear = row.score.mad / line.score.mad;
      rows.push_back(std::move(row));
    }
    rows[rows.size() - models.size() - 1].mad_to_linear =
        line.status == "ok" ? std::optional(1.0) : std::nullopt;
  }
  return rows;
}

}  // namespace torsio
