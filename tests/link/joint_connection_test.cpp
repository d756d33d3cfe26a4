#include "torsio/link/joint_connection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "link/served_joint.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::LinkedJoint;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

/// A joint on a socket of the file system, and a host that is connected to it.
class JointConnections : public testing::Test {
 protected:
  JointConnection connection(int tries = 5, double timeout_s = 0.2) {
    JointConnection made(JointLine{.unix_path = path_}, {.timeout_s = timeout_s, .tries = tries});
    return made;
  }
  TemporaryFolder folder_;
  std::string path_ = folder_.path("joint");
  // A second is long enough for a busy machine.
  test::ServedJoint joint_ =
      test::ServedJoint(open_unix({.path = path_, .peer = path_ + ".host"}), {.watchdog_s = 1.0});
};

TEST_F(JointConnections, DescribeReadAndWriteRegisters) {
  JointConnection host = connection();
  const auto information = host.information();
  EXPECT_EQ(information.name, "elbow");
  EXPECT_EQ(information.state, LinkDriveState::ready);
  EXPECT_EQ(information.watchdog_s, 1.0);
  ASSERT_EQ(host.registers().size(), 2U);
  EXPECT_EQ(host.registers()[0].unit, "1/s");
  EXPECT_EQ(std::get<double>(host.read("gain")), 2.0);
  host.write("gain", 3.5);
  host.write("ratio", 160.0);  // a number in the type of the register
  EXPECT_EQ(std::get<double>(host.read("gain")), 3.5);
  EXPECT_EQ(std::get<std::int32_t>(host.read("ratio")), 160);
  EXPECT_THAT(host.channels(), ElementsAre("angle_rad", "torque_Nm", "current_A"));
}

TEST_F(JointConnections, MistakesNameTheJointWhatWasSentAndTheReason) {
  JointConnection host = connection();
  EXPECT_THAT(error_message([&] { host.write("gain", 12.0); }),
              AllOf(HasSubstr("joint 1 at " + path_), HasSubstr("write of gain = 12"),
                    HasSubstr("expected 0 to 9"), HasSubstr("outside the limits")));
  EXPECT_THAT(error_message([&] { host.write("ratio", 0.5); }),
              AllOf(HasSubstr("ratio"), HasSubstr("int32"), HasSubstr("'0.5'")));
  EXPECT_THAT(error_message([&] { static_cast<void>(host.read("gian")); }),
              HasSubstr("Did you mean 'gain'?"));
  EXPECT_THAT(error_message([&] { host.subscribe({"torque"}, 100.0); }), HasSubstr("angle_rad"));
  EXPECT_THAT(error_message([&] { host.subscribe({}, 1e5); }), HasSubstr("outside the limits"));
  EXPECT_THAT(error_message([&] { host.inject_fault("encoder_jump", "", 1.0, 0.0); }),
              HasSubstr("this joint does not offer it"));
  host.enable();
  EXPECT_THAT(error_message([&] { host.write("ratio", 5.0); }),
              HasSubstr("Disable the joint first"));
  JointConnection absent(JointLine{.unix_path = folder_.path("absent")},
                         {.joint = 3, .timeout_s = 0.01});
  EXPECT_THAT(error_message([&] { absent.enable(); }),
              AllOf(HasSubstr("joint 3 at "), HasSubstr("no reply: enable"),
                    HasSubstr("Is the joint running")));
}

TEST_F(JointConnections, ReferencesMoveTheJointUntilTheHostIsDestroyed) {
  {
    JointConnection host = connection();
    host.enable();
    for (int n = 0; n < 50; ++n) {
      host.send({.mode = JointMode::torque, .torque_Nm = 0.1F * static_cast<float>(n)}, 0.5);
      host.poll([](const LinkTelemetry&) {}, 1e-3);
    }
    host.send({.mode = JointMode::torque, .torque_Nm = 60.0F}, 0.5);
    host.poll([](const LinkTelemetry&) {}, 0.05);
    EXPECT_EQ(host.counts().references, 51U);
    EXPECT_EQ(host.counts().refused[static_cast<std::size_t>(LinkRefusal::out_of_range)], 1U);
    EXPECT_TRUE(
        joint_.with([](LinkedJoint& joint) { return joint.endpoint.drive().is_enabled(); }));
  }
  joint_.with([](LinkedJoint& joint) {
    EXPECT_EQ(joint.joint.references.size(), 50U);
    EXPECT_EQ(joint.endpoint.drive().reason(), LinkStateReason::host_released);
  });
}

TEST_F(JointConnections, RepliesThatAreLostAreRequestedAgain) {
  joint_.lost_share = 0.3;
  // Many tries within the second of the watchdog, which stops an enabled joint in between.
  JointConnection host = connection(60, 0.02);
  for (int n = 0; n < 5; ++n) {
    host.write("gain", 1.0 + n);
    EXPECT_EQ(std::get<double>(host.read("gain")), 1.0 + n);
    host.enable();
    host.disable();
  }
  host.stop(StopCategory::power_off);
  host.disable();
}

TEST_F(JointConnections, TelemetryIsRenewedAndItsLossIsCounted) {
  JointConnection host = connection();
  const auto made = host.subscribe({"current_A", "angle_rad"}, 480.0);
  EXPECT_EQ(made.rate_Hz, 500.0);
  EXPECT_THAT(made.channels, ElementsAre("angle_rad", "current_A"));  // in the joint's order
  std::size_t received = 0;
  const auto visit = [&](const LinkTelemetry& telemetry) {
    EXPECT_EQ(telemetry.values.count, 2);
    EXPECT_EQ(telemetry.values.values[1], 2.5F);
    ++received;
  };
  while (received < 600) host.poll(visit, 0.01);
  EXPECT_EQ(host.counts().lost, 0U);
  joint_.lost_share = 0.1;
  while (received < 900) host.poll(visit, 0.01);
  EXPECT_GT(host.counts().lost, 10U);
}

TEST_F(JointConnections, ASecondHostLearnsThatAnotherOneIsInControl) {
  const std::shared_ptr<LinkTransport> line = open_joint_line({.unix_path = path_});
  JointConnection first(line, path_, {.id = 200, .timeout_s = 0.02});
  JointConnection second(line, path_, {.id = 201, .timeout_s = 0.02});
  first.enable();
  EXPECT_EQ(std::get<double>(second.read("gain")), 2.0);
  EXPECT_THAT(error_message([&] { second.write("gain", 3.0); }),
              HasSubstr("another host is in control"));
  second.stop(StopCategory::ramp_and_brake);  // any host may stop a joint
  EXPECT_EQ(first.information().state, LinkDriveState::stop);
}

TEST_F(JointConnections, AFileIsUploadedInPartsAlsoIfRepliesAreLost) {
  JointConnection host = connection(30);
  const std::string text(777, 'm');
  const std::span<const std::uint8_t> file(reinterpret_cast<const std::uint8_t*>(text.data()),
                                           text.size());
  joint_.lost_share = 0.25;
  double fraction = 0.0;
  host.upload(file, "dfki-50", [&](double now) { fraction = now; });
  EXPECT_EQ(fraction, 1.0);
  joint_.with([&](LinkedJoint& joint) { EXPECT_EQ(joint.joint.model, text); });
  joint_.lost_share = 0.0;
  EXPECT_THAT(error_message([&] { host.upload(file, "other", {}); }),
              AllOf(HasSubstr("begin of an upload"), HasSubstr("upload_rejected"),
                    HasSubstr("for the actuator of this joint")));
}

/// A joint of another release, which refuses every layout.
class OtherRelease : public LinkTransport {
 public:
  std::size_t receive(std::span<std::uint8_t> out) noexcept override {
    std::ranges::copy(replies_, out.begin());
    return std::exchange(replies_, {}).size();
  }
  bool send(std::span<const std::uint8_t> frame) noexcept override {
    while (const auto request = decoder_.next(frame)) {
      test::LinkBytes payload(kNdlcomMaxPayloadBytes);
      payload.resize(encode_payload(
          LinkRefused{.message = request->payload[0], .reason = LinkRefusal::wrong_version},
          {.receiver = 254, .sender = 1}, payload));
      replies_ = test::encoded({.receiver = 254, .sender = 1, .payload = payload});
    }
    return true;
  }
  int descriptor() const noexcept override { return -1; }
  std::string place() const override { return "line"; }

 private:
  NdlcomDecoder decoder_;
  test::LinkBytes replies_ = {};
};

TEST(JointConnectionToAnotherRelease, StatesThatTheLayoutsDiffer) {
  JointConnection host(std::make_shared<OtherRelease>(), "line", {.timeout_s = 0.01});
  const auto advice = HasSubstr("Host and joint have different releases of torsio");
  EXPECT_THAT(error_message([&] { static_cast<void>(host.information()); }), advice);
  EXPECT_THAT(error_message([&] { host.enable(); }), advice);
}

TEST_F(JointConnections, JointsAreFoundByTheirReply) {
  const auto line = open_joint_line({.unix_path = path_});
  EXPECT_THAT(find_joints(*line, 254, 0.2), ElementsAre(1));
}

}  // namespace
}  // namespace torsio
