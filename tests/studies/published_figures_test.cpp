#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "studies/studies.hpp"
#include "studies/study_report.hpp"

// docs/results holds the output of commands: what it prints as a figure of a paper must be the
// figure of paper_figures.csv, which is compiled into `StudyInfo::published`.

namespace torsio {
namespace {

const std::filesystem::path kResults = std::filesystem::path(TORSIO_SOURCE) / "docs/results";

/// (condition, model, title of the column) -> text
using Cells = std::map<std::vector<std::string>, std::string>;

/// The lines of all outputs in docs/results, one after the other.
std::vector<std::string> lines_of_results() {
  std::vector<std::string> lines;
  for (const auto& entry : std::filesystem::directory_iterator(kResults)) {
    if (entry.path().extension() != ".txt") continue;
    std::ifstream file(entry.path());
    for (std::string line; std::getline(file, line);) lines.push_back(line);
  }
  return lines;
}

struct HeaderCell {
  std::string title;
  std::size_t begin;
  std::size_t end;
};

/// Columns are separated by two spaces or more.
std::vector<HeaderCell> header_of(const std::string& line) {
  static const std::regex cell("[^ ]+( [^ ]+)*");
  std::vector<HeaderCell> header;
  for (std::sregex_iterator at(line.begin(), line.end(), cell), end; at != end; ++at) {
    const auto begin = static_cast<std::size_t>(at->position());
    header.push_back({at->str(), begin, begin + at->str().size()});
  }
  return header;
}

/// The left-aligned cell that begins there.
std::string cell_from(const std::string& line, std::size_t begin) {
  if (begin >= line.size() || line[begin] == ' ') return {};
  return line.substr(begin, line.find("  ", begin) - begin);
}

/// The right-aligned cell that ends there.
std::string cell_until(const std::string& line, std::size_t end) {
  if (end > line.size() || line[end - 1] == ' ') return {};
  return line.substr(line.rfind(' ', end - 1) + 1, end - 1 - line.rfind(' ', end - 1));
}

/// The figures of papers in the printed table of a study; no entry if the document does not have
/// it.
Cells printed(const std::vector<std::string>& lines, std::string_view study, bool& is_found) {
  Cells cells;
  auto line = lines.begin();
  while (line != lines.end() && !line->starts_with(std::string(study) + " (")) ++line;
  while (line != lines.end() && !line->starts_with("condition ")) ++line;
  is_found = line != lines.end();
  if (!is_found) return cells;
  const std::vector<HeaderCell> header = header_of(*line);
  std::string condition;
  for (++line; line != lines.end() && !line->starts_with("% of max"); ++line) {
    if (const std::string cell = cell_from(*line, 0); !cell.empty()) condition = cell;
    for (const HeaderCell& column : header)
      if (column.title.starts_with("paper"))
        if (const std::string cell = cell_until(*line, column.end); !cell.empty())
          cells[{condition, cell_from(*line, header.at(1).begin), column.title}] = cell;
  }
  return cells;
}

Cells expected(const StudyInfo& info) {
  Cells cells;
  for (const PaperEntry& entry : info.published)
    cells[{std::string(entry.condition), std::string(entry.model),
           std::string(published_title(entry.quantity))}] = entry.figure.text;
  return cells;
}

TEST(PublishedFigures, InTheGeneratedTablesAreThoseOfTheFile) {
  const std::vector<std::string> lines = lines_of_results();
  std::size_t tables = 0;
  for (const StudyInfo& info : studies()) {
    if (info.name == "000-tracking" || info.name == "model-comparison") continue;
    // Their rows take their figure from the file when they are compiled; they have no `published`.
    if (info.name == "000-brake" || info.name == "000-figures" || info.name == "003-figures" ||
        info.name == "001-figures" || info.name == "000-arm" || info.name == "002-design" ||
        info.name == "002-selection" || info.name == "002-figures" || info.name == "002-drop" ||
        info.name == "003-coupling")
      continue;
    // No figure of these is printed.
    if (info.name == "002-algorithm" || info.name == "000-transfer" ||
        info.name == "004-sensitivity" || info.name == "000-arm-identification" ||
        info.name == "few-data" || info.name == "known-load" || info.name == "coverage" ||
        info.name.starts_with("arm-") || info.name.starts_with("identify-"))
      continue;
    // Its figures are on docs/board.md, which BoardPage.IsThatOfTheSetsAndRows compares.
    if (info.name == "board") continue;
    bool is_found = false;
    const Cells cells = printed(lines, info.name, is_found);
    EXPECT_TRUE(is_found) << info.name;
    EXPECT_EQ(cells, expected(info)) << info.name;
    ++tables;
  }
  EXPECT_EQ(tables, 11U);
}

/// `paper 000: dgmm  0.79 (3.95 %)  0.62  -  0.581  -` below `dfki-120, 20 Nm locked, chirp`.
TEST(PublishedFigures, InTheTablesOfTorqueTrackingAreThoseOfTheFile) {
  static const std::regex heading(R"((dfki-.*?Nm) (?:locked|free), ([a-z-]+)(, .*)?)");
  static const std::regex row(
      R"(paper (\d+): (\w+) +([\d.]+|-)(?: \(([\d.]+) %\))? +([\d.]+|-) +([\d.]+|-) +([\d.]+|-) +-)");
  Cells cells;
  std::string condition;
  std::size_t rows = 0;
  std::ifstream file(kResults / "000-tracking.txt");
  for (std::string line; std::getline(file, line);) {
    std::smatch match;
    if (std::regex_match(line, match, heading)) condition = match[1].str() + ", " + match[2].str();
    if (line.starts_with("paper ")) ++rows;
    if (!std::regex_match(line, match, row)) continue;
    --rows;
    const std::vector<std::pair<RowQuantity, int>> columns{{RowQuantity::mad, 3},
                                                           {RowQuantity::mad_percent, 4},
                                                           {RowQuantity::std_abs, 5},
                                                           {RowQuantity::rmse, 6},
                                                           {RowQuantity::mad_to_linear, 7}};
    for (const auto& [quantity, group] : columns)
      if (const std::string text = match[static_cast<std::size_t>(group)];
          !text.empty() && text != "-")
        cells[{condition, match[2].str(), std::string(published_title(quantity))}] = text;
  }
  EXPECT_EQ(rows, 0U) << "rows of papers that could not be read";
  EXPECT_EQ(cells, expected(find_study("000-tracking")));
}

}  // namespace
}  // namespace torsio
