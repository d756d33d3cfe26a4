#include "torsio/link/joint_connection.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <charconv>
#include <cmath>

#include "core/checks.hpp"
#include "core/did_you_mean.hpp"
#include "link/joint_exchange.hpp"

namespace torsio {
namespace {

constexpr float kLifetime_s = 5.0F;
constexpr std::size_t kPart_B = 200;
/// A joint may read an uploaded model for a long time before it uses it.
constexpr double kLongestCommit_s = 30.0;

JointConnection::Value owned(const LinkValue& value) {
  switch (value.type) {
    case LinkValueType::boolean: return value.boolean;
    case LinkValueType::int32: return value.int32;
    case LinkValueType::uint32: return value.uint32;
    case LinkValueType::float64: return value.float64;
    case LinkValueType::text: return std::string(value.text);
  }
  return {};
}

template <class Whole>
std::optional<JointConnection::Value> whole_number(double number) {
  const bool fits = number == std::floor(number) &&
                    number >= static_cast<double>(std::numeric_limits<Whole>::min()) &&
                    number <= static_cast<double>(std::numeric_limits<Whole>::max());
  if (!fits) return std::nullopt;
  return JointConnection::Value(static_cast<Whole>(number));
}

std::optional<JointConnection::Value> number_as(LinkValueType type, double number) {
  switch (type) {
    case LinkValueType::int32: return whole_number<std::int32_t>(number);
    case LinkValueType::uint32: return whole_number<std::uint32_t>(number);
    case LinkValueType::float64: return JointConnection::Value(number);
    default: return std::nullopt;
  }
}

std::optional<double> as_number(const JointConnection::Value& value) {
  return std::visit(
      [](const auto& held) -> std::optional<double> {
        using Held = std::remove_cvref_t<decltype(held)>;
        if constexpr (std::is_same_v<Held, bool> || std::is_same_v<Held, std::string>)
          return std::nullopt;
        else
          return static_cast<double>(held);
      },
      value);
}

[[noreturn]] void refuse_value(const JointConnection::Register& described,
                               const std::string& text) {
  refuse(described.name, fmt::format("a value of type {}", name(described.type)), "'" + text + "'");
}

/// The value in the type of the register. A text in it refers to `value`.
LinkValue link_value(const JointConnection::Register& described,
                     const JointConnection::Value& value) {
  const auto as_link = [](const JointConnection::Value& each) {
    return std::visit([](const auto& held) { return LinkValue::of(held); }, each);
  };
  const LinkValue same = as_link(value);
  if (same.type == described.type) return same;
  const std::optional<double> number = as_number(value);
  const auto converted = number ? number_as(described.type, *number) : std::nullopt;
  if (!converted) refuse_value(described, text_of(value));
  return as_link(*converted);
}

}  // namespace

JointConnection::JointConnection(const JointLine& line, const Settings& settings)
    : JointConnection(open_joint_line(line), torsio::name(line), settings) {}

JointConnection::JointConnection(std::shared_ptr<LinkTransport> line, const std::string& place,
                                 const Settings& settings)
    : exchange_(std::make_unique<Exchange>(std::move(line), place, settings)) {}

JointConnection::~JointConnection() = default;
JointConnection::JointConnection(JointConnection&&) noexcept = default;
JointConnection& JointConnection::operator=(JointConnection&&) noexcept = default;

JointConnection::Information JointConnection::information() {
  Information found;
  exchange_->ask(LinkInformationRequest{}, "information", [&](const LinkInformation& reply) {
    found = {.state = reply.state,
             .registers = reply.registers,
             .channels = reply.channels,
             .watchdog_s = 1e-3 * reply.watchdog_ms,
             .name = std::string(reply.name),
             .version = std::string(reply.version),
             .serial = std::string(reply.serial),
             .actuator = std::string(reply.actuator)};
    return true;
  });
  return found;
}

const std::vector<JointConnection::Register>& JointConnection::registers() {
  if (!registers_.empty()) return registers_;
  std::vector<Register> found(information().registers);
  for (std::size_t n = 0; n < found.size(); ++n) {
    const auto index = static_cast<std::uint16_t>(n);
    exchange_->ask(LinkRegisterDescribe{.index = index},
                   fmt::format("description of register {}", index),
                   [&](const LinkRegisterDescription& reply) {
                     if (reply.index != index) return false;
                     found[index] = {.index = index,
                                     .type = reply.type,
                                     .access = reply.access,
                                     .is_persistent = reply.is_persistent != 0,
                                     .lowest = reply.lowest,
                                     .highest = reply.highest,
                                     .name = std::string(reply.name),
                                     .unit = std::string(reply.unit),
                                     .description = std::string(reply.description)};
                     return true;
                   });
  }
  registers_ = std::move(found);
  return registers_;
}

const JointConnection::Register& JointConnection::find(std::string_view name) {
  std::vector<std::string> names;
  for (const Register& each : registers()) {
    if (each.name == name) return each;
    names.push_back(each.name);
  }
  std::string advice = did_you_mean(name, names);
  if (advice.empty()) advice = "`torsio connect describe` lists them.";
  refuse(place(), "the name of a register", fmt::format("'{}'", name), advice);
}

const std::vector<std::string>& JointConnection::channels() {
  if (!channels_.empty()) return channels_;
  std::vector<std::string> found(information().channels);
  for (std::size_t index = 0; index < found.size(); ++index)
    exchange_->ask(LinkChannelDescribe{.index = static_cast<std::uint8_t>(index)},
                   fmt::format("description of channel {}", index),
                   [&](const LinkChannelDescription& reply) {
                     if (reply.index != index) return false;
                     found[index] = std::string(reply.name);
                     return true;
                   });
  channels_ = std::move(found);
  return channels_;
}

std::uint8_t JointConnection::channel_index(std::string_view channel) {
  const std::vector<std::string>& names = channels();
  for (std::size_t index = 0; index < names.size(); ++index)
    if (names[index] == channel) return static_cast<std::uint8_t>(index);
  refuse(place(), fmt::format("one of the channels {}", fmt::join(names, ", ")),
         fmt::format("'{}'", channel), did_you_mean(channel, names));
}

JointConnection::Value JointConnection::read(std::string_view name) {
  const Register& described = find(name);
  Value value;
  exchange_->ask(LinkRegisterRead{.index = described.index}, fmt::format("read of {}", name),
                 [&](const LinkRegisterValue& reply) {
                   if (reply.index != described.index) return false;
                   value = owned(reply.value);
                   return true;
                 });
  return value;
}

void JointConnection::write(std::string_view name, const Value& value) {
  const Register& described = find(name);
  exchange_->command(
      LinkRegisterWrite{.index = described.index, .value = link_value(described, value)},
      fmt::format("write of {} = {}", name, text_of(value)));
}

/// A try whose reply was lost may have been executed: then the state is already the wanted one.
void JointConnection::change(LinkStateCommand command, LinkDriveState wanted) {
  exchange_->forget_change();
  try {
    exchange_->command(LinkStateChange{.command = command}, torsio::name(command));
  } catch (const Error&) {
    if (!exchange_->was_refused_when_repeated() || information().state != wanted) throw;
  }
}

void JointConnection::enable() { change(LinkStateCommand::enable, LinkDriveState::enabled); }
void JointConnection::disable() { change(LinkStateCommand::disable, LinkDriveState::ready); }
void JointConnection::reset_fault() {
  change(LinkStateCommand::reset_fault, LinkDriveState::ready);
}

void JointConnection::stop(StopCategory category) {
  exchange_->ask(LinkStop{.category = static_cast<std::uint8_t>(category)}, "stop",
                 [](const LinkState&) { return true; });
}

void JointConnection::set_mode(JointMode mode) {
  exchange_->command(LinkModeChange{.mode = mode}, fmt::format("mode {}", torsio::name(mode)));
}

void JointConnection::zero(std::string_view channel, double value) {
  exchange_->command(LinkZero{.channel = channel_index(channel), .value = value},
                     fmt::format("{} becomes {}", channel, value));
}

void JointConnection::inject_fault(const std::string& fault, std::string_view channel,
                                   double magnitude, double duration_s) {
  exchange_->command(
      LinkInjectFault{.fault = fault,
                      .channel = channel.empty() ? std::uint8_t{0} : channel_index(channel),
                      .magnitude = magnitude,
                      .duration_s = static_cast<float>(duration_s)},
      fault.empty() ? "end of all injected faults" : "fault " + fault);
}

void JointConnection::upload(std::span<const std::uint8_t> file, const std::string& actuator,
                             const std::function<void(double)>& progress) {
  const auto crc = static_cast<std::uint32_t>(crc32_z(0, file.data(), file.size()));
  LinkUpload last;
  const auto has_reached = [&](std::size_t received) {
    return [&last, received](const LinkUpload& reply) {
      last = reply;
      return reply.refusal != LinkRefusal::none || reply.received == received;
    };
  };
  const auto check = [&](std::string_view what) {
    if (last.refusal != LinkRefusal::none) exchange_->throw_refusal(what, {.reason = last.refusal});
  };
  exchange_->ask(
      LinkUploadBegin{
          .size = static_cast<std::uint32_t>(file.size()), .crc = crc, .actuator = actuator},
      "begin of an upload", has_reached(0));
  check("begin of an upload");
  for (std::size_t at = 0; at < file.size();) {
    const auto part = file.subspan(at, std::min(kPart_B, file.size() - at));
    exchange_->ask(LinkUploadChunk{.offset = static_cast<std::uint32_t>(at), .data = part},
                   "part of an upload", has_reached(at + part.size()));
    // A part that is refused because its reply was lost, and the joint has it already.
    if (last.received != at + part.size()) check("part of an upload");
    at += part.size();
    if (progress) progress(static_cast<double>(at) / static_cast<double>(file.size()));
  }
  const auto is_over = [&last] {
    return last.state == LinkUploadState::committed || last.state == LinkUploadState::rejected ||
           (last.refusal != LinkRefusal::none && last.refusal != LinkRefusal::not_in_this_state);
  };
  exchange_->ask(LinkUploadCommit{.crc = crc}, "commit of an upload", [&](const LinkUpload& reply) {
    last = reply;
    return true;
  });
  // While the joint checks the file it refuses another commit, and afterwards replies with the result.
  for (int second = 0; !is_over() && second < kLongestCommit_s; ++second) {
    exchange_->wait_until(1'000'000'000, is_over, [&](const auto& reply) {
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(reply)>, LinkUpload>) last = reply;
    });
    if (!is_over()) exchange_->transmit(LinkUploadCommit{.crc = crc});
  }
  if (last.state == LinkUploadState::committed) return;
  if (last.refusal == LinkRefusal::none) last.refusal = LinkRefusal::upload_rejected;
  check("commit of an upload");
}

void JointConnection::send(LinkReference reference, double valid_s) {
  exchange_->send(reference, valid_s);
}
void JointConnection::heartbeat() { exchange_->heartbeat(); }

JointConnection::Subscription JointConnection::subscribe(const std::vector<std::string>& names,
                                                         double rate_Hz) {
  LinkSubscribe wanted{.rate_Hz = static_cast<float>(rate_Hz), .lifetime_s = kLifetime_s};
  for (const std::string& each : names.empty() ? channels() : names)
    wanted.mask |= std::uint32_t{1} << channel_index(each);
  LinkSubscription reply;
  exchange_->renew(wanted);
  exchange_->ask(wanted, fmt::format("telemetry at {:g} Hz", rate_Hz),
                 [&](const LinkSubscription& received) {
                   reply = received;
                   return received.mask == wanted.mask;
                 });
  if (reply.refusal == LinkRefusal::line_too_slow)
    throw Error({.place = place(),
                 .problem = fmt::format("the joint refuses: telemetry at {:g} Hz", rate_Hz),
                 .expected = fmt::format("at most {:.0f} bytes per second", reply.available_B_s),
                 .found = fmt::format("{:.0f}", reply.asked_B_s),
                 .advice = "Ask for fewer channels or a lower rate."});
  if (reply.refusal != LinkRefusal::none)
    exchange_->throw_refusal(fmt::format("telemetry at {:g} Hz", rate_Hz),
                             {.reason = reply.refusal});
  Subscription made{.rate_Hz = double{reply.rate_Hz}};
  for (std::size_t index = 0; index < channels().size(); ++index)
    if ((wanted.mask >> index & 1U) != 0) made.channels.push_back(channels()[index]);
  return made;
}

std::size_t JointConnection::poll(const VisitTelemetry& visit, double wait_s) {
  return exchange_->poll(visit, wait_s);
}

const JointConnection::Counts& JointConnection::counts() const noexcept {
  return exchange_->counts();
}
std::optional<LinkState> JointConnection::last_change() const noexcept {
  return exchange_->last_change();
}
const std::string& JointConnection::place() const noexcept { return exchange_->place(); }

JointConnection::Value value_of(const JointConnection::Register& described,
                                const std::string& text) {
  if (described.type == LinkValueType::text) return text;
  if (described.type == LinkValueType::boolean) {
    if (text == "true" || text == "1") return true;
    if (text == "false" || text == "0") return false;
    refuse_value(described, text);
  }
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool is_number = error == std::errc() && end == text.data() + text.size();
  const auto value = is_number ? number_as(described.type, number) : std::nullopt;
  if (!value) refuse_value(described, text);
  return *value;
}

std::string text_of(const JointConnection::Value& value) {
  return std::visit([](const auto& held) { return fmt::format("{}", held); }, value);
}

}  // namespace torsio
