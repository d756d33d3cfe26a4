#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "bindings.hpp"
#include "data/log_table.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/write.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/common/load_target.hpp"
#include "torsio/joint_load/known_load.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio::python {
namespace {

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Flags = py::array_t<bool, py::array::c_style | py::array::forcecast>;

std::vector<double> values_of(const Doubles& array, const std::string& place) {
  if (array.ndim() != 1)
    throw UsageError(
        {.place = place, .expected = "an array of one dimension", .found = kind_of(array)});
  return {array.data(), array.data() + array.size()};
}

/// The memory of the channel itself, which lives as long as the recording does and never moves.
py::array view_of(const py::object& recording, const std::string& name) {
  const std::vector<double>& values = recording.cast<const Recording&>().channel(name).values;
  py::array_t<double> view(static_cast<py::ssize_t>(values.size()), values.data(), recording);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

py::array_t<bool> freshness(const Recording& recording, const std::string& name) {
  const Channel& channel = recording.channel(name);
  py::array_t<bool> fresh(static_cast<py::ssize_t>(recording.size()));
  bool* to = fresh.mutable_data();
  for (std::size_t n = 0; n < recording.size(); ++n) to[n] = channel.is_fresh(n);
  return fresh;
}

py::array_t<double> times(const Recording& recording) {
  py::array_t<double> t_s(static_cast<py::ssize_t>(recording.size()));
  double* to = t_s.mutable_data();
  for (std::size_t n = 0; n < recording.size(); ++n) to[n] = recording.time_s(n);
  return t_s;
}

void add_channel(Recording& recording, const std::string& name, const py::object& measured,
                 const std::optional<Flags>& fresh) {
  const auto values = Doubles::ensure(unmasked(measured));
  if (!values) {
    PyErr_Clear();
    throw UsageError(
        {.place = name, .expected = "an array of numbers", .found = kind_of(measured)});
  }
  Channel channel{name, values_of(values, name)};
  if (fresh) {
    if (fresh->ndim() != 1 || fresh->size() != values.size())
      throw UsageError({.place = name + ": fresh",
                        .expected = "as many as there are values",
                        .found = kind_of(*fresh)});
    channel.fresh.assign(fresh->data(), fresh->data() + fresh->size());
  }
  recording.add(std::move(channel));
}

void add_condition(Recording& recording, const py::object& name, const py::object& value) {
  if (!py::isinstance<py::str>(name))
    throw UsageError({.place = "add_condition",
                      .expected = "a name with its unit, such as kp_1",
                      .found = kind_of(name)});
  const double number = PyFloat_AsDouble(value.ptr());
  if (PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    throw UsageError(
        {.place = name.cast<std::string>(), .expected = "a number", .found = kind_of(value)});
  }
  recording.add_condition(name.cast<std::string>(), number);
}

/// Columns of a table in memory, read as those of a CSV file are.
std::vector<Recording> recordings_from_columns(
    const std::vector<std::pair<std::string, Doubles>>& columns, std::optional<double> rate_Hz,
    const std::string& mapping, const std::string& name) {
  LogTable table;
  table.source.file = name;
  table.row_word = "row";
  table.line_marks = {{0, 0}};  // rows are counted as pandas does
  for (const auto& [column, values] : columns)
    table.columns.push_back({column, table.columns.size() + 1, values_of(values, column)});
  return interruptible([&](const Progress& progress) {
    const Mapping rules = mapping.empty() ? Mapping{} : read_mapping(mapping, progress);
    std::vector<Recording> recordings =
        measured_recordings(table, rules, rate_Hz.value_or(0.0), name);
    for (Recording& recording : recordings) {
      add_derived(recording, rules.derive);
      recording.mapping = mapping_text(rules);
    }
    return recordings;
  });
}

void warn_of_end(const Recording& recording) {
  if (!recording.is_unfinished) return;
  const std::string text = recording.name() + ": " + std::string(kUnfinishedText);
  if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) != 0) throw py::error_already_set();
}

std::vector<Recording> read(const py::object& path, const py::object& mapping,
                            std::optional<double> rate_Hz, const std::string& target) {
  LoadOptions options;
  options.rate_Hz = rate_Hz;
  options.target = target;
  if (!mapping.is_none()) options.mapping = path_text(mapping);
  const std::string file = path_text(path);
  std::vector<Recording> recordings = interruptible([&](const Progress& progress) {
    options.progress = progress;
    return load_recordings(file, options);
  });
  for (const Recording& recording : recordings) warn_of_end(recording);
  return recordings;
}

struct Roles {
  py::object train;
  py::object validation;
  py::object test;
};

/// Recordings, paths of logs or manifests, or lists of those.
void add_to(Dataset& dataset, const py::handle& item, Role role, const LoadOptions& options) {
  if (item.is_none()) return;
  if (py::isinstance<Recording>(item)) {
    DatasetRecord record{item.cast<const Recording&>(), {}};
    record.segments = whole_record(record.recording.size(), role);
    dataset.records.push_back(std::move(record));
  } else if (is_path(item)) {
    const std::vector<std::string> files{path_text(item)};
    Dataset read = interruptible([&](const Progress& progress) {
      LoadOptions of_file = options;
      of_file.role = role;
      of_file.progress = progress;
      return role == Role::test ? load_dataset({}, files, of_file)
                                : load_dataset(files, {}, of_file);
    });
    for (DatasetRecord& record : read.records) {
      warn_of_end(record.recording);
      dataset.records.push_back(std::move(record));
    }
    if (dataset.input_sets.empty()) dataset.input_sets = read.input_sets;
    if (dataset.label.empty()) dataset.label = read.label;
    if (options.target.empty()) dataset.target = read.target;
    dataset.target_computed_from.insert(dataset.target_computed_from.end(),
                                        read.target_computed_from.begin(),
                                        read.target_computed_from.end());
    dataset.files.insert(dataset.files.end(), read.files.begin(), read.files.end());
  } else if (py::isinstance<py::sequence>(item)) {
    for (const py::handle& each : item) add_to(dataset, each, role, options);
  } else {
    throw UsageError({.place = std::string(name(role)) + " of a Dataset",
                      .expected = "Recordings, paths, or lists of them",
                      .found = kind_of(item),
                      .advice = "Recording.from_pandas makes one of a DataFrame."});
  }
}

/// How the target is computed, if it is.
struct TargetSource {
  std::optional<LoadSheet> load = {};
  LoadTarget before = {};  ///< how that of a model was computed
};

TargetSource target_source(const py::object& load, const py::object& model) {
  TargetSource source;
  if (load.is_none()) return source;
  source.load = py::isinstance<LoadSheet>(load) ? load.cast<const LoadSheet&>()
                                                : read_load_sheet(path_text(load));
  if (!model.is_none()) source.before = model.cast<const Model&>().file->card.load_target;
  return source;
}

void compute_target(Dataset& dataset, const TargetSource& source) {
  const LoadSheet& sheet = *source.load;
  // The inputs are those of a spring, whose agreement under several loads shows what is fitted.
  const FeatureSpec features =
      sheet.fits_joint_inertia || sheet.fits_zero ? resolve_inputs(dataset, {}) : FeatureSpec{};
  add_load_target(dataset, sheet, features, source.before);
}

Dataset dataset_of(const Roles& roles, const std::string& target, const py::object& mapping,
                   std::optional<double> rate_Hz, std::optional<std::size_t> initialise_samples,
                   const TargetSource& source) {
  LoadOptions options;
  options.rate_Hz = rate_Hz;
  options.target = target;
  options.computes_target = source.load.has_value();
  if (!mapping.is_none()) options.mapping = path_text(mapping);
  Dataset dataset;
  if (!target.empty()) dataset.target = target;
  if (initialise_samples) dataset.initialise_samples = *initialise_samples;
  add_to(dataset, roles.train, Role::train, options);
  add_to(dataset, roles.validation, Role::validation, options);
  add_to(dataset, roles.test, Role::test, options);
  if (dataset.records.empty())
    throw UsageError({.place = "Dataset",
                      .expected = "at least one recording",
                      .found = "none",
                      .advice = "Dataset(train=[...], test=[...])"});
  if (source.load) compute_target(dataset, source);
  dataset.check();
  return dataset;
}

std::vector<std::pair<std::string, std::string>> roles_of(const Dataset& dataset) {
  std::vector<std::pair<std::string, std::string>> all;
  for (const DatasetRecord& record : dataset.records) {
    std::string text;
    for (const Role role : {Role::train, Role::validation, Role::test})
      if (record.has_role(role)) text += (text.empty() ? "" : ", ") + std::string(name(role));
    all.emplace_back(record.recording.name(), text);
  }
  return all;
}

py::tuple pickled(const py::object& self) {
  const auto& recording = self.cast<const Recording&>();
  py::list channels;
  for (const Channel& channel : recording.channels())
    channels.append(py::make_tuple(
        channel.name, view_of(self, channel.name).attr("tobytes")(),
        py::bytes(reinterpret_cast<const char*>(channel.fresh.data()), channel.fresh.size()),
        channel.step_before_resampling));
  py::list definitions;
  for (const ChannelDefinition& each : recording.definitions)
    definitions.append(py::make_tuple(each.name, each.expression));
  py::list zeros;
  for (const ZeroRule& each : recording.zeros)
    zeros.append(py::make_tuple(each.channel, each.first_s, each.mid_range));
  py::list uncertainties;
  for (const auto& [channel, sensor] : recording.uncertainties)
    uncertainties.append(py::make_tuple(channel, sensor.constant, sensor.relative));
  return py::make_tuple(kPickleVersion, recording.name(), recording.sample_rate_Hz(),
                        recording.time_s(0), channels, recording.conditions(), definitions, zeros,
                        recording.mapping, recording.source.file, recording.source.sha256,
                        recording.labels, uncertainties);
}

Recording recording_unpickled(const py::tuple& state) {
  check_pickle(state, 13, "Recording");
  Recording recording(state[1].cast<std::string>(), state[2].cast<double>(),
                      state[3].cast<double>());
  const auto conditions = state[5].cast<std::vector<std::string>>();
  for (const py::handle& each : state[4]) {
    const auto part = each.cast<py::tuple>();
    Channel channel{part[0].cast<std::string>(), {}};
    const auto values = part[1].cast<std::string>();
    channel.values.resize(values.size() / sizeof(double));
    values.copy(reinterpret_cast<char*>(channel.values.data()),
                channel.values.size() * sizeof(double));
    const auto fresh = part[2].cast<std::string>();
    channel.fresh.assign(fresh.begin(), fresh.end());
    if (!fresh.empty() && fresh.size() != channel.values.size())
      throw Error({.place = "pickle of a Recording", .problem = "its channels are damaged"});
    channel.step_before_resampling = part[3].cast<double>();
    const bool is_condition =
        std::find(conditions.begin(), conditions.end(), channel.name) != conditions.end();
    if (is_condition && !channel.values.empty() && recording.size() > 0) {
      recording.add_condition(channel.name, channel.values.front());
    } else {
      recording.add(std::move(channel));
    }
  }
  for (const py::handle& each : state[6]) {
    const auto part = each.cast<std::pair<std::string, std::string>>();
    recording.definitions.push_back({part.first, part.second});
  }
  for (const py::handle& each : state[7]) {
    const auto part = each.cast<std::tuple<std::string, double, bool>>();
    recording.zeros.push_back({std::get<0>(part), std::get<1>(part), std::get<2>(part)});
  }
  recording.mapping = state[8].cast<std::string>();
  recording.source = {state[9].cast<std::string>(), state[10].cast<std::string>()};
  recording.labels = state[11].cast<std::vector<std::pair<std::string, std::string>>>();
  for (const py::handle& each : state[12]) {
    const auto part = each.cast<std::tuple<std::string, double, double>>();
    recording.uncertainties[std::get<0>(part)] = {std::get<1>(part), std::get<2>(part)};
  }
  return recording;
}

std::string short_text(const Recording& recording) {
  std::string channels;
  for (const Channel& channel : recording.channels())
    channels += (channels.empty() ? "" : ", ") + channel.name;
  return "<Recording '" + recording.name() + "': " + std::to_string(recording.size()) +
         " samples at " + std::string(py::str(py::float_(recording.sample_rate_Hz()))) + " Hz; " +
         channels + ">";
}

void bind_recording(py::module_& module) {
  py::class_<Recording>(module, "Recording",
                        "Channels by name on one uniform clock, in SI units.\n\n"
                        "Names end in their unit (torque_Nm, gear_angle_rad). recording[name] is a "
                        "read-only view of shape (samples,), without a copy.")
      .def(py::init<std::string, double, double>(), py::arg("name"), py::arg("sample_rate_Hz"),
           py::arg("start_s") = 0.0, "An empty recording, for `add`.")
      .def_property_readonly("name", &Recording::name)
      .def_property_readonly("sample_rate_Hz", &Recording::sample_rate_Hz)
      .def_property_readonly("time_s", times, "Times of the samples in s, shape (samples,).")
      .def_property_readonly("channels",
                             [](const Recording& self) {
                               std::vector<std::string> names;
                               for (const Channel& each : self.channels())
                                 names.push_back(each.name);
                               return names;
                             })
      .def_property_readonly("conditions", &Recording::conditions,
                             "Channels that are constant over the record.")
      .def_property_readonly(
          "labels",
          [](const Recording& self) {
            return std::map<std::string, std::string>(self.labels.begin(), self.labels.end());
          },
          "Texts that the file states about the whole run, such as the motor in a log of BAM.")
      .def_property_readonly("file", [](const Recording& self) { return self.source.file; })
      .def_property_readonly(
          "notes", [](const Recording& self) { return self.notes; },
          "What reading the file assumed, in sentences.")
      .def_property_readonly(
          "not_read", [](const Recording& self) { return self.not_read; },
          "Arrays of the file that are not read, with the reason.")
      .def("__len__", &Recording::size)
      .def("__contains__",
           [](const Recording& self, const std::string& channel) { return self.has(channel); })
      .def("__getitem__", view_of, py::arg("channel"))
      .def("fresh", freshness, py::arg("channel"),
           "True where the sensor measured anew, False where its last value is held; shape "
           "(samples,).")
      .def("add", add_channel, py::arg("name"), py::arg("values"), py::arg("fresh") = py::none(),
           "Adds a channel in SI; values of shape (samples,).")
      .def("add_condition", add_condition, py::arg("name"), py::arg("value"),
           "Adds a condition of the whole record, in SI.")
      .def(
          "write_csv",
          [](const Recording& self, const py::object& path) {
            const std::string file = path_text(path);
            interruptible([&](const Progress& progress) {
              write_csv(self, file, progress);
              return 0;
            });
          },
          py::arg("path"), "Writes t_s and every channel.")
      .def("__repr__", short_text)
      .def(py::pickle([](const py::object& self) { return pickled(self); },
                      [](const py::tuple& state) { return recording_unpickled(state); }));
}

/// Gravity, inertia and zero of a load in a recording, and what one standard error of each fact changes in them.
py::dict load_in(const LoadSheet& sheet, const Recording& recording) {
  const KnownLoad known = known_load(sheet, recording);
  const auto numbers = [](const JointLoad& load) {
    return py::dict(py::arg("gravity_Nm") = load.gravity_Nm,
                    py::arg("inertia_kg_m2") = load.inertia_kg_m2,
                    py::arg("zero_rad") = load.zero_rad);
  };
  py::dict found = numbers(known.load);
  py::dict errors;
  for (const LoadError& error : known.errors) errors[py::str(error.fact)] = numbers(error.change);
  found["errors"] = errors;
  return found;
}

void bind_load(py::module_& module) {
  py::class_<LoadSheet>(module, "Load",
                        "The known load of a joint: a pendulum, or a joint of a URDF with its "
                        "payload (docs/use/known_load.md). Made by `read_load`.")
      .def_property_readonly("file", [](const LoadSheet& self) { return self.file; })
      .def("of", load_in, py::arg("recording"),
           "gravity_Nm, inertia_kg_m2 and zero_rad in a recording, and in `errors` what one "
           "standard error of each fact changes in them.")
      .def("__repr__", [](const LoadSheet& self) { return "<Load of '" + self.file + "'>"; });
  module.def(
      "read_load", [](const py::object& path) { return read_load_sheet(path_text(path)); },
      py::arg("path"), "Reads a load file (.yaml).");
}

void append_recordings(const py::handle& item, const LoadOptions& options,
                       std::vector<Recording>& recordings) {
  if (py::isinstance<Recording>(item)) {
    recordings.push_back(item.cast<const Recording&>());
  } else if (is_path(item)) {
    const std::string file = path_text(item);
    for (Recording& recording : interruptible([&](const Progress& progress) {
           LoadOptions with_progress = options;
           with_progress.progress = progress;
           return load_recordings(file, with_progress);
         }))
      recordings.push_back(std::move(recording));
  } else if (py::isinstance<py::sequence>(item)) {
    for (const py::handle& each : py::reinterpret_borrow<py::sequence>(item))
      append_recordings(each, options, recordings);
  } else {
    throw UsageError({.place = "recordings",
                      .expected = "Recordings, paths of logs or manifests, or lists of them",
                      .found = kind_of(item)});
  }
}

}  // namespace

std::vector<Recording> recordings_from(const py::object& items, const LoadOptions& options) {
  std::vector<Recording> recordings;
  append_recordings(items, options, recordings);
  return recordings;
}

void bind_recordings(py::module_& module) {
  bind_recording(module);
  bind_load(module);
  module.def("recordings_from_columns", recordings_from_columns, py::arg("columns"),
             py::arg("rate_Hz"), py::arg("mapping"), py::arg("name"));
  module.def(
      "read", read, py::arg("path"), py::kw_only(), py::arg("mapping") = py::none(),
      py::arg("rate_Hz") = py::none(), py::arg("target") = "",
      "Reads a CSV file, plain or gzipped, or every file of a manifest (.yaml).\n\n"
      "mapping: a YAML file that names the columns of a foreign log (docs/use/recordings.md).\n"
      "rate_Hz: all recordings are brought to it.");
  module.def(
      "simulate",
      [](const std::string& actuator, const std::string& experiment, std::uint64_t seed,
         std::optional<double> duration_s, std::optional<double> lever_m,
         std::optional<double> mass_kg, double inclination_rad,
         std::optional<double> torque_amplitude_Nm, std::optional<double> angle_amplitude_rad,
         std::optional<double> frequency_Hz, std::optional<double> lowest_frequency_Hz,
         std::optional<double> highest_frequency_Hz, bool is_electrical, bool with_truth) {
        const ExperimentSpec spec{.actuator = actuator,
                                  .experiment = experiment,
                                  .seed = seed,
                                  .duration_s = duration_s,
                                  .lever_m = lever_m,
                                  .mass_kg = mass_kg,
                                  .inclination_rad = inclination_rad,
                                  .torque_amplitude_Nm = torque_amplitude_Nm,
                                  .angle_amplitude_rad = angle_amplitude_rad,
                                  .frequency_Hz = frequency_Hz,
                                  .lowest_frequency_Hz = lowest_frequency_Hz,
                                  .highest_frequency_Hz = highest_frequency_Hz,
                                  .is_electrical = is_electrical,
                                  .with_truth = with_truth};
        return interruptible([&](const Progress& progress) { return simulate(spec, progress); });
      },
      py::arg("actuator"), py::arg("experiment") = "sweep", py::kw_only(), py::arg("seed") = 1,
      py::arg("duration_s") = py::none(), py::arg("lever_m") = py::none(),
      py::arg("mass_kg") = py::none(), py::arg("inclination_rad") = 0.0,
      py::arg("torque_amplitude_Nm") = py::none(), py::arg("angle_amplitude_rad") = py::none(),
      py::arg("frequency_Hz") = py::none(), py::arg("lowest_frequency_Hz") = py::none(),
      py::arg("highest_frequency_Hz") = py::none(), py::arg("is_electrical") = false,
      py::arg("with_truth") = false,
      "One experiment on a simulated bench (docs/simulation/actuators.md). Equal arguments give "
      "equal "
      "recordings.");
  module.def(
      "sweep_dataset",
      [](const std::string& actuator, std::uint64_t seed) {
        return interruptible(
            [&](const Progress& progress) { return sweep_dataset(actuator, seed, progress); });
      },
      py::arg("actuator") = "dfki-50", py::kw_only(), py::arg("seed") = 1,
      "Three simulated sweeps for training and one with another lever for the test: the data of "
      "`torsio demo`.");
  py::class_<Dataset>(
      module, "Dataset",
      "Recordings with their roles: train, validation, test.\n\n"
      "Each argument is a Recording, the path of a log or of a manifest, or a list of these.")
      .def(py::init([](py::object train, py::object test, py::object validation,
                       const std::string& target, const py::object& mapping,
                       std::optional<double> rate_Hz, std::optional<std::size_t> initialise_samples,
                       const py::object& load, const py::object& fitted_by) {
             return dataset_of({std::move(train), std::move(validation), std::move(test)}, target,
                               mapping, rate_Hz, initialise_samples,
                               target_source(load, fitted_by));
           }),
           py::arg("train") = py::none(), py::arg("test") = py::none(),
           py::arg("validation") = py::none(), py::kw_only(), py::arg("target") = "",
           py::arg("mapping") = py::none(), py::arg("rate_Hz") = py::none(),
           py::arg("initialise_samples") = py::none(), py::arg("load") = py::none(),
           py::arg("fitted_by") = py::none(),
           "load: the target is the torque of this known load, a `Load` or the path of a load file "
           "(docs/use/known_load.md).\n"
           "fitted_by: a model, whose facts of the load are taken where the file fits them.")
      .def_property_readonly(
          "load_notes",
          [](const Dataset& self) {
            return self.load_target.is_used() ? load_target_notes(self.load_target)
                                              : std::vector<std::string>{};
          },
          "How the torque of a known load was computed, and its errors, in sentences.")
      .def_property_readonly("target", [](const Dataset& self) { return self.target; })
      .def_property_readonly("sample_rate_Hz", &Dataset::sample_rate_Hz)
      .def_property_readonly("roles", roles_of, "(name, role) of each recording.")
      .def_property_readonly("recordings",
                             [](const Dataset& self) {
                               std::vector<Recording> all;
                               for (const DatasetRecord& each : self.records)
                                 all.push_back(each.recording);
                               return all;
                             })
      .def("__len__", [](const Dataset& self) { return self.records.size(); })
      .def("__repr__", [](const Dataset& self) {
        std::string text = "<Dataset of " + self.target + ":";
        for (const auto& [name, role] : roles_of(self)) text += " " + name + " (" + role + ")";
        return text + ">";
      });
}

}  // namespace torsio::python
