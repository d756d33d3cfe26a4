#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include "estimators.hpp"
#include "report/model_description.hpp"
#include "torsio/evaluate/slow_cycle.hpp"

namespace torsio::python {
namespace {

Model loaded(const py::object& path, const std::string& serial) {
  const std::string file = path_text(path);
  return {.file = std::make_shared<const ModelFile>(load_model(file, serial))};
}

py::bytes bytes_of(const Model& model) {
  const std::vector<std::byte> bytes = model_bytes(*model.file);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Model from_bytes(const py::bytes& data, const std::string& serial) {
  const auto bytes = data.cast<std::string>();
  return {.file = std::make_shared<const ModelFile>(
              parse_model(std::as_bytes(std::span(bytes)), "the bytes of a model", serial))};
}

py::tuple pickled(const Model& model) {
  py::list table;
  for (const FittedParameter& each : model.table)
    table.append(py::make_tuple(each.name, each.unit, each.value, each.std_error));
  return py::make_tuple(kPickleVersion, bytes_of(model), model.notes, table, model.fit_seconds);
}

Model model_unpickled(const py::tuple& state) {
  check_pickle(state, 5, "Model");
  Model model = from_bytes(state[1].cast<py::bytes>(), "");
  model.notes = state[2].cast<std::vector<std::string>>();
  for (const py::handle& each : state[3]) {
    const auto row = each.cast<std::tuple<std::string, std::string, double, double>>();
    model.table.push_back({std::get<0>(row), std::get<1>(row), std::get<2>(row), std::get<3>(row)});
  }
  model.fit_seconds = state[4].cast<double>();
  return model;
}

std::string fitted_as(const Model& model) {
  const std::string& name = model.file->card.fitted_as;
  return name.empty() ? std::string(model.file->parameters.family()) : name;
}

py::list parameters(const Model& model) {
  py::list all;
  for (const FittedParameter& each : model.table)
    all.append(py::make_tuple(each.name, each.value, each.std_error, each.unit));
  return all;
}

}  // namespace

void bind_models(py::module_& module) {
  py::class_<Model>(module, "Model", "A fitted model with its settings and card; never changes.")
      .def_property_readonly("family", fitted_as, "The fitter's name: grey_box, mlp, ...")
      .def_property_readonly(
          "inputs", [](const Model& self) { return self.file->settings.features.inputs; },
          "Expressions of channels (docs/use/expressions.md).")
      .def_property_readonly("target", [](const Model& self) { return self.file->settings.target; })
      .def_property_readonly("sample_rate_Hz",
                             [](const Model& self) { return self.file->settings.sample_rate_Hz; })
      .def_property_readonly("zeroed_channels",
                             [](const Model& self) { return self.file->settings.zeroed_channels; })
      .def_property_readonly(
          "target_uncertainty",
          [](const Model& self) {
            const SensorUncertainty& sensor = self.file->settings.target_uncertainty;
            return py::make_tuple(sensor.constant, sensor.relative);
          },
          "(constant, relative): standard uncertainty of the sensor that the model was learned "
          "from, as a mapping\n"
          "stated it; part of every error bar.")
      .def_property_readonly(
          "parameter_count",
          [](const Model& self) { return AnyModel(self.file->parameters).parameter_count(); })
      .def_property_readonly("serial",
                             [](const Model& self) { return self.file->card.device_serial; })
      .def_property_readonly("seed", [](const Model& self) { return self.file->card.seed; })
      .def_property_readonly("options", [](const Model& self) { return self.file->card.options; })
      .def_property_readonly(
          "metrics", [](const Model& self) { return self.file->card.metrics; },
          "Scores on held-out samples, in the unit of the target.")
      .def_readonly("notes", &Model::notes, "Messages of the fit; empty for a model from a file.")
      .def_readonly("fit_seconds", &Model::fit_seconds, "NaN for a model from a file.")
      .def_property_readonly(
          "parameters", parameters,
          "(name, value, standard error, unit) of the fit; empty for a model from a file.")
      .def(
          "with_serial",
          [](const Model& self, const std::string& serial) {
            Model other = self;
            ModelFile file = *self.file;
            file.card.device_serial = serial;
            other.file = std::make_shared<const ModelFile>(std::move(file));
            return other;
          },
          py::arg("serial"), "The same model for the joint with this serial number.")
      .def(
          "save",
          [](const Model& self, const py::object& path) {
            const std::string file = path_text(path);
            const py::gil_scoped_release unlocked;
            save_model(file, *self.file);
          },
          py::arg("path"), "Writes a model file completely or not at all.")
      .def("to_bytes", bytes_of, "The bytes of a model file.")
      .def_static("from_bytes", from_bytes, py::arg("data"), py::kw_only(), py::arg("serial") = "")
      .def(
          "description_json",
          [](const Model& self) {
            return interruptible([&](const Progress& progress) {
              return model_description_json(*self.file, slow_cycle(*self.file, progress));
            });
          },
          "The document of `torsio evaluate MODEL`.")
      .def(
          "estimator",
          [](const Model& self, std::optional<double> rate_Hz) {
            return std::make_unique<PythonEstimator>(self.file, rate_of(*self.file, rate_Hz));
          },
          py::kw_only(), py::arg("rate_Hz") = py::none(),
          "For a loop at this rate; without one, that of the training.")
      .def("__repr__",
           [](const Model& self) {
             std::string inputs;
             for (const std::string& each : self.file->settings.features.inputs)
               inputs += (inputs.empty() ? "" : ", ") + each;
             return "<Model " + fitted_as(self) + " of " + self.file->settings.target + " from " +
                    inputs + ">";
           })
      .def(py::pickle([](const Model& self) { return pickled(self); },
                      [](const py::tuple& state) { return model_unpickled(state); }));
  module.def(
      "load", loaded, py::arg("path"), py::kw_only(), py::arg("serial") = "",
      "Reads a model file.\n\nserial: that of the joint; a model of another one is refused.");
}

}  // namespace torsio::python
