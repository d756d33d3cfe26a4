#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "bindings.hpp"
#include "core/checks.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/report/tracking.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio::python {
namespace {

constexpr std::uint64_t kLineSeed = 1;  // the line has that of `torsio track`

/// What `track` was given beside the models.
struct TrackCall {
  std::string reference;
  std::optional<Recording> recorded;
  std::optional<double> amplitude_Nm, duration_s;
  double bandwidth_rad_s = 50.0;
  double damping = 0.9;
  bool is_free = false;
  std::optional<double> lever_m;
  double friction_share = 0.0;
  std::optional<double> observer_Hz;
  bool feeds_forward = false;
  std::optional<double> lowest_rad, highest_rad, speed_rad_s;
  bool acts_on_velocity = false;
  std::optional<double> velocity_rad_s;
  std::string schedule;
  std::vector<std::string> injections;
};

TorqueReference reference_of(const TrackCall& call) {
  TorqueReference reference{.kind = find_reference(call.reference),
                            .amplitude_Nm = call.amplitude_Nm,
                            .duration_s = call.duration_s};
  if ((reference.kind == TorqueReference::Kind::replay) != call.recorded.has_value())
    throw UsageError({.place = "recorded",
                      .expected = "a Recording with torque_Nm, with reference='replay'",
                      .found = call.recorded ? "reference='" + call.reference + "'" : "None",
                      .advice = "Give both or neither."});
  if (!call.recorded) return reference;
  reference.recorded_Nm = call.recorded->channel("torque_Nm").values;
  reference.recorded_Hz = call.recorded->sample_rate_Hz();
  for (std::size_t n = 0; n < reference.recorded_Nm.size(); ++n)
    if (!std::isfinite(reference.recorded_Nm[n]))
      throw UsageError({.place = "recorded: torque_Nm in sample " + std::to_string(n),
                        .expected = "a number: a replayed reference has no gaps",
                        .found = as_text(reference.recorded_Nm[n])});
  return reference;
}

/// Refuses what has no effect on the loop that was chosen.
void check_call(const TrackCall& call) {
  const auto refuse = [](const char* place, const char* problem, const char* advice) {
    throw UsageError({.place = place, .problem = problem, .advice = advice});
  };
  if (call.lever_m && !call.is_free)
    refuse("lever_m", "the output is locked", "Give is_free=True, too.");
  if (!call.acts_on_velocity && call.velocity_rad_s)
    refuse("velocity_bandwidth_rad_s", "the loop acts on the current",
           "Give acts_on='velocity', too.");
  if (call.acts_on_velocity && (call.observer_Hz || call.feeds_forward))
    refuse("acts_on", "observer_Hz and feed_forward belong to a loop on the current",
           "Leave them out, or acts_on='velocity'.");
  if (!(call.friction_share >= 0.0 && call.friction_share <= 1.0))
    throw UsageError({.place = "friction",
                      .expected = "a share from 0 to 1",
                      .found = as_text(call.friction_share)});
}

std::optional<DriveLimits> limits_of(const TrackCall& call) {
  if (!call.lowest_rad && !call.highest_rad && !call.speed_rad_s) return std::nullopt;
  DriveLimits limits;
  if (call.lowest_rad) limits.lowest_rad = *call.lowest_rad;
  if (call.highest_rad) limits.highest_rad = *call.highest_rad;
  if (call.speed_rad_s) limits.speed_rad_s = *call.speed_rad_s;
  const auto refuse = [](const char* place, const char* expected, double found) {
    throw UsageError({.place = place, .expected = expected, .found = as_text(found)});
  };
  if (!(limits.lowest_rad < 0.0))
    refuse("lowest_rad", "below 0, where the run starts", limits.lowest_rad);
  if (!(limits.highest_rad > 0.0))
    refuse("highest_rad", "above 0, where the run starts", limits.highest_rad);
  if (!(limits.speed_rad_s > 0.0)) refuse("speed_rad_s", "above 0", limits.speed_rad_s);
  return limits;
}

TrackingSpec spec_of(const TrackCall& call, const DataSheet& sheet, const Progress& progress) {
  check_call(call);
  TrackingSpec spec;
  spec.output = call.is_free ? JointOutput::free : JointOutput::locked;
  spec.reference = reference_of(call);
  spec.bandwidth_rad_s = call.bandwidth_rad_s;
  spec.damping = call.damping;
  if (call.lever_m) spec.lever_m = *call.lever_m;
  if (call.friction_share != 0.0) spec.friction = {.share = call.friction_share};
  spec.observer_cutoff_Hz = call.observer_Hz;
  spec.feeds_rate_forward = call.feeds_forward;
  if (call.acts_on_velocity) spec.actuation = DeflectionController::Actuation::velocity;
  spec.velocity_rad_s = call.velocity_rad_s;
  spec.limits = limits_of(call);
  if (!call.schedule.empty()) spec.faults = read_fault_schedule(call.schedule, sheet, progress);
  for (const std::string& injection : call.injections)
    spec.faults.faults.push_back(parse_injection(injection, sheet));
  return spec;
}

using NamedModels = std::vector<std::pair<std::string, Model>>;

/// The document of the program's command, and if it is wanted the first run with the only model.
std::pair<std::string, std::optional<Recording>> track(const std::string& actuator,
                                                       const NamedModels& models,
                                                       const TrackCall& call,
                                                       const std::vector<std::uint64_t>& seeds,
                                                       bool is_recorded) {
  return interruptible([&](const Progress& progress) {
    if (seeds.empty())
      throw UsageError({.place = "seeds", .expected = "at least one", .found = "none"});
    if (is_recorded && models.size() > 1)
      throw UsageError({.place = "record",
                        .expected = "at most one model",
                        .found = std::to_string(models.size()),
                        .advice = "Call track once for each model that is to be recorded."});
    const DataSheet sheet = find_data_sheet(actuator, progress);
    const TrackingSpec spec = spec_of(call, sheet, progress);
    check_tracking(sheet, spec, seeds.front());  // before the sweeps for the line
    std::vector<NamedInverse> inverses;
    for (const auto& [name, model] : models) inverses.push_back({name, inverse_of(*model.file)});
    const LinearInverse linear = sweep_line(sheet, kLineSeed, progress);
    std::string document =
        tracking_json(track_models(sheet, spec, linear, inverses, seeds, progress));
    std::optional<Recording> record;
    if (is_recorded) {
      TrackingSpec once = spec;
      once.measures_bandwidth = false;
      const AnyInverse inverse = inverses.empty() ? AnyInverse(linear) : inverses.front().inverse;
      record = torsio::track(sheet, once, inverse, seeds.front(), progress).record;
    }
    return std::pair(std::move(document), std::move(record));
  });
}

using MarginsRow = std::tuple<std::string, bool, double, double, double, double, double>;

std::vector<MarginsRow> margins(const std::string& actuator, double bandwidth_rad_s, double damping,
                                double load_inertia_kg_m2) {
  if (!(load_inertia_kg_m2 >= 0.0))
    throw UsageError({.place = "load_inertia_kg_m2",
                      .expected = "0 or more",
                      .found = std::string(py::str(py::float_(load_inertia_kg_m2)))});
  DeflectionController::Settings settings{.joint = series_elastic_joint(find_data_sheet(actuator)),
                                          .bandwidth_rad_s = bandwidth_rad_s,
                                          .damping = damping};
  settings.joint.joint_inertia_kg_m2 += load_inertia_kg_m2;
  constexpr double kRate_Hz = 1000.0;
  TorqueLoopCore::Settings loop;
  loop.deflection = settings;
  const TorqueLoopCore core(loop, kRate_Hz);
  std::vector<MarginsRow> rows;
  for (const auto& [name, output] :
       {std::pair("locked", JointOutput::locked), std::pair("free", JointOutput::free)}) {
    const Margins of = core.margins_of(output);
    rows.emplace_back(name, of.is_stable, of.phase_rad, of.crossover_rad_s, of.gain, of.gain_rad_s,
                      of.least_gain);
  }
  return rows;
}

}  // namespace

void bind_control(py::module_& module) {
  py::class_<TrackCall>(module, "TrackCall")
      .def(py::init<>())
      .def_readwrite("reference", &TrackCall::reference)
      .def_readwrite("recorded", &TrackCall::recorded)
      .def_readwrite("amplitude_Nm", &TrackCall::amplitude_Nm)
      .def_readwrite("duration_s", &TrackCall::duration_s)
      .def_readwrite("bandwidth_rad_s", &TrackCall::bandwidth_rad_s)
      .def_readwrite("damping", &TrackCall::damping)
      .def_readwrite("is_free", &TrackCall::is_free)
      .def_readwrite("lever_m", &TrackCall::lever_m)
      .def_readwrite("friction_share", &TrackCall::friction_share)
      .def_readwrite("observer_Hz", &TrackCall::observer_Hz)
      .def_readwrite("feeds_forward", &TrackCall::feeds_forward)
      .def_readwrite("lowest_rad", &TrackCall::lowest_rad)
      .def_readwrite("highest_rad", &TrackCall::highest_rad)
      .def_readwrite("speed_rad_s", &TrackCall::speed_rad_s)
      .def_readwrite("acts_on_velocity", &TrackCall::acts_on_velocity)
      .def_readwrite("velocity_rad_s", &TrackCall::velocity_rad_s)
      .def_readwrite("schedule", &TrackCall::schedule)
      .def_readwrite("injections", &TrackCall::injections);
  module.def("track", track, py::arg("actuator"), py::arg("models"), py::arg("call"),
             py::arg("seeds"), py::arg("is_recorded"));
  module.def("margins", margins, py::arg("actuator"), py::arg("bandwidth_rad_s"),
             py::arg("damping"), py::arg("load_inertia_kg_m2"));
}

}  // namespace torsio::python
