#include "data/arrays/npz.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>

#include "core/report_progress.hpp"
#include "data/arrays/zip_archive.hpp"
#include "data/little_endian.hpp"
#include "data/names.hpp"
#include "data/written_columns.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::string_view kEnding = ".npy";
constexpr std::string_view kNumpyMark{"\x93NUMPY", 6};
constexpr std::size_t kBlockBytes = std::size_t{1} << 20;
/// The longest header that is read.
constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 16;

/// The header of an array: a Python dictionary as text.
struct ArrayHeader {
  std::string type;  ///< "<f8"
  bool is_by_columns = false;
  std::vector<std::size_t> shape;
};

/// The text after `'key':`, without leading blanks.
std::string_view value_of(std::string_view header, std::string_view key) {
  const std::size_t at = header.find(fmt::format("'{}':", key));
  if (at == std::string_view::npos) return {};
  header.remove_prefix(at + key.size() + 3);
  header.remove_prefix(std::min(header.find_first_not_of(' '), header.size()));
  return header;
}

std::optional<std::vector<std::size_t>> shape_of(std::string_view text) {
  std::vector<std::size_t> shape;
  if (!text.starts_with('(')) return std::nullopt;
  text.remove_prefix(1);
  while (!text.starts_with(')')) {
    std::size_t size = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), size);
    if (code != std::errc{}) return std::nullopt;
    shape.push_back(size);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    text.remove_prefix(std::min(text.find_first_not_of(", "), text.size()));
  }
  return shape;
}

/// Takes the header off the bytes of an array.
std::optional<ArrayHeader> take_header(std::string_view& bytes) {
  LittleEndianReader reader(bytes);
  const auto mark = reader.bytes(kNumpyMark.size());
  const auto major = reader.number<std::uint8_t>();
  const auto minor = reader.number<std::uint8_t>();
  if (!mark || *mark != kNumpyMark || !major || !minor) return std::nullopt;
  const auto text = *major == 1 ? reader.text<std::uint16_t>() : reader.text<std::uint32_t>();
  if (!text) return std::nullopt;
  ArrayHeader header;
  std::string_view type = value_of(*text, "descr");
  if (type.starts_with('\'')) {
    type.remove_prefix(1);
    header.type = type.substr(0, type.find('\''));
  }
  header.is_by_columns = value_of(*text, "fortran_order").starts_with("True");
  auto shape = shape_of(value_of(*text, "shape"));
  if (!shape) return std::nullopt;
  header.shape = std::move(*shape);
  bytes = reader.rest();
  return header;
}

using Convert = double (*)(const char*);

template <class Number>
double converted(const char* at) {
  Number value{};
  std::memcpy(&value, at, sizeof(value));
  return static_cast<double>(value);
}

struct NumberType {
  std::string_view name;
  std::size_t bytes;
  Convert convert;
};

constexpr std::array<NumberType, 11> kTypes{{{"<f8", 8, converted<double>},
                                             {"<f4", 4, converted<float>},
                                             {"<i8", 8, converted<std::int64_t>},
                                             {"<i4", 4, converted<std::int32_t>},
                                             {"<i2", 2, converted<std::int16_t>},
                                             {"|i1", 1, converted<std::int8_t>},
                                             {"<u8", 8, converted<std::uint64_t>},
                                             {"<u4", 4, converted<std::uint32_t>},
                                             {"<u2", 2, converted<std::uint16_t>},
                                             {"|u1", 1, converted<std::uint8_t>},
                                             {"|b1", 1, converted<std::uint8_t>}}};

/// @returns why an array that begins like this is not read; empty if it is
std::string problem_of_header(std::string_view start) {
  const auto header = take_header(start);
  if (!header) return "its header is not that of an array";
  if (std::ranges::find(kTypes, header->type, &NumberType::name) == kTypes.end())
    return fmt::format("numbers of type '{}' are not read",
                       header->type.empty() ? "structured" : printable(header->type));
  if (header->shape.size() > 2) return "it has more than two dimensions";
  return {};
}

/// @returns why the array is not read; empty if its columns were added
std::string add_array(std::vector<NamedArray>& arrays, const std::string& name,
                      std::string_view bytes) {
  const auto header = take_header(bytes);
  const auto* const type = std::ranges::find(kTypes, header->type, &NumberType::name);
  const std::size_t rows = header->shape.empty() ? 1 : header->shape.front();
  const std::size_t columns = header->shape.size() < 2 ? 1 : header->shape.back();
  const std::size_t count = bytes.size() / type->bytes;
  if (rows == 0 || columns == 0) return "it is empty";
  if (bytes.size() % type->bytes != 0 || columns > count || rows != count / columns ||
      count % columns != 0)
    return "its size is not that of its shape";
  add_columns(arrays, name, rows, columns, [&](std::size_t row, std::size_t column) {
    const std::size_t index = header->is_by_columns ? column * rows + row : row * columns + column;
    return type->convert(bytes.data() + index * type->bytes);
  });
  return {};
}

bool is_of(std::string_view wanted, std::string_view array) {
  return wanted == array ||
         (wanted.starts_with(array) && wanted.substr(array.size()).starts_with('/'));
}

}  // namespace

std::vector<NamedArray> read_npz(const PlacedBytes& bytes, const std::string& name,
                                 const std::vector<std::string>& wanted, const Progress& progress) {
  ReadBudget budget(name, progress);
  const ZipArchive archive(bytes, budget);
  std::vector<NamedArray> arrays;
  std::size_t values = 0;
  for (const ZipMember& member : archive.members()) {
    if (!member.name.ends_with(kEnding)) continue;
    const std::string array = member.name.substr(0, member.name.size() - kEnding.size());
    const bool is_wanted = std::ranges::any_of(
        wanted, [&](const std::string& column) { return is_of(column, array); });
    const std::size_t before = arrays.size();
    // What is not read is not unpacked either.
    std::string problem = problem_of_header(archive.start(member, kMaxHeaderBytes));
    if (problem.empty()) {
      const std::string content = archive.read(member);
      budget.keep(sizeof(double) * content.size());
      problem = add_array(arrays, array, content);
    }
    if (!problem.empty() && is_wanted)
      throw Error({.place = fmt::format("{}: {}", name, array),
                   .problem = problem,
                   .expected = "an array of real numbers, little-endian",
                   .advice = "Save it as numpy.asarray(x, dtype=float)."});
    for (std::size_t i = before; i < arrays.size(); ++i) values += arrays[i].values.size();
    if (values > kMaxArrayValues)
      throw Error({.place = name, .problem = fmt::format("more than {} numbers", kMaxArrayValues)});
  }
  return arrays;
}

std::vector<NamedArray> read_npz(ByteSource& source, const std::string& name,
                                 const std::vector<std::string>& wanted, const Progress& progress) {
  std::string bytes;
  ReadBudget budget(name, progress);
  std::string block;
  bool is_whole = true;
  while (is_whole) {
    is_whole = read_exactly(source, block, kBlockBytes);
    budget.read_to(source.bytes_read());
    budget.require(bytes.size() + block.size());
    bytes += block;
  }
  return read_npz(*placed_bytes(bytes), name, wanted, progress);
}

void write_npz(const Recording& recording, OutputFile& file, const Progress& progress) {
  constexpr std::size_t kHeaderAlignment = 64;
  const std::vector<WrittenColumn> columns = written_columns(recording);
  ZipWriter archive(file);
  std::size_t done = 0;
  for (const WrittenColumn& column : columns) {
    report_progress(progress, static_cast<double>(done++) / static_cast<double>(columns.size()),
                    "writing");
    std::string text = fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}",
                                   column.values.size());
    const std::size_t head = kNumpyMark.size() + 2 + sizeof(std::uint16_t);
    while ((head + text.size() + 1) % kHeaderAlignment != 0) text += ' ';
    text += '\n';
    std::string bytes;
    LittleEndianWriter writer(bytes);
    writer.bytes(kNumpyMark)
        .number(std::uint8_t{1})
        .number(std::uint8_t{0})
        .text<std::uint16_t>(text)
        .bytes({reinterpret_cast<const char*>(column.values.data()),
                column.values.size() * sizeof(double)});
    archive.add(column.name + std::string(kEnding), bytes);
  }
  archive.finish();
}

}  // namespace torsio
