#include "estimators.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/did_you_mean.hpp"
#include "torsio/evaluate/estimate_recording.hpp"

namespace torsio::python {
namespace {

std::string list_of(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& each : names) text += (text.empty() ? "" : ", ") + each;
  return text;
}

/// Members of `torsio.Fault` by number; they live as long as the process.
py::handle fault_object(Fault fault) {
  // Not initialised by a call: Python may let another thread run in it, which would wait here for ever with
  // the interpreter's lock.
  using Members = std::array<PyObject*, kFaultCount>;
  static Members* members = nullptr;
  if (members == nullptr) {
    auto all = std::make_unique<Members>();
    const py::object type = py::module_::import("torsio._faults").attr("Fault");
    for (std::size_t i = 0; i < all->size(); ++i) (*all)[i] = type(i).release().ptr();
    if (members == nullptr) members = all.release();
  }
  return (*members)[static_cast<std::size_t>(fault)];
}

/// `torsio.Estimates`; it lives as long as the process.
py::handle estimates_type() {
  static PyObject* type = nullptr;  // as above
  if (type == nullptr) {
    py::object found = py::module_::import("torsio._results").attr("Estimates");
    if (type == nullptr) type = found.release().ptr();
  }
  return type;
}

/// One tick from the arguments of `step`: numbers, one sequence or array, or channels by name.
void fill_row(PythonEstimator& self, const py::args& arguments, const py::kwargs& by_name) {
  const std::vector<std::string>& channels = self.estimator.raw_inputs();
  const auto number = [](const py::handle& from, const std::string& channel) {
    const double value = PyFloat_AsDouble(from.ptr());
    if (value == -1.0 && PyErr_Occurred() != nullptr) {
      PyErr_Clear();
      throw UsageError(
          {.place = "step: " + channel, .expected = "a number", .found = kind_of(from)});
    }
    return value;
  };
  const auto wrong_count = [&](std::size_t found) {
    return UsageError(
        {.place = "step",
         .expected = std::to_string(channels.size()) + " numbers: " + list_of(channels),
         .found = std::to_string(found)});
  };
  if (by_name.size() > 0) {
    if (arguments.size() > 0 || by_name.size() != channels.size())
      throw wrong_count(arguments.size() + by_name.size());
    for (const auto& [key, value] : by_name) {
      const auto channel = py::cast<std::string>(key);
      const auto found = std::find(channels.begin(), channels.end(), channel);
      if (found == channels.end())
        throw UsageError({.place = "step",
                          .expected = "the channels " + list_of(channels),
                          .found = channel,
                          .advice = did_you_mean(channel, channels)});
      self.row[static_cast<std::size_t>(found - channels.begin())] = number(value, channel);
    }
    return;
  }
  if (arguments.size() == 1 && py::isinstance<py::array>(arguments[0])) {
    const Rows one(arguments[0].attr("reshape")(1, -1), channels, "step");
    one.copy(0, self.row);
    return;
  }
  if (arguments.size() == 1 && py::isinstance<py::sequence>(arguments[0]) &&
      !py::isinstance<py::str>(arguments[0])) {
    const auto sequence = py::reinterpret_borrow<py::sequence>(arguments[0]);
    if (sequence.size() != channels.size()) throw wrong_count(sequence.size());
    for (std::size_t i = 0; i < channels.size(); ++i)
      self.row[i] = number(py::object(sequence[i]), channels[i]);
    return;
  }
  if (arguments.size() != channels.size()) throw wrong_count(arguments.size());
  for (std::size_t i = 0; i < channels.size(); ++i) self.row[i] = number(arguments[i], channels[i]);
}

Estimate step(PythonEstimator& self, const py::args& arguments, const py::kwargs& by_name) {
  const InUse in_use(self.is_in_use);
  fill_row(self, arguments, by_name);
  return self.estimator.step(self.row);
}

py::object run(PythonEstimator& self, const py::object& inputs) {
  const InUse in_use(self.is_in_use);
  const Rows rows(inputs, self.estimator.raw_inputs(), "run");
  EstimateArrays estimates(rows.size());
  {
    const py::gil_scoped_release unlocked;
    for (std::size_t n = 0; n < rows.size(); ++n) {
      rows.copy(n, self.row);
      estimates.set(n, self.estimator.step(self.row));
    }
  }
  return estimates.result();
}

py::bytes saved(const PythonEstimator& self) {
  const InUse in_use(self.is_in_use);
  std::string bytes(self.estimator.state_size(), '\0');
  if (bytes.empty() || !self.estimator.save(std::as_writable_bytes(std::span(bytes))))
    throw Error({.place = "save", .problem = "the state of this model cannot be saved"});
  return bytes;
}

PythonEstimator copied(const PythonEstimator& self) {
  const InUse in_use(self.is_in_use);
  return self;
}

void load(PythonEstimator& self, const py::object& state) {
  const InUse in_use(self.is_in_use);
  if (!PyBytes_Check(state.ptr()) && !PyByteArray_Check(state.ptr()))
    throw UsageError({.place = "load", .expected = "bytes from save", .found = kind_of(state)});
  const auto bytes = py::bytes(state).cast<std::string>();
  if (!self.estimator.load(std::as_bytes(std::span(bytes))))
    throw Error({.place = "load",
                 .expected = "bytes that save gave for the same model and rate",
                 .found = std::to_string(bytes.size()) + " other bytes",
                 .advice = "The state of the estimator is as it was."});
}

py::tuple pickled(const PythonEstimator& self) {
  const std::vector<std::byte> model = model_bytes(*self.file);
  return py::make_tuple(kPickleVersion,
                        py::bytes(reinterpret_cast<const char*>(model.data()), model.size()),
                        self.rate_Hz, self.zeros, saved(self));
}

std::unique_ptr<PythonEstimator> unpickled(const py::tuple& state) {
  check_pickle(state, 5, "Estimator");
  const auto bytes = state[1].cast<std::string>();
  auto file = std::make_shared<const ModelFile>(
      parse_model(std::as_bytes(std::span(bytes)), "pickle of an Estimator"));
  auto estimator = std::make_unique<PythonEstimator>(std::move(file), state[2].cast<double>());
  for (const auto& [channel, value] : state[3].cast<std::map<std::string, double>>())
    estimator->set_zero(channel, value);
  load(*estimator, state[4]);
  return estimator;
}

py::object estimate(const Model& model, const Recording& recording) {
  const EstimatedRecording estimated = interruptible([&](const Progress& progress) {
    return estimate_recording(make_estimator(*model.file, recording.sample_rate_Hz()), recording,
                              progress);
  });
  const std::string& target = model.file->settings.target;
  const auto& values = estimated.channels.channel(estimate_channel(target)).values;
  const auto& std_devs = estimated.channels.channel(error_bar_channel(target)).values;
  const auto& novelties = estimated.channels.channel("novelty_1").values;
  EstimateArrays arrays(values.size());
  for (std::size_t n = 0; n < values.size(); ++n)
    arrays.set(n, {values[n], std_devs[n], novelties[n], estimated.faults[n]});
  return arrays.result();
}

}  // namespace

Rows::Rows(const py::handle& object, const std::vector<std::string>& channels,
           const std::string& place) {
  const auto refuse = [&](const std::string& found) {
    throw UsageError({.place = place,
                      .expected = "numbers of shape (rows, " + std::to_string(channels.size()) +
                                  "), the columns " + list_of(channels),
                      .found = found});
  };
  py::object source = py::reinterpret_borrow<py::object>(object);
  if (py::hasattr(source, "columns") && py::hasattr(source, "to_numpy")) {
    for (const std::string& channel : channels)
      if (!source.attr("columns").contains(channel))
        refuse("a DataFrame without the column " + channel);
    source = source[py::cast(channels)].attr("to_numpy")();
  }
  py::array array = py::array::ensure(unmasked(source));
  if (!array) {
    PyErr_Clear();
    refuse(kind_of(object));
  }
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b') refuse(kind_of(array));
  if (!py::isinstance<py::array_t<double>>(array)) array = py::array_t<double>::ensure(array);
  const bool is_column = array.ndim() == 1 && channels.size() == 1;
  if (!is_column &&
      (array.ndim() != 2 || array.shape(1) != static_cast<py::ssize_t>(channels.size())))
    refuse(kind_of(array));
  array_ = std::move(array);
  data_ = static_cast<const char*>(array_.data());
  rows_ = static_cast<std::size_t>(array_.shape(0));
  row_stride_ = array_.strides(0);
  column_stride_ = is_column ? 0 : array_.strides(1);
}

EstimateArrays::EstimateArrays(std::size_t rows)
    : values_(static_cast<py::ssize_t>(rows)),
      std_devs_(static_cast<py::ssize_t>(rows)),
      novelties_(static_cast<py::ssize_t>(rows)),
      faults_(static_cast<py::ssize_t>(rows)),
      value_(values_.mutable_data()),
      std_dev_(std_devs_.mutable_data()),
      novelty_(novelties_.mutable_data()),
      fault_(faults_.mutable_data()) {}

EstimateArrays::EstimateArrays(std::size_t rows, const py::object& out, const std::string& place)
    : EstimateArrays(out.is_none() ? rows : 0) {
  if (out.is_none()) return;
  if (!py::isinstance(out, estimates_type()))
    throw UsageError(
        {.place = place + ": out", .expected = "Estimates or None", .found = kind_of(out)});
  const auto take = [&]<class Number>(const char* name, py::array_t<Number>& into) {
    const py::object array = out.attr(name);
    if (!py::isinstance<py::array_t<Number, py::array::c_style>>(array) ||
        py::array(array).ndim() != 1 ||
        py::array(array).shape(0) != static_cast<py::ssize_t>(rows) ||
        !py::array(array).writeable())
      throw UsageError({.place = place + ": out." + name,
                        .expected = "a writeable contiguous array of shape (" +
                                    std::to_string(rows) + ",) and type " +
                                    std::string(py::str(py::dtype::of<Number>())),
                        .found = kind_of(array),
                        .advice = "Reuse the result of an earlier step of this batch."});
    into = py::reinterpret_borrow<py::array_t<Number>>(array);
    return into.mutable_data();
  };
  value_ = take("value", values_);
  std_dev_ = take("std_dev", std_devs_);
  novelty_ = take("novelty", novelties_);
  fault_ = take("fault", faults_);
  const std::array<std::uintptr_t, 4> starts{
      reinterpret_cast<std::uintptr_t>(value_), reinterpret_cast<std::uintptr_t>(std_dev_),
      reinterpret_cast<std::uintptr_t>(novelty_), reinterpret_cast<std::uintptr_t>(fault_)};
  const std::array<std::size_t, 4> sizes{rows * sizeof(double), rows * sizeof(double),
                                         rows * sizeof(double), rows};
  for (std::size_t i = 0; i < starts.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (starts[i] < starts[j] + sizes[j] && starts[j] < starts[i] + sizes[i])
        throw UsageError({.place = place + ": out",
                          .expected = "four arrays that share no memory",
                          .found = "two that do",
                          .advice = "Reuse the result of an earlier step of this batch."});
  out_ = out;
}

py::object EstimateArrays::result() const {
  if (!out_.is_none()) return out_;
  return estimates_type()(values_, std_devs_, novelties_, faults_);
}

InUse::InUse(std::atomic<bool>& flag) : flag_(flag) {
  if (flag_.exchange(true, std::memory_order_acquire))
    throw UsageError({.place = "estimator",
                      .problem = "another thread is using it",
                      .advice = "Give each thread its own: copy.copy(estimator)."});
}

PythonEstimator::PythonEstimator(std::shared_ptr<const ModelFile> model, double sample_rate_Hz)
    : file(std::move(model)),
      rate_Hz(sample_rate_Hz),
      estimator(make_estimator(*file, sample_rate_Hz)),
      row(estimator.raw_inputs().size()) {}

PythonEstimator::PythonEstimator(const PythonEstimator& other)
    : file(other.file),
      rate_Hz(other.rate_Hz),
      estimator(other.estimator),
      zeros(other.zeros),
      row(other.row) {}

void PythonEstimator::set_zero(const std::string& channel, double value) {
  const InUse in_use(is_in_use);
  estimator.set_zero(channel, value);
  zeros[channel] = value;
}

double rate_of(const ModelFile& file, std::optional<double> rate_Hz) {
  if (!rate_Hz) return file.settings.sample_rate_Hz;
  if (!(*rate_Hz > 0.0) || !std::isfinite(*rate_Hz))
    throw UsageError({.place = "rate_Hz",
                      .expected = "a positive number of Hz",
                      .found = std::string(py::str(py::float_(*rate_Hz)))});
  return *rate_Hz;
}

void bind_estimators(py::module_& module) {
  py::class_<Estimate>(module, "Estimate", "The output of one step; use the value while not fault.")
      .def_readonly("value", &Estimate::value, "In the unit of the target; finite in every case.")
      .def_readonly("std_dev", &Estimate::std_dev, "One standard deviation, NaN without evidence.")
      .def_readonly("novelty", &Estimate::novelty,
                    "Larger: less like the training data; NaN if unknown.")
      .def_property_readonly("fault",
                             [](const Estimate& self) {
                               return py::reinterpret_borrow<py::object>(fault_object(self.fault));
                             })
      .def("__repr__", [](const Estimate& self) {
        return "<Estimate " + std::string(py::str(py::float_(self.value))) + " +- " +
               std::string(py::str(py::float_(self.std_dev))) + ", fault " +
               std::string(name(self.fault)) + ">";
      });
  py::class_<PythonEstimator>(module, "Estimator",
                              "A model in a loop: one row of channels in, one estimate out.\n\n"
                              "One thread at a time; copy.copy gives each thread its own.")
      .def_property_readonly(
          "raw_inputs", [](const PythonEstimator& self) { return self.estimator.raw_inputs(); },
          "The channels of a row, in this order, in SI.")
      .def_property_readonly(
          "unset_zeros", [](const PythonEstimator& self) { return self.estimator.unset_zeros(); },
          "Channels that need set_zero; until then each step has the fault zero_not_set.")
      .def_property_readonly(
          "target", [](const PythonEstimator& self) { return self.estimator.settings().target; })
      .def_readonly("sample_rate_Hz", &PythonEstimator::rate_Hz)
      .def_property_readonly("is_settled",
                             [](const PythonEstimator& self) {
                               const InUse in_use(self.is_in_use);
                               return self.estimator.is_settled();
                             })
      .def("set_zero", &PythonEstimator::set_zero, py::arg("channel"), py::arg("value"),
           "Subtracts a value in SI from a channel from now on.")
      .def(
          "reset",
          [](PythonEstimator& self) {
            const InUse in_use(self.is_in_use);
            self.estimator.reset();
          },
          "Filters and memory start again; zeros are kept.")
      .def("step", step,
           "One tick: step(a, b), step([a, b]) or step(gear_angle_rad=a, joint_angle_rad=b), in "
           "SI.\n\n"
           "NaN is a value that was not measured: a fault, never a guess.")
      .def("run", run, py::arg("inputs"),
           "All rows of an array of shape (rows, channels), of any strides, or of a DataFrame with "
           "these "
           "columns;\ncontinues from the present state. Other threads run meanwhile.")
      .def("save", saved, "The state (filters, memory, guards; not the zeros) as bytes.")
      .def("load", load, py::arg("state"), "Returns to a state of save.")
      .def("__copy__", copied)
      .def("__deepcopy__",
           [](const PythonEstimator& self, const py::dict& /*memo*/) { return copied(self); })
      .def("__repr__",
           [](const PythonEstimator& self) {
             return "<Estimator of " + self.estimator.settings().target + " from " +
                    list_of(self.estimator.raw_inputs()) + ">";
           })
      .def(py::pickle([](const PythonEstimator& self) { return pickled(self); },
                      [](const py::tuple& state) { return unpickled(state); }));
  module.def(
      "estimate", estimate, py::arg("model"), py::arg("recording"),
      "The estimates of a recording, streamed as a loop would; its zeros count as subtracted.");
}

}  // namespace torsio::python
