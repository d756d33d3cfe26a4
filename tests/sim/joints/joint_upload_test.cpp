// Models that a host sends to a joint: accepted, exchanged without a step in the torque, refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "model/linear/linear.hpp"
#include "sim/joints/hosted_joints.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {
namespace {

using test::HostedJoint;
using test::HostedJoints;
using testing::Contains;
using testing::HasSubstr;

/// A linear spring with this slope and offset, over a deflection of gear and joint, or another input.
std::vector<std::byte> linear_model(double slope_Nm_rad, double offset_Nm,
                                    const std::string& gear = "gear_angle_rad") {
  Matrix coefficients(1, 2, 0.0);
  coefficients(0, 0) = offset_Nm;
  coefficients(0, 1) = slope_Nm_rad;
  EstimatorSettings settings;
  settings.features = {.inputs = {"spring_deflection_rad"},
                       .definitions = {{"spring_deflection_rad", gear + " - joint_angle_rad"}}};
  settings.sample_rate_Hz = 1000.0;
  settings.target = "torque_Nm";
  settings.ranges = {.lowest = {-0.2}, .highest = {0.2}, .margin = 0.1};
  settings.fallback = {.intercept = offset_Nm, .slope = {slope_Nm_rad}, .residual_std = 1.0};
  return model_bytes({.card = {},
                      .settings = settings,
                      .parameters = Linear::Parameters{.coefficients = {.values = coefficients}}});
}

class AnUpload : public testing::Test {
 protected:
  /// @returns the state of the upload at its end
  LinkUploadState upload(const std::vector<std::byte>& file,
                         const std::string& actuator = "dfki-50") {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(file.data());
    const auto crc = static_cast<std::uint32_t>(crc32_z(0, bytes, file.size()));
    if (hosted_.command(joint_, LinkUploadBegin{.size = static_cast<std::uint32_t>(file.size()),
                                                .crc = crc,
                                                .actuator = actuator}) != LinkRefusal::none)
      return joint_.upload->state;
    for (std::size_t at = 0; at < file.size(); at += 200) {
      hosted_.send(joint_, LinkStateChange{.command = LinkStateCommand::heartbeat});
      EXPECT_EQ(
          hosted_.command(
              joint_,
              LinkUploadChunk{.offset = static_cast<std::uint32_t>(at),
                              .data = {bytes + at, std::min<std::size_t>(200, file.size() - at)}}),
          LinkRefusal::none);
    }
    EXPECT_EQ(hosted_.command(joint_, LinkUploadCommit{.crc = crc}), LinkRefusal::none);
    for (int n = 0; n < 20000 && joint_.upload->state == LinkUploadState::complete; ++n) {
      const double before_Nm = joint_[JointChannel::torque];
      hosted_.hold(1);
      largest_step_Nm_ =
          std::max(largest_step_Nm_, std::abs(joint_[JointChannel::torque] - before_Nm));
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    return joint_.upload->state;
  }

  HostedJoints hosted_{HostedJoints::single("dfki-50")};
  HostedJoint& joint_ = hosted_.joints[0];
  double largest_step_Nm_ = 0.0;
};

TEST_F(AnUpload, IsUsedWithoutAStepInTheTorque) {
  const double stiffness_Nm_rad = 500.0;
  ASSERT_TRUE(hosted_.start());
  hosted_.hold(300);
  const double before_Nm = joint_[JointChannel::torque];
  ASSERT_EQ(upload(linear_model(stiffness_Nm_rad, 4.0)), LinkUploadState::committed);
  const double at_exchange_Nm = joint_[JointChannel::torque];
  EXPECT_NEAR(at_exchange_Nm, before_Nm, 0.5);
  EXPECT_LT(largest_step_Nm_, 0.5);
  hosted_.hold(1500);
  const double truth_Nm = joint_[JointChannel::truth_torque];
  EXPECT_NEAR(joint_[JointChannel::torque], truth_Nm + 4.0, 1.5) << "the model with its offset";
  EXPECT_EQ(hosted_.state(), LinkDriveState::enabled);
  EXPECT_THAT(hosted_.server.joints()[0].model, HasSubstr("linear"));
}

TEST_F(AnUpload, IsRejectedIfItDoesNotFit) {
  EXPECT_EQ(upload(linear_model(500.0, 0.0), "dfki-28"), LinkUploadState::rejected);
  EXPECT_EQ(upload(std::vector<std::byte>(500, std::byte{7})), LinkUploadState::rejected);
  EXPECT_EQ(upload(linear_model(5000.0, 0.0)), LinkUploadState::rejected) << "another joint";
  EXPECT_EQ(upload(linear_model(500.0, 0.0, "oil_pressure_rad")), LinkUploadState::rejected);
  hosted_.tick(20);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const std::vector<std::string> events = hosted_.server.take_events();
  EXPECT_THAT(events, Contains(HasSubstr("joint 1: model rejected: ")));
  EXPECT_THAT(events, Contains(HasSubstr("oil_pressure_rad")));
  EXPECT_THAT(events, Contains(HasSubstr("within a factor of")));
  EXPECT_THAT(hosted_.server.joints()[0].model, HasSubstr("data sheet"));
}

}  // namespace
}  // namespace torsio
