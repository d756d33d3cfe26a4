#include "data/arrays/zip_archive.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "data/little_endian.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::uint32_t kMemberMark = 0x04034b50;
constexpr std::uint32_t kDirectoryMark = 0x02014b50;
constexpr std::uint32_t kEndMark = 0x06054b50;
constexpr std::uint32_t kEnd64Mark = 0x06064b50;
constexpr std::uint32_t kEnd64PlaceMark = 0x07064b50;
constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kEnd64PlaceBytes = 20;
constexpr std::size_t kEnd64Bytes = 56;
constexpr std::size_t kMemberBytes = 30;
constexpr std::uint64_t kBytesPerElement = 8;
constexpr std::uint32_t kIn64Bits = 0xFFFFFFFF;  // the size is in the extra field
constexpr std::uint16_t kExtra64 = 1;
constexpr std::uint16_t kStored = 0;
constexpr std::uint16_t kDeflated = 8;

std::uint32_t checksum(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

/// Unpacks up to `size` bytes. @returns false if it is damaged or, where `is_whole`, has another size
bool inflated(std::string_view packed, std::uint64_t size, bool is_whole, std::string& to) {
  constexpr std::size_t kBlock = std::size_t{1} << 16;
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) return false;
  int code = Z_OK;
  // One byte more than `size` shows that there are more.
  while (code == Z_OK && to.size() <= size) {
    const std::size_t taken = std::min<std::size_t>(packed.size(), kBlock);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = static_cast<uInt>(taken);
    const std::size_t before = to.size();
    to.resize(before + std::min<std::uint64_t>(kBlock, size + 1 - before));
    stream.next_out = reinterpret_cast<Bytef*>(to.data() + before);
    stream.avail_out = static_cast<uInt>(to.size() - before);
    code = inflate(&stream, Z_NO_FLUSH);
    to.resize(to.size() - stream.avail_out);
    packed.remove_prefix(taken - stream.avail_in);
    if (taken == 0 && to.size() == before) break;
  }
  inflateEnd(&stream);
  if (is_whole) return code == Z_STREAM_END && to.size() == size;
  to.resize(std::min<std::uint64_t>(to.size(), size));
  return code == Z_STREAM_END || code == Z_OK || code == Z_BUF_ERROR;
}

/// Reads the numbers of a header; `is_whole` is false once one was missing.
class HeaderReader {
 public:
  explicit HeaderReader(std::string_view bytes) : reader_(bytes) {}
  template <class Number>
  Number number() {
    const auto value = reader_.number<Number>();
    is_whole_ = is_whole_ && value;
    return value.value_or(Number{});
  }
  std::string_view bytes(std::size_t size) {
    const auto value = reader_.bytes(size);
    is_whole_ = is_whole_ && value;
    return value.value_or(std::string_view{});
  }
  void skip(std::size_t size) { static_cast<void>(bytes(size)); }
  [[nodiscard]] bool is_whole() const noexcept { return is_whole_; }
  [[nodiscard]] std::size_t left() const noexcept { return reader_.left(); }

 private:
  LittleEndianReader reader_;
  bool is_whole_ = true;
};

/// The 64-bit numbers of an extra field, in the order of those that do not fit.
void read_extra(std::string_view extra, ZipMember& member) {
  HeaderReader reader(extra);
  while (reader.left() > 0 && reader.is_whole()) {
    const auto kind = reader.number<std::uint16_t>();
    HeaderReader field(reader.bytes(reader.number<std::uint16_t>()));
    if (kind != kExtra64) continue;
    for (std::uint64_t* const size : {&member.bytes, &member.packed_bytes, &member.start})
      if (*size == kIn64Bits) *size = field.number<std::uint64_t>();
  }
}

struct Directory {
  std::uint64_t start = 0;
  std::uint64_t members = 0;
};

/// Where the archive's end places its directory.
std::optional<Directory> find_directory(const PlacedBytes& all) {
  constexpr std::size_t kMaxComment = 0xFFFF;
  constexpr std::uint64_t kMaxEnd = kEnd64PlaceBytes + kEndBytes + kMaxComment;
  const std::string bytes = all.at(all.size() - std::min(all.size(), kMaxEnd), kMaxEnd);
  std::string mark;
  LittleEndianWriter(mark).number(kEndMark);
  const std::size_t at = bytes.rfind(mark);
  if (at == std::string::npos || bytes.size() - at < kEndBytes) return std::nullopt;
  HeaderReader end(std::string_view(bytes).substr(at));
  end.skip(10);
  Directory found;
  found.members = end.number<std::uint16_t>();
  end.skip(4);
  found.start = end.number<std::uint32_t>();
  if (at < kEnd64PlaceBytes) return found;
  HeaderReader place(std::string_view(bytes).substr(at - kEnd64PlaceBytes));
  if (place.number<std::uint32_t>() != kEnd64PlaceMark) return found;
  place.skip(4);
  const auto start64 = place.number<std::uint64_t>();
  if (start64 > all.size()) return std::nullopt;
  const std::string bytes64 = all.at(start64, kEnd64Bytes);
  HeaderReader end64(bytes64);
  if (end64.number<std::uint32_t>() != kEnd64Mark) return std::nullopt;
  end64.skip(28);
  found.members = end64.number<std::uint64_t>();
  end64.skip(8);
  found.start = end64.number<std::uint64_t>();
  return end64.is_whole() ? std::optional(found) : std::nullopt;
}

}  // namespace

ZipArchive::ZipArchive(const PlacedBytes& bytes, ReadBudget& budget)
    : bytes_(bytes), budget_(budget) {
  budget.read_to(bytes.size());
  const auto directory = find_directory(bytes);
  if (!directory || directory->start > bytes.size())
    refuse("the directory at its end is missing or damaged");
  budget.require(bytes.size() - directory->start);
  const std::string entries = bytes.at(directory->start, bytes.size() - directory->start);
  HeaderReader reader(entries);
  for (std::uint64_t i = 0; i < directory->members; ++i) {
    ZipMember member;
    const auto mark = reader.number<std::uint32_t>();
    reader.skip(4);
    const auto flags = reader.number<std::uint16_t>();
    member.packing = reader.number<std::uint16_t>();
    reader.skip(4);
    member.checksum = reader.number<std::uint32_t>();
    member.packed_bytes = reader.number<std::uint32_t>();
    member.bytes = reader.number<std::uint32_t>();
    const auto name_size = reader.number<std::uint16_t>();
    const auto extra_size = reader.number<std::uint16_t>();
    const auto comment_size = reader.number<std::uint16_t>();
    reader.skip(8);
    member.start = reader.number<std::uint32_t>();
    member.name = escaped(reader.bytes(name_size));
    read_extra(reader.bytes(extra_size), member);
    reader.skip(comment_size);
    if (!reader.is_whole() || mark != kDirectoryMark) refuse("its directory is damaged");
    if ((flags & 1U) != 0) refuse("it is encrypted");
    budget.keep(sizeof(ZipMember) + member.name.size());
    members_.push_back(std::move(member));
  }
}

void ZipArchive::refuse(const std::string& problem) const {
  throw Error({.place = budget_.name(), .problem = problem, .expected = "a ZIP archive"});
}

/// Up to `size` bytes of a member as they are in the archive.
std::string ZipArchive::packed(const ZipMember& member, std::uint64_t size) const {
  if (member.start > bytes_.size()) refuse(member.name + " is beyond its end");
  const std::string head = bytes_.at(member.start, kMemberBytes);
  HeaderReader reader(head);
  const auto mark = reader.number<std::uint32_t>();
  reader.skip(22);
  const auto name_size = reader.number<std::uint16_t>();
  const auto extra_size = reader.number<std::uint16_t>();
  if (!reader.is_whole() || mark != kMemberMark) refuse(member.name + " is damaged");
  const std::uint64_t start = member.start + kMemberBytes + name_size + extra_size;
  if (start > bytes_.size() || member.packed_bytes > bytes_.size() - start)
    refuse(member.name + " ends too early");
  return bytes_.at(start, std::min(size, member.packed_bytes));
}

std::string ZipArchive::start(const ZipMember& member, std::uint64_t size) const {
  budget_.work(1 + size / kBytesPerElement);
  const std::string first = packed(member, size);
  std::string content;
  if (member.packing == kStored)
    content = first;
  else if (member.packing != kDeflated || !inflated(first, size, false, content))
    refuse(member.name + " cannot be unpacked");
  return content;
}

std::string ZipArchive::read(const ZipMember& member) const {
  budget_.require(member.bytes);
  budget_.work(member.bytes / kBytesPerElement);
  const std::string all = packed(member, member.packed_bytes);
  std::string content;
  if (member.packing == kStored && all.size() == member.bytes)
    content = all;
  else if (member.packing != kDeflated || !inflated(all, member.bytes, true, content))
    refuse(member.name + " cannot be unpacked");
  if (checksum(content) != member.checksum) refuse("the checksum of " + member.name + " is wrong");
  return content;
}

void ZipWriter::put(std::string_view bytes) {
  file_.write(std::as_bytes(std::span(bytes)));
  written_ += bytes.size();
}

namespace {

constexpr std::uint16_t kVersion20 = 20;
constexpr std::uint16_t kFirstDay = 0x21;  // 1980-01-01

/// What the header of a member and its entry in the directory share.
void put_common(LittleEndianWriter& writer, const ZipMember& member) {
  writer.number(kVersion20)
      .number(std::uint16_t{0})
      .number(kStored)
      .number(std::uint16_t{0})
      .number(kFirstDay)
      .number(member.checksum)
      .number(static_cast<std::uint32_t>(member.bytes))
      .number(static_cast<std::uint32_t>(member.bytes))
      .number(static_cast<std::uint16_t>(member.name.size()))
      .number(std::uint16_t{0});
}

}  // namespace

void ZipWriter::add(const std::string& name, std::string_view bytes) {
  constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
  constexpr std::uint64_t kRoom = std::uint64_t{1} << 20;  // for the directory
  if (written_ + bytes.size() + kRoom > kMax)
    throw Error({.problem = "an .npz file of more than 4 GiB",
                 .advice = "Write a CSV or MCAP file, or fewer samples."});
  const ZipMember member{.name = name,
                         .packing = kStored,
                         .checksum = checksum(bytes),
                         .packed_bytes = bytes.size(),
                         .bytes = bytes.size(),
                         .start = written_};
  std::string header;
  LittleEndianWriter writer(header);
  writer.number(kMemberMark);
  put_common(writer, member);
  writer.bytes(name);
  put(header);
  put(bytes);
  members_.push_back(member);
}

void ZipWriter::finish() {
  std::string directory;
  LittleEndianWriter writer(directory);
  for (const ZipMember& member : members_) {
    writer.number(kDirectoryMark).number(kVersion20);
    put_common(writer, member);
    writer.number(std::uint16_t{0})
        .number(std::uint16_t{0})
        .number(std::uint16_t{0})
        .number(std::uint32_t{0})
        .number(static_cast<std::uint32_t>(member.start))
        .bytes(member.name);
  }
  const auto size = static_cast<std::uint32_t>(directory.size());
  const auto count = static_cast<std::uint16_t>(members_.size());
  writer.number(kEndMark)
      .number(std::uint32_t{0})
      .number(count)
      .number(count)
      .number(size)
      .number(static_cast<std::uint32_t>(written_))
      .number(std::uint16_t{0});
  put(directory);
}

}  // namespace torsio
