#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/data/load.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/family_info.hpp"

namespace torsio::python {

namespace py = pybind11;

/// A model as Python holds it: never changed, so that estimators and threads share it.
struct Model {
  std::shared_ptr<const ModelFile> file;
  std::vector<std::string> notes = {};
  std::vector<FittedParameter> table = {};
  double fit_seconds = kNotMeasured;
};

/// Pickles begin with this number; a later one is refused.
inline constexpr int kPickleVersion = 1;
void check_pickle(const py::tuple& state, std::size_t size, std::string_view what);

/// The function of (fraction, text) that `torsio.progress` has set in this thread; null: none.
[[nodiscard]] py::object progress_listener();

/// Calls the listener with the interpreter's lock, at most every 0.1 s.
class ProgressCalls {
 public:
  explicit ProgressCalls(py::object listener) : listener_(std::move(listener)) {}
  /// What the listener raised; none: nothing.
  [[nodiscard]] std::optional<py::error_already_set> call(double fraction, std::string_view doing);

 private:
  py::object listener_;
  std::chrono::steady_clock::time_point next_ = {};
};

/// Runs `work(progress)` without the interpreter's lock. Ctrl-C, and whatever else a handler of a signal or
/// the listener of the progress raises, stops the work and is raised afterwards.
template <class Work>
auto interruptible(const Work& work) {
  std::optional<py::error_already_set> raised;
  ProgressCalls calls(progress_listener());
  const Progress progress = [&raised, &calls](double fraction, std::string_view doing) {
    const py::gil_scoped_acquire lock;
    if (!raised && PyErr_CheckSignals() != 0) raised.emplace();
    if (!raised) raised = calls.call(fraction, doing);
    return !raised.has_value();
  };
  try {
    const py::gil_scoped_release unlocked;
    return work(progress);
  } catch (const Cancelled&) {
    if (raised) throw py::error_already_set(*raised);
    throw;
  }
}

/// An array without its mask (numpy.ma): what is masked was not measured, and is NaN. Other objects are returned as
/// they are.
[[nodiscard]] py::object unmasked(const py::handle& object);

/// The text of a path-like object.
[[nodiscard]] std::string path_text(const py::handle& path);
[[nodiscard]] bool is_path(const py::handle& object);
/// "an array of shape (3, 2)", "a str": for messages.
[[nodiscard]] std::string kind_of(const py::handle& object);

/// Recordings, paths of logs or manifests, or lists of those.
[[nodiscard]] std::vector<Recording> recordings_from(const py::object& items,
                                                     const LoadOptions& options = {});

void bind_errors(py::module_& module);
void bind_progress(py::module_& module);
void bind_fleet(py::module_& module);
void bind_impedance(py::module_& module);
void bind_supervision(py::module_& module);
void bind_imports(py::module_& module);
void bind_recordings(py::module_& module);
void bind_models(py::module_& module);
void bind_estimators(py::module_& module);
void bind_batches(py::module_& module);
void bind_learning(py::module_& module);
void bind_control(py::module_& module);
void bind_drives(py::module_& module);
void bind_arms(py::module_& module);
void bind_links(py::module_& module);
void bind_graphs(py::module_& module);

}  // namespace torsio::python

namespace pybind11::detail {

/// `__new__` alone, as by mocks and subclasses without `super().__init__()`, makes an object without a C++
/// value; pybind11 would give the methods memory without contents.
template <class T>
struct InitialisedCaster : type_caster_base<T> {
  bool load(handle source, bool convert) {
    if (PyObject_TypeCheck(source.ptr(), reinterpret_cast<PyTypeObject*>(
                                             get_type_handle(typeid(T), false).ptr())) != 0) {
      auto* const object = reinterpret_cast<instance*>(source.ptr());
      if (object->get_value_and_holder().value_ptr() == nullptr)
        throw type_error(
            std::string(Py_TYPE(source.ptr())->tp_name) +
            ": the object was not initialised: call __init__, or the function that makes it");
    }
    return type_caster_base<T>::load(source, convert);
  }
};

template <>
struct type_caster<torsio::python::Model> : InitialisedCaster<torsio::python::Model> {};
template <>
struct type_caster<torsio::Recording> : InitialisedCaster<torsio::Recording> {};
template <>
struct type_caster<torsio::Dataset> : InitialisedCaster<torsio::Dataset> {};
template <>
struct type_caster<torsio::Estimate> : InitialisedCaster<torsio::Estimate> {};

}  // namespace pybind11::detail
