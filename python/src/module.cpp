#include "bindings.hpp"
#include "torsio/core/version.hpp"

namespace torsio::python {

void bind_errors(py::module_& module) {
  // The last one that is registered is tried first.
  static const py::exception<Error> error(module, "Error", PyExc_ValueError);
  static const py::exception<UsageError> usage_error(module, "UsageError", error.ptr());
  error.attr("__module__") = "torsio";
  usage_error.attr("__module__") = "torsio";
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const UsageError& caught) {
      PyErr_SetString(usage_error.ptr(), caught.what());
    } catch (const Cancelled& caught) {
      PyErr_SetString(PyExc_KeyboardInterrupt, caught.what());
    } catch (const Error& caught) {
      PyErr_SetString(error.ptr(), caught.what());
    }
  });
}

void check_pickle(const py::tuple& state, std::size_t size, std::string_view what) {
  const bool has_version = !state.empty() && py::isinstance<py::int_>(state[0]);
  if (has_version && state[0].cast<long long>() == kPickleVersion && state.size() == size) return;
  throw Error(
      {.place = "pickle of a " + std::string(what),
       .expected = "version " + std::to_string(kPickleVersion),
       .found = has_version ? "version " + std::string(py::str(state[0])) : "something else",
       .advice = "Was it made by a later release of torsio? For storage, use save and load."});
}

bool is_path(const py::handle& object) {
  return py::isinstance<py::str>(object) || py::hasattr(object, "__fspath__");
}

std::string path_text(const py::handle& path) {
  if (!is_path(path))
    throw UsageError({.place = "path", .expected = "a str or a path", .found = kind_of(path)});
  return py::module_::import("os").attr("fspath")(path).cast<std::string>();
}

py::object unmasked(const py::handle& object) {
  if (!py::hasattr(object, "mask") || !py::hasattr(object, "filled"))
    return py::reinterpret_borrow<py::object>(object);
  return object.attr("astype")("float64").attr("filled")(kNotMeasured);
}

std::string kind_of(const py::handle& object) {
  if (object.is_none()) return "None";
  const std::string type = py::str(py::type::handle_of(object).attr("__name__"));
  if (py::hasattr(object, "shape") && py::hasattr(object, "dtype"))
    return type + " of shape " + std::string(py::str(object.attr("shape"))) + " and type " +
           std::string(py::str(object.attr("dtype")));
  return "a " + type;
}

}  // namespace torsio::python

PYBIND11_MODULE(_core, module) {
  using namespace torsio::python;
  module.doc() = "The compiled part of torsio; use the package torsio.";
  module.attr("__version__") = torsio::kVersion;
  bind_errors(module);
  bind_progress(module);
  bind_recordings(module);
  bind_models(module);
  bind_estimators(module);
  bind_batches(module);
  bind_learning(module);
  bind_control(module);
  bind_impedance(module);
  bind_fleet(module);
  bind_supervision(module);
  bind_imports(module);
  bind_drives(module);
  bind_arms(module);
  bind_links(module);
  bind_graphs(module);
}
