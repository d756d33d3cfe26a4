#include "data/arrays/npz.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "core/report_progress.hpp"
#include "data/arrays/zip_archive.hpp"
#include "data/foreign_format.hpp"
#include "data/little_endian.hpp"
#include "data/names.hpp"
#include "data/read_all.hpp"
#include "data/written_columns.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr std::string_view kEnding = ".npy";
constexpr std::string_view kNumpyMark{"\x93NUMPY", 6};
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

/// Numbers of `bytes` bytes of a kind, as numpy names it: 'f', 'i', 'u', 'b'; 'M' and 'm' are times.
struct NumberType {
  char kind = 0;
  std::size_t bytes = 0;
  bool is_big_endian = false;
  double scale = 1.0;  ///< from times to seconds
};

/// The count and the unit in "M8[25us]"; 0 for those that have no fixed length.
double seconds_of_unit(std::string_view text) {
  constexpr auto kUnits = std::to_array<std::pair<std::string_view, double>>({{"ns", 1e-9},
                                                                              {"us", 1e-6},
                                                                              {"ms", 1e-3},
                                                                              {"s", 1.0},
                                                                              {"m", 60.0},
                                                                              {"h", 3600.0},
                                                                              {"D", 86400.0},
                                                                              {"ps", 1e-12},
                                                                              {"fs", 1e-15},
                                                                              {"as", 1e-18}});
  if (!text.starts_with('[') || !text.ends_with(']')) return 0.0;
  text = text.substr(1, text.size() - 2);
  unsigned count = 1;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (code == std::errc{}) text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  const auto* const at =
      std::ranges::find(kUnits, text, &std::pair<std::string_view, double>::first);
  return at == kUnits.end() ? 0.0 : count * at->second;
}

/// Nothing for types that are not read.
std::optional<NumberType> type_of(std::string_view written) {
  if (written.size() < 3 || std::string_view("<>|=").find(written[0]) == std::string_view::npos)
    return std::nullopt;
  NumberType type{.kind = written[1], .is_big_endian = written[0] == '>'};
  const char* const end = written.data() + written.size();
  const auto [after, code] = std::from_chars(written.data() + 2, end, type.bytes);
  if (code != std::errc{}) return std::nullopt;
  const std::string_view unit(after, static_cast<std::size_t>(end - after));
  const auto has_size = [&](std::initializer_list<std::size_t> sizes) {
    return std::ranges::find(sizes, type.bytes) != sizes.end();
  };
  switch (type.kind) {
    case 'f':
      if (unit.empty() && has_size({2, 4, 8})) return type;
      break;
    case 'i':
    case 'u':
      if (unit.empty() && has_size({1, 2, 4, 8})) return type;
      break;
    case 'b':
      if (unit.empty() && type.bytes == 1) return type;
      break;
    case 'M':
    case 'm':
      type.scale = seconds_of_unit(unit);
      if (type.bytes == 8 && type.scale > 0.0) return type;
      break;
    default: break;
  }
  return std::nullopt;
}

/// IEEE 754, binary16.
double half_precision(std::uint16_t bits) {
  constexpr int kMantissaBits = 10;
  constexpr int kMinExponent = -24;
  constexpr unsigned kMaxExponent = 31;
  const double sign = (bits & 0x8000U) != 0 ? -1.0 : 1.0;
  const unsigned exponent = (bits >> kMantissaBits) & kMaxExponent;
  const unsigned mantissa = bits & 0x3ffU;
  if (exponent == kMaxExponent) return mantissa != 0 ? kNotMeasured : sign * HUGE_VAL;
  if (exponent == 0) return sign * std::ldexp(mantissa, kMinExponent);
  return sign * std::ldexp(mantissa | 0x400U, static_cast<int>(exponent) - 1 + kMinExponent);
}

template <class Number>
Number number_at(const std::array<char, 8>& bytes) {
  Number value{};
  std::memcpy(&value, bytes.data(), sizeof(value));
  return value;
}

double converted(const char* at, const NumberType& type) {
  std::array<char, 8> bytes{};
  std::copy_n(at, type.bytes, bytes.begin());
  if (type.is_big_endian)
    std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(type.bytes));
  if (type.kind == 'f')
    return type.bytes == 8   ? number_at<double>(bytes)
           : type.bytes == 4 ? static_cast<double>(number_at<float>(bytes))
                             : half_precision(number_at<std::uint16_t>(bytes));
  if (type.kind == 'i')
    return type.bytes == 8   ? static_cast<double>(number_at<std::int64_t>(bytes))
           : type.bytes == 4 ? static_cast<double>(number_at<std::int32_t>(bytes))
           : type.bytes == 2 ? static_cast<double>(number_at<std::int16_t>(bytes))
                             : static_cast<double>(number_at<std::int8_t>(bytes));
  const auto unsigned_value = number_at<std::uint64_t>(bytes);
  if (type.kind == 'u' || type.kind == 'b') return static_cast<double>(unsigned_value);
  const auto ticks = number_at<std::int64_t>(bytes);
  if (ticks == std::numeric_limits<std::int64_t>::min()) return kNotMeasured;  // "not a time"
  return static_cast<double>(ticks) * type.scale;
}

/// @returns why an array that begins like this is not read; empty if it is
std::string problem_of_header(std::string_view start) {
  const auto header = take_header(start);
  if (!header) return "its header is not that of an array";
  if (header->type.empty()) return "structured: save each field as an array of its own";
  const std::string_view kind = std::string_view(header->type).substr(1);
  if (kind.starts_with('O')) return "objects of Python";
  if (kind.starts_with('c')) return fmt::format("complex numbers, '{}'", header->type);
  if (kind.starts_with('U') || kind.starts_with('S')) return "texts";
  if (!type_of(header->type)) return fmt::format("numbers of type '{}'", printable(header->type));
  return problem_of_shape(header->shape);
}

/// @returns why the array is not read; empty if its columns were added
std::string add_array(std::vector<NamedArray>& arrays, const std::string& name,
                      std::string_view bytes) {
  const auto header = take_header(bytes);
  const auto type = type_of(header->type);
  const MatrixShape shape = *as_matrix(header->shape);
  const std::size_t count = bytes.size() / type->bytes;
  if (shape.rows == 0 || shape.columns == 0) return "it is empty";
  if (bytes.size() % type->bytes != 0 || shape.columns > count ||
      shape.rows != count / shape.columns || count % shape.columns != 0)
    return "its size is not that of its shape";
  const bool is_by_columns = header->is_by_columns != shape.is_turned;
  const std::size_t before = arrays.size();
  add_columns(arrays, name, shape.rows, shape.columns, [&](std::size_t row, std::size_t column) {
    const std::size_t index =
        is_by_columns ? column * shape.rows + row : row * shape.columns + column;
    return converted(bytes.data() + index * type->bytes, *type);
  });
  for (std::size_t i = before; i < arrays.size(); ++i)
    if (type->kind == 'M' || type->kind == 'm')
      arrays[i].time = type->kind == 'M' ? TimeKind::date_time : TimeKind::time_of_day;
  return {};
}

[[noreturn]] void refuse_other_archive(const ZipArchive& archive, const std::string& name) {
  const auto has = [&](std::string_view start) {
    return std::ranges::any_of(
        archive.members(), [&](const ZipMember& member) { return member.name.starts_with(start); });
  };
  const bool is_sheet = has("xl/");
  throw Error({.place = name,
               .expected = "an .npz file: a ZIP archive of arrays of numpy",
               .found = is_sheet ? "an Excel file" : "another ZIP archive",
               .advice = is_sheet
                             ? advice_by_pandas("read_excel", name)
                             : "Unpack it, and name a file in it:  unzip " + shell_quoted(name)});
}

bool is_of(std::string_view wanted, std::string_view array) {
  return wanted == array ||
         (wanted.starts_with(array) && wanted.substr(array.size()).starts_with('/'));
}

}  // namespace

ReadArrays read_npz(const PlacedBytes& bytes, const std::string& name,
                    const std::vector<std::string>& wanted, const Progress& progress) {
  ReadBudget budget(name, progress);
  const ZipArchive archive(bytes, budget);
  ReadArrays result;
  std::vector<NamedArray>& arrays = result.arrays;
  std::size_t values = 0;
  bool has_arrays = false;
  for (const ZipMember& member : archive.members()) {
    if (!member.name.ends_with(kEnding)) continue;
    has_arrays = true;
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
                   .problem = "the array is not read: " + problem,
                   .expected = "real or integer numbers, times, or booleans",
                   .advice = "Save it as numpy.asarray(x, dtype=float)."});
    if (!problem.empty()) result.not_read.push_back(fmt::format("{} ({})", array, problem));
    for (std::size_t i = before; i < arrays.size(); ++i) values += arrays[i].values.size();
    if (values > kMaxArrayValues)
      throw Error({.place = name, .problem = fmt::format("more than {} numbers", kMaxArrayValues)});
  }
  if (!has_arrays) refuse_other_archive(archive, name);
  return result;
}

ReadArrays read_npz(ByteSource& source, const std::string& name,
                    const std::vector<std::string>& wanted, const Progress& progress) {
  ReadBudget budget(name, progress);
  const std::string bytes = read_all(source, budget);
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
