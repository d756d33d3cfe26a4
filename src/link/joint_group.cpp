#include "torsio/link/joint_group.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/checks.hpp"
#include "link/descriptor.hpp"
#include "link/split_line.hpp"

namespace torsio {
namespace {

constexpr double kSilentPeriods = 3.0;
/// The longest wait without the pings and renewals of all joints.
constexpr std::int64_t kLongestWait_ns = 5'000'000;

}  // namespace

class JointGroup::Parts {
 public:
  Parts(std::shared_ptr<LinkTransport> line, const std::string& place, const Settings& settings)
      : settings_(settings), line_(std::move(line), settings.rules) {
    require(!settings.joints.empty(), "joint group: joints", "at least one id", "none");
    require(settings.silence_s > 0.0, "joint group: silence_s", "a time above 0",
            settings.silence_s);
    std::set<std::uint8_t> ids;
    for (const std::uint8_t id : settings.joints)
      require(ids.insert(id).second, "joint group: joints", "each id once",
              fmt::format("{} twice", id));
    for (const std::uint8_t id : settings.joints)
      members_.push_back(
          {.connection = JointConnection(line_.end_of(id), place,
                                         {.id = settings.id,
                                          .joint = id,
                                          .rules = settings.rules,
                                          .timeout_s = settings.timeout_s,
                                          .tries = settings.tries,
                                          .ping_period_s = settings.ping_period_s})});
    for (Member& each : members_) {
      each.information = each.connection.information();
      each.channels = each.connection.channels();
    }
  }

  void subscribe(const std::vector<std::string>& names, double rate_Hz) {
    for (Member& each : members_) {
      each.subscription = each.connection.subscribe(names, rate_Hz);
      each.silence_ns = static_cast<std::int64_t>(
          1e9 * std::max(settings_.silence_s, kSilentPeriods / each.subscription.rate_Hz));
    }
    for (Member& each : members_) each.heard_ns = detail::monotonic_ns();
  }

  std::size_t poll(const VisitTelemetry& visit, double wait_s) {
    const std::int64_t end_ns = detail::monotonic_ns() + static_cast<std::int64_t>(1e9 * wait_s);
    std::size_t visited = 0;
    while (true) {
      for (std::size_t joint = 0; joint < members_.size(); ++joint)
        visited += poll_one(joint, visit);
      const std::int64_t left_ns = end_ns - detail::monotonic_ns();
      if (left_ns <= 0) return visited;
      static_cast<void>(line_.whole().wait(std::min(left_ns, kLongestWait_ns)));
    }
  }

  struct Member {
    JointConnection connection;
    JointConnection::Information information = {};
    std::vector<std::string> channels = {};
    JointConnection::Subscription subscription = {};
    std::int64_t silence_ns = 0;  ///< 0: nothing is subscribed
    std::int64_t heard_ns = 0;
    bool is_silent = false;
  };
  [[nodiscard]] const std::vector<Member>& members() const noexcept { return members_; }
  [[nodiscard]] std::vector<Member>& members() noexcept { return members_; }
  [[nodiscard]] const Settings& settings() const noexcept { return settings_; }

 private:
  std::size_t poll_one(std::size_t joint, const VisitTelemetry& visit) {
    Member& member = members_[joint];
    const std::size_t visited = member.connection.poll(
        [&](const LinkTelemetry& telemetry) { visit(joint, telemetry); }, 0.0);
    const std::int64_t now_ns = detail::monotonic_ns();
    if (visited > 0) member.heard_ns = now_ns;
    member.is_silent = member.silence_ns > 0 && now_ns - member.heard_ns > member.silence_ns;
    return visited;
  }

  Settings settings_;
  detail::SplitLine line_;
  std::vector<Member> members_ = {};
};

JointGroup::JointGroup(std::shared_ptr<LinkTransport> line, const std::string& place,
                       const Settings& settings)
    : parts_(std::make_unique<Parts>(std::move(line), place, settings)) {}

JointGroup::JointGroup(const JointLine& line, const Settings& settings)
    : JointGroup(open_joint_line(line), name(line), settings) {}

JointGroup::~JointGroup() = default;
JointGroup::JointGroup(JointGroup&&) noexcept = default;
JointGroup& JointGroup::operator=(JointGroup&&) noexcept = default;

void JointGroup::subscribe(const std::vector<std::string>& names, double rate_Hz) {
  parts_->subscribe(names, rate_Hz);
}

std::size_t JointGroup::poll(const VisitTelemetry& visit, double wait_s) {
  return parts_->poll(visit, wait_s);
}

std::size_t JointGroup::size() const noexcept { return parts_->members().size(); }
std::uint8_t JointGroup::id(std::size_t joint) const { return parts_->settings().joints.at(joint); }
JointConnection::Value JointGroup::read(std::size_t joint, std::string_view name) {
  return parts_->members().at(joint).connection.read(name);
}
LinkDriveState JointGroup::state(std::size_t joint) {
  return parts_->members().at(joint).connection.information().state;
}
const JointConnection::Information& JointGroup::information(std::size_t joint) const {
  return parts_->members().at(joint).information;
}
const std::vector<std::string>& JointGroup::channels(std::size_t joint) const {
  return parts_->members().at(joint).channels;
}
const JointConnection::Subscription& JointGroup::subscription(std::size_t joint) const {
  return parts_->members().at(joint).subscription;
}
const JointConnection::Counts& JointGroup::counts(std::size_t joint) const {
  return parts_->members().at(joint).connection.counts();
}
bool JointGroup::is_silent(std::size_t joint) const {
  return parts_->members().at(joint).is_silent;
}
const std::string& JointGroup::place(std::size_t joint) const {
  return parts_->members().at(joint).connection.place();
}

}  // namespace torsio
