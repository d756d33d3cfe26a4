#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bindings.hpp"
#include "files/whole_file.hpp"
#include "torsio/link/joint_connection.hpp"

namespace torsio::python {
namespace {

constexpr std::size_t kLargestUpload_B = 64 << 20;
constexpr double kLongestSlice_s = 0.1;

JointLine line_of(const std::string& host, std::uint16_t port, std::uint16_t host_port,
                  const py::object& unix_path, const py::object& serial, double baud) {
  return {.host = host,
          .port = port,
          .host_port = host_port,
          .unix_path = unix_path.is_none() ? std::string() : path_text(unix_path),
          .serial = serial.is_none() ? std::string() : path_text(serial),
          .baud = baud};
}

JointMode mode_of(const std::string& text) {
  for (const JointMode mode : {JointMode::current, JointMode::velocity, JointMode::position,
                               JointMode::torque, JointMode::impedance, JointMode::deflection})
    if (name(mode) == text) return mode;
  throw UsageError({.place = "mode",
                    .expected = "current, velocity, position, torque, impedance or deflection",
                    .found = "'" + text + "'"});
}

/// Rows of telemetry.
struct TelemetryRows {
  std::vector<double> time_s = {};
  std::vector<float> values = {};
};

/// A `JointConnection` that threads of Python may share: one call at a time.
class RemoteJoint {
 public:
  RemoteJoint(const JointLine& line, const JointConnection::Settings& settings)
      : joint_(std::make_unique<JointConnection>(line, settings)) {}

  /// Without the interpreter's lock. @throws UsageError after `close`
  template <class Work>
  auto with(const Work& work) {
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    if (!joint_) throw UsageError({.place = "RemoteJoint", .problem = "the connection was closed"});
    return work(*joint_);
  }
  void close() {
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    joint_.reset();
  }
  void subscribe(const std::vector<std::string>& channels, double rate_Hz) {
    subscription_ =
        with([&](JointConnection& joint) { return joint.subscribe(channels, rate_Hz); });
  }
  [[nodiscard]] const JointConnection::Subscription& subscription() const { return subscription_; }

  /// Telemetry until `wait_s` has passed; raises what a handler of a signal raises.
  TelemetryRows poll(double wait_s) {
    using Clock = std::chrono::steady_clock;
    const auto end = Clock::now() + std::chrono::duration<double>(wait_s);
    TelemetryRows rows;
    for (;;) {
      const double left_s = std::chrono::duration<double>(end - Clock::now()).count();
      with([&](JointConnection& joint) {
        joint.poll(
            [&](const LinkTelemetry& telemetry) {
              const auto& values = telemetry.values;
              if (values.count != subscription_.channels.size()) return;
              rows.time_s.push_back(1e-9 * static_cast<double>(telemetry.time_ns));
              rows.values.insert(rows.values.end(), values.values.begin(),
                                 values.values.begin() + values.count);
            },
            std::clamp(left_s, 0.0, kLongestSlice_s));
      });
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (left_s <= kLongestSlice_s) return rows;
    }
  }

 private:
  std::mutex mutex_;
  std::unique_ptr<JointConnection> joint_;
  JointConnection::Subscription subscription_ = {};
};

template <class Values>
py::array_t<typename Values::value_type> array_of(const Values& values,
                                                  const std::vector<py::ssize_t>& shape) {
  py::array_t<typename Values::value_type> made(shape);
  std::ranges::copy(values, made.mutable_data());
  return made;
}

py::tuple poll(RemoteJoint& joint, double wait_s) {
  const TelemetryRows rows = joint.poll(wait_s);
  const auto count = static_cast<py::ssize_t>(rows.time_s.size());
  const auto width = static_cast<py::ssize_t>(joint.subscription().channels.size());
  return py::make_tuple(array_of(rows.time_s, {count}), array_of(rows.values, {count, width}));
}

/// The rows on a uniform clock; what was lost is NaN.
Recording record(RemoteJoint& joint, double duration_s, const std::vector<std::string>& channels,
                 double rate_Hz) {
  joint.subscribe(channels, rate_Hz);
  const TelemetryRows rows = joint.poll(duration_s);
  const JointConnection::Subscription& subscription = joint.subscription();
  if (rows.time_s.empty())
    throw Error({.place = "RemoteJoint.record", .problem = "no telemetry has arrived"});
  const auto tick = [&](double time_s) {
    return static_cast<std::size_t>(
        std::lround(std::max(0.0, time_s - rows.time_s.front()) * subscription.rate_Hz));
  };
  const std::size_t width = subscription.channels.size();
  const std::size_t size = tick(*std::ranges::max_element(rows.time_s)) + 1;
  Recording made("telemetry", subscription.rate_Hz);
  for (std::size_t k = 0; k < width; ++k) {
    Channel channel{.name = subscription.channels[k],
                    .values = std::vector<double>(size, kNotMeasured)};
    for (std::size_t row = 0; row < rows.time_s.size(); ++row)
      channel.values[tick(rows.time_s[row])] = double{rows.values[row * width + k]};
    made.add(std::move(channel));
  }
  return made;
}

py::dict information(RemoteJoint& joint) {
  const auto found = joint.with([](JointConnection& of) { return of.information(); });
  py::dict made;
  made["name"] = found.name;
  made["actuator"] = found.actuator;
  made["serial"] = found.serial;
  made["version"] = found.version;
  made["state"] = std::string(name(found.state));
  made["watchdog_s"] = found.watchdog_s;
  return made;
}

py::list registers(RemoteJoint& joint) {
  py::list made;
  for (const auto& each : joint.with([](JointConnection& of) { return of.registers(); })) {
    py::dict one;
    one["name"] = each.name;
    one["unit"] = each.unit;
    one["type"] = std::string(name(each.type));
    one["access"] = std::string(name(each.access));
    one["lowest"] = each.lowest;
    one["highest"] = each.highest;
    one["is_persistent"] = each.is_persistent;
    one["description"] = each.description;
    made.append(one);
  }
  return made;
}

py::dict counts(RemoteJoint& joint) {
  const auto found = joint.with([](JointConnection& of) { return of.counts(); });
  py::dict refused;
  for (std::size_t k = 0; k < found.refused.size(); ++k)
    if (found.refused[k] > 0)
      refused[py::str(std::string(name(static_cast<LinkRefusal>(k))))] = found.refused[k];
  py::dict made;
  made["references"] = found.references;
  made["refused"] = refused;
  made["telemetry"] = found.telemetry;
  made["lost"] = found.lost;
  return made;
}

void send(RemoteJoint& joint, const std::string& mode, float position_rad, float velocity_rad_s,
          float torque_Nm, float current_A, float stiffness_Nm_rad, float damping_Nms_rad,
          float deflection_rad, double valid_s) {
  const LinkReference reference{.mode = mode_of(mode),
                                .position_rad = position_rad,
                                .velocity_rad_s = velocity_rad_s,
                                .torque_Nm = torque_Nm,
                                .current_A = current_A,
                                .stiffness_Nm_rad = stiffness_Nm_rad,
                                .damping_Nms_rad = damping_Nms_rad,
                                .deflection_rad = deflection_rad};
  joint.with([&](JointConnection& of) { of.send(reference, valid_s); });
}

void stop(RemoteJoint& joint, int category) {
  if (category < 0 || category > 2)
    throw UsageError(
        {.place = "category", .expected = "0, 1 or 2", .found = std::to_string(category)});
  joint.with([&](JointConnection& of) { of.stop(static_cast<StopCategory>(category)); });
}

void upload(RemoteJoint& joint, const py::object& file, const std::string& actuator) {
  const std::vector<std::byte> bytes = read_whole_file(path_text(file), kLargestUpload_B);
  joint.with([&](JointConnection& of) {
    of.upload({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
              actuator.empty() ? of.information().actuator : actuator);
  });
}

void bind_calls(py::class_<RemoteJoint>& bound) {
  const auto call = [](auto member) {
    return
        [member](RemoteJoint& joint) { joint.with([&](JointConnection& of) { (of.*member)(); }); };
  };
  bound.def("enable", call(&JointConnection::enable), "From now on it stops without a `send`.")
      .def("disable", call(&JointConnection::disable))
      .def("reset_fault", call(&JointConnection::reset_fault))
      .def("heartbeat", call(&JointConnection::heartbeat), "Keeps an enabled joint from stopping.")
      .def("stop", &stop, py::arg("category") = 1)
      .def(
          "set_mode",
          [](RemoteJoint& joint, const std::string& mode) {
            joint.with([&](JointConnection& of) { of.set_mode(mode_of(mode)); });
          },
          py::arg("mode"))
      .def(
          "zero",
          [](RemoteJoint& joint, const std::string& channel, double value) {
            joint.with([&](JointConnection& of) { of.zero(channel, value); });
          },
          py::arg("channel"), py::arg("value") = 0.0,
          "Makes the present value of a channel this value.")
      .def(
          "inject_fault",
          [](RemoteJoint& joint, const std::string& fault, const std::string& channel,
             double magnitude, double duration_s) {
            joint.with([&](JointConnection& of) {
              of.inject_fault(fault, channel, magnitude, duration_s);
            });
          },
          py::arg("fault") = "", py::arg("channel") = "", py::arg("magnitude") = 0.0,
          py::arg("duration_s") = 0.0, "Of a simulated joint; without a name all end.")
      .def("upload", &upload, py::arg("file"), py::arg("actuator") = "",
           "Sends a model file; an empty actuator is that of the joint.");
}

void bind_data(py::class_<RemoteJoint>& bound) {
  bound.def_property_readonly("information", &information)
      .def_property_readonly("registers", &registers)
      .def_property_readonly("channels",
                             [](RemoteJoint& joint) {
                               return joint.with([](JointConnection& of) { return of.channels(); });
                             })
      .def_property_readonly("counts", &counts,
                             "Sent references, those refused by reason, telemetry and its loss.")
      .def(
          "__getitem__",
          [](RemoteJoint& joint, const std::string& name) {
            return joint.with([&](JointConnection& of) { return of.read(name); });
          },
          py::arg("name"), "The value of a register.")
      .def(
          "__setitem__",
          [](RemoteJoint& joint, const std::string& name, const JointConnection::Value& value) {
            joint.with([&](JointConnection& of) { of.write(name, value); });
          },
          py::arg("name"), py::arg("value"))
      .def("send", &send, py::arg("mode"), py::kw_only(), py::arg("position_rad") = 0.0F,
           py::arg("velocity_rad_s") = 0.0F, py::arg("torque_Nm") = 0.0F,
           py::arg("current_A") = 0.0F, py::arg("stiffness_Nm_rad") = 0.0F,
           py::arg("damping_Nms_rad") = 0.0F, py::arg("deflection_rad") = 0.0F,
           py::arg("valid_s") = 0.02,
           "Sends a reference without waiting; the joint refuses it when it is older than valid_s.")
      .def(
          "subscribe",
          [](RemoteJoint& joint, const std::vector<std::string>& channels, double rate_Hz) {
            joint.subscribe(channels, rate_Hz);
            return py::make_tuple(joint.subscription().channels, joint.subscription().rate_Hz);
          },
          py::arg("channels") = std::vector<std::string>(), py::arg("rate_Hz") = 1000.0,
          "Telemetry of these channels, of all if there are none. Returns channels and rate.")
      .def("poll", &poll, py::arg("wait_s") = 0.0,
           "Telemetry that has arrived, and arrives within wait_s: the joint's clock [s], shape "
           "(n,), and the channels, shape (n, channels).")
      .def("record", &record, py::arg("duration_s"),
           py::arg("channels") = std::vector<std::string>(), py::arg("rate_Hz") = 1000.0,
           "Telemetry as a Recording; what was lost is NaN.");
}

}  // namespace

void bind_links(py::module_& module) {
  py::class_<RemoteJoint> bound(module, "RemoteJoint",
                                "A joint that is reached over its link (docs/robot/connect.md).\n\n"
                                "UDP to host and port, or a socket of the file system (unix), or a "
                                "serial line. Errors name the "
                                "joint, what was sent and why it was refused. At the end of a "
                                "`with`, or by close, control is "
                                "given up: an enabled joint then stops.");
  bound
      .def(py::init([](unsigned joint, const std::string& host, std::uint16_t port,
                       std::uint16_t host_port, const py::object& unix_path,
                       const py::object& serial, double baud, unsigned id, double timeout_s) {
             for (const unsigned each : {joint, id})
               if (each < 1 || each > 254)
                 throw UsageError({.place = "RemoteJoint",
                                   .expected = "ids of 1 to 254",
                                   .found = std::to_string(each)});
             return std::make_unique<RemoteJoint>(
                 line_of(host, port, host_port, unix_path, serial, baud),
                 JointConnection::Settings{.id = static_cast<std::uint8_t>(id),
                                           .joint = static_cast<std::uint8_t>(joint),
                                           .timeout_s = timeout_s});
           }),
           py::arg("joint") = 1, py::kw_only(), py::arg("host") = "127.0.0.1",
           py::arg("port") = kNdlcomJointPort, py::arg("host_port") = kNdlcomHostPort,
           py::arg("unix") = py::none(), py::arg("serial") = py::none(), py::arg("baud") = 921600.0,
           py::arg("id") = 254, py::arg("timeout_s") = 0.1)
      .def("close", &RemoteJoint::close)
      .def("__enter__", [](const py::object& self) { return self; })
      .def("__exit__", [](RemoteJoint& joint, const py::args&) { joint.close(); });
  bind_data(bound);
  bind_calls(bound);
  module.def(
      "find_joints",
      [](const std::string& host, std::uint16_t port, std::uint16_t host_port,
         const py::object& unix_path, const py::object& serial, double baud, double wait_s) {
        const JointLine line = line_of(host, port, host_port, unix_path, serial, baud);
        const py::gil_scoped_release unlocked;
        const auto open = open_joint_line(line);
        const std::vector<std::uint8_t> found = find_joints(*open, 254, wait_s);
        return std::vector<int>(found.begin(), found.end());
      },
      py::kw_only(), py::arg("host") = "127.0.0.1", py::arg("port") = kNdlcomJointPort,
      py::arg("host_port") = kNdlcomHostPort, py::arg("unix") = py::none(),
      py::arg("serial") = py::none(), py::arg("baud") = 921600.0, py::arg("wait_s") = 0.3,
      "The ids of the joints that reply to a ping.");
}

}  // namespace torsio::python
