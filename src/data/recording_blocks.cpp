#include "torsio/data/recording_blocks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "data/byte_source.hpp"
#include "data/names.hpp"
#include "files/whole_file.hpp"
#include "realtime/block_format.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{4} << 30;
constexpr std::size_t kMaxValues = std::size_t{256} << 20;  ///< as in a CSV file

/// Sealed blocks one after the other, up to the first that is not whole.
class SealedBlocks {
 public:
  explicit SealedBlocks(std::span<const std::byte> bytes) : left_(bytes) { find(); }

  [[nodiscard]] bool at_end() const noexcept { return !is_whole_; }
  [[nodiscard]] BlockKind kind() const noexcept { return seal_.kind; }
  [[nodiscard]] std::span<const std::byte> payload() const noexcept {
    return left_.subspan(kSealBytes, seal_.payload_bytes);
  }
  [[nodiscard]] std::size_t bytes_left() const noexcept { return left_.size(); }
  void next() {
    left_ = left_.subspan(kSealBytes + seal_.payload_bytes);
    find();
  }

 private:
  void find() {
    const auto found = read_seal(left_);
    is_whole_ = found && left_.size() - kSealBytes >= found->payload_bytes;
    if (!is_whole_) return;
    seal_ = *found;
    is_whole_ = is_whole(seal_, payload());
  }

  std::span<const std::byte> left_;
  Seal seal_;
  bool is_whole_ = false;
};

RecordingHeader header_of(SealedBlocks& blocks, const std::string& name) {
  if (blocks.at_end() || blocks.kind() != BlockKind::header)
    throw Error(
        {.place = name,
         .expected = "a recorder's file, which begins with a sealed header",
         .found = blocks.bytes_left() == 0 ? "an empty file" : "something else, or a torn header"});
  auto header = read_header(blocks.payload());
  if (!header)
    throw Error({.place = name,
                 .problem = "the header is of a format that this release does not read",
                 .advice = "Read it with the release of torsio that recorded it."});
  blocks.next();
  return std::move(*header);
}

[[noreturn]] void refuse_block(const std::string& name, std::size_t block) {
  throw Error({.place = fmt::format("{}: block {}", name, block),
               .problem = "it is sealed, and contradicts the header or the blocks before",
               .advice = "No recorder of torsio writes that: the file was put together."});
}

/// Ticks without a frame become NaN.
Recording recording_of(const RecordingHeader& header, const FrameBlock& frames,
                       const std::string& name) {
  const bool is_empty = frames.ticks.empty();
  const std::int64_t first = is_empty ? 0 : frames.ticks.front();
  // Unsigned: the distance of two ticks may exceed the range of a signed number.
  const std::uint64_t last_row = is_empty ? 0
                                          : static_cast<std::uint64_t>(frames.ticks.back()) -
                                                static_cast<std::uint64_t>(first);
  const std::size_t channels = header.channels.size();
  if (last_row >= kMaxValues / channels)
    throw Error({.place = name,
                 .expected = fmt::format("at most {} values", kMaxValues),
                 .found = fmt::format("{} channels from tick {} to {}", channels, first,
                                      frames.ticks.back())});
  const std::size_t rows = is_empty ? 0 : static_cast<std::size_t>(last_row) + 1;
  Recording recording(file_stem(name), 1.0 / header.period_s,
                      static_cast<double>(first) * header.period_s);
  for (std::size_t column = 0; column < channels; ++column) {
    Channel channel{.name = header.channels[column],
                    .values = std::vector(rows, std::numeric_limits<double>::quiet_NaN())};
    for (std::size_t frame = 0; frame < frames.ticks.size(); ++frame)
      channel.values[static_cast<std::size_t>(frames.ticks[frame] - first)] =
          frames.values[frame * channels + column];
    recording.add(std::move(channel));
  }
  return recording;
}

std::string sha256_of(std::span<const std::byte> bytes, const std::string& name) {
  const auto source =
      bytes_in_memory({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name);
  std::vector<char> buffer(std::size_t{1} << 16);
  while (source->read(buffer.data(), buffer.size()) > 0) {
  }
  return source->sha256();
}

}  // namespace

RecordingBlocks parse_recording_blocks(std::span<const std::byte> bytes, const std::string& name) {
  SealedBlocks sealed(bytes);
  const RecordingHeader header = header_of(sealed, name);
  FrameBlock frames;
  std::size_t blocks = 0;
  bool was_closed = false;
  for (; !sealed.at_end(); sealed.next()) {
    const std::uint64_t dropped_before = frames.dropped;
    const auto end = sealed.kind() == BlockKind::end ? read_end(sealed.payload())
                                                     : std::optional<RecordingEnd>{};
    if (end) frames.dropped = end->dropped;
    const bool is_sound =
        !was_closed && (end ? end->frames == frames.ticks.size()
                            : sealed.kind() == BlockKind::frames &&
                                  read_frames(sealed.payload(), header.channels.size(), frames));
    if (!is_sound || frames.dropped < dropped_before) refuse_block(name, blocks + 1);
    was_closed = end.has_value();
    if (!end) ++blocks;
  }
  if (std::ranges::adjacent_find(frames.ticks, std::ranges::greater_equal{}) != frames.ticks.end())
    throw Error({.place = name, .problem = "its ticks do not increase"});
  RecordingBlocks result{.recording = recording_of(header, frames, name),
                         .frames = frames.ticks.size(),
                         .blocks = blocks,
                         .dropped = frames.dropped,
                         .torn_bytes = sealed.bytes_left(),
                         .was_closed = was_closed};
  result.recording.source = {.file = name, .sha256 = sha256_of(bytes, name)};
  return result;
}

RecordingBlocks read_recording_blocks(const std::string& path) {
  return parse_recording_blocks(read_whole_file(path, kMaxFileBytes), path);
}

}  // namespace torsio
