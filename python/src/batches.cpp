#include <cstddef>
#include <utility>

#include "estimators.hpp"
#include "torsio/estimate/estimator_batch.hpp"

namespace torsio::python {
namespace {

/// A batch as Python holds it.
class Batch {
 public:
  Batch(const std::shared_ptr<const ModelFile>& file, double rate_Hz, std::size_t rows)
      : Batch(PythonEstimator(file, rate_Hz), rows) {}

  [[nodiscard]] std::size_t size() const noexcept { return rows_.size(); }
  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept {
    return rows_.raw_inputs();
  }
  [[nodiscard]] const std::vector<std::string>& unset_zeros() const noexcept {
    return rows_.unset_zeros();
  }
  void set_zero(const std::string& channel, double value) {
    const InUse in_use(is_in_use_);
    rows_.set_zero(channel, value);
  }

  py::object step(const py::object& inputs, const py::object& out) {
    const InUse in_use(is_in_use_);
    const Rows rows(inputs, raw_inputs(), "Batch.step");
    if (rows.size() != size())
      throw UsageError({.place = "Batch.step",
                        .expected = std::to_string(size()) + " rows",
                        .found = std::to_string(rows.size())});
    EstimateArrays estimates(size(), out, "Batch.step");
    {
      const py::gil_scoped_release unlocked;
      const std::size_t channels = raw_inputs().size();
      for (std::size_t n = 0; n < size(); ++n)
        rows.copy(n, std::span(raw_).subspan(n * channels, channels));
      rows_.step(raw_, estimates_);
      for (std::size_t n = 0; n < size(); ++n) estimates.set(n, estimates_[n]);
    }
    return estimates.result();
  }

  void reset(const py::object& mask) {
    const InUse in_use(is_in_use_);
    if (mask.is_none()) return rows_.reset();
    const auto flags = py::array::ensure(mask);
    if (!flags || flags.ndim() != 1 || flags.dtype().kind() != 'b' ||
        flags.shape(0) != static_cast<py::ssize_t>(size())) {
      PyErr_Clear();
      throw UsageError(
          {.place = "Batch.reset",
           .expected = "a mask of shape (" + std::to_string(size()) + ",) and type bool",
           .found = kind_of(mask)});
    }
    const py::array_t<bool> chosen(flags);
    for (std::size_t n = 0; n < size(); ++n)
      if (chosen.at(n)) rows_.reset(n);
  }

  [[nodiscard]] py::array_t<std::uint8_t> saved() {
    const InUse in_use(is_in_use_);
    const std::size_t width = rows_.state_size();
    py::array_t<std::uint8_t> all({size(), width});
    auto* const to = reinterpret_cast<std::byte*>(all.mutable_data());
    for (std::size_t n = 0; n < size(); ++n)
      static_cast<void>(rows_.save(n, {to + n * width, width}));
    return all;
  }

  /// All rows are checked before the first one changes.
  void load(const py::object& object) {
    const InUse in_use(is_in_use_);
    const std::size_t width = rows_.state_size();
    const auto refuse = [&](const std::string& found) {
      throw UsageError({.place = "Batch.load",
                        .expected = "states of save, of shape (" + std::to_string(size()) + ", " +
                                    std::to_string(width) + ") and type uint8",
                        .found = found});
    };
    const auto array = py::array::ensure(object);
    if (!array || !py::isinstance<py::array_t<std::uint8_t>>(array) || array.ndim() != 2 ||
        array.shape(0) != static_cast<py::ssize_t>(size()) ||
        array.shape(1) != static_cast<py::ssize_t>(width)) {
      PyErr_Clear();
      refuse(kind_of(object));
    }
    const py::array_t<std::uint8_t, py::array::c_style> whole(array);
    const auto* const from = reinterpret_cast<const std::byte*>(whole.data());
    for (std::size_t n = 0; n < size(); ++n)
      if (!rows_.is_state({from + n * width, width}))
        throw Error({.place = "Batch.load: row " + std::to_string(n),
                     .expected = "bytes that save gave for the same model and rate",
                     .found = "other bytes",
                     .advice = "The states of all rows are as they were."});
    for (std::size_t n = 0; n < size(); ++n)
      static_cast<void>(rows_.load(n, {from + n * width, width}));
  }

 private:
  Batch(const PythonEstimator& one, std::size_t rows)
      : rows_(one.estimator.settings(), one.estimator.model(), rows),
        raw_(rows * rows_.raw_inputs().size()),
        estimates_(rows) {}

  EstimatorBatch rows_;
  std::vector<double> raw_;
  std::vector<Estimate> estimates_;
  std::atomic<bool> is_in_use_ = false;
};

}  // namespace
}  // namespace torsio::python

template <>
struct pybind11::detail::type_caster<torsio::python::Batch>
    : InitialisedCaster<torsio::python::Batch> {};

namespace torsio::python {
namespace {

std::unique_ptr<Batch> batch_of(const Model& model, std::size_t rows,
                                std::optional<double> rate_Hz) {
  return std::make_unique<Batch>(model.file, rate_of(*model.file, rate_Hz), rows);
}

}  // namespace

void bind_batches(py::module_& module) {
  py::class_<Batch>(module, "Batch",
                    "Many joints of one model, each with a state of its own: one joint a row.")
      .def(py::init(&batch_of), py::arg("model"), py::arg("rows"), py::kw_only(),
           py::arg("rate_Hz") = py::none())
      .def("__len__", &Batch::size)
      .def_property_readonly("raw_inputs", &Batch::raw_inputs)
      .def_property_readonly("unset_zeros", &Batch::unset_zeros)
      .def("set_zero", &Batch::set_zero, py::arg("channel"), py::arg("value"),
           "Subtracts a value in SI from a channel of all rows from now on.")
      .def("step", &Batch::step, py::arg("inputs"), py::kw_only(), py::arg("out") = py::none(),
           "One tick of every joint: inputs of shape (rows, channels); Estimates of shape "
           "(rows,).\n\n"
           "Writes into the arrays of out, the result of an earlier step, and returns it, if it is "
           "given. They may share memory with the inputs, which are read first.")
      .def("reset", &Batch::reset, py::arg("mask") = py::none(),
           "Resets all rows, or those where the mask of shape (rows,) is True.")
      .def("save", &Batch::saved, "The states of all rows: uint8 of shape (rows, bytes).")
      .def("load", &Batch::load, py::arg("states"), "Returns to the states of save.");
  const py::object model = module.attr("Model");
  model.attr("batch") = py::cpp_function(
      batch_of, py::name("batch"), py::is_method(model), py::arg("rows"), py::kw_only(),
      py::arg("rate_Hz") = py::none(), "So many joints of this model, one per row.");
}

}  // namespace torsio::python
