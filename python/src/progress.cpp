#include "bindings.hpp"

namespace torsio::python {
namespace {

constexpr std::chrono::milliseconds kBetweenCalls{100};

/// Owned by the block of `torsio.progress` that set it, which ends in the same thread.
thread_local PyObject* listener_of_thread = nullptr;

/// @return the one before, or None
py::object set_listener(const py::object& listener) {
  PyObject* const before = listener_of_thread;
  listener_of_thread = listener.is_none() ? nullptr : listener.inc_ref().ptr();
  return before == nullptr ? py::object(py::none()) : py::reinterpret_steal<py::object>(before);
}

}  // namespace

py::object progress_listener() { return py::reinterpret_borrow<py::object>(listener_of_thread); }

std::optional<py::error_already_set> ProgressCalls::call(double fraction, std::string_view doing) {
  const auto now = std::chrono::steady_clock::now();
  if (!listener_ || now < next_) return std::nullopt;
  next_ = now + kBetweenCalls;
  try {
    listener_(fraction, doing);
  } catch (const py::error_already_set& raised) {
    return raised;
  }
  return std::nullopt;
}

void bind_progress(py::module_& module) {
  module.def("set_progress", set_listener, py::arg("listener"));
}

}  // namespace torsio::python
