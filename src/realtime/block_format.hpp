#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "realtime/frame_ring.hpp"

namespace torsio {

// The format of docs/robot/realtime.md, little-endian: a file is a sequence of sealed blocks, the first
// one a header, the last one an end unless the process was killed.
//
//     seal     8 bytes magic, u32 kind, u32 bytes of payload, u32 CRC-32 of kind, size and payload
//     header   u32 version, u32 channels, f64 period in s, the names, each after its u32 length
//     frames   u64 dropped, u32 frames, u32 channels, i64 tick each, f64 values row by row
//     end      u64 dropped, u64 frames in the file

inline constexpr std::size_t kSealBytes = 20;
inline constexpr std::size_t kMaxPayloadBytes = std::size_t{64} << 20;
inline constexpr std::size_t kMaxChannels = 1024;

enum class BlockKind : std::uint32_t { header = 1, frames = 2, end = 3 };

struct RecordingHeader {
  std::vector<std::string> channels;
  double period_s = 0.0;
};

struct RecordingEnd {
  std::uint64_t dropped = 0;
  std::uint64_t frames = 0;
};

/// The whole block, seal included, in `bytes`, whose memory is used again.
void seal(const RecordingHeader& header, std::vector<std::byte>& bytes);
void seal(const FrameBlock& block, std::size_t channels, std::vector<std::byte>& bytes);
void seal(const RecordingEnd& end, std::vector<std::byte>& bytes);

struct Seal {
  BlockKind kind = BlockKind::header;
  std::size_t payload_bytes = 0;
  std::uint32_t crc = 0;
};

/// Nothing if these bytes begin no block.
[[nodiscard]] std::optional<Seal> read_seal(std::span<const std::byte> bytes) noexcept;
[[nodiscard]] bool is_whole(const Seal& seal, std::span<const std::byte> payload) noexcept;

/// Nothing if the payload is complete but does not match its kind.
[[nodiscard]] std::optional<RecordingHeader> read_header(std::span<const std::byte> payload);
[[nodiscard]] std::optional<RecordingEnd> read_end(std::span<const std::byte> payload);
/// Appends to the block.
[[nodiscard]] bool read_frames(std::span<const std::byte> payload, std::size_t channels,
                               FrameBlock& block);

}  // namespace torsio
