#include "torsio/sim/joints/joint_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <utility>

#include "core/checks.hpp"
#include "realtime/frame_ring.hpp"
#include "sim/joints/joint_registers.hpp"
#include "sim/joints/linked_arm.hpp"
#include "sim/joints/model_upload.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr auto kServerPlace = "joint server";
constexpr std::size_t kIds = 256;
constexpr std::size_t kEvents = 4096;
/// Datagrams of one tick: a host that sends more does not make the joints late.
constexpr int kReadsPerJoint = 8;
constexpr std::uint64_t kRefusedEveryTicks = 1000;

enum class ServerEvent : std::uint8_t { state, control, refused };

/// Frames of one tick that a datagram carries together: on the way into the system each costs as much as twenty frames here.
/// A line with a limited rate gets each frame by itself, since it may take one and not the next.
class FrameBundle : public LinkSink {
 public:
  explicit FrameBundle(LinkTransport& transport)
      : transport_(transport), is_bundling_(std::isinf(transport.line_B_s())) {}

  bool send(std::span<const std::uint8_t> frame) noexcept override {
    if (!is_bundling_) return transport_.send(frame);
    const bool fits = size_ + frame.size() <= bytes_.size();
    const bool is_sent = fits || flush();
    std::ranges::copy(frame, bytes_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += frame.size();
    return is_sent;
  }
  bool flush() noexcept {
    if (size_ == 0) return true;
    return transport_.send(std::span(bytes_).first(std::exchange(size_, 0)));
  }

 private:
  LinkTransport& transport_;
  bool is_bundling_;
  std::size_t size_ = 0;
  std::array<std::uint8_t, 1400> bytes_ = {};  ///< no fragments on Ethernet
};

}  // namespace

class JointServer::Parts {
 public:
  Parts(std::vector<ServedArm> served, const Settings& settings, LinkTransport& line_transport,
        CanBus* can_bus);

  void cycle(std::uint64_t now_ns) noexcept;
  std::vector<std::string> take_events();

  std::vector<std::unique_ptr<LinkedArm>> arms;
  std::deque<ServedJoint> joints;  ///< stay where they are
  LineStatus line = {};
  LinkTransport& transport;
  FrameBundle bundle;
  NdlcomDecoder decoder;
  CanBus* can;                             ///< null: none
  std::optional<CanSimpleLine> can_nodes;  ///< with a bus: its nodes

 private:
  /// What was last reported of a joint.
  struct Reported {
    LinkDriveState state = LinkDriveState::initialising;
    std::uint8_t host = 0;
    std::uint64_t refused = 0;
  };

  void add(LinkedArm& arm, std::uint8_t first_id, const Settings& settings, double line_B_s);
  void add_can_nodes(const Settings& settings);
  void receive(std::uint64_t now_ns) noexcept;
  void receive_can(std::uint64_t now_ns) noexcept;
  void dispatch(const NdlcomFrame& frame, std::uint64_t now_ns) noexcept;
  void note_events() noexcept;
  void note(std::size_t joint, ServerEvent event, double value, double reason) noexcept;
  [[nodiscard]] std::string text_of(std::span<const double> row) const;

  std::array<ServedJoint*, kIds> by_id_ = {};
  std::vector<Reported> reported_;
  FrameRing events_{5, kEvents};
  std::uint64_t tick_ = 0;
  std::int64_t noted_ = 0;
  std::array<std::uint8_t, 2048> bytes_ = {};
  std::optional<ModelWorker> worker_;  ///< last: it uses the joints
};

JointServer::Parts::Parts(std::vector<ServedArm> served, const Settings& settings,
                          LinkTransport& line_transport, CanBus* can_bus)
    : transport(line_transport), bundle(line_transport), decoder(settings.rules), can(can_bus) {
  require(!served.empty(), kServerPlace, "at least one joint", "none");
  Random seeds(settings.seed);
  std::size_t count = 0;
  for (const ServedArm& arm : served) count += arm.setup.joints.size();
  const double line_B_s = transport.line_B_s() / static_cast<double>(count);
  std::vector<ModelUpload*> uploads;
  for (ServedArm& arm : served) {
    const std::uint8_t first_id = arm.first_id;
    arms.push_back(
        std::make_unique<LinkedArm>(std::move(arm), settings.has_gear_stage, seeds.bits()));
    add(*arms.back(), first_id, settings, line_B_s);
  }
  for (ServedJoint& each : joints) uploads.push_back(&each.joint->upload());
  reported_.resize(joints.size());
  line.place = transport.place();
  if (can != nullptr) add_can_nodes(settings);
  worker_.emplace(std::move(uploads));
}

void JointServer::Parts::add(LinkedArm& arm, std::uint8_t first_id, const Settings& settings,
                             double line_B_s) {
  for (std::size_t j = 0; j < arm.size(); ++j) {
    const std::size_t id = first_id + j;
    require(id > kNdlcomReserved && id < kNdlcomBroadcast, kServerPlace, "an id of 1 to 254",
            fmt::format("{}", id));
    require(by_id_[id] == nullptr, kServerPlace, "an id per joint", fmt::format("{} twice", id));
    ServedJoint& made = joints.emplace_back();
    by_id_[id] = &made;
    made.joint = &arm.joint(j);
    made.id = static_cast<std::uint8_t>(id);
    made.watchdog_s = settings.watchdog_s;
    made.registers = joint_registers(made);
    made.table.emplace(made.registers);
    made.endpoint.emplace(
        JointEndpoint::Settings{.id = made.id,
                                .watchdog_s = settings.watchdog_s,
                                .tick_rate_Hz = kBenchRate_Hz,
                                .rules = settings.rules,
                                .line_B_s = line_B_s,
                                .bus_host = can == nullptr ? std::uint8_t{0} : kCanHost},
        *made.joint, *made.table, bundle);
  }
}

void JointServer::Parts::add_can_nodes(const Settings& settings) {
  std::vector<std::unique_ptr<CanSimpleNode>> nodes;
  for (ServedJoint& each : joints)
    nodes.push_back(std::make_unique<CanSimpleNode>(
        CanSimpleNode::Settings{.node = each.id,
                                .tick_rate_Hz = kBenchRate_Hz,
                                .estimate_rate_Hz = settings.can_rate_Hz},
        *each.endpoint, *each.joint, *each.table, *can));
  can_nodes.emplace(std::move(nodes));
}

void JointServer::Parts::cycle(std::uint64_t now_ns) noexcept {
  for (auto& arm : arms) arm->sense();
  for (ServedJoint& each : joints) each.endpoint->tick(now_ns);
  receive(now_ns);
  static_cast<void>(bundle.flush());  // the transport counts what it does not take
  if (can_nodes) receive_can(now_ns);
  for (auto& arm : arms) arm->control();
  note_events();
  ++tick_;
}

void JointServer::Parts::receive(std::uint64_t now_ns) noexcept {
  const int most = kReadsPerJoint * static_cast<int>(joints.size());
  for (int n = 0; n < most; ++n) {
    const std::size_t size = transport.receive(bytes_);
    if (size == 0) return;
    std::span<const std::uint8_t> left = std::span(bytes_).first(size);
    while (const auto frame = decoder.next(left)) dispatch(*frame, now_ns);
  }
}

void JointServer::Parts::receive_can(std::uint64_t now_ns) noexcept {
  can_nodes->tick(now_ns);
  const int most = kReadsPerJoint * static_cast<int>(joints.size());
  CanFrame frame;
  for (int n = 0; n < most && can->receive(frame); ++n) can_nodes->receive(frame, now_ns);
}

void JointServer::Parts::dispatch(const NdlcomFrame& frame, std::uint64_t now_ns) noexcept {
  if (frame.receiver == kNdlcomBroadcast) {
    for (ServedJoint& each : joints) each.endpoint->receive(frame, now_ns);
  } else if (ServedJoint* const to = by_id_[frame.receiver]; to != nullptr) {
    to->endpoint->receive(frame, now_ns);
  } else {
    ++line.to_no_joint;
  }
}

void JointServer::Parts::note(std::size_t joint, ServerEvent event, double value,
                              double reason) noexcept {
  const std::array row = {static_cast<double>(tick_) / kBenchRate_Hz, static_cast<double>(joint),
                          static_cast<double>(event), value, reason};
  static_cast<void>(events_.push(noted_++, row));
}

void JointServer::Parts::note_events() noexcept {
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const JointEndpoint& endpoint = *joints[k].endpoint;
    Reported& last = reported_[k];
    if (const std::uint8_t host = endpoint.guard().controlling_host(); host != last.host) {
      last.host = host;
      note(k, ServerEvent::control, host, 0.0);
    }
    if (const LinkDriveState state = endpoint.drive().state(); state != last.state) {
      last.state = state;
      note(k, ServerEvent::state, static_cast<double>(state),
           static_cast<double>(endpoint.drive().reason()));
    }
    // Once per second, one joint after the other.
    if (tick_ % kRefusedEveryTicks != k) continue;
    if (const std::uint64_t refused = endpoint.counts().all_refused(); refused != last.refused) {
      note(k, ServerEvent::refused, static_cast<double>(refused - last.refused), 0.0);
      last.refused = refused;
    }
  }
}

std::string JointServer::Parts::text_of(std::span<const double> row) const {
  const ServedJoint& of = joints[static_cast<std::size_t>(row[1])];
  const std::string start = fmt::format("{:10.3f} s  joint {}: ", row[0], of.id);
  switch (static_cast<ServerEvent>(row[2])) {
    case ServerEvent::control:
      if (row[3] == 0.0) return start + "no host in control";
      if (can != nullptr && row[3] == kCanHost) return start + "the CAN bus in control";
      return start + fmt::format("host {} in control", row[3]);
    case ServerEvent::refused: return start + fmt::format("{} messages refused", row[3]);
    case ServerEvent::state: break;
  }
  const auto state = static_cast<LinkDriveState>(row[3]);
  const bool has_reason = state == LinkDriveState::stop || state == LinkDriveState::fault;
  return start + std::string(name(state)) +
         (has_reason ? fmt::format(": {}", name(static_cast<LinkStateReason>(row[4]))) : "");
}

std::vector<std::string> JointServer::Parts::take_events() {
  std::vector<std::string> texts;
  FrameBlock block;
  events_.drain(block, kEvents);
  for (std::size_t row = 0; row < block.ticks.size(); ++row)
    texts.push_back(
        text_of(std::span(block.values).subspan(row * events_.channels(), events_.channels())));
  for (const ModelWorker::Remark& remark : worker_->take_remarks())
    texts.push_back(fmt::format("joint {}: {}", joints[remark.upload].id, remark.text));
  return texts;
}

JointServer::JointServer(std::vector<ServedArm> arms, const Settings& settings,
                         LinkTransport& transport, CanBus* can)
    : parts_(std::make_unique<Parts>(std::move(arms), settings, transport, can)) {}
JointServer::~JointServer() = default;

void JointServer::cycle(std::uint64_t now_ns) noexcept { parts_->cycle(now_ns); }

void JointServer::stop_all(StopCategory category) noexcept {
  for (auto& arm : parts_->arms) arm->stop(category);
}

bool JointServer::is_off() const noexcept {
  return std::ranges::all_of(parts_->arms, [](const auto& arm) { return arm->is_off(); });
}

std::vector<std::string> JointServer::take_events() { return parts_->take_events(); }

std::vector<JointServer::JointStatus> JointServer::joints() const {
  std::vector<JointStatus> all;
  for (const ServedJoint& each : parts_->joints) {
    const JointEndpoint& endpoint = *each.endpoint;
    all.push_back({.id = each.id,
                   .name = std::string(each.joint->identity().name),
                   .actuator = each.joint->actuator(),
                   .model = std::string(each.joint->model()),
                   .state = endpoint.drive().state(),
                   .reason = endpoint.drive().reason(),
                   .host = endpoint.guard().controlling_host(),
                   .counts = endpoint.counts()});
  }
  return all;
}

JointServer::LineStatus JointServer::line() const {
  LineStatus status = parts_->line;
  status.frames = parts_->decoder.counts();
  status.transport = parts_->transport.counts();
  return status;
}

std::optional<JointServer::CanStatus> JointServer::can() const {
  if (parts_->can == nullptr) return std::nullopt;
  return CanStatus{.place = parts_->can->place(),
                   .frames = parts_->can_nodes->counts(),
                   .bus = parts_->can->counts()};
}

std::string JointServer::registers(std::uint8_t id) const {
  for (const ServedJoint& each : parts_->joints)
    if (each.id == id) return json_of(*each.table);
  refuse(kServerPlace, "the id of a joint", fmt::format("{}", id));
}

}  // namespace torsio
