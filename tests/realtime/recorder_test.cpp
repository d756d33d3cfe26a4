#include "torsio/realtime/recorder.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <limits>
#include <random>
#include <span>
#include <thread>
#include <vector>

#include "files/whole_file.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/recording_blocks.hpp"

namespace torsio {
namespace {

using namespace std::chrono_literals;
using test::error_message;

RecorderOptions options_of(std::size_t ring_frames = 4096, std::size_t block_frames = 16) {
  return {.channels = {"joint_angle_rad", "torque_Nm"},
          .period_s = 1e-3,
          .ring_frames = ring_frames,
          .block_frames = block_frames,
          .seal_after_s = 0.001,
          .sync_after_s = 0.0};
}

/// The values of the frame of that tick, which a reader can check.
std::array<double, 2> frame_of(std::int64_t tick) {
  const auto number = static_cast<double>(tick);
  return {std::sin(number), -3.0 * number};
}

/// Each frame that is there is that of its tick; every tick that is not was dropped.
void expect_only_counted_gaps(const RecordingBlocks& blocks) {
  const auto& angle = blocks.recording.channel("joint_angle_rad").values;
  const auto& torque = blocks.recording.channel("torque_Nm").values;
  std::size_t frames = 0;
  std::size_t wrong = 0;
  const auto first = std::llround(blocks.recording.time_s(0) * 1e3);
  for (std::size_t n = 0; n < blocks.recording.size(); ++n) {
    if (std::isnan(torque[n])) continue;
    ++frames;
    const auto expected = frame_of(first + static_cast<std::int64_t>(n));
    if (angle[n] != expected[0] || torque[n] != expected[1]) ++wrong;
  }
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(frames, blocks.frames);
  const std::uint64_t missing =
      static_cast<std::uint64_t>(first) + blocks.recording.size() - blocks.frames;
  // Frames may have been dropped after the last one in a file that was closed.
  if (blocks.was_closed) {
    EXPECT_GE(blocks.dropped, missing);
  } else {
    EXPECT_EQ(blocks.dropped, missing);
  }
}

TEST(Recorder, WhatWasPushedIsReadBackBitByBit) {
  const TemporaryFolder folder;
  Recorder recorder(folder.path("run.tsr"), options_of());
  constexpr std::int64_t kFrames = 1000;
  for (std::int64_t tick = 0; tick < kFrames; ++tick)
    EXPECT_TRUE(recorder.push(tick, frame_of(tick)));
  const RecorderReport report = recorder.close();
  EXPECT_EQ(report.frames, 1000U);
  EXPECT_EQ(report.dropped, 0U);
  EXPECT_EQ(report.trouble, "");
  const RecordingBlocks blocks = read_recording_blocks(folder.path("run.tsr"));
  EXPECT_TRUE(blocks.was_closed);
  EXPECT_EQ(blocks.torn_bytes, 0U);
  EXPECT_EQ(blocks.frames, 1000U);
  EXPECT_EQ(blocks.blocks, report.blocks);
  EXPECT_EQ(blocks.recording.size(), 1000U);
  EXPECT_EQ(blocks.recording.sample_rate_Hz(), 1000.0);
  EXPECT_EQ(blocks.recording.name(), "run");
  EXPECT_EQ(blocks.recording.source.sha256.size(), 64U);
  expect_only_counted_gaps(blocks);
}

TEST(Recorder, PeriodsThatTheLoopSkippedAreNotANumber) {
  const TemporaryFolder folder;
  Recorder recorder(folder.path("run.tsr"), options_of());
  EXPECT_TRUE(recorder.push(10, frame_of(10)));
  EXPECT_TRUE(recorder.push(13, std::array{std::numeric_limits<double>::infinity(), 1.0}));
  recorder.close();
  const RecordingBlocks blocks = read_recording_blocks(folder.path("run.tsr"));
  EXPECT_EQ(blocks.recording.size(), 4U);
  EXPECT_DOUBLE_EQ(blocks.recording.time_s(0), 0.010);
  EXPECT_TRUE(std::isnan(blocks.recording.channel("torque_Nm").values[1]));
  EXPECT_TRUE(std::isinf(blocks.recording.channel("joint_angle_rad").values[3]));
  EXPECT_EQ(blocks.dropped, 0U);
}

TEST(Recorder, AFullRingDropsAndCountsAndTheFileRecordsIt) {
  const TemporaryFolder folder;
  Recorder recorder(folder.path("run.tsr"), options_of(64));
  std::uint64_t refused = 0;
  constexpr std::int64_t kFrames = 50'000;
  for (std::int64_t tick = 0; tick < kFrames; ++tick) {
    if (!recorder.push(tick, frame_of(tick))) ++refused;
    if (tick % 10'000 == 0) std::this_thread::sleep_for(10ms);
  }
  EXPECT_EQ(recorder.dropped(), refused);
  const RecorderReport report = recorder.close();
  EXPECT_GT(report.dropped, 0U);
  EXPECT_EQ(report.dropped, refused);
  EXPECT_EQ(report.frames + report.dropped, 50'000U);
  const RecordingBlocks blocks = read_recording_blocks(folder.path("run.tsr"));
  EXPECT_EQ(blocks.dropped, refused);
  EXPECT_EQ(blocks.frames, report.frames);
  expect_only_counted_gaps(blocks);
}

TEST(Recorder, FramesThatAreNoneAreDropped) {
  const TemporaryFolder folder;
  Recorder recorder(folder.path("run.tsr"), options_of());
  EXPECT_TRUE(recorder.push(5, frame_of(5)));
  EXPECT_FALSE(recorder.push(5, frame_of(5)));
  EXPECT_FALSE(recorder.push(4, frame_of(4)));
  EXPECT_FALSE(recorder.push(6, std::array{1.0}));
  EXPECT_TRUE(recorder.push(6, frame_of(6)));
  EXPECT_EQ(recorder.close().dropped, 3U);
}

/// Records more than the disk takes, and expects what it took to be sound.
void expect_a_full_disk_costs_frames_only(const std::string& path) {
  constexpr std::int64_t kFrames = 20'000;  // 480 KB
  Recorder recorder(path, options_of(1 << 15));
  for (std::int64_t tick = 0; tick < kFrames; ++tick)
    EXPECT_TRUE(recorder.push(tick, frame_of(tick)));
  const RecorderReport report = recorder.close();
  EXPECT_GT(report.frames, 1000U);
  EXPECT_GT(report.dropped, 1000U);
  EXPECT_EQ(report.frames + report.dropped, 20'000U);
  EXPECT_NE(report.trouble, "");
  const RecordingBlocks blocks = read_recording_blocks(path);
  EXPECT_EQ(blocks.frames, report.frames);
  EXPECT_EQ(blocks.torn_bytes, 0U);
  expect_only_counted_gaps(blocks);
}

TEST(Recorder, AFileThatMayNotGrowCostsFramesOnly) {
  const TemporaryFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = 64 << 10;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  expect_a_full_disk_costs_frames_only(folder.path("run.tsr"));
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
}

TEST(Recorder, AFullDiskCostsFramesOnly) {
  const TemporaryFolder folder;
  const std::string disk = folder.path("disk");
  std::filesystem::create_directory(disk);
  // A view of the file systems that ends with this process, and the disk with it.
  if (unshare(CLONE_NEWNS) != 0 ||
      mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
      mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0)
    GTEST_SKIP() << "only root may mount a small disk";
  expect_a_full_disk_costs_frames_only(disk + "/run.tsr");
  umount2(disk.c_str(), MNT_DETACH);
}

/// Records until it is killed.
[[noreturn]] void record_for_ever(const std::string& path, std::size_t ring_frames) {
  Recorder recorder(path, options_of(ring_frames));
  for (std::int64_t tick = 0;; ++tick) {
    (void)recorder.push(tick, frame_of(tick));
    if (tick % 200 == 0) std::this_thread::sleep_for(1ms);
  }
}

TEST(Recorder, EveryBlockThatWasSealedOutlivesAKillAtAnyMoment) {
  constexpr int kKills = 36;
  std::mt19937 random(20261121);
  std::size_t with_frames = 0;
  for (int kill_number = 0; kill_number < kKills; ++kill_number) {
    const TemporaryFolder folder;
    const std::string path = folder.path("run.tsr");
    const std::size_t ring_frames = random() % 2 == 0 ? 64 : 4096;
    const auto delay = std::chrono::microseconds(random() % 40'000);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) record_for_ever(path, ring_frames);
    while (!std::filesystem::exists(path) || std::filesystem::file_size(path) == 0)
      std::this_thread::sleep_for(100us);
    std::this_thread::sleep_for(delay);
    ASSERT_EQ(kill(child, SIGKILL), 0);
    ASSERT_EQ(waitpid(child, nullptr, 0), child);

    SCOPED_TRACE(testing::Message() << "kill " << kill_number);
    const RecordingBlocks blocks = read_recording_blocks(path);
    EXPECT_FALSE(blocks.was_closed);
    if (blocks.frames == 0) continue;
    ++with_frames;
    expect_only_counted_gaps(blocks);
  }
  EXPECT_GT(with_frames, 12U);
}

/// A file of some blocks, and where each of them ends.
struct Written {
  std::vector<std::byte> bytes;
  std::vector<std::size_t> block_ends;  ///< the header's first
};

Written example_file(const TemporaryFolder& folder) {
  RecorderOptions options = options_of(4096, 4);
  options.seal_after_s = 3600.0;  // sealed by size alone, so that the result is deterministic
  Recorder recorder(folder.path("example.tsr"), options);
  for (std::int64_t tick = 0; tick < 16; ++tick) (void)recorder.push(tick, frame_of(tick));
  recorder.close();
  Written file{.bytes = read_whole_file(folder.path("example.tsr"), 1 << 20), .block_ends = {}};
  constexpr std::size_t kBlock = 20 + 16 + 4 * (8 + 16);
  constexpr std::size_t kEnd = 20 + 16;
  const std::size_t header = file.bytes.size() - 4 * kBlock - kEnd;
  for (std::size_t block = 0; block <= 4; ++block)
    file.block_ends.push_back(header + block * kBlock);
  return file;
}

TEST(RecordingBlocks, ATornEndIsLeftOutWhereverItIsTorn) {
  const TemporaryFolder folder;
  const Written file = example_file(folder);
  for (std::size_t size = 0; size < file.bytes.size(); ++size) {
    SCOPED_TRACE(testing::Message() << size << " bytes");
    const auto torn = std::span(file.bytes).first(size);
    if (size < file.block_ends.front()) {
      EXPECT_THROW((void)parse_recording_blocks(torn, "torn.tsr"), Error);
      continue;
    }
    std::size_t whole = 0;
    while (whole + 1 < file.block_ends.size() && file.block_ends[whole + 1] <= size) ++whole;
    const RecordingBlocks blocks = parse_recording_blocks(torn, "torn.tsr");
    EXPECT_EQ(blocks.blocks, whole);
    EXPECT_EQ(blocks.frames, 4 * whole);
    EXPECT_EQ(blocks.torn_bytes, size - file.block_ends[whole]);
    EXPECT_FALSE(blocks.was_closed);
    if (whole > 0) expect_only_counted_gaps(blocks);
  }
}

TEST(RecordingBlocks, NoFlippedBitBecomesAValue) {
  const TemporaryFolder folder;
  const Written file = example_file(folder);
  EXPECT_TRUE(rc::check([&file] {
    std::vector<std::byte> bytes = file.bytes;
    const auto at = *rc::gen::inRange<std::size_t>(0, bytes.size());
    bytes[at] ^= std::byte{1} << *rc::gen::inRange(0, 8);
    if (at < file.block_ends.front()) {
      RC_ASSERT_THROWS_AS((void)parse_recording_blocks(bytes, "flipped.tsr"), Error);
      return;
    }
    const RecordingBlocks blocks = parse_recording_blocks(bytes, "flipped.tsr");
    RC_ASSERT(blocks.torn_bytes > 0U);
    RC_ASSERT(!blocks.was_closed);
    if (blocks.frames > 0) expect_only_counted_gaps(blocks);
  }));
}

TEST(RecordingBlocks, SealedNonsenseIsRefused) {
  const TemporaryFolder folder;
  const Written file = example_file(folder);
  const std::span<const std::byte> all = file.bytes;
  const auto block = [&](std::size_t number) {
    return all.subspan(file.block_ends[number],
                       file.block_ends[number + 1] - file.block_ends[number]);
  };
  std::vector<std::byte> repeated(all.begin(), all.end());
  repeated.insert(repeated.end(), block(0).begin(), block(0).end());
  EXPECT_NE(error_message([&] { (void)parse_recording_blocks(repeated, "a.tsr"); }).find("block 5"),
            std::string::npos);
  std::vector<std::byte> backward(all.begin(),
                                  all.begin() + static_cast<std::ptrdiff_t>(file.block_ends[2]));
  backward.insert(backward.end(), block(0).begin(), block(0).end());
  EXPECT_NE(error_message([&] {
              (void)parse_recording_blocks(backward, "a.tsr");
            }).find("do not increase"),
            std::string::npos);
  const std::vector<std::byte> text(100, std::byte{'a'});
  EXPECT_NE(error_message([&] { (void)parse_recording_blocks(text, "a.csv"); }).find("a.csv"),
            std::string::npos);
}

TEST(Recorder, RefusesBadOptionsAndFilesThatExist) {
  const TemporaryFolder folder;
  const auto refused = [&](void (*spoil)(RecorderOptions&)) {
    RecorderOptions options = options_of();
    spoil(options);
    EXPECT_THROW(Recorder(folder.path("bad.tsr"), options), UsageError);
  };
  refused([](RecorderOptions& options) { options.channels.clear(); });
  refused([](RecorderOptions& options) { options.channels = {"torque"}; });
  refused([](RecorderOptions& options) { options.channels = {"angle_deg"}; });
  refused([](RecorderOptions& options) { options.channels = {"a_rad", "a_rad"}; });
  refused([](RecorderOptions& options) { options.period_s = 0.0; });
  refused([](RecorderOptions& options) { options.ring_frames = 0; });
  refused([](RecorderOptions& options) { options.block_frames = std::size_t{1} << 30; });
  refused([](RecorderOptions& options) {
    options.seal_after_s = std::numeric_limits<double>::quiet_NaN();
  });
  refused([](RecorderOptions& options) { options.sync_after_s = -1.0; });
  EXPECT_EQ(folder.files(), 0U);
  folder.file("old.tsr", "old");
  EXPECT_THROW(Recorder(folder.path("old.tsr"), options_of()), Error);
  EXPECT_THROW(Recorder(folder.path("none/run.tsr"), options_of()), Error);
}

}  // namespace
}  // namespace torsio
