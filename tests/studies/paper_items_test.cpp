#include "studies/paper_items.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "studies/studies.hpp"

namespace torsio {
namespace {

using testing::AnyOf;
using testing::StartsWith;

const std::filesystem::path kSource = TORSIO_SOURCE;

std::string whole_text(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::string cited(const PaperItem& item) {
  return std::string(item.paper) + " " + std::string(item.item);
}

TEST(PaperItems, HaveAStatusAndWhatItNeeds) {
  std::set<std::string> names;
  for (const PaperItem& item : paper_items()) {
    SCOPED_TRACE(cited(item));
    EXPECT_TRUE(names.insert(cited(item)).second) << "two lines";
    EXPECT_THAT(item.status, AnyOf("done", "partly", "planned", "not possible", "nothing to run"));
    EXPECT_THAT(item.verdict, AnyOf("reproduced", "order only", "not reproduced", "holds", ""));
    const bool is_run = item.status == "done" || item.status == "partly";
    EXPECT_EQ(!item.run.empty(), is_run);
    EXPECT_TRUE(item.status == "partly" || !item.verdict.empty() == is_run);
    const bool needs_reason = item.status == "partly" || item.status == "planned" ||
                              item.status == "not possible" || item.verdict == "order only" ||
                              item.verdict == "not reproduced";
    EXPECT_EQ(!item.reason.empty(), needs_reason);
    if (item.reason.empty())
      EXPECT_TRUE(item.evidence.empty());
    else
      EXPECT_THAT(std::string(item.evidence), AnyOf("supposed", StartsWith("shown: ")));
  }
}

TEST(PaperItems, HaveAReasonThatARunShowsForHalfOfWhatDidNotComeOut) {
  std::size_t all = 0;
  std::size_t is_shown = 0;
  for (const PaperItem& item : paper_items()) {
    if (item.verdict != "order only" && item.verdict != "not reproduced") continue;
    ++all;
    if (item.evidence.starts_with("shown: ")) ++is_shown;
  }
  EXPECT_GT(all, 0U);
  EXPECT_GE(2 * is_shown, all);
}

// A run is a study, a call of another verb, or a test that exists.
TEST(PaperItems, NameRunsThatExist) {
  std::string tests;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(kSource / "tests"))
    if (entry.path().extension() == ".cpp") tests += whole_text(entry.path());
  std::erase_if(tests, [](unsigned char letter) { return std::isspace(letter) != 0; });
  const auto document = nlohmann::json::parse(paper_items_json());
  for (const auto& item : document["items"]) {
    SCOPED_TRACE(item["paper"].get<std::string>() + " " + item["item"].get<std::string>());
    for (const std::string run : item["run"]) {
      if (run.starts_with("test: ")) {
        const std::string name = run.substr(6);
        const std::size_t dot = name.find('.');
        ASSERT_NE(dot, std::string::npos) << run;
        const std::string head = "(" + name.substr(0, dot) + "," + name.substr(dot + 1);
        // A property of rapidcheck has a third argument.
        EXPECT_TRUE(tests.find(head + ")") != std::string::npos ||
                    tests.find(head + ",()") != std::string::npos)
            << run;
      } else if (std::ranges::find(studies(), run, &StudyInfo::name) == studies().end()) {
        EXPECT_THAT(run, AnyOf(StartsWith("simulate "), StartsWith("design "),
                               StartsWith("monitor "), StartsWith("track "), StartsWith("arm "),
                               StartsWith("compare "), StartsWith("fit "), StartsWith("transfer "),
                               StartsWith("attribute"), StartsWith("adapt"), StartsWith("joint "),
                               StartsWith("connect "), StartsWith("tune-loop ")));
      }
    }
  }
}

TEST(PaperResults, AreInOneTableEach) {
  for (const PaperResult& result : paper_results()) {
    SCOPED_TRACE(testing::Message() << result.paper << " " << result.item << " " << result.condition
                                    << " " << result.quantity << " " << result.value);
    EXPECT_TRUE(result.table == "planned" || result.table == "text" ||
                std::ranges::find(studies(), result.table, &StudyInfo::name) != studies().end())
        << result.table;
    EXPECT_TRUE(std::ranges::any_of(
        paper_items(), [&](const PaperItem& item) { return item.paper == result.paper; }));
  }
  EXPECT_EQ(paper_results().size(), 137U);
}

/// The fields of a line of a table in which a field with a comma has quotes.
std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  bool is_quoted = false;
  for (const char letter : line) {
    if (letter == '"')
      is_quoted = !is_quoted;
    else if (letter == ',' && !is_quoted)
      fields.emplace_back();
    else
      fields.back() += letter == ',' ? ';' : letter;
  }
  return fields;
}

// The numbers that were read from the texts of the papers, where they are beside this repository.
TEST(PaperResults, AreThoseOfTheTexts) {
  const std::filesystem::path table = kSource.parent_path() / "shared/papers/paper_results.csv";
  if (!std::filesystem::exists(table)) GTEST_SKIP() << "the papers' numbers are not here";
  std::multiset<std::string> printed;
  std::ifstream file(table);
  for (std::string line; std::getline(file, line);) {
    const std::vector<std::string> fields = fields_of(line);
    if (fields.size() > 7 && fields[7] == "result")
      printed.insert(fields[0] + "," + fields[4] + "," + fields[5] + "," + fields[6]);
  }
  std::multiset<std::string> ours;
  for (const PaperResult& result : paper_results())
    ours.insert(std::string(result.paper) + "," + std::string(result.quantity) + "," +
                std::string(result.value) + "," + std::string(result.unit));
  EXPECT_EQ(ours, printed);
}

TEST(PaperItems, AreThePageOfTheDocumentation) {
  EXPECT_EQ(whole_text(kSource / "docs/papers.md"), paper_items_page())
      << "write it again: torsio reproduce --list --page docs/papers.md";
}

TEST(DurationText, HasTheUnitThatFits) {
  EXPECT_EQ(duration_text(6.0), "6 s");
  EXPECT_EQ(duration_text(120.0), "2 min");
  EXPECT_EQ(duration_text(7200.0), "2.0 h");
}

}  // namespace
}  // namespace torsio
