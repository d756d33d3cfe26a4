#include "link/joint_exchange.hpp"

#include <fmt/format.h>

#include "core/checks.hpp"

namespace torsio {
namespace {

/// More than a minute of 1 kHz: telemetry that no `poll` takes must not fill the memory.
constexpr std::size_t kStoredTelemetry = 1 << 16;
/// Telemetry that arrives late has been overtaken by fewer than this.
constexpr std::uint32_t kLongestDelay = 1000;
constexpr std::int64_t kRenewalPeriod_ns = 1'000'000'000;

std::string_view refusal_advice(LinkRefusal reason) noexcept {
  switch (reason) {
    case LinkRefusal::wrong_version:
    case LinkRefusal::wrong_length:
    case LinkRefusal::unknown_message:
      return "Host and joint have different releases of torsio: use the same on both.";
    case LinkRefusal::only_when_disabled: return "Disable the joint first.";
    case LinkRefusal::not_in_this_state:
      return "`torsio connect describe` shows the state: a stop ends by disable at rest, a fault "
             "by a reset at rest when its cause has ended.";
    case LinkRefusal::too_many_subscribers: return "End another program that watches this joint.";
    case LinkRefusal::line_too_slow: return "Ask for fewer channels or a lower rate.";
    case LinkRefusal::repeated:
      return "Another program has the same id of a host: give each its own (--id).";
    case LinkRefusal::too_old:
    case LinkRefusal::deadline: return "The line is slower than the watchdog of the joint permits.";
    case LinkRefusal::upload_rejected:
      return "The model must be one for the actuator of this joint, with inputs that it measures.";
    default: return {};
  }
}

}  // namespace

JointConnection::Exchange::Exchange(std::shared_ptr<LinkTransport> line, const std::string& place,
                                    const Settings& settings)
    : settings_(settings),
      line_(std::move(line)),
      place_(fmt::format("joint {} at {}", settings.joint, place)),
      timeout_ns_(static_cast<std::int64_t>(1e9 * settings.timeout_s)),
      ping_period_ns_(static_cast<std::int64_t>(1e9 * settings.ping_period_s)),
      host_({.id = settings.id, .joint = settings.joint, .rules = settings.rules}) {
  require(settings.timeout_s >= 1e-3 && settings.timeout_s <= 60.0, "joint connection: timeout_s",
          "0.001 to 60", settings.timeout_s);
  require(settings.ping_period_s >= 1e-3 && settings.ping_period_s <= 60.0,
          "joint connection: ping_period_s", "0.001 to 60", settings.ping_period_s);
  require(settings.tries >= 1, "joint connection: tries", "at least 1",
          fmt::format("{}", settings.tries));
}

bool JointConnection::Exchange::depends_on_the_line(LinkRefusal reason) noexcept {
  return reason == LinkRefusal::too_old || reason == LinkRefusal::from_future ||
         reason == LinkRefusal::repeated;
}

void JointConnection::Exchange::throw_refusal(std::string_view what,
                                              const LinkRefused& refused) const {
  ErrorReport report{.place = place_,
                     .problem = fmt::format("the joint refuses: {}", what),
                     .found = fmt::format("{}: {}", name(refused.reason), meaning(refused.reason)),
                     .advice = std::string(refusal_advice(refused.reason))};
  if (refused.reason == LinkRefusal::out_of_range && refused.lowest < refused.highest)
    report.expected = fmt::format("{} to {}", refused.lowest, refused.highest);
  throw Error(std::move(report));
}

void JointConnection::Exchange::throw_silence(std::string_view what, bool is_command) const {
  if (refusal_ != LinkRefusal::none) throw_refusal(what, {.reason = refusal_});
  ErrorReport report{
      .place = place_,
      .problem = fmt::format("no reply: {}", what),
      .found = fmt::format("none after {} tries of {} s", settings_.tries, settings_.timeout_s)};
  if (host_.counts().refused > 0) {
    report.found = fmt::format("{} messages with another layout", host_.counts().refused);
    report.advice = refusal_advice(LinkRefusal::wrong_version);
  } else if (!has_heard_) {
    report.advice =
        "Is the joint running, with this address and this id? `torsio connect list` shows the "
        "joints that reply.";
  } else if (is_command) {
    report.advice =
        "The joint replies to other messages, but not to this command: another host is in control. "
        "End that "
        "program, or wait until it has ended.";
  } else {
    report.advice = "Other replies did arrive: the line loses frames. Try again, or test the line.";
  }
  throw Error(std::move(report));
}

void JointConnection::Exchange::store(const LinkTelemetry& telemetry) {
  if (telemetry.mask != subscription_.mask) return;  // an earlier subscription
  ++counts_.telemetry;
  // A joint that was started again, or in which the subscription had ended, numbers from 0.
  const bool is_renumbered =
      telemetry.sequence < next_sequence_ &&
      (telemetry.time_ns > latest_ns_ || next_sequence_ - telemetry.sequence > kLongestDelay);
  if (is_renumbered) has_sequence_ = false;
  latest_ns_ = is_renumbered ? telemetry.time_ns : std::max(latest_ns_, telemetry.time_ns);
  if (has_sequence_ && telemetry.sequence > next_sequence_)
    counts_.lost += telemetry.sequence - next_sequence_;
  if (!has_sequence_ || telemetry.sequence >= next_sequence_)
    next_sequence_ = telemetry.sequence + 1;
  has_sequence_ = true;
  if (telemetry_.size() >= kStoredTelemetry) {
    telemetry_.pop_front();
    ++counts_.lost;
  }
  telemetry_.push_back(telemetry);
}

void JointConnection::Exchange::ping() {
  pinged_ns_ = detail::monotonic_ns();
  transmit(LinkPing{.token = ++token_});
}

void JointConnection::Exchange::keep_young() {
  const std::int64_t now_ns = detail::monotonic_ns();
  if (now_ns - std::max(heard_ns_, pinged_ns_) >= ping_period_ns_) ping();
  if (subscription_.mask != 0 && now_ns - renewed_ns_ >= kRenewalPeriod_ns) renew(subscription_);
}

/// Hears the joint's clock of now, so that the next command is young. @returns false: no reply
bool JointConnection::Exchange::refresh() {
  ping();
  const std::uint32_t first = token_;
  bool is_heard = false;
  wait_until(
      timeout_ns_, [&] { return is_heard; },
      [&](const auto& reply) {
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(reply)>, LinkPong>)
          is_heard = is_heard || reply.token >= first;
      });
  return is_heard;
}

void JointConnection::Exchange::send(LinkReference reference, double valid_s) {
  receive([](const auto&) {});
  keep_young();
  if (host_.clock_ns() == 0 && !refresh()) throw_silence("reference", true);
  const std::int64_t age_ns = detail::monotonic_ns() - heard_ns_;
  reference.deadline_ns = host_.clock_ns() + static_cast<std::uint64_t>(age_ns) +
                          static_cast<std::uint64_t>(1e9 * valid_s);
  ++counts_.references;
  transmit(reference);
}

void JointConnection::Exchange::heartbeat() {
  receive([](const auto&) {});
  keep_young();
  transmit(LinkStateChange{.command = LinkStateCommand::heartbeat});
}

/// A failure is ignored: a destructor cannot report it, and the watchdog has the same effect.
void JointConnection::Exchange::release() noexcept {
  if (!has_control_) return;
  try {
    settings_.tries = 2;
    command(LinkStateChange{.command = LinkStateCommand::release}, "release");
  } catch (const std::exception&) {
    has_control_ = false;
  }
}

void JointConnection::Exchange::renew(const LinkSubscribe& subscription) {
  if (subscription.mask != subscription_.mask || subscription.rate_Hz != subscription_.rate_Hz)
    has_sequence_ = false;
  subscription_ = subscription;
  renewed_ns_ = detail::monotonic_ns();
  transmit(subscription);
}

std::size_t JointConnection::Exchange::poll(const VisitTelemetry& visit, double wait_s) {
  std::size_t visited = 0;
  const auto take_all = [&] {
    for (; !telemetry_.empty(); telemetry_.pop_front(), ++visited) visit(telemetry_.front());
    return false;
  };
  wait_until(static_cast<std::int64_t>(1e9 * wait_s), take_all, [](const auto&) {});
  keep_young();
  take_all();
  return visited;
}

}  // namespace torsio
