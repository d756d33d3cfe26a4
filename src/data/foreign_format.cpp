#include "data/foreign_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "data/names.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// How a format is recognised, and what converts it: a function of pandas, a command before the file, or one that writes
/// to the file after it.
struct ForeignFormat {
  std::string_view mark;
  std::string_view name;
  std::string_view pandas = {};
  std::string_view command = {};
  std::string_view ending = {};  ///< ending of the written file
};

constexpr auto kForeign = std::to_array<ForeignFormat>({
    {"PAR1", "a Parquet file", "read_parquet"},
    {"ARROW1", "an Arrow (Feather) file", "read_feather"},
    {"FEA1", "a Feather file", "read_feather"},
    {"\xd0\xcf\x11\xe0", "an Excel file of the old format (.xls)", "read_excel"},
    {"\x80\x04\x95", "a pickle of Python", "read_pickle"},
    {"\x80\x05\x95", "a pickle of Python", "read_pickle"},
    {"BZh", "a file packed by bzip2", {}, "bunzip2 -k"},
    {std::string_view("\xfd"
                      "7zXZ\0",
                      6),
     "a file packed by xz",
     {},
     "unxz -k"},
    {"\x04\x22\x4d\x18", "a file packed by lz4", {}, "unlz4 -k"},
    {"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", {}, "7z x"},
    {"Rar!\x1a\x07", "a RAR archive", {}, "unrar x"},
    {"\x93NUMPY",
     "an array of numpy (.npy)",
     {},
     "python3 -c \"import numpy, sys; numpy.savez('log.npz', log=numpy.load(sys.argv[1]))\""},
    {"PK\x05\x06", "an empty ZIP archive"},
    {"ULog\x01", "a ULog file of PX4", {}, "ulog2csv"},
    {"TDSm",
     "a TDMS file of LabVIEW",
     {},
     "python3 -c \"import nptdms, sys; nptdms.TdmsFile.read(sys.argv[1]).as_dataframe().to_csv("
     "sys.argv[2], index=False)\"",
     ".csv"},
    {"MDF     ",
     "an MDF file",
     {},
     "python3 -c \"import asammdf, sys; asammdf.MDF(sys.argv[1]).export('csv', sys.argv[2])\"",
     ".csv"},
    {"LabVIEW Measurement",
     "a measurement file of LabVIEW (.lvm), with a header for each segment",
     {},
     R"(awk -F'\t' '/^X_Value/ { if (!n++) { sub(/\tComment\r?$/, ""); print } r = 1; next } )"
     R"(/^(Channels|[*])/ { r = 0 } r && NF > 1')",
     " > LOG.tsv"},
});

/// The first characters of an object or a list in JSON.
bool is_json(std::string_view start) {
  const auto is_blank = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  const auto skip_blanks = [&] {
    start.remove_prefix(
        static_cast<std::size_t>(std::ranges::find_if_not(start, is_blank) - start.begin()));
  };
  skip_blanks();
  if (start.empty() || (start.front() != '{' && start.front() != '[')) return false;
  const bool is_object = start.front() == '{';
  start.remove_prefix(1);
  skip_blanks();
  return start.starts_with(is_object ? '"' : '{') || (!is_object && start.starts_with('['));
}

/// Whether a file of JSON has an object in each line, as far as its beginning and its name show.
bool has_json_lines(std::string_view start, std::string_view path) {
  return start.find("}\n{") != std::string_view::npos ||
         start.find("}\r\n{") != std::string_view::npos || path.ends_with(".jsonl") ||
         path.ends_with(".ndjson");
}

[[noreturn]] void refuse(const std::string& path, std::string_view name,
                         const std::string& advice) {
  throw Error(
      {.place = path,
       .expected =
           "CSV, MCAP, .npz, .mat, a bag of ROS, or JSON of BAM (an object with \"entries\")",
       .found = std::string(name),
       .advice = advice});
}

}  // namespace

std::string shell_quoted(std::string_view text) {
  const bool is_plain = std::ranges::all_of(text, [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("_-./+,:@=").find(static_cast<char>(c)) != std::string_view::npos;
  });
  if (is_plain && !text.empty()) return std::string(text);
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string advice_by_pandas(std::string_view reader, const std::string& path) {
  const std::size_t arguments = reader.find('(');
  const std::string options(arguments == std::string_view::npos ? ""
                                                                : reader.substr(arguments + 1));
  return fmt::format(
      "Convert it:  python3 -c \"import pandas, sys; pandas.{}(sys.argv[1]{}).to_csv(sys.argv[2], "
      "index=False)\" {} {}",
      reader.substr(0, arguments), options.empty() ? "" : ", " + options, shell_quoted(path),
      shell_quoted(file_stem(path) + ".csv"));
}

void refuse_foreign_format(std::string_view start, const std::string& path) {
  constexpr std::string_view kHdf5 = "\x89HDF\r\n";
  if (start.starts_with(kHdf5) && !path.ends_with(".mat"))
    refuse(path, "an HDF5 file",
           "Save one array for each signal: numpy.savez('run.npz', **signals)");
  for (const ForeignFormat& format : kForeign) {
    if (!start.starts_with(format.mark)) continue;
    std::string advice;
    if (!format.pandas.empty()) advice = advice_by_pandas(format.pandas, path);
    if (!format.command.empty())
      advice = fmt::format("Convert it:  {} {}", format.command, shell_quoted(path));
    if (format.ending.starts_with('.'))
      advice += ' ' + shell_quoted(file_stem(path) + std::string(format.ending));
    else
      advice += format.ending;
    refuse(path, format.name, advice);
  }
  if (start.find_first_of("{[") != std::string_view::npos && is_json(start)) {
    const bool has_lines = has_json_lines(start, path);
    refuse(path, has_lines ? "JSON, an object in each line" : "JSON",
           advice_by_pandas(has_lines ? "read_json(lines=True" : "read_json", path));
  }
}

}  // namespace torsio
