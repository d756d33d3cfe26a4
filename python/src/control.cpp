#include <cstdint>
#include <utility>

#include "bindings.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/torque_controller.hpp"
#include "torsio/report/tracking.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"

namespace torsio::python {
namespace {

std::string track(const std::string& actuator,
                  const std::vector<std::pair<std::string, Model>>& models,
                  const std::string& reference, std::optional<double> amplitude_Nm,
                  std::optional<double> duration_s, double bandwidth_rad_s, bool is_free,
                  const std::vector<std::uint64_t>& seeds) {
  return interruptible([&](const Progress& progress) {
    if (seeds.empty())
      throw UsageError({.place = "seeds", .expected = "at least one", .found = "none"});
    const DataSheet sheet = find_data_sheet(actuator, progress);
    TrackingSpec spec;
    spec.output = is_free ? JointOutput::free : JointOutput::locked;
    spec.reference.kind = find_reference(reference);
    spec.reference.amplitude_Nm = amplitude_Nm;
    spec.reference.duration_s = duration_s;
    spec.bandwidth_rad_s = bandwidth_rad_s;
    std::vector<NamedInverse> inverses;
    for (const auto& [name, model] : models) inverses.push_back({name, inverse_of(*model.file)});
    const LinearInverse linear = sweep_line(sheet, seeds.front(), progress);
    return tracking_json(track_models(sheet, spec, linear, inverses, seeds, progress));
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
  module.def("track", track, py::arg("actuator"), py::arg("models"), py::arg("reference"),
             py::arg("amplitude_Nm"), py::arg("duration_s"), py::arg("bandwidth_rad_s"),
             py::arg("is_free"), py::arg("seeds"));
  module.def("margins", margins, py::arg("actuator"), py::arg("bandwidth_rad_s"),
             py::arg("damping"), py::arg("load_inertia_kg_m2"));
}

}  // namespace torsio::python
