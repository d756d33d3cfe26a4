#include "realtime/block_format.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>
#include <type_traits>

namespace torsio {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the blocks are written in the machine's byte order");

constexpr std::string_view kMagic = "TORSIOB1";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kKindAt = kMagic.size();
constexpr std::size_t kCrcAt = kKindAt + 2 * sizeof(std::uint32_t);
static_assert(kCrcAt + sizeof(std::uint32_t) == kSealBytes);

std::uint32_t crc_of(std::span<const std::byte> kind_and_size, std::span<const std::byte> payload) {
  const auto add = [](uLong crc, std::span<const std::byte> bytes) {
    return crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  };
  return static_cast<std::uint32_t>(add(add(0, kind_and_size), payload));
}

/// Builds a block after the space for its seal.
class BlockBuilder {
 public:
  explicit BlockBuilder(std::vector<std::byte>& bytes) : bytes_(bytes) {
    bytes_.assign(kSealBytes, std::byte{});
  }

  template <class T>
    requires std::is_arithmetic_v<T>
  void add(T value) {
    add(std::as_bytes(std::span(&value, 1)));
  }
  void add(std::span<const std::byte> more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
  }

  void seal_as(BlockKind kind) {
    const auto size = static_cast<std::uint32_t>(bytes_.size() - kSealBytes);
    std::memcpy(bytes_.data(), kMagic.data(), kMagic.size());
    std::memcpy(bytes_.data() + kKindAt, &kind, sizeof(kind));
    std::memcpy(bytes_.data() + kKindAt + sizeof(kind), &size, sizeof(size));
    const std::span<const std::byte> all = bytes_;
    const std::uint32_t crc =
        crc_of(all.subspan(kKindAt, kCrcAt - kKindAt), all.subspan(kSealBytes));
    std::memcpy(bytes_.data() + kCrcAt, &crc, sizeof(crc));
  }

 private:
  std::vector<std::byte>& bytes_;
};

/// Takes a payload apart; once it is too short, it stays so.
class PayloadReader {
 public:
  explicit PayloadReader(std::span<const std::byte> bytes) : left_(bytes) {}

  template <class T>
  T take() {
    T value{};
    take_into(std::span(&value, 1));
    return value;
  }
  template <class T>
  void take_into(std::span<T> values) {
    const std::span<const std::byte> bytes = take_bytes(values.size_bytes());
    if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  }
  std::span<const std::byte> take_bytes(std::size_t count) {
    is_short_ = is_short_ || count > left_.size();
    if (is_short_) return {};
    const auto taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }
  [[nodiscard]] std::size_t left() const noexcept { return left_.size(); }
  [[nodiscard]] bool is_used_up() const noexcept { return !is_short_ && left_.empty(); }

 private:
  std::span<const std::byte> left_;
  bool is_short_ = false;
};

}  // namespace

void seal(const RecordingHeader& header, std::vector<std::byte>& bytes) {
  BlockBuilder builder(bytes);
  builder.add(kVersion);
  builder.add(static_cast<std::uint32_t>(header.channels.size()));
  builder.add(header.period_s);
  for (const std::string& channel : header.channels) {
    builder.add(static_cast<std::uint32_t>(channel.size()));
    builder.add(std::as_bytes(std::span(channel)));
  }
  builder.seal_as(BlockKind::header);
}

void seal(const FrameBlock& block, std::size_t channels, std::vector<std::byte>& bytes) {
  BlockBuilder builder(bytes);
  builder.add(block.dropped);
  builder.add(static_cast<std::uint32_t>(block.ticks.size()));
  builder.add(static_cast<std::uint32_t>(channels));
  builder.add(std::as_bytes(std::span(block.ticks)));
  builder.add(std::as_bytes(std::span(block.values)));
  builder.seal_as(BlockKind::frames);
}

void seal(const RecordingEnd& end, std::vector<std::byte>& bytes) {
  BlockBuilder builder(bytes);
  builder.add(end.dropped);
  builder.add(end.frames);
  builder.seal_as(BlockKind::end);
}

std::optional<Seal> read_seal(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < kSealBytes || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
    return std::nullopt;
  std::array<std::uint32_t, 3> words{};
  std::memcpy(words.data(), bytes.data() + kKindAt, sizeof(words));
  const auto [kind, size, crc] = words;
  if (kind < static_cast<std::uint32_t>(BlockKind::header) ||
      kind > static_cast<std::uint32_t>(BlockKind::end) || size > kMaxPayloadBytes)
    return std::nullopt;
  return Seal{.kind = static_cast<BlockKind>(kind), .payload_bytes = size, .crc = crc};
}

bool is_whole(const Seal& seal, std::span<const std::byte> payload) noexcept {
  const std::array<std::uint32_t, 2> kind_and_size{static_cast<std::uint32_t>(seal.kind),
                                                   static_cast<std::uint32_t>(seal.payload_bytes)};
  return payload.size() == seal.payload_bytes &&
         crc_of(std::as_bytes(std::span(kind_and_size)), payload) == seal.crc;
}

std::optional<RecordingHeader> read_header(std::span<const std::byte> payload) {
  PayloadReader reader(payload);
  if (reader.take<std::uint32_t>() != kVersion) return std::nullopt;
  const auto channels = reader.take<std::uint32_t>();
  RecordingHeader header{.channels = {}, .period_s = reader.take<double>()};
  if (channels == 0 || channels > kMaxChannels) return std::nullopt;
  for (std::uint32_t channel = 0; channel < channels; ++channel) {
    const auto name = reader.take_bytes(reader.take<std::uint32_t>());
    header.channels.emplace_back(reinterpret_cast<const char*>(name.data()), name.size());
  }
  const bool is_sane =
      reader.is_used_up() && std::isfinite(header.period_s) && header.period_s > 0.0;
  return is_sane ? std::optional(std::move(header)) : std::nullopt;
}

std::optional<RecordingEnd> read_end(std::span<const std::byte> payload) {
  PayloadReader reader(payload);
  const RecordingEnd end{.dropped = reader.take<std::uint64_t>(),
                         .frames = reader.take<std::uint64_t>()};
  return reader.is_used_up() ? std::optional(end) : std::nullopt;
}

bool read_frames(std::span<const std::byte> payload, std::size_t channels, FrameBlock& block) {
  PayloadReader reader(payload);
  const auto dropped = reader.take<std::uint64_t>();
  const std::size_t frames = reader.take<std::uint32_t>();
  const std::size_t frame_bytes = sizeof(std::int64_t) + channels * sizeof(double);
  if (reader.take<std::uint32_t>() != channels || reader.left() != frames * frame_bytes)
    return false;
  const std::size_t ticks_before = block.ticks.size();
  const std::size_t values_before = block.values.size();
  block.ticks.resize(ticks_before + frames);
  block.values.resize(values_before + frames * channels);
  reader.take_into(std::span(block.ticks).subspan(ticks_before));
  reader.take_into(std::span(block.values).subspan(values_before));
  block.dropped = dropped;
  return reader.is_used_up();
}

}  // namespace torsio
