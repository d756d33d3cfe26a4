#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "identify/drive/known_servo.hpp"
#include "identify/drive/servo_recordings.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {
namespace {

using test::error_message;
using ::testing::Contains;
using ::testing::Each;
using ::testing::Field;
using ::testing::HasSubstr;
using testing::known_servo;
using ::testing::Not;
using testing::servo_recording;

TEST(AdviseDrive, RefusesAnEmptyList) {
  EXPECT_THAT(error_message([] { (void)advise_drive(known_servo(), {}); }),
              HasSubstr("expected recordings, found none"));
}

TEST(AdviseDrive, NamesParametersOfWhichTheDriveHasNoRow) {
  DriveIdentification drive = known_servo();
  const std::vector<Recording> recordings{servo_recording({}, 200.0, 0.7, 0.3, false, 1)};
  const std::vector<DriveAdvice> without = advise_drive(drive, recordings);
  ASSERT_EQ(without.size(), 3U);
  EXPECT_THAT(without, Each(Field(&DriveAdvice::standard_error, ::testing::IsNan())));
  // A row of another parameter at the first place changes no name.
  const DriveParameter named = without.front().parameter;
  drive.parameters = {{.parameter = DriveParameter::stall_torque, .standard_error = 0.1},
                      {.parameter = named, .standard_error = 0.5}};
  const std::vector<DriveAdvice> with = advise_drive(drive, recordings);
  for (std::size_t k = 0; k < with.size(); ++k) {
    EXPECT_EQ(with[k].parameter, without[k].parameter);
  }
  EXPECT_EQ(with.front().standard_error, 0.5);
}

/// Every n-th sample of the channels.
Recording thinned(const Recording& from, std::size_t n) {
  Recording recording(from.name(), from.sample_rate_Hz() / static_cast<double>(n));
  for (Channel channel : from.channels()) {
    std::vector<double> kept;
    for (std::size_t k = 0; k < channel.values.size(); k += n) kept.push_back(channel.values[k]);
    channel.values = std::move(kept);
    recording.add(std::move(channel));
  }
  return recording;
}

TEST(AdviseDrive, ProposesAReleaseOfAsManySamplesAsARecordingNeeds) {
  const Recording slow = thinned(servo_recording({}, 200.0, 0.7, 0.1, false, 1, 10.0), 40);
  ASSERT_EQ(slow.sample_rate_Hz(), 5.0);
  EXPECT_THAT(advise_drive(known_servo(), {slow}),
              Contains(Field(&DriveAdvice::recording, HasSubstr("power off, 4 s"))));
}

TEST(AdviseDrive, ProposesAReleaseThatIsLongerThanTheRecording) {
  const Recording recording = servo_recording({}, 200.0, 0.7, 0.8, false, 1, 1.0);
  EXPECT_THAT(advise_drive(known_servo(), {recording}),
              Contains(Field(&DriveAdvice::recording, HasSubstr("power off, 3 s"))));
}

TEST(AdviseDrive, ProposesNoReleaseWhereThereIsAMotionWithoutPower) {
  const std::vector<Recording> recordings{servo_recording({}, 200.0, 0.7, 0.8, true, 1)};
  EXPECT_THAT(advise_drive(known_servo(), recordings),
              Each(Field(&DriveAdvice::recording, Not(HasSubstr("released")))));
}

}  // namespace
}  // namespace torsio
