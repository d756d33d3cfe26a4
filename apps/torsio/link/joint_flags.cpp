#include "link/joint_flags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <utility>

#include "arm/arm_verbs.hpp"
#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "core/quantity.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/bench/sheet_file.hpp"
#include "torsio/sim/joints/single_joint.hpp"

namespace {

constexpr std::string_view kModelKey = "model=";
constexpr unsigned kLastId = 254;

unsigned whole_number(std::string_view text, unsigned highest, const std::string& place,
                      const std::string& what) {
  unsigned number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < 1 || number > highest)
    throw torsio::UsageError({.place = place,
                              .expected = fmt::format("{} from 1 to {}", what, highest),
                              .found = fmt::format("'{}'", text)});
  return number;
}

/// ADDRESS or ADDRESS:PORT
torsio::UdpAddress peer_of(const std::string& text, std::uint16_t port) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return {.address = text, .port = port};
  return {.address = text.substr(0, colon),
          .port = static_cast<std::uint16_t>(whole_number(std::string_view(text).substr(colon + 1),
                                                          65535, "--allow " + text, "a port"))};
}

}  // namespace

void JointLineFlags::add(CLI::App& verb) {
  verb.add_option("--port", port, "UDP port of the joints")->capture_default_str();
  verb.add_option("--host-port", host_port, "UDP port of the host, to which they reply")
      ->capture_default_str();
  verb.add_option("--listen", listen,
                  "address of the interface on which they listen; another one than that of this "
                  "machine needs --allow")
      ->capture_default_str();
  verb.add_option(
      "--allow", allowed,
      "ADDRESS[:PORT] of a host; no other is listened to; may be repeated. NDLCom has no "
      "authentication: an address can be forged");
  verb.add_option("--unix", unix_path, "PATH of a socket in place of UDP; the host's is PATH.host");
  verb.add_option("--serial-line", serial, "serial line in place of UDP, as /dev/ttyUSB0");
  verb.add_option("--pty", pty, "PATH of a link to a new pseudo-terminal in place of UDP");
  verb.add_option("--baud", baud, "rate of the serial line or pseudo-terminal")
      ->capture_default_str();
  verb.add_option(
      "--can", can,
      "udp_multicast[:GROUP[:PORT]] or socketcan:INTERFACE: the joints are also nodes of "
      "this CAN bus, with the frames of ODrive's CANSimple; ids of 1 to 62");
}

std::unique_ptr<torsio::CanBus> JointLineFlags::open_can() const {
  if (can.empty()) return nullptr;
  const std::size_t colon = std::min(can.find(':'), can.size());
  const std::string interface = can.substr(0, colon);
  const std::string channel = colon < can.size() ? can.substr(colon + 1) : std::string();
  if (interface == "socketcan" && !channel.empty()) return torsio::open_socketcan(channel);
  if (interface != "udp_multicast")
    throw torsio::UsageError({.place = "--can " + can,
                              .expected = "udp_multicast, or socketcan with an interface",
                              .found = "'" + can + "'",
                              .advice = "As in --can udp_multicast:239.74.163.2:43113, or --can "
                                        "socketcan:can0."});
  torsio::CanMulticastSettings settings;
  const std::size_t second = channel.find(':');
  if (!channel.empty()) settings.group = channel.substr(0, second);
  if (second != std::string::npos)
    settings.port = static_cast<std::uint16_t>(whole_number(
        std::string_view(channel).substr(second + 1), 65535, "--can " + can, "a port"));
  for (const std::string& host : allowed) settings.allowed.push_back(peer_of(host, 1).address);
  if (!allowed.empty())
    remark(
        "warning: the frames go to the local network, and whoever can send from an allowed address "
        "can drive the joints: CAN has no authentication");
  return torsio::open_can_multicast(settings);
}

std::unique_ptr<torsio::LinkTransport> JointLineFlags::open(const CLI::App& verb) const {
  const auto is_given = [&](const char* flag) { return verb.get_option(flag)->count() > 0; };
  const bool is_udp =
      is_given("--port") || is_given("--host-port") || is_given("--listen") || is_given("--allow");
  const int lines = (is_udp ? 1 : 0) + (unix_path.empty() ? 0 : 1) + (serial.empty() ? 0 : 1) +
                    (pty.empty() ? 0 : 1);
  if (lines > 1)
    throw torsio::UsageError({.place = "torsio joint",
                              .expected = "one line: UDP, --unix, --serial-line or --pty",
                              .found = fmt::format("options of {}", lines)});
  if (is_given("--baud") && serial.empty() && pty.empty())
    throw torsio::UsageError({.place = "--baud",
                              .expected = "--serial-line or --pty, which have a rate",
                              .found = "neither"});
  if (!unix_path.empty())
    return torsio::open_unix({.path = unix_path, .peer = unix_path + ".host"});
  if (!serial.empty()) return torsio::open_serial({.device = serial, .baud = baud});
  if (!pty.empty()) return torsio::open_pseudo_terminal({.link = pty, .baud = baud});
  torsio::UdpSettings settings{.listen = {.address = listen, .port = port}, .peers = {}};
  for (const std::string& host : allowed) settings.peers.push_back(peer_of(host, host_port));
  const bool is_local = listen.starts_with("127.");
  if (settings.peers.empty() && !is_local)
    throw torsio::UsageError(
        {.place = "--listen " + listen,
         .expected = "--allow ADDRESS for each host",
         .found = "none",
         .advice = "NDLCom has no authentication: whoever can send to a joint can drive it."});
  if (settings.peers.empty()) settings.peers = {{.port = host_port}};
  if (!is_local)
    remark(
        "warning: whoever can send to this address can drive the joints: NDLCom has no "
        "authentication");
  return torsio::open_udp(settings);
}

void ServedJointFlags::add(CLI::App& verb) {
  verb.add_option("JOINT", joints,
                  "[ID=]ACTUATOR[#SPECIMEN][,model=FILE]: as dfki-50, or 7=dfki-50#03,model=m."
                  "safetensors; ids from 1 on if none are given (default: dfki-50)");
  verb.add_option("--arm", arm, "serve the joints of an arm, arm6 or ARM.yaml; ids from 1 on");
  verb.add_option("--link-mass", link_mass,
                  "mass at the end of each link, as 4kg (default: a weight of a quarter of the "
                  "rated torque)");
  verb.add_option("--link-length", link_length, "length of each link, as 300mm (default)");
  verb.add_flag("--vertical-axis", has_vertical_axis, "gravity does not act on the links");
  verb.add_option(
      "--fault", injected,
      "ID:WHAT=AMOUNT@TIME, a fault of a sensor or part: 1:gear_angle=freeze@3s; may be "
      "repeated");
  verb.add_option("--faults", faults, "FILE.yaml with a schedule of faults for every joint");
}

std::vector<torsio::ServedArm> ServedJointFlags::single_joints(
    const torsio::Progress& progress) const {
  torsio::SingleLink link{.has_vertical_axis = has_vertical_axis};
  if (!link_mass.empty())
    link.mass_kg = torsio::signed_quantity_with_unit(link_mass, "kg", "--link-mass");
  if (!link_length.empty())
    link.length_m = torsio::signed_quantity_with_unit(link_length, "m", "--link-length");
  std::vector<torsio::ServedArm> arms;
  unsigned next_id = 1;
  for (const std::string& text : joints.empty() ? std::vector<std::string>{"dfki-50"} : joints) {
    const std::size_t comma = text.find(',');
    std::string actuator = text.substr(0, comma);
    if (const std::size_t equals = actuator.find('='); equals != std::string::npos) {
      next_id = whole_number(actuator.substr(0, equals), kLastId, "joint '" + text + "'", "an id");
      actuator.erase(0, equals + 1);
    }
    torsio::ServedArm made{
        .setup = single_joint_setup(torsio::find_data_sheet(actuator, progress), link),
        .first_id = static_cast<std::uint8_t>(next_id++)};
    if (comma != std::string::npos) {
      const std::string more = text.substr(comma + 1);
      if (!more.starts_with(kModelKey))
        throw torsio::UsageError({.place = "joint '" + text + "'",
                                  .expected = "model=FILE after the comma",
                                  .found = "'" + more + "'"});
      made.setup.joints.front().model = more.substr(kModelKey.size());
    }
    arms.push_back(std::move(made));
  }
  return arms;
}

void ServedJointFlags::add_faults(std::vector<torsio::ServedArm>& arms,
                                  const torsio::Progress& progress) const {
  if (faults.empty() && injected.empty()) return;
  for (torsio::ServedArm& each : arms) {
    each.faults.resize(each.setup.joints.size());
    if (faults.empty()) continue;
    for (std::size_t j = 0; j < each.faults.size(); ++j)
      each.faults[j] = torsio::read_fault_schedule(faults, each.setup.joints[j].sheet, progress);
  }
  for (const std::string& text : injected) {
    const std::size_t colon = std::min(text.find(':'), text.size());
    const std::string place = "--fault " + text;
    const unsigned id = whole_number(text.substr(0, colon), kLastId, place, "the id of a joint");
    bool is_found = false;
    for (torsio::ServedArm& each : arms) {
      if (id < each.first_id || id >= each.first_id + each.faults.size()) continue;
      const std::size_t j = id - each.first_id;
      each.faults[j].faults.push_back(torsio::parse_injection(
          colon < text.size() ? text.substr(colon + 1) : "", each.setup.joints[j].sheet));
      is_found = true;
    }
    if (!is_found)
      throw torsio::UsageError(
          {.place = place, .expected = "the id of a joint", .found = fmt::format("{}", id)});
  }
}

std::vector<torsio::ServedArm> ServedJointFlags::arms(const torsio::Progress& progress) const {
  if (!arm.empty() && !joints.empty())
    throw torsio::UsageError({.place = "torsio joint",
                              .expected = "joints, or --arm",
                              .found = "both",
                              .advice = "Start one program for each, on two ports."});
  if (!arm.empty() && !(link_mass.empty() && link_length.empty() && !has_vertical_axis))
    throw torsio::UsageError({.place = "--arm",
                              .expected = "no option of a link",
                              .found = "one",
                              .advice = "The links are in the URDF file of the arm."});
  std::vector<torsio::ServedArm> all;
  if (arm.empty())
    all = single_joints(progress);
  else
    all.push_back({.setup = arm_of(arm, progress)});
  add_faults(all, progress);
  return all;
}
