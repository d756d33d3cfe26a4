// Comments and documents cite sections of docs/development/specification.md by number. A citation whose section
// does not exist leads nowhere, and no compiler reports it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "docs/source_tree.hpp"
#include "support/file_bytes.hpp"

namespace torsio {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using test::kRoot;
constexpr std::array kPlaces = {"src",   "studies",   "include",      "apps",
                                "tests", "docs",      "examples",     "benchmarks",
                                "tools", "README.md", "CHANGELOG.md", "CONTRIBUTING.md"};
constexpr std::array kEndings = {".hpp", ".cpp", ".h", ".c", ".md", ".txt", ".cmake", ".py", ""};

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// @returns the number at the start of `text`, such as "4" or "3.11"; empty if there is none
std::string leading_number(std::string_view text) {
  std::size_t end = 0;
  while (end < text.size() && is_digit(text[end])) ++end;
  if (end > 0 && end + 1 < text.size() && text[end] == '.' && is_digit(text[end + 1])) {
    ++end;
    while (end < text.size() && is_digit(text[end])) ++end;
  }
  return std::string(text.substr(0, end));
}

/// @returns the numbers of the headings: "## 3 Algorithms", "### 3.1 Mixtures"
std::set<std::string> section_numbers(std::string_view markdown) {
  std::set<std::string> numbers;
  std::size_t at = 0;
  while (at < markdown.size()) {
    const std::string_view line = markdown.substr(at, markdown.find('\n', at) - at);
    const std::size_t text = line.find_first_not_of('#');
    if (line.starts_with("##") && text != std::string_view::npos && line[text] == ' ') {
      if (auto number = leading_number(line.substr(text + 1)); !number.empty())
        numbers.insert(std::move(number));
    }
    at += line.size() + 1;
  }
  return numbers;
}

/// @returns the sections that are cited in `text`: one number, or several as in "4.2, 4.3 and 4.5",
/// also across the lines of a comment. Numbers of errata such as 002-24 are not sections.
std::vector<std::string> cited_sections(std::string_view text) {
  constexpr std::string_view kWord = "pecification";
  constexpr std::string_view kBetween = " \t\r\n/#*";
  constexpr std::array<std::string_view, 3> kJoints = {", ", " and ", " to "};
  std::vector<std::string> cited;
  for (auto at = text.find(kWord); at != std::string_view::npos; at = text.find(kWord, at)) {
    at += kWord.size();
    auto begin = text.find_first_not_of(kBetween, at);
    if (begin == at) continue;
    while (begin < text.size()) {
      std::string number = leading_number(text.substr(begin));
      auto end = begin + number.size();
      if (number.empty() || text.substr(end).starts_with('-')) break;
      cited.push_back(std::move(number));
      const std::string_view part = text.substr(end, 4);  // as in "2.1 (a)"
      if (part.size() == 4 && part.starts_with(" (") && part.ends_with(')')) end += part.size();
      const auto* const joint = std::ranges::find_if(
          kJoints, [&](std::string_view words) { return text.substr(end).starts_with(words); });
      if (joint == kJoints.end()) break;
      begin = end + joint->size();
      // "specification 6, 13 Nm": no chapter has two digits.
      const std::string next = leading_number(text.substr(begin));
      if (std::min(next.find('.'), next.size()) > 1) break;
    }
  }
  return cited;
}

/// @returns "file: section" for each citation without a heading
std::vector<std::string> dangling_citations() {
  const std::filesystem::path specification = kRoot / "docs/development/specification.md";
  const std::set<std::string> sections = section_numbers(test::file_bytes(specification));
  std::vector<std::string> dangling;
  const auto check = [&](const std::filesystem::path& path) {
    if (std::ranges::find(kEndings, path.extension().string()) == kEndings.end()) return;
    if (path == specification || path.filename() == "citations_test.cpp") return;
    for (const std::string& section : cited_sections(test::file_bytes(path)))
      if (!sections.contains(section))
        dangling.push_back(std::filesystem::relative(path, kRoot).string() + ": " + section);
  };
  for (const char* place : kPlaces) {
    if (!std::filesystem::is_directory(kRoot / place)) {
      check(kRoot / place);
      continue;
    }
    for (const auto& entry : std::filesystem::recursive_directory_iterator(kRoot / place))
      if (entry.is_regular_file()) check(entry.path());
  }
  std::ranges::sort(dangling);
  return dangling;
}

TEST(Citations, AreFoundInTextAndComments) {
  EXPECT_THAT(cited_sections("as specification 3.4 has it. Specification 2: 20 Nm"),
              ElementsAre("3.4", "2"));
  EXPECT_THAT(cited_sections("/// Source: specification\n  /// 4.1. And (specification 3.11)."),
              ElementsAre("4.1", "3.11"));
  EXPECT_THAT(cited_sections("specification 2.1 (a), 4.1; specification 4.2 to 4.6, 4.7 and 6."),
              ElementsAre("2.1", "4.1", "4.2", "4.6", "4.7", "6"));
  EXPECT_THAT(cited_sections("specification 1, 002-24; specification 6, 13 Nm and 20 Nm"),
              ElementsAre("1", "6"));
  EXPECT_THAT(cited_sections("the specification, the specifications 2, specification-3"),
              IsEmpty());
}

TEST(Citations, SectionsAreTheNumberedHeadings) {
  EXPECT_THAT(section_numbers("# 9 Title\n## 0 Conventions\n\n### 3.11 Loops\n### Paper 002\n5 no"),
              ElementsAre("0", "3.11"));
}

TEST(Citations, LeadToASectionOfTheSpecification) {
  EXPECT_GT(section_numbers(test::file_bytes(kRoot / "docs/development/specification.md")).size(),
            20U);
  EXPECT_THAT(dangling_citations(), IsEmpty());
}

}  // namespace
}  // namespace torsio
