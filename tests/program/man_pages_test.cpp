// The manual pages, compared with what --help prints.
#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <vector>

#include "program/program.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// What precedes the descriptions below a heading of the help, such as "-o,--output".
std::vector<std::string> names_below(const std::string& help, const std::string& heading) {
  std::vector<std::string> names;
  bool is_below = false;
  for (const std::string& line : lines_of(help)) {
    if (!line.starts_with("  "))
      is_below = line == heading;
    else if (is_below && line[2] != ' ')
      names.push_back(line.substr(2, line.find_first_of(" =", 2) - 2));
  }
  return names;
}

std::string with_minus_signs(const std::string& text) {
  std::string page;
  for (const char each : text) page += each == '-' ? std::string("\\-") : std::string(1, each);
  return page;
}

class ManPages : public Program {
 protected:
  void SetUp() override {
    const Outcome outcome = torsio("--man-pages .");
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  /// As they are typed: "fit", "design", "design clutch".
  [[nodiscard]] std::vector<std::string> verbs() {
    std::vector<std::string> all;
    for (const std::string& verb : names_below(torsio("--help").out, "Subcommands:")) {
      all.push_back(verb);
      for (const std::string& part : names_below(torsio(verb + " --help").out, "Subcommands:"))
        all.push_back(verb + " " + part);
    }
    return all;
  }
  [[nodiscard]] static std::string page_of(std::string verb) {
    std::ranges::replace(verb, ' ', '-');
    return "torsio-" + verb + ".1";
  }
};

TEST_F(ManPages, OfEachVerbHasEveryOptionOfItsHelp) {
  const std::vector<std::string> found = verbs();
  ASSERT_GE(found.size(), 18U);
  for (const std::string& verb : found) {
    const std::size_t space = verb.find(' ');
    const std::string above =
        space == std::string::npos ? "torsio.1" : page_of(verb.substr(0, space));
    const std::string name = space == std::string::npos ? verb : verb.substr(space + 1);
    EXPECT_THAT(contents(above), HasSubstr("\\fB" + with_minus_signs(name) + "\\fR"));
    const std::string page = contents(page_of(verb));
    const std::string help = torsio(verb + " --help").out;
    const std::vector<std::string> options = names_below(help, "Options:");
    EXPECT_GE(options.size() + names_below(help, "Subcommands:").size(), 1U) << verb;
    for (const std::string& option : options)
      EXPECT_THAT(page, HasSubstr("\\fB" + with_minus_signs(option))) << verb;
    for (const std::string& argument : names_below(help, "Positionals:"))
      EXPECT_THAT(page, HasSubstr(".TP\n\\fB" + argument)) << verb;
  }
}

TEST_F(ManPages, AreRoffWithoutOtherRequests) {
  const std::set<std::string> requests{".TH", ".SH", ".TP", ".nf", ".fi"};
  std::vector<std::string> pages{"torsio.1"};
  for (const std::string& verb : verbs()) pages.push_back(page_of(verb));
  for (const std::string& page : pages) {
    const std::vector<std::string> lines = lines_of(contents(page));
    ASSERT_FALSE(lines.empty()) << page;
    EXPECT_TRUE(lines[0].starts_with(".TH \"TORSIO") || lines[0].starts_with(".TH \"torsio"));
    for (const std::string& line : lines) {
      const bool is_request = line.starts_with('.') || line.starts_with('\'');
      EXPECT_TRUE(!is_request || requests.contains(line.substr(0, 3))) << page << ": " << line;
    }
  }
}

TEST_F(ManPages, GoNowhereIntoAFolderThatDoesNotExist) {
  const Outcome outcome = torsio("--man-pages missing");
  EXPECT_EQ(outcome.exit_code, kWorkFailed);
  EXPECT_THAT(outcome.err, HasSubstr("missing"));
}

}  // namespace
}  // namespace torsio::test
