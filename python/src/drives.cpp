#include <memory>
#include <span>
#include <utility>

#include "bindings.hpp"
#include "files/whole_file.hpp"
#include "report/identify.hpp"
#include "torsio/data/load.hpp"
#include "torsio/identify/drive/drive_file.hpp"
#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/identify/drive/write_drive.hpp"

namespace torsio::python {
namespace {

/// An identified drive as Python holds it: never changed.
struct IdentifiedDrive {
  std::shared_ptr<const DriveIdentification> drive;
  std::vector<DriveAdvice> advice = {};
};

LoadSheet load_sheet_of(const py::object& load) {
  return py::isinstance<LoadSheet>(load) ? load.cast<LoadSheet>()
                                         : read_load_sheet(path_text(load));
}

IdentifiedDrive identify(const py::object& items, const py::object& load, const py::object& drive,
                         const std::optional<std::vector<std::string>>& terms, bool has_spring,
                         const std::string& group_by, std::size_t starts, std::uint64_t seed,
                         bool has_standard_errors, bool has_nested_score) {
  const LoadSheet sheet = load_sheet_of(load);
  const std::vector<Recording> recordings = recordings_from(items);
  if (recordings.empty())
    throw UsageError({.place = "identify", .expected = "recordings", .found = "none"});
  const DriveSheet law = drive.is_none() ? assumed_drive_sheet(recordings.front())
                                         : read_drive_sheet(path_text(drive));
  IdentifyOptions options{.group_by = group_by,
                          .starts = starts,
                          .has_standard_errors = has_standard_errors,
                          .has_nested_score = has_nested_score,
                          .seed = seed};
  if (terms) options.terms = drive_terms_named(*terms, "terms", "'auto' or terms of ");
  if (has_spring) options.largest = DriveTerms().set();
  return interruptible([&](const Progress& progress) {
    options.progress = progress;
    auto identified = std::make_shared<const DriveIdentification>(
        identify_drive(recordings, sheet, law, options));
    std::vector<DriveAdvice> advice = advise_drive(*identified, recordings);
    return IdentifiedDrive{std::move(identified), std::move(advice)};
  });
}

void write_all(const py::object& path, std::string_view text) {
  write_whole_file(path_text(path), std::as_bytes(std::span(text)));
}

py::array_t<double> array_of(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::dict simulate_recording(const IdentifiedDrive& self, const Recording& recording) {
  const DriveTrace trace = interruptible(
      [&](const Progress& /*progress*/) { return simulate_drive(*self.drive, recording); });
  py::dict columns;
  columns["measured_rad"] = array_of(trace.measured_rad);
  columns["angle_rad"] = array_of(trace.angle_rad);
  columns["joint_angle_rad"] = array_of(trace.joint_angle_rad);
  columns["joint_torque_Nm"] = array_of(trace.joint_torque_Nm);
  return columns;
}

IdentifiedDrive evaluated(const IdentifiedDrive& self, const py::object& items,
                          const py::object& load, const std::string& group_by) {
  DriveIdentification drive = *self.drive;
  if (!load.is_none()) drive.load = load_sheet_of(load);
  const std::vector<Recording> recordings = recordings_from(items);
  return interruptible([&](const Progress& /*progress*/) {
    return IdentifiedDrive{
        std::make_shared<const DriveIdentification>(evaluate_drive(drive, recordings, group_by))};
  });
}

double write_for(const IdentifiedDrive& self, const std::string& target, const py::object& path,
                 const py::object& items, const std::string& name, const std::string& group_by,
                 std::size_t starts) {
  const DriveTarget wanted = drive_target(target);
  require_writable(wanted, self.drive->drive.law, name);
  const std::vector<Recording> recordings = recordings_from(items);
  const WrittenDrive written = interruptible([&](const Progress& progress) {
    const DriveIdentification here = evaluate_drive(*self.drive, recordings, group_by);
    return write_drive(wanted, here, recordings, name, {.starts = starts, .progress = progress});
  });
  write_all(path, written.text);
  return written.mae_rad;
}

}  // namespace

void bind_drives(py::module_& module) {
  py::class_<IdentifiedDrive>(module, "IdentifiedDrive",
                              "Motor, friction and spring of a joint, found by free runs.")
      .def(
          "document_json",
          [](const IdentifiedDrive& self) { return identification_json(*self.drive, self.advice); })
      .def("text",
           [](const IdentifiedDrive& self) {
             return self.drive->groups == 0 ? drive_evaluation_text(*self.drive)
                                            : identification_text(*self.drive);
           })
      .def("simulate", simulate_recording, py::arg("recording"))
      .def("evaluate", evaluated, py::arg("recordings"), py::arg("load"), py::arg("group_by"))
      .def("write", write_for, py::arg("target"), py::arg("path"), py::arg("recordings"),
           py::arg("name"), py::arg("group_by"), py::arg("starts"))
      .def("save", [](const IdentifiedDrive& self, const py::object& path) {
        write_all(path, identification_json(*self.drive, self.advice));
      });
  module.def("identify", identify, py::arg("recordings"), py::arg("load"), py::arg("drive"),
             py::arg("terms"), py::arg("spring"), py::arg("group_by"), py::arg("starts"),
             py::arg("seed"), py::arg("standard_errors"), py::arg("nested"));
  module.def("read_drive", [](const py::object& path) {
    return IdentifiedDrive{
        std::make_shared<const DriveIdentification>(read_identified_drive(path_text(path)))};
  });
}

}  // namespace torsio::python
