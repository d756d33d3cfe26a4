// What the README shows is what was built: its code is an example's.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
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
  const std::string part = quoted_part(contents(root / "examples/02_estimate_torque.cpp"));
  ASSERT_FALSE(part.empty());
  EXPECT_NE(contents(root / "README.md").find(part), std::string::npos) << part;
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
