// Where a user of a library starts, and which headers are public (decision 0007).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "docs/source_tree.hpp"
#include "support/file_bytes.hpp"

namespace torsio {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

using test::file_bytes;
using test::kRoot;

constexpr const char* kStarts[] = {"runtime", "files",  "realtime", "data", "learn", "bench",
                                   "trials",  "report", "design",   "arm",  "link"};

/// The public headers that a text includes, as "core/error.hpp".
std::set<std::string> included(const std::string& text) {
  static const std::regex include(R"re(#include ["<]torsio/([^">]+)[">])re");
  std::set<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), include); at != std::sregex_iterator();
       ++at)
    found.insert((*at)[1].str());
  return found;
}

std::string public_header(const std::string& name) {
  return file_bytes(kRoot / "include/torsio" / name);
}

/// These headers and all that they include.
std::set<std::string> with_all_included(std::set<std::string> headers) {
  std::vector<std::string> open(headers.begin(), headers.end());
  while (!open.empty()) {
    const std::string header = open.back();
    open.pop_back();
    if (!fs::exists(kRoot / "include/torsio" / header)) continue;
    for (const std::string& next : included(public_header(header)))
      if (headers.insert(next).second) open.push_back(next);
  }
  return headers;
}

/// What the users of the library include: examples, program, Python, C, and the projects of the install test.
std::set<std::string> included_by_users() {
  std::set<std::string> found;
  for (const char* folder : {"examples", "apps", "python/src", "c", "tests/install"})
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".cpp" || extension == ".hpp" || extension == ".h")
        found.merge(included(file_bytes(entry.path())));
    }
  return found;
}

/// The names in the first column of a start header's list.
std::vector<std::string> listed_names(const std::string& text) {
  static const std::regex name(R"(//   (\w+)  )");
  std::vector<std::string> found;
  for (std::sregex_iterator at(text.begin(), text.end(), name); at != std::sregex_iterator(); ++at)
    found.push_back((*at)[1].str());
  return found;
}

TEST(PublicHeaders, AreThoseThatAUserIncludes) {
  std::set<std::string> roots = included_by_users();
  for (const char* start : kStarts) roots.insert(std::string(start) + ".hpp");
  const std::set<std::string> reached = with_all_included(std::move(roots));
  std::vector<std::string> not_reached;
  for (const fs::directory_entry& entry :
       fs::recursive_directory_iterator(kRoot / "include/torsio")) {
    const std::string header = fs::relative(entry.path(), kRoot / "include/torsio").string();
    if (entry.is_regular_file() && !reached.contains(header)) not_reached.push_back(header);
  }
  EXPECT_THAT(not_reached, IsEmpty()) << "these belong into src";
}

TEST(PublicHeaders, AreAtMostTwoHundred) {
  std::size_t headers = 0;
  for (const fs::directory_entry& entry :
       fs::recursive_directory_iterator(kRoot / "include/torsio"))
    headers += entry.is_regular_file() ? 1 : 0;
  EXPECT_LE(headers, 200U);
}

TEST(StartHeaders, ListFiveNamesThatTheyDeclare) {
  for (const char* start : kStarts) {
    SCOPED_TRACE(start);
    const std::string text = public_header(std::string(start) + ".hpp");
    const std::vector<std::string> names = listed_names(text);
    EXPECT_EQ(names.size(), 5U);
    std::string declared;
    for (const std::string& header : with_all_included(included(text)))
      declared += public_header(header);
    for (const std::string& name : names)
      EXPECT_TRUE(std::regex_search(declared, std::regex("\\b" + name + "\\b"))) << name;
  }
}

}  // namespace
}  // namespace torsio
