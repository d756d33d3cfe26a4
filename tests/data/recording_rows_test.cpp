#include "data/recording_rows.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "support/error_message.hpp"

namespace torsio {
namespace {

using Names = std::vector<std::string>;

Recording recording_of_three() {
  Recording recording("three", 100.0);
  recording.add({.name = "a_rad", .values = {1.0, 2.0, 3.0}});
  recording.add({.name = "b_rad", .values = {10.0, 20.0, 30.0}});
  recording.add({.name = "c_Nm", .values = {100.0, 200.0, 300.0}});
  return recording;
}

std::vector<double> row_of(RecordingRows& rows, std::size_t sample) {
  const auto row = rows.at(sample);
  return {row.begin(), row.end()};
}

TEST(RecordingRows, HaveTheChannelsInTheOrderOfTheirNames) {
  const Recording recording = recording_of_three();
  const Names names{"c_Nm", "a_rad"};
  RecordingRows rows(recording, names);
  EXPECT_EQ(row_of(rows, 0), (std::vector<double>{100.0, 1.0}));
  EXPECT_EQ(row_of(rows, 2), (std::vector<double>{300.0, 3.0}));
  EXPECT_EQ(rows.channels()[1]->name, "a_rad");
}

TEST(RecordingRows, TakeReplacedValuesAlsoAfterAMove) {
  const Recording recording = recording_of_three();
  const Names names{"a_rad", "b_rad"};
  RecordingRows rows(recording, names);
  rows.replace(1, {7.0, 8.0, 9.0});
  rows.replace(0, {4.0, 5.0, 6.0});
  RecordingRows moved = std::move(rows);
  EXPECT_EQ(row_of(moved, 1), (std::vector<double>{5.0, 8.0}));
}

TEST(RecordingRows, NameAChannelThatIsMissing) {
  const Recording recording = recording_of_three();
  const Names names{"a_rad", "c_N"};
  const std::string message = test::error_message([&] { RecordingRows(recording, names); });
  EXPECT_NE(message.find("three: there is no channel 'c_N'"), std::string::npos) << message;
}

}  // namespace
}  // namespace torsio
