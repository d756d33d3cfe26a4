#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "torsio/data/recording.hpp"

namespace torsio {

/// The contents of a `Recorder`'s file.
struct RecordingBlocks {
  /// From the first tick to the last that is in the file, at time tick * period; a tick without a
  /// frame (dropped, or skipped by the loop) is NaN in every channel.
  Recording recording;
  std::size_t frames = 0;
  std::size_t blocks = 0;      ///< with frames
  std::uint64_t dropped = 0;   ///< dropped frames, up to the last one in the file
  std::size_t torn_bytes = 0;  ///< after the last sealed block: ignored
  bool was_closed = false;     ///< false: the process ended without closing the recorder
};

/// Reads every sealed block up to the first that is torn or damaged.
/// @throws Error if it is not a recorder's file, its header is damaged, or a sealed block
/// contradicts the header or the blocks before.
[[nodiscard]] RecordingBlocks read_recording_blocks(const std::string& path);

/// The same from bytes in memory; `name` is the file name in messages.
[[nodiscard]] RecordingBlocks parse_recording_blocks(std::span<const std::byte> bytes,
                                                     const std::string& name);

}  // namespace torsio
