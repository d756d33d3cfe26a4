#include <cstddef>
#include <cstring>
#include <utility>

#include "estimators.hpp"
#include "torsio/core/state_bytes.hpp"

namespace torsio::python {
namespace {

/// Many joints of one model: one estimator, whose state is exchanged for that of each row, so that the
/// parameters remain in the nearest cache.
class Batch {
 public:
  Batch(std::shared_ptr<const ModelFile> file, double rate_Hz, std::size_t rows)
      : worker_(std::move(file), rate_Hz), rows_(rows) {
    if (rows == 0)
      throw UsageError({.place = "batch", .expected = "at least one row", .found = "0"});
    detail::StateBytes count;
    worker_.estimator.visit_state(count);
    if (!count.is_valid())
      throw Error({.place = "batch", .problem = "the state of this model cannot be saved"});
    state_bytes_ = count.position();
    start_.resize(state_bytes_);
    write(start_.data());
    states_.resize(rows * state_bytes_);
    reset_rows([](std::size_t) { return true; });
  }

  [[nodiscard]] std::size_t size() const noexcept { return rows_; }
  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept {
    return worker_.estimator.raw_inputs();
  }
  [[nodiscard]] const std::vector<std::string>& unset_zeros() const noexcept {
    return worker_.estimator.unset_zeros();
  }
  void set_zero(const std::string& channel, double value) { worker_.set_zero(channel, value); }

  py::object step(const py::object& inputs, const py::object& out) {
    const InUse in_use(worker_.is_in_use);
    const Rows rows(inputs, raw_inputs(), "Batch.step");
    if (rows.size() != rows_)
      throw UsageError({.place = "Batch.step",
                        .expected = std::to_string(rows_) + " rows",
                        .found = std::to_string(rows.size())});
    EstimateArrays estimates(rows_, out, "Batch.step");
    {
      const py::gil_scoped_release unlocked;
      for (std::size_t n = 0; n < rows_; ++n) {
        rows.copy(n, worker_.row);
        std::byte* const state = states_.data() + n * state_bytes_;
        read(state);
        estimates.set(n, worker_.estimator.step(worker_.row));
        write(state);
      }
    }
    return estimates.result();
  }

  void reset(const py::object& mask) {
    const InUse in_use(worker_.is_in_use);
    if (mask.is_none()) return reset_rows([](std::size_t) { return true; });
    const auto flags = py::array::ensure(mask);
    if (!flags || flags.ndim() != 1 || flags.dtype().kind() != 'b' ||
        flags.shape(0) != static_cast<py::ssize_t>(rows_)) {
      PyErr_Clear();
      throw UsageError(
          {.place = "Batch.reset",
           .expected = "a mask of shape (" + std::to_string(rows_) + ",) and type bool",
           .found = kind_of(mask)});
    }
    const py::array_t<bool> chosen(flags);
    reset_rows([&](std::size_t n) { return chosen.at(n); });
  }

  [[nodiscard]] py::array_t<std::uint8_t> saved() const {
    py::array_t<std::uint8_t> all({rows_, detail::kStateHeaderBytes + state_bytes_});
    auto* to = reinterpret_cast<std::byte*>(all.mutable_data());
    for (std::size_t n = 0; n < rows_; ++n) {
      const std::span row(to + n * (detail::kStateHeaderBytes + state_bytes_),
                          detail::kStateHeaderBytes + state_bytes_);
      std::memcpy(row.data() + detail::kStateHeaderBytes, states_.data() + n * state_bytes_,
                  state_bytes_);
      detail::write_state_header(row, worker_.estimator.state_identity());
    }
    return all;
  }

  /// All rows are checked before the first one changes.
  void load(const py::object& object) {
    const InUse in_use(worker_.is_in_use);
    const std::size_t width = detail::kStateHeaderBytes + state_bytes_;
    const auto refuse = [&](const std::string& found) {
      throw UsageError({.place = "Batch.load",
                        .expected = "states of save, of shape (" + std::to_string(rows_) + ", " +
                                    std::to_string(width) + ") and type uint8",
                        .found = found});
    };
    const auto array = py::array::ensure(object);
    if (!array || !py::isinstance<py::array_t<std::uint8_t>>(array) || array.ndim() != 2 ||
        array.shape(0) != static_cast<py::ssize_t>(rows_) ||
        array.shape(1) != static_cast<py::ssize_t>(width)) {
      PyErr_Clear();
      refuse(kind_of(object));
    }
    const py::array_t<std::uint8_t, py::array::c_style> whole(array);
    const auto* const from = reinterpret_cast<const std::byte*>(whole.data());
    for (std::size_t n = 0; n < rows_; ++n)
      if (!worker_.estimator.load({from + n * width, width}))
        refuse("row " + std::to_string(n) + ", which is not a state of this model");
    for (std::size_t n = 0; n < rows_; ++n)
      std::memcpy(states_.data() + n * state_bytes_, from + n * width + detail::kStateHeaderBytes,
                  state_bytes_);
  }

 private:
  void read(const std::byte* state) noexcept {
    detail::StateBytes bytes(detail::StateBytes::Task::read, {state, state_bytes_});
    worker_.estimator.visit_state(bytes);
  }
  void write(std::byte* state) noexcept {
    detail::StateBytes bytes(std::span(state, state_bytes_));
    worker_.estimator.visit_state(bytes);
  }
  template <class Chosen>
  void reset_rows(const Chosen& chosen) {
    for (std::size_t n = 0; n < rows_; ++n)
      if (chosen(n)) std::memcpy(states_.data() + n * state_bytes_, start_.data(), state_bytes_);
  }

  PythonEstimator worker_;
  std::size_t rows_;
  std::size_t state_bytes_ = 0;
  std::vector<std::byte> start_;  ///< the state after a reset
  std::vector<std::byte> states_;
};

}  // namespace

void bind_batches(py::module_& module) {
  py::class_<Batch>(module, "Batch",
                    "Many joints of one model, each with a state of its own: one joint a row.")
      .def(py::init([](const Model& model, std::size_t rows, std::optional<double> rate_Hz) {
             return std::make_unique<Batch>(model.file, rate_of(*model.file, rate_Hz), rows);
           }),
           py::arg("model"), py::arg("rows"), py::kw_only(), py::arg("rate_Hz") = py::none())
      .def("__len__", &Batch::size)
      .def_property_readonly("raw_inputs", &Batch::raw_inputs)
      .def_property_readonly("unset_zeros", &Batch::unset_zeros)
      .def("set_zero", &Batch::set_zero, py::arg("channel"), py::arg("value"),
           "Subtracts a value in SI from a channel of all rows from now on.")
      .def("step", &Batch::step, py::arg("inputs"), py::kw_only(), py::arg("out") = py::none(),
           "One tick of every joint: inputs of shape (rows, channels); Estimates of shape "
           "(rows,).\n\n"
           "Writes into the arrays of out, the result of an earlier step, and returns it, if it is "
           "given.")
      .def("reset", &Batch::reset, py::arg("mask") = py::none(),
           "Resets all rows, or those where the mask of shape (rows,) is True.")
      .def("save", &Batch::saved, "The states of all rows: uint8 of shape (rows, bytes).")
      .def("load", &Batch::load, py::arg("states"), "Returns to the states of save.");
  const py::object model = module.attr("Model");
  model.attr("batch") = py::cpp_function(
      [](const Model& self, std::size_t rows, std::optional<double> rate_Hz) {
        return std::make_unique<Batch>(self.file, rate_of(*self.file, rate_Hz), rows);
      },
      py::name("batch"), py::is_method(model), py::arg("rows"), py::kw_only(),
      py::arg("rate_Hz") = py::none(), "So many joints of this model, one per row.");
}

}  // namespace torsio::python
