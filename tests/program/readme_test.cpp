// What the README shows is what was built: its code is an example's, its files exist.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

namespace torsio::test {
namespace {

namespace fs = std::filesystem;

std::string contents(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// The lines between the markers of an example, without their common indentation.
std::string quoted_part(const std::string& example) {
  std::istringstream lines(example);
  std::string part;
  bool is_inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.find("// readme-end") != std::string::npos) is_inside = false;
    if (is_inside) part += (line.size() > 2 ? line.substr(2) : "") + "\n";
    if (line.find("// readme-begin") != std::string::npos) is_inside = true;
  }
  return part;
}

TEST(Readme, QuotesAnExampleThatTheTestsRun) {
  const fs::path root = TORSIO_SOURCE;
  const std::string part = quoted_part(contents(root / "examples/01_estimate_torque.cpp"));
  ASSERT_FALSE(part.empty());
  EXPECT_NE(contents(root / "README.md").find(part), std::string::npos) << part;
}

TEST(Readme, LinksOnlyToWhatExists) {
  const fs::path root = TORSIO_SOURCE;
  const std::string text = contents(root / "README.md");
  const std::regex link(R"(\]\(([^)#:]+)\))");
  std::size_t links = 0;
  for (std::sregex_iterator match(text.begin(), text.end(), link), end; match != end;
       ++match, ++links)
    EXPECT_TRUE(fs::exists(root / (*match)[1].str())) << (*match)[1];
  EXPECT_GT(links, 5U);
}

TEST(Examples, StayUnderEightyLines) {
  for (const fs::directory_entry& entry :
       fs::directory_iterator(fs::path(TORSIO_SOURCE) / "examples")) {
    if (entry.path().extension() != ".cpp") continue;
    const std::string text = contents(entry.path());
    EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 80) << entry.path();
  }
}

}  // namespace
}  // namespace torsio::test
