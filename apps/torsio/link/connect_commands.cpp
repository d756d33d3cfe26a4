// Verbs of `torsio connect` that send one command.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "common/data_flags.hpp"
#include "common/interrupt.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "files/whole_file.hpp"
#include "link/connect_flags.hpp"
#include "link/until_at_rest.hpp"
#include "report/json_text.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/files/model_file.hpp"

namespace {

using torsio::JointConnection;

constexpr std::size_t kLargestModel_B = 64 << 20;
constexpr double kLongestRest_s = 3.0;
constexpr std::chrono::milliseconds kBetweenResets(50);

struct CommandFlags : ConnectFlags {
  unsigned category = 1;
  std::string file;
  std::string actuator;
  std::string channel;
  double value = 0.0;
  std::string duration = "0s";
};

/// The state after the command, as every verb here reports it.
void report(const CommandFlags& flags, JointConnection& connection) {
  const auto state = connection.information().state;
  if (flags.json.wants_tables())
    print(fmt::format("{}: {}, {}\n", connection.place(), name(state), meaning(state)));
  flags.json.write(torsio::json_text(nlohmann::ordered_json{{"state", name(state)}}));
}

/// @param work what is sent
template <class Work>
CLI::App* add_command(CLI::App& connect, const char* word, const char* help, const char* example,
                      const std::shared_ptr<CommandFlags>& flags, Work work) {
  CLI::App* verb = connect.add_subcommand(word, help);
  verb->footer(fmt::format("Example: torsio connect {}", example));
  verb->callback([flags, work] {
    JointConnection connection = flags->connection();
    work(*flags, connection);
    report(*flags, connection);
  });
  return verb;
}

void upload(const CommandFlags& flags, JointConnection& connection) {
  const std::vector<std::byte> bytes = torsio::read_whole_file(flags.file, kLargestModel_B);
  ProgressBar shown;
  const auto progress = shown.listener();
  connection.upload({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
                    flags.actuator.empty() ? connection.information().actuator : flags.actuator,
                    [&](double fraction) {
                      if (!progress(fraction, "upload")) throw torsio::Cancelled();
                    });
}

/// A joint that has found a fault comes to rest first, and refuses until then.
void reset_when_at_rest(JointConnection& connection) {
  const bool is_fault = connection.information().state == torsio::LinkDriveState::fault;
  until_at_rest(
      is_fault ? kLongestRest_s : 0.0, [&] { connection.reset_fault(); },
      [] { std::this_thread::sleep_for(kBetweenResets); });
}

void add_state_verbs(CLI::App& connect) {
  auto stop = std::make_shared<CommandFlags>();
  CLI::App* verb = add_command(connect, "stop", "stop a joint, also one that another host controls",
                               "stop --joint 3", stop,
                               [](const CommandFlags& flags, JointConnection& connection) {
                                 connection.stop(static_cast<torsio::StopCategory>(flags.category));
                               });
  verb->add_option("--category", stop->category,
                   "of IEC 60204-1: 0 no power, 1 to rest and then no power, 2 to rest with power")
      ->check(CLI::Range(0U, 2U))
      ->capture_default_str();
  stop->add(*verb);
  auto disable = std::make_shared<CommandFlags>();
  disable->add(
      *add_command(connect, "disable", "end a stop of a joint that is at rest, or remove its power",
                   "disable --joint 3", disable,
                   [](const CommandFlags&, JointConnection& connection) { connection.disable(); }));
  auto reset = std::make_shared<CommandFlags>();
  reset->add(*add_command(
      connect, "reset", "end a fault as soon as its cause has ended", "reset --joint 3", reset,
      [](const CommandFlags&, JointConnection& connection) { reset_when_at_rest(connection); }));
}

void add_data_verbs(CLI::App& connect) {
  auto model = std::make_shared<CommandFlags>();
  CLI::App* verb =
      add_command(connect, "upload", "send a model file to a joint, which uses it from then on",
                  "upload joint.safetensors --joint 3", model, upload);
  verb->add_option("MODEL", model->file, "model file written by torsio fit")->required();
  verb->add_option("--actuator", model->actuator,
                   "type of the actuator for which it was fitted (default: that of the joint)");
  model->add(*verb);
  auto zero = std::make_shared<CommandFlags>();
  verb = add_command(connect, "zero", "make the present value of a channel a given one",
                     "zero joint_angle_rad --joint 3", zero,
                     [](const CommandFlags& flags, JointConnection& connection) {
                       connection.zero(flags.channel, flags.value);
                     });
  verb->add_option("CHANNEL", zero->channel, "channel of the telemetry")->required();
  verb->add_option("--value", zero->value, "in the unit of the channel")->capture_default_str();
  zero->add(*verb);
  auto fault = std::make_shared<CommandFlags>();
  verb = add_command(
      connect, "fault", "inject a fault into a simulated joint; without a name all end",
      "fault freeze --channel joint_angle_rad --joint 3", fault,
      [](const CommandFlags& flags, JointConnection& connection) {
        connection.inject_fault(flags.file, flags.channel, flags.value,
                                torsio::signed_quantity_with_unit(flags.duration, "s", "--for"));
      });
  verb->add_option("NAME", fault->file, "name of the fault");
  verb->add_option("--channel", fault->channel, "channel of the telemetry");
  verb->add_option("--magnitude", fault->value, "in the unit of the fault")->capture_default_str();
  verb->add_option("--for", fault->duration, "its duration; 0: until it is ended")
      ->capture_default_str();
  fault->add(*verb);
}

}  // namespace

void add_connect_commands(CLI::App& connect) {
  add_state_verbs(connect);
  add_data_verbs(connect);
}
