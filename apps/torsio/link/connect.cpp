#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "core/quantity.hpp"
#include "link/connect_flags.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"
#include "verbs.hpp"

namespace {

using Json = nlohmann::ordered_json;
using torsio::JointConnection;

struct RegisterFlags : ConnectFlags {
  std::vector<std::string> names;
  std::string name;
  std::string value;
  std::string wait = "300ms";
};

Json json_of(const JointConnection::Value& value) {
  return std::visit([](const auto& held) { return Json(held); }, value);
}

Json json_of(const JointConnection::Information& joint, std::uint8_t id) {
  return {{"id", id},
          {"name", joint.name},
          {"actuator", joint.actuator},
          {"serial", joint.serial},
          {"version", joint.version},
          {"state", torsio::name(joint.state)},
          {"watchdog_s", joint.watchdog_s}};
}

/// With the digits that a table has space for.
std::string short_text(const JointConnection::Value& value) {
  const double* const number = std::get_if<double>(&value);
  return number == nullptr ? torsio::text_of(value) : fmt::format("{:.6g}", *number);
}

std::string range_text(const JointConnection::Register& each) {
  const bool is_number =
      each.type != torsio::LinkValueType::boolean && each.type != torsio::LinkValueType::text;
  if (!is_number || each.access == torsio::LinkAccess::read) return {};
  if (std::isinf(each.lowest) && std::isinf(each.highest)) return {};
  return fmt::format("{:g} to {:g}", each.lowest, each.highest);
}

void list(const RegisterFlags& flags) {
  const std::shared_ptr<torsio::LinkTransport> line = torsio::open_joint_line(flags.line);
  const double wait_s =
      above_zero(torsio::signed_quantity_with_unit(flags.wait, "s", "--wait"), "--wait");
  torsio::TextTable table;
  table.header({"id", "name", "actuator", "serial", "state", "version"});
  Json joints = Json::array();
  for (const std::uint8_t id :
       torsio::find_joints(*line, static_cast<std::uint8_t>(flags.id), wait_s)) {
    JointConnection::Settings settings = flags.settings();
    settings.joint = id;
    const auto joint = JointConnection(line, name(flags.line), settings).information();
    table.row({fmt::format("{}", id), joint.name, joint.actuator, joint.serial,
               std::string(name(joint.state)), joint.version});
    joints.push_back(json_of(joint, id));
  }
  if (joints.empty())
    throw torsio::Error({.place = name(flags.line),
                         .problem = "no joint replies to a ping",
                         .advice = "Is one running there? A joint sends its replies to the port of "
                                   "this program that it was given (--host-port)."});
  if (flags.json.wants_tables()) print(table.text());
  flags.json.write(torsio::json_text(Json{{"joints", joints}}));
}

void describe(const RegisterFlags& flags) {
  JointConnection connection = flags.connection();
  const auto joint = connection.information();
  torsio::TextTable table;
  table.header({"register", "value", "unit", "type", "written", "range", "description"});
  Json registers = Json::array();
  for (const JointConnection::Register& each : connection.registers()) {
    const auto value = connection.read(each.name);
    table.row({each.name, short_text(value), each.unit, std::string(name(each.type)),
               std::string(name(each.access)), range_text(each), each.description});
    registers.push_back({{"name", each.name},
                         {"value", json_of(value)},
                         {"unit", each.unit},
                         {"type", name(each.type)},
                         {"access", name(each.access)},
                         {"is_persistent", each.is_persistent},
                         {"lowest", each.lowest},
                         {"highest", each.highest},
                         {"description", each.description}});
  }
  if (flags.json.wants_tables())
    print(
        fmt::format("{}: {}, actuator {}, serial number {}, version {}\nstate {}: {}; watchdog "
                    "{:g} ms\n\n{}\ntelemetry: {}\n",
                    connection.place(), joint.name, joint.actuator, joint.serial, joint.version,
                    name(joint.state), meaning(joint.state), 1e3 * joint.watchdog_s, table.text(),
                    fmt::join(connection.channels(), ", ")));
  Json document = json_of(joint, static_cast<std::uint8_t>(flags.joint));
  document["registers"] = registers;
  document["channels"] = connection.channels();
  flags.json.write(torsio::json_text(document));
}

void get(const RegisterFlags& flags) {
  JointConnection connection = flags.connection();
  Json values = Json::object();
  std::string text;
  for (const std::string& name : flags.names) {
    const auto value = connection.read(name);
    text += fmt::format("{} = {} {}\n", name, torsio::text_of(value), connection.find(name).unit);
    values[name] = json_of(value);
  }
  if (flags.json.wants_tables()) print(text);
  flags.json.write(torsio::json_text(Json{{"values", values}}));
}

void set(const RegisterFlags& flags) {
  JointConnection connection = flags.connection();
  const JointConnection::Register& described = connection.find(flags.name);
  const auto before = connection.read(flags.name);
  connection.write(flags.name, value_of(described, flags.value));
  const auto after = connection.read(flags.name);
  if (flags.json.wants_tables())
    print(fmt::format("{} = {} {} (before: {})\n", flags.name, torsio::text_of(after),
                      described.unit, torsio::text_of(before)));
  flags.json.write(torsio::json_text(
      Json{{"name", flags.name}, {"before", json_of(before)}, {"value", json_of(after)}}));
}

void add_list(CLI::App& connect) {
  auto flags = std::make_shared<RegisterFlags>();
  CLI::App* verb = connect.add_subcommand("list", "show the joints that reply to a ping");
  verb->footer("Example: torsio connect list --host 192.168.2.10");
  flags->add_line(*verb);
  verb->add_option("--wait", flags->wait, "how long replies are waited for")->capture_default_str();
  verb->callback([flags] { list(*flags); });
}

void add_describe(CLI::App& connect) {
  auto flags = std::make_shared<RegisterFlags>();
  CLI::App* verb = connect.add_subcommand(
      "describe", "show what a joint is, all its registers with their values, and its channels");
  verb->footer("Example: torsio connect describe --joint 3");
  flags->add(*verb);
  verb->callback([flags] { describe(*flags); });
}

void add_get(CLI::App& connect) {
  auto flags = std::make_shared<RegisterFlags>();
  CLI::App* verb = connect.add_subcommand("get", "read registers");
  verb->footer("Example: torsio connect get largest_torque_Nm watchdog_s --joint 3");
  verb->add_option("NAME", flags->names, "registers of torsio connect describe")->required();
  flags->add(*verb);
  verb->callback([flags] { get(*flags); });
}

void add_set(CLI::App& connect) {
  auto flags = std::make_shared<RegisterFlags>();
  CLI::App* verb = connect.add_subcommand("set", "write a register, and read it again");
  verb->footer("Example: torsio connect set largest_torque_Nm 20 --joint 3");
  verb->add_option("NAME", flags->name, "register of torsio connect describe")->required();
  verb->add_option("VALUE", flags->value, "in the unit of the register; true or false; a text")
      ->required();
  flags->add(*verb);
  verb->callback([flags] { set(*flags); });
}

}  // namespace

void add_connect(CLI::App& app) {
  CLI::App* verb = app.add_subcommand(
      "connect", "reach a joint over its link: registers, telemetry, references");
  verb->footer(
      "Example: torsio connect list\n"
      "         torsio connect describe --joint 3\n"
      "         torsio connect record -o run.mcap --for 10s\n"
      "docs/robot/connect.md has more of them. The link does not authenticate a host.");
  verb->require_subcommand(1);
  add_list(*verb);
  add_describe(*verb);
  add_get(*verb);
  add_set(*verb);
  add_connect_watch(*verb);
  add_connect_record(*verb);
  add_connect_play(*verb);
  add_connect_commands(*verb);
#ifdef TORSIO_HAS_LIVE
  add_connect_page(*verb);
  add_connect_publish(*verb);
#endif
  add_connect_proxy(*verb);
}
