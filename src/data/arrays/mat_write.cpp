#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "core/report_progress.hpp"
#include "data/arrays/mat.hpp"
#include "data/little_endian.hpp"
#include "data/written_columns.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"

namespace torsio {
namespace {

// Kinds of data elements, and the class of an array of doubles.
constexpr std::uint32_t kInt8 = 1;
constexpr std::uint32_t kInt32 = 5;
constexpr std::uint32_t kUint32 = 6;
constexpr std::uint32_t kDouble = 9;
constexpr std::uint32_t kMatrix = 14;
constexpr std::uint32_t kClassOfDoubles = 6;

constexpr std::size_t kWord = 8;

void require_variable_name(const std::string& recording, const std::string& name) {
  constexpr std::size_t kLongest = 63;
  if (name.size() <= kLongest && std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
      std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; }))
    return;
  throw Error({.place = recording + ": " + name,
               .problem = "a variable of MATLAB cannot have this name",
               .expected = "a letter, then letters, digits and underscores, at most 63",
               .advice = "Write a CSV file, or rename the channel in a mapping."});
}

/// All of a variable but its values: what comes before them, with their tag.
std::string head_of(const WrittenColumn& column) {
  const std::size_t padded_name = (column.name.size() + kWord - 1) / kWord * kWord;
  const std::size_t value_bytes = column.values.size() * sizeof(double);
  const std::size_t content = 2 * kWord + 2 * kWord + kWord + padded_name + kWord + value_bytes;
  if (content > std::numeric_limits<std::uint32_t>::max())
    throw Error({.problem = "a variable of more than 4 GiB cannot be written to a .mat file",
                 .advice = "Write a CSV or MCAP file."});
  std::string head;
  LittleEndianWriter(head)
      .number(kMatrix)
      .number(static_cast<std::uint32_t>(content))
      .number(kUint32)
      .number(std::uint32_t{2 * sizeof(std::uint32_t)})
      .number(kClassOfDoubles)
      .number(std::uint32_t{0})
      .number(kInt32)
      .number(std::uint32_t{2 * sizeof(std::int32_t)})
      .number(static_cast<std::int32_t>(column.values.size()))
      .number(std::int32_t{1})
      .number(kInt8)
      .number(static_cast<std::uint32_t>(column.name.size()))
      .bytes(column.name)
      .bytes(std::string(padded_name - column.name.size(), '\0'))
      .number(kDouble)
      .number(static_cast<std::uint32_t>(value_bytes));
  return head;
}

}  // namespace

void write_mat(const Recording& recording, OutputFile& file, const Progress& progress) {
  constexpr std::size_t kTextBytes = 116;
  const std::vector<WrittenColumn> columns = written_columns(recording);
  for (const WrittenColumn& column : columns) require_variable_name(recording.name(), column.name);
  std::string header = fmt::format("MATLAB 5.0 MAT-file, written by torsio {}", kVersion);
  header.resize(kTextBytes, ' ');
  LittleEndianWriter(header)
      .number(std::uint64_t{0})
      .number(std::uint16_t{0x0100})  // version
      .bytes("IM");                   // little-endian
  file.write(std::as_bytes(std::span(header)));
  std::size_t done = 0;
  for (const WrittenColumn& column : columns) {
    report_progress(progress, static_cast<double>(done++) / static_cast<double>(columns.size()),
                    "writing");
    const std::string head = head_of(column);
    file.write(std::as_bytes(std::span(head)));
    file.write(std::as_bytes(std::span(column.values)));
  }
}

}  // namespace torsio
