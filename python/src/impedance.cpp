#include <cstdint>
#include <utility>

#include "bindings.hpp"
#include "torsio/report/tracking.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/closed_loop/impedance_tracking.hpp"

namespace torsio::python {
namespace {

/// "high", "zero" or a stiffness in Nm/rad.
void set_impedance(ImpedanceSpec& spec, const py::object& impedance) {
  if (py::isinstance<py::str>(impedance)) {
    const auto name = impedance.cast<std::string>();
    if (name != "high" && name != "zero")
      throw UsageError({.place = "impedance",
                        .expected = "'high', 'zero' or a stiffness in Nm/rad",
                        .found = "'" + name + "'"});
    spec.kind = name == "high" ? ImpedanceSpec::Kind::high : ImpedanceSpec::Kind::zero;
    return;
  }
  const bool is_number =
      (py::isinstance<py::float_>(impedance) || py::isinstance<py::int_>(impedance)) &&
      !py::isinstance<py::bool_>(impedance);  // a bool is an int of Python
  if (!is_number)
    throw UsageError({.place = "impedance",
                      .expected = "'high', 'zero' or a stiffness in Nm/rad",
                      .found = kind_of(impedance)});
  spec.kind = ImpedanceSpec::Kind::wanted;
  spec.stiffness_Nm_rad = impedance.cast<double>();
}

/// Refuses what belongs to a stiffness where the gains are given.
void check_impedance_call(const ImpedanceSpec& spec) {
  if (spec.kind == ImpedanceSpec::Kind::wanted) return;
  if (spec.damping_Nms_rad == 0.0 && !spec.torque_gain_Nm_rad) return;
  throw UsageError({.place = spec.torque_gain_Nm_rad ? "torque_gain_Nm_rad" : "damping_Nms_rad",
                    .problem = "the gains of the impedance 'high' or 'zero' are given",
                    .expected = "a stiffness, impedance=2000.0"});
}

/// As `torsio track --impedance`: without a model and then with each.
std::pair<std::string, std::vector<Recording>> track_impedance(
    const std::string& actuator, const ImpedanceSpec& spec,
    const std::vector<std::pair<std::string, Model>>& models, std::uint64_t seed) {
  return interruptible([&](const Progress& progress) {
    const DataSheet sheet = find_data_sheet(actuator, progress);
    std::vector<ImpedanceModel> used;
    used.reserve(models.size());
    for (const auto& [name, model] : models)
      used.push_back(impedance_model(name, *model.file, sheet));
    std::vector<ImpedanceRun> runs = track_impedances(sheet, spec, used, seed, progress);
    std::pair<std::string, std::vector<Recording>> found{impedance_json(runs), {}};
    for (ImpedanceRun& run : runs) found.second.push_back(std::move(run.record));
    return found;
  });
}

}  // namespace

void bind_impedance(py::module_& module) {
  module.def(
      "track_impedance",
      [](const std::string& actuator, const py::object& impedance,
         const std::vector<std::pair<std::string, Model>>& models, double damping_Nms_rad,
         std::optional<double> torque_gain_Nm_rad, std::optional<double> bandwidth_rad_s,
         std::optional<double> loop_damping, std::optional<double> correction_rad_s,
         std::optional<double> amplitude_Nm, double duration_s, std::uint64_t seed) {
        ImpedanceSpec spec;
        set_impedance(spec, impedance);
        spec.damping_Nms_rad = damping_Nms_rad;
        spec.torque_gain_Nm_rad = torque_gain_Nm_rad;
        spec.bandwidth_rad_s = bandwidth_rad_s;
        spec.loop_damping = loop_damping;
        spec.correction_rad_s = correction_rad_s;
        spec.amplitude_Nm = amplitude_Nm;
        spec.duration_s = duration_s;
        check_impedance_call(spec);
        return track_impedance(actuator, spec, models, seed);
      },
      py::arg("actuator"), py::arg("impedance"), py::arg("models"), py::arg("damping_Nms_rad"),
      py::arg("torque_gain_Nm_rad"), py::arg("bandwidth_rad_s"), py::arg("loop_damping"),
      py::arg("correction_rad_s"), py::arg("amplitude_Nm"), py::arg("duration_s"), py::arg("seed"));
}

}  // namespace torsio::python
