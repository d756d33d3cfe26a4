#include "torsio/link/joint_endpoint.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "link/recording_joint.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using test::LinkBytes;
using test::LinkedJoint;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class AJointOnALine : public testing::Test {
 protected:
  void enable() { ASSERT_EQ(line_.change(host_, LinkStateCommand::enable), LinkRefusal::none); }

  LinkedJoint line_;
  HostEndpoint host_ = HostEndpoint({.id = 200, .joint = 1});
  HostEndpoint other_ = HostEndpoint({.id = 201, .joint = 1});
};

TEST_F(AJointOnALine, RepliesToRequests) {
  const auto pong = line_.ask<LinkPong>(host_, LinkPing{.token = 77});
  ASSERT_TRUE(pong);
  EXPECT_EQ(pong->token, 77U);
  EXPECT_EQ(pong->clock_ns, line_.now_ns);
  EXPECT_EQ(host_.clock_ns(), line_.now_ns);
  line_.endpoint.receive(LinkBytes{}, line_.now_ns);
  LinkBytes frame(kNdlcomMaxEncodedBytes);
  frame.resize(host_.build(LinkInformationRequest{}, frame));
  line_.endpoint.receive(frame, line_.now_ns);
  host_.receive(line_.sent.take(), []<class Message>(const Message& message) {
    if constexpr (std::is_same_v<Message, LinkInformation>) {
      EXPECT_EQ(message.name, "elbow");
      EXPECT_EQ(message.actuator, "dfki-50");
      EXPECT_EQ(message.registers, 2);
      EXPECT_EQ(message.watchdog_ms, 50);
    } else {
      ADD_FAILURE();
    }
  });
}

TEST_F(AJointOnALine, HasRegistersThatAreReadDescribedAndWritten) {
  EXPECT_EQ(line_.ask<LinkRegisterValue>(host_, LinkRegisterRead{.index = 0})->value,
            LinkValue::of(2.0));
  EXPECT_EQ(line_.ask<LinkRegisterDescription>(host_, LinkRegisterDescribe{.index = 1})->count, 2);
  EXPECT_EQ(line_.command(host_, LinkRegisterWrite{.index = 0, .value = LinkValue::of(3.0)}),
            LinkRefusal::none);
  EXPECT_EQ(line_.gain, 3.0);
  line_.ping(host_);
  const auto refused =
      line_.ask<LinkRefused>(host_, LinkRegisterWrite{.index = 0, .value = LinkValue::of(9.5)});
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->reason, LinkRefusal::out_of_range);
  EXPECT_EQ(refused->highest, 9.0);
  EXPECT_EQ(refused->sequence, host_.sequence());
  EXPECT_EQ(line_.gain, 3.0);
  EXPECT_EQ(line_.command(host_, LinkRegisterWrite{.index = 0, .value = LinkValue::of(true)}),
            LinkRefusal::wrong_type);
  EXPECT_EQ(line_.command(host_, LinkRegisterWrite{.index = 7, .value = LinkValue::of(1.0)}),
            LinkRefusal::unknown_register);
  const LinkRegisterWrite ratio{.index = 1, .value = LinkValue::of(std::int32_t{50})};
  enable();
  EXPECT_EQ(line_.command(host_, ratio), LinkRefusal::only_when_disabled);
  EXPECT_EQ(line_.change(host_, LinkStateCommand::disable), LinkRefusal::none);
  EXPECT_EQ(line_.command(host_, ratio), LinkRefusal::none);
  EXPECT_EQ(line_.ratio, 50);
}

TEST_F(AJointOnALine, ExecutesReferencesOnlyWhenItIsEnabled) {
  EXPECT_EQ(line_.command(host_, line_.reference(5.0F)), LinkRefusal::not_in_this_state);
  enable();
  EXPECT_EQ(line_.command(host_, line_.reference(5.0F)), std::nullopt);
  ASSERT_EQ(line_.joint.references.size(), 1U);
  EXPECT_EQ(line_.joint.references[0].torque_Nm, 5.0);
  EXPECT_EQ(line_.command(host_, line_.reference(51.0F)), LinkRefusal::out_of_range);
  EXPECT_EQ(line_.command(host_, line_.reference(std::numeric_limits<float>::quiet_NaN())),
            LinkRefusal::not_finite);
  EXPECT_EQ(line_.command(host_, line_.reference(1.0F, 0)), LinkRefusal::deadline);
  EXPECT_EQ(line_.joint.references.size(), 1U);
}

TEST_F(AJointOnALine, StopsWithinTheTimeOfTheWatchdogWhenItsHostIsSilent) {
  enable();
  for (int n = 0; n < 200; ++n) {
    ASSERT_EQ(line_.command(host_, line_.reference(5.0F)), std::nullopt) << n;
    line_.tick();
  }
  line_.tick(38);
  EXPECT_TRUE(line_.endpoint.drive().is_enabled());
  line_.tick();  // 40 ms after the last reference: its deadline
  EXPECT_EQ(line_.endpoint.drive().state(), LinkDriveState::stop);
  EXPECT_EQ(line_.endpoint.drive().reason(), LinkStateReason::host_lost);
  EXPECT_THAT(line_.joint.stops, ElementsAre(StopCategory::ramp_and_brake));
  EXPECT_EQ(line_.received<LinkState>(host_)->reason, LinkStateReason::host_lost);
  EXPECT_EQ(line_.command(host_, line_.reference(5.0F)), LinkRefusal::not_in_this_state);
}

TEST_F(AJointOnALine, ReferencesThatAreRefusedDoNotFeedTheWatchdog) {
  enable();
  for (int n = 0; n < 60; ++n) {
    static_cast<void>(line_.command(host_, line_.reference(99.0F)));
    static_cast<void>(
        line_.command(host_, LinkRegisterWrite{.index = 0, .value = LinkValue::of(1.0)}));
    line_.tick();
  }
  EXPECT_EQ(line_.endpoint.drive().reason(), LinkStateReason::host_lost);
}

TEST_F(AJointOnALine, HeartbeatsKeepItEnabled) {
  enable();
  for (int n = 0; n < 300; ++n) {
    ASSERT_EQ(line_.change(host_, LinkStateCommand::heartbeat), std::nullopt);
    line_.tick();
  }
  EXPECT_TRUE(line_.endpoint.drive().is_enabled());
}

TEST_F(AJointOnALine, IsControlledByOneHost) {
  enable();
  EXPECT_EQ(line_.command(other_, line_.reference(5.0F)), std::nullopt);
  EXPECT_EQ(line_.command(other_, LinkRegisterWrite{.index = 0, .value = LinkValue::of(1.0)}),
            std::nullopt);
  EXPECT_EQ(line_.gain, 2.0);
  EXPECT_THAT(line_.joint.references, IsEmpty());
  EXPECT_EQ(line_.endpoint.guard().refused(CommandGuard::Refusal::other_host), 2U);
  EXPECT_EQ(line_.change(host_, LinkStateCommand::release), LinkRefusal::none);
  EXPECT_EQ(line_.endpoint.drive().reason(), LinkStateReason::host_released);
  line_.tick();
  EXPECT_EQ(line_.change(other_, LinkStateCommand::disable), LinkRefusal::none);
  EXPECT_EQ(line_.change(other_, LinkStateCommand::enable), LinkRefusal::none);
}

TEST_F(AJointOnALine, IsNotStoppedByAReleaseWhileItIsDisabled) {
  EXPECT_EQ(line_.change(host_, LinkStateCommand::release), LinkRefusal::none);
  EXPECT_EQ(line_.endpoint.drive().state(), LinkDriveState::ready);
  EXPECT_THAT(line_.joint.stops, IsEmpty());
}

TEST_F(AJointOnALine, StopsAtAnyTimeForAnyHost) {
  enable();
  EXPECT_EQ(line_.ask<LinkState>(other_, LinkStop{.category = 2})->state, LinkDriveState::stop);
  EXPECT_EQ(line_.ask<LinkState>(other_, LinkStop{.category = 9})->state, LinkDriveState::stop);
  EXPECT_THAT(line_.joint.stops, ElementsAre(StopCategory::ramp_and_hold, StopCategory::power_off));
  line_.joint.at_rest = false;
  EXPECT_EQ(line_.change(host_, LinkStateCommand::disable), LinkRefusal::not_in_this_state);
  line_.joint.at_rest = true;
  EXPECT_EQ(line_.change(host_, LinkStateCommand::disable), LinkRefusal::none);
}

TEST_F(AJointOnALine, OfABroadcastExecutesOnlyAStop) {
  enable();
  line_.ping(host_);
  LinkBytes payload(kNdlcomMaxPayloadBytes);
  const LinkRoute route{.receiver = kNdlcomBroadcast, .sender = 200};
  payload.resize(encode_payload(LinkStateChange{.seal = {.sequence = 99, .clock_ns = line_.now_ns},
                                                .command = LinkStateCommand::disable},
                                route, payload));
  EXPECT_FALSE(line_.deliver<LinkDone>(host_, test::encoded({kNdlcomBroadcast, 200, 0, payload})));
  EXPECT_TRUE(line_.endpoint.drive().is_enabled());
  EXPECT_EQ(line_.endpoint.counts().broadcasts, 1U);
  LinkBytes frame(kNdlcomMaxEncodedBytes);
  frame.resize(other_.build_stop_of_all(1, frame));
  EXPECT_FALSE(line_.deliver<LinkState>(other_, frame)) << "all joints would reply at once";
  EXPECT_EQ(line_.endpoint.drive().state(), LinkDriveState::stop);
}

TEST_F(AJointOnALine, AStopOfAnotherLayoutIsAStop) {
  enable();
  EXPECT_EQ(
      line_.deliver<LinkRefused>(host_, test::encoded({1, 200, 0, {LinkStop::kId, 2, 0}}))->reason,
      LinkRefusal::wrong_version);
  EXPECT_EQ(line_.endpoint.drive().state(), LinkDriveState::stop);
}

TEST_F(AJointOnALine, CountsWhatItDoesNotReplyTo) {
  enable();
  line_.sent.take();
  for (const LinkBytes& frame :
       {test::encoded({9, 200, 0, {1, 1, 0, 0, 0, 0}}),
        test::encoded({1, 0, 0, {1, 1, 0, 0, 0, 0}}), test::encoded({1, 1, 0, {1, 1}}),
        test::encoded({1, 255, 0, {1, 1}}), test::encoded({1, 201, 0, {0x77, 1}}),
        test::encoded({1, 201, 1, {}}), test::encoded({1, 201, 2, {LinkPong::kId, 1}}),
        test::encoded({1, 201, 3, {LinkPing::kId, 1}}),
        test::encoded({1, 200, 3, LinkBytes(60, LinkReference::kId)})})
    line_.endpoint.receive(frame, line_.now_ns);
  EXPECT_THAT(line_.sent.take(), IsEmpty());
  const JointEndpoint::Counts& counts = line_.endpoint.counts();
  EXPECT_EQ(counts.to_others, 1U);
  EXPECT_EQ(counts.without_sender, 3U);
  EXPECT_EQ(counts.unknown, 3U);
  EXPECT_EQ(counts.refused[static_cast<std::size_t>(LinkRefusal::wrong_length)], 1U);
  EXPECT_EQ(counts.refused[static_cast<std::size_t>(LinkRefusal::checksum)], 1U);
  EXPECT_EQ(line_.deliver<LinkRefused>(host_, test::encoded({1, 200, 4, {0x77, 1}}))->reason,
            LinkRefusal::unknown_message);
}

TEST_F(AJointOnALine, GoesToAFaultAndOutOfItByAReset) {
  enable();
  line_.joint.fault = true;
  line_.tick();
  EXPECT_EQ(line_.received<LinkState>(host_)->state, LinkDriveState::fault);
  EXPECT_EQ(line_.joint.disables, 1);
  EXPECT_EQ(line_.change(host_, LinkStateCommand::reset_fault), LinkRefusal::not_in_this_state);
  line_.joint.fault = false;
  EXPECT_EQ(line_.change(host_, LinkStateCommand::reset_fault), LinkRefusal::none);
  line_.joint.enable_objection = LinkRefusal::not_supported;
  EXPECT_EQ(line_.change(host_, LinkStateCommand::enable), LinkRefusal::not_supported);
  EXPECT_EQ(line_.endpoint.drive().state(), LinkDriveState::ready);
}

TEST_F(AJointOnALine, StopsWhereItsClockRunsBackwards) {
  enable();
  line_.now_ns -= 5 * LinkedJoint::kTick_ns;
  line_.tick();
  EXPECT_EQ(line_.endpoint.drive().reason(), LinkStateReason::clock);
}

TEST_F(AJointOnALine, SendsTelemetryAtTheRateAndForTheTimeOfASubscription) {
  const auto reply = line_.ask<LinkSubscription>(
      host_, LinkSubscribe{.mask = 0b101, .rate_Hz = 240.0F, .lifetime_s = 1.0F});
  EXPECT_EQ(reply->refusal, LinkRefusal::none);
  EXPECT_FLOAT_EQ(reply->rate_Hz, 250.0F);
  std::vector<LinkTelemetry> rows;
  for (int n = 0; n < 1500; ++n) {
    line_.tick();
    if (const auto row = line_.received<LinkTelemetry>(host_)) rows.push_back(*row);
  }
  ASSERT_EQ(rows.size(), 250U);
  for (std::uint32_t n = 0; n < rows.size(); ++n) {
    ASSERT_EQ(rows[n].sequence, n);
    ASSERT_EQ(rows[n].time_ns, rows[0].time_ns + n * 4 * LinkedJoint::kTick_ns);
    ASSERT_EQ(rows[n].values.count, 2);
    ASSERT_EQ(rows[n].values.values[1], 2.5F);
  }
  EXPECT_EQ(host_.clock_ns(), rows.back().time_ns);
}

TEST_F(AJointOnALine, ContinuesTheTelemetryOfASubscriptionThatIsRenewed) {
  const LinkSubscribe subscribe{.mask = 1, .rate_Hz = 500.0F, .lifetime_s = 0.01F};
  std::vector<std::uint32_t> sequences;
  for (int n = 0; n < 40; ++n) {
    if (n % 5 == 0) {
      EXPECT_EQ(line_.ask<LinkSubscription>(host_, subscribe)->refusal, LinkRefusal::none);
    }
    line_.tick();
    if (const auto row = line_.received<LinkTelemetry>(host_)) sequences.push_back(row->sequence);
  }
  ASSERT_EQ(sequences.size(), 20U);
  for (std::uint32_t n = 0; n < sequences.size(); ++n) EXPECT_EQ(sequences[n], n);
  EXPECT_EQ(line_.ask<LinkSubscription>(host_, LinkSubscribe{.mask = 0})->refusal,
            LinkRefusal::none);
  line_.tick(3);
  EXPECT_FALSE(line_.received<LinkTelemetry>(host_));
}

TEST_F(AJointOnALine, RefusesASubscriptionThatItCannotServe) {
  const auto refusal = [&](HostEndpoint& host, const LinkSubscribe& message) {
    return line_.ask<LinkSubscription>(host, message)->refusal;
  };
  EXPECT_EQ(refusal(host_, {.mask = 0b1000, .rate_Hz = 1.0F, .lifetime_s = 1.0F}),
            LinkRefusal::out_of_range);
  EXPECT_EQ(refusal(host_, {.mask = 1, .rate_Hz = 1001.0F, .lifetime_s = 1.0F}),
            LinkRefusal::out_of_range);
  EXPECT_EQ(refusal(host_, {.mask = 1, .rate_Hz = 0.0F, .lifetime_s = 1.0F}),
            LinkRefusal::out_of_range);
  EXPECT_EQ(refusal(host_, {.mask = 1, .rate_Hz = 1.0F, .lifetime_s = 61.0F}),
            LinkRefusal::out_of_range);
  const LinkSubscribe good{.mask = 1, .rate_Hz = 1.0F, .lifetime_s = 1.0F};
  for (std::uint8_t id = 10; id < 14; ++id) {
    HostEndpoint host({.id = id});
    EXPECT_EQ(refusal(host, good), LinkRefusal::none);
  }
  EXPECT_EQ(refusal(host_, good), LinkRefusal::too_many_subscribers);
  HostEndpoint tenth({.id = 10});
  EXPECT_EQ(refusal(tenth, {.mask = 0}), LinkRefusal::none);
  EXPECT_EQ(refusal(host_, good), LinkRefusal::none);
}

TEST(JointEndpoint, RefusesTelemetryThatItsLineDoesNotCarryWithTheSum) {
  LinkedJoint line({.line_B_s = serial_B_s(115200)});
  HostEndpoint host({.id = 200});
  HostEndpoint other({.id = 201});
  const LinkSubscribe half{.mask = 0b111, .rate_Hz = 200.0F, .lifetime_s = 1.0F};
  EXPECT_EQ(line.ask<LinkSubscription>(host, half)->refusal, LinkRefusal::none);
  const auto reply = line.ask<LinkSubscription>(other, half);
  EXPECT_EQ(reply->refusal, LinkRefusal::line_too_slow);
  EXPECT_NEAR(reply->available_B_s, 0.9 * 11520.0, 1.0);
  EXPECT_NEAR(reply->asked_B_s, 2 * 200 * telemetry_frame_bytes(3), 1.0);
  line.tick(5);
  EXPECT_FALSE(line.received<LinkTelemetry>(other));
}

TEST(JointEndpoint, CountsFramesThatTheLineDoesNotTake) {
  LinkedJoint line;
  HostEndpoint host({.id = 200});
  line.sent.takes = false;
  EXPECT_FALSE(line.ask<LinkPong>(host, LinkPing{}));
  EXPECT_EQ(line.endpoint.counts().not_sent, 1U);
}

TEST_F(AJointOnALine, TakesAModelInPartsAndUsesItOnceItIsComplete) {
  std::string file(500, 'm');
  file[3] = '\x7E';
  const std::uint8_t* bytes = reinterpret_cast<const std::uint8_t*>(file.data());
  const auto crc = static_cast<std::uint32_t>(crc32_z(0, bytes, file.size()));
  const LinkUploadBegin begin{.size = 500, .crc = crc, .actuator = "dfki-50"};
  const auto chunk = [&](std::uint32_t offset, std::size_t size) {
    line_.ping(host_);
    return line_
        .ask<LinkUpload>(host_, LinkUploadChunk{.offset = offset, .data = {bytes + offset, size}})
        ->refusal;
  };
  const auto ask = [&](const auto& message) {
    line_.ping(host_);
    return *line_.ask<LinkUpload>(host_, message);
  };
  EXPECT_EQ(ask(LinkUploadBegin{.size = 500, .crc = crc, .actuator = "dfki-28"}).refusal,
            LinkRefusal::upload_rejected);
  EXPECT_EQ(ask(LinkUploadBegin{.size = 2000, .crc = crc, .actuator = "dfki-50"}).state,
            LinkUploadState::rejected);
  EXPECT_EQ(chunk(0, 100), LinkRefusal::upload_out_of_order);
  EXPECT_EQ(ask(begin).state, LinkUploadState::receiving);
  EXPECT_EQ(chunk(0, 200), LinkRefusal::none);
  EXPECT_EQ(chunk(0, 200), LinkRefusal::upload_out_of_order);
  EXPECT_EQ(ask(LinkUploadCommit{.crc = crc}).refusal, LinkRefusal::upload_out_of_order);
  EXPECT_EQ(chunk(200, 200), LinkRefusal::none);
  EXPECT_EQ(chunk(400, 100), LinkRefusal::none);
  EXPECT_EQ(ask(LinkUploadCommit{.crc = crc}).state, LinkUploadState::committed);
  EXPECT_EQ(line_.joint.model, file);
  EXPECT_EQ(ask(LinkUploadCommit{.crc = crc}).refusal, LinkRefusal::upload_out_of_order);
  EXPECT_EQ(ask(LinkUploadBegin{.size = 200, .crc = crc, .actuator = "dfki-50"}).refusal,
            LinkRefusal::none);
  EXPECT_EQ(chunk(0, 200), LinkRefusal::none);
  EXPECT_EQ(ask(LinkUploadCommit{.crc = crc}).refusal, LinkRefusal::upload_rejected)
      << "another file";
  EXPECT_EQ(ask(begin).refusal, LinkRefusal::none);
  EXPECT_EQ(chunk(0, 200), LinkRefusal::none);
  EXPECT_EQ(chunk(200, 200), LinkRefusal::none);
  EXPECT_EQ(chunk(400, 0), LinkRefusal::upload_out_of_order);
  file.resize(700, 'n');
  bytes = reinterpret_cast<const std::uint8_t*>(file.data());
  EXPECT_EQ(chunk(400, 101), LinkRefusal::upload_out_of_order) << "more than was announced";
  EXPECT_EQ(chunk(400, 100), LinkRefusal::none);
  EXPECT_EQ(ask(LinkUploadCommit{.crc = crc + 1}).state, LinkUploadState::rejected);
  EXPECT_EQ(ask(LinkUploadAbort{}).state, LinkUploadState::idle);
}

TEST_F(AJointOnALine, SetsZerosAndRefusesFaultsThatItCannotInject) {
  EXPECT_EQ(line_.command(host_, LinkZero{.channel = 1, .value = 0.25}), LinkRefusal::none);
  EXPECT_EQ(line_.joint.zeros[1], 0.25);
  EXPECT_EQ(line_.command(host_, LinkZero{.channel = 3}), LinkRefusal::out_of_range);
  EXPECT_EQ(line_.command(host_, LinkInjectFault{.fault = "frozen"}), LinkRefusal::not_supported);
  EXPECT_EQ(line_.command(host_, LinkModeChange{.mode = JointMode::impedance}), LinkRefusal::none);
  EXPECT_EQ(line_.joint.mode, JointMode::impedance);
  enable();
  EXPECT_EQ(line_.command(host_, LinkZero{.channel = 1}), LinkRefusal::only_when_disabled);
}

TEST(JointEndpoint, RefusesImpossibleSettings) {
  const auto message = [](const JointEndpoint::Settings& settings) {
    return test::error_message([&] { LinkedJoint line(settings); });
  };
  EXPECT_THAT(message({.id = 0}), HasSubstr("joint endpoint: expected an id of 1 to 254, found 0"));
  EXPECT_THAT(message({.watchdog_s = 0.0}), HasSubstr("watchdog_s"));
  EXPECT_THAT(message({.tick_rate_Hz = -1.0}), HasSubstr("the rate of the ticks"));
  EXPECT_THAT(test::error_message([] { HostEndpoint host({.id = 3, .joint = 3}); }),
              HasSubstr("an id that is not that of the joint, found 3 for both"));
}

TEST_F(AJointOnALine, ReportsLaterWhetherItUsesWhatItHasToCheck) {
  const std::string file(100, 'm');
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(file.data());
  const auto crc = static_cast<std::uint32_t>(crc32_z(0, bytes, file.size()));
  const auto ask = [&](const auto& message) {
    line_.ping(host_);
    return *line_.ask<LinkUpload>(host_, message);
  };
  for (const LinkRefusal result : {LinkRefusal::none, LinkRefusal::upload_rejected}) {
    line_.joint.upload_result.reset();
    ASSERT_EQ(ask(LinkUploadBegin{.size = 100, .crc = crc, .actuator = "dfki-50"}).state,
              LinkUploadState::receiving);
    EXPECT_EQ(ask(LinkUploadChunk{.offset = 0, .data = {bytes, 100}}).state,
              LinkUploadState::complete);
    const LinkUpload checked = ask(LinkUploadCommit{.crc = crc});
    EXPECT_EQ(checked.state, LinkUploadState::complete);
    EXPECT_EQ(checked.refusal, LinkRefusal::none);
    for (const LinkRefusal refusal :
         {ask(LinkUploadBegin{.size = 100, .crc = crc, .actuator = "dfki-50"}).refusal,
          ask(LinkUploadCommit{.crc = crc}).refusal, ask(LinkUploadAbort{}).refusal})
      EXPECT_EQ(refusal, LinkRefusal::not_in_this_state) << "the joint reads the space";
    line_.tick(3);
    EXPECT_FALSE(line_.received<LinkUpload>(host_));
    line_.joint.upload_result = result;
    line_.tick();
    const auto reply = line_.received<LinkUpload>(host_);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->refusal, result);
    EXPECT_EQ(reply->state,
              result == LinkRefusal::none ? LinkUploadState::committed : LinkUploadState::rejected);
    line_.tick();
    EXPECT_FALSE(line_.received<LinkUpload>(host_)) << "once";
  }
}

TEST_F(AJointOnALine, StopsWithItsArm) {
  line_.joint.stopped_by = LinkStateReason::joint_fault;
  line_.tick();
  EXPECT_EQ(line_.endpoint.drive().state(), LinkDriveState::ready) << "it was not enabled";
  line_.joint.stopped_by = LinkStateReason::none;
  enable();
  line_.joint.stopped_by = LinkStateReason::joint_fault;
  line_.tick();
  EXPECT_EQ(line_.endpoint.drive().state(), LinkDriveState::stop);
  const auto state = line_.received<LinkState>(host_);
  ASSERT_TRUE(state);
  EXPECT_EQ(state->reason, LinkStateReason::joint_fault);
  EXPECT_THAT(line_.joint.stops, IsEmpty()) << "it stops by itself";
}

}  // namespace
}  // namespace torsio
