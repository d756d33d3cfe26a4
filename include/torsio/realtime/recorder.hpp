#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "torsio/core/realtime.hpp"

namespace torsio {

struct RecorderOptions {
  std::vector<std::string> channels;  ///< names that end in their SI units: "torque_Nm"
  double period_s = 1e-3;             ///< between two ticks
  /// Capacity in memory while the disk is slow, rounded up to a power of two: 4 s at 1 kHz.
  std::size_t ring_frames = 4096;
  std::size_t block_frames = 256;  ///< a block is sealed when it has this many ...
  double seal_after_s =
      0.1;  ///< ... or, with fewer, after this time: the loss if the process is killed
  /// How often the file is synced: the loss after a power failure. 0: left to the operating system.
  double sync_after_s = 1.0;
};

/// Counters of a recorder.
struct RecorderReport {
  std::uint64_t frames = 0;   ///< in the file
  std::uint64_t dropped = 0;  ///< because the ring or the disk was full
  std::uint64_t blocks = 0;   ///< with frames
  std::string trouble = {};   ///< last error of the disk; empty: none
};

/// Writes a loop's frames into a file without ever blocking the loop.
///
/// `push` copies a frame into a lock-free ring; a thread of ordinary priority takes the frames out
/// and writes them as sealed blocks (docs/robot/realtime.md describes the format). A disk that is slow or
/// full costs frames, which are counted and marked in the file, never time of the loop. A file
/// whose process was killed contains every block that was sealed; `read_recording_blocks`
/// distinguishes them from an incomplete end.
class Recorder {
 public:
  /// @throws UsageError if the options are out of range or a channel has no SI unit; Error if the
  /// file exists already, or cannot be written.
  Recorder(const std::filesystem::path& path, const RecorderOptions& options);
  ~Recorder();  ///< as `close`
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Called by one thread. `tick`: the period (`Tick::index`), later than the one before.
  /// @returns false if the frame was dropped.
  bool push(std::int64_t tick, std::span<const double> values) noexcept TORSIO_REALTIME;
  /// Frames that were dropped because the ring or the disk was full; by any thread.
  [[nodiscard]] std::uint64_t dropped() const noexcept;

  /// Writes the remaining frames, seals the file and syncs it. Not at the same time as `push`.
  RecorderReport close();

 private:
  class Writer;
  std::unique_ptr<Writer> writer_;
};

}  // namespace torsio
