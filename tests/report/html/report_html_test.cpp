#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "report/html/linked_report.hpp"
#include "report/html/page_files.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {
namespace {

std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const std::size_t from = text.find(begin);
  if (from == std::string::npos) return {};
  const std::size_t first = from + begin.size();
  return text.substr(first, text.find(end, first) - first);
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++found;
  return found;
}

ReportDocument example(const std::string& name) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  XyFigure loop{.title = name,
                .x = {name},
                .y = {"y"},
                .series = {{.label = name, .x = {0.0, 1.0, nan, 2.0}, .y = {0.0, 1.0, 2.0, 3.0}}}};
  TimeFigure series{.title = name, .rate_Hz = 10.0, .samples = 2, .windows = {{0, 2, name}}};
  series.marks.push_back({.begin_s = 0.0, .end_s = 0.1, .label = name});
  series.panels.push_back(
      {.label = name,
       .series = {{.label = name, .overview = {1.0F, 2.0F}, .detail = {1.0F, 2.0F}}}});
  ReportSection section{.heading = name,
                        .text = name,
                        .tables = {{.title = name, .headings = {name}, .rows = {{{name}, name}}}},
                        .preformatted = name};
  section.figures.emplace_back(loop);
  section.figures.emplace_back(series);
  return {.title = name, .summary = {name}, .sections = {section}, .origin = {{name, name}}};
}

TEST(ReportHtml, ShowsNamesWithTagsAsText) {
  const std::string name = "</script><script>alert(1)</script>\"'&";
  const std::string page = report_html(example(name));
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
  EXPECT_EQ(count(page, "</script>"), 3U);  // the figures, the numbers, the program
  EXPECT_NE(page.find("&lt;script&gt;alert(1)"), std::string::npos);
  const auto figures = nlohmann::json::parse(between(page, "id=\"report-figures\">", "</script>"));
  ASSERT_EQ(figures.size(), 2U);
  EXPECT_EQ(figures[0]["title"], name);
  EXPECT_EQ(figures[1]["panels"][0]["series"][0]["label"], name);
}

TEST(ReportHtml, AcceptsTextThatIsNotUtf8) {
  EXPECT_NO_THROW((void)report_html(example("\xff\xfe file")));
}

TEST(ReportHtml, HasTablesAndAPictureWithoutJavaScript) {
  const std::string page = report_html(example("model"));
  EXPECT_NE(page.find("<td>model</td>"), std::string::npos);
  EXPECT_NE(between(page, "<noscript>", "</noscript>").find("<img alt="), std::string::npos);
}

TEST(ReportHtml, FirstCellsLeadToOtherPages) {
  const std::string page =
      linked_report_html(example("knee#1 & 2"), {{"knee#1 & 2", "knee#1 & 2.html"}});
  EXPECT_NE(page.find(R"(<td><a href="knee%231%20%26%202.html">knee#1 &amp; 2</a></td>)"),
            std::string::npos);
  EXPECT_EQ(linked_report_html(example("hip"), {{"knee", "knee.html"}}),
            report_html(example("hip")));
}

TEST(ReportHtml, AsksForNoOtherFile) {
  std::string page = report_html(example("model"));
  constexpr std::string_view kWithin = "src=\"data:";
  for (std::size_t at = page.find(kWithin); at != std::string::npos; at = page.find(kWithin))
    page.erase(at, kWithin.size());
  for (const char* attribute : {"src=\"", "href=\"http", "url(http", "@import"})
    EXPECT_EQ(page.find(attribute), std::string::npos) << attribute;
}

TEST(ReportHtml, RefersToNumbersInTheirOrder) {
  const auto figures = nlohmann::json::parse(
      between(report_html(example("m")), "id=\"report-figures\">", "</script>"));
  EXPECT_EQ(figures[0]["series"][0]["x"], (nlohmann::json{0, 4}));
  EXPECT_EQ(figures[0]["series"][0]["y"], (nlohmann::json{4, 4}));
  EXPECT_EQ(figures[1]["panels"][0]["series"][0]["overview"], (nlohmann::json{8, 2}));
  // 0.0f, 1.0f, NaN, 2.0f in little-endian bytes
  const std::string numbers =
      between(report_html(example("m")), "id=\"report-numbers\">", "</script>");
  EXPECT_EQ(numbers.substr(0, 20), "AAAAAAAAgD8AAMB/AAAA");
}

TEST(ReportHtml, ContainsTheScriptAndTheStyle) {
  EXPECT_GT(page_script().size(), 10'000U);
  EXPECT_NE(page_style().find("prefers-color-scheme"), std::string_view::npos);
}

}  // namespace
}  // namespace torsio
