// What the documents name exists: tests, files and headings that they link to, faults, verbs of the program, studies; and
// the pages that sources name. A name that was changed elsewhere is reported here, and by nothing else.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "docs/source_tree.hpp"
#include "support/file_bytes.hpp"

namespace torsio {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;
using Names = std::set<std::string>;
using Found = std::vector<std::string>;

using test::file_bytes;
using test::kRoot;

bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// @returns the word that begins at `at`, after white space
std::string word_at(std::string_view text, std::size_t at) {
  while (at < text.size() && std::isspace(static_cast<unsigned char>(text[at])) != 0) ++at;
  std::size_t end = at;
  while (end < text.size() && is_word(text[end])) ++end;
  return std::string(text.substr(at, end - at));
}

Found lines_of(std::string_view text) {
  Found lines;
  for (std::size_t at = 0; at < text.size(); at += lines.back().size() + 1)
    lines.emplace_back(text.substr(at, text.find('\n', at) - at));
  return lines;
}

// ------------------------------------------------------------------------------------- Markdown

/// @returns the text without its blocks of code
std::string prose(std::string_view markdown) {
  std::string text;
  bool is_code = false;
  for (const std::string& line : lines_of(markdown)) {
    if (line.find("```") == line.find_first_not_of(' ') && line.find("```") != std::string::npos) {
      is_code = !is_code;
    } else if (!is_code && !line.starts_with("    ")) {
      text += line;
    }
    text += '\n';
  }
  return text;
}

/// The inline code of prose, or what is left without it.
Found inline_code(std::string_view text) {
  Found codes;
  for (auto at = text.find('`'); at != std::string_view::npos; at = text.find('`', at + 1)) {
    const auto end = text.find('`', at + 1);
    if (end == std::string_view::npos) break;
    codes.emplace_back(text.substr(at + 1, end - at - 1));
    at = end;
  }
  return codes;
}
std::string without_code(std::string_view text) {
  std::string rest;
  bool is_code = false;
  for (const char c : text) {
    if (c == '`') is_code = !is_code;
    if (!is_code) rest += c;
  }
  return rest;
}

/// @returns the targets of the links, those to other sites excepted
Found links(std::string_view markdown) {
  Found targets;
  const std::string text = without_code(prose(markdown));
  for (auto at = text.find("]("); at != std::string::npos; at = text.find("](", at + 2)) {
    std::string target = text.substr(at + 2, text.find(')', at) - at - 2);
    if (target.find(':') == std::string::npos) targets.push_back(std::move(target));
  }
  return targets;
}

/// @returns the anchors that GitHub gives the headings
Names anchors(std::string_view markdown) {
  Names slugs;
  std::map<std::string, int> times;
  for (const std::string& line : lines_of(prose(markdown))) {
    const auto text = line.find_first_not_of('#');
    if (!line.starts_with('#') || text == std::string::npos || line[text] != ' ') continue;
    std::string slug;
    for (std::size_t at = text + 1; at < line.size(); ++at) {
      const char c = line[at];
      if (c == ']' && line.substr(at).starts_with("](")) at = line.find(')', at);
      if (at == std::string::npos) break;
      if (c == ' ') slug += '-';
      if (is_word(c) || c == '-' || static_cast<unsigned char>(c) >= 0x80)
        slug += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    const int before = times[slug]++;
    slugs.insert(before == 0 ? slug : slug + "-" + std::to_string(before));
  }
  return slugs;
}

/// @returns the links of a document that lead nowhere
Found dangling_links(const fs::path& document, std::string_view markdown) {
  Found dangling;
  for (const std::string& link : links(markdown)) {
    const auto hash = link.find('#');
    const std::string file = link.substr(0, hash);
    const fs::path target = file.empty() ? document : document.parent_path() / file;
    const bool leads =
        fs::exists(target) && (hash == std::string::npos ||
                               anchors(file.empty() ? std::string(markdown) : file_bytes(target))
                                   .contains(link.substr(hash + 1)));
    if (!leads) dangling.push_back(link);
  }
  return dangling;
}

/// @returns the pages, by their paths below docs, to which its list of pages has no link; a link to a folder counts for
/// the pages in it
Found unlisted(std::string_view list, const Names& pages) {
  Names listed;
  for (const std::string& link : links(list))
    listed.insert(fs::path(link.substr(0, link.find('#'))).lexically_normal().string());
  Found missing;
  std::ranges::copy_if(pages, std::back_inserter(missing), [&](const std::string& page) {
    return !listed.contains(page) && !listed.contains(fs::path(page).parent_path().string());
  });
  return missing;
}

/// @returns the pages that a text names by their paths, as in docs/README.md, but that do not exist
Found missing_pages(std::string_view text) {
  Found missing;
  for (auto at = text.find("docs/"); at != std::string_view::npos;
       at = text.find("docs/", at + 1)) {
    auto end = at;
    while (end < text.size() &&
           (is_word(text[end]) || text[end] == '/' || text[end] == '-' || text[end] == '.'))
      ++end;
    while (text[end - 1] == '.') --end;  // a full stop is not part of it
    std::string page(text.substr(at, end - at));
    if (page.ends_with(".md") && !fs::exists(kRoot / page)) missing.push_back(std::move(page));
  }
  return missing;
}

// ---------------------------------------------------------------------------------------- names

/// @returns "Suite.Name" of each test in a source
Names tests_of(std::string_view source) {
  constexpr std::array<std::string_view, 5> kMacros = {"TEST(", "TEST_F(", "TEST_P(", "TYPED_TEST(",
                                                       "RC_GTEST_PROP("};
  Names names;
  for (const std::string_view macro : kMacros)
    for (auto at = source.find(macro); at != std::string_view::npos;
         at = source.find(macro, at + 1)) {
      if (at > 0 && is_word(source[at - 1])) continue;  // TEST( of TYPED_TEST(
      const auto comma = source.find(',', at);
      if (comma == std::string_view::npos) break;
      names.insert(word_at(source, at + macro.size()) + '.' + word_at(source, comma + 1));
    }
  return names;
}

/// Whether a code is the name of a test: `Suite.Name`.
bool is_test_name(std::string_view code) {
  const auto dot = code.find('.');
  return dot != std::string_view::npos && is_upper(code.front()) && dot + 1 < code.size() &&
         is_upper(code[dot + 1]) &&
         std::ranges::all_of(code, [](char c) { return is_word(c) || c == '.'; });
}

/// @returns the tests that are named but do not exist; `Suite.Name...` is each that begins so
Found unknown_tests(std::string_view markdown, const Names& tests) {
  constexpr std::string_view kRest = "...";
  Found unknown;
  for (const std::string& code : inline_code(prose(markdown))) {
    if (!is_test_name(code)) continue;
    const bool is_beginning = code.ends_with(kRest);
    const std::string name = code.substr(0, code.size() - (is_beginning ? kRest.size() : 0));
    const auto first = tests.lower_bound(name);
    if (first == tests.end() || (is_beginning ? !first->starts_with(name) : *first != name))
      unknown.push_back(code);
  }
  return unknown;
}

/// @returns the enumerators of `Fault`
Names faults_of(std::string_view header) {
  Names names;
  const auto begin = header.find('{', header.find("enum class Fault"));
  for (const std::string& line :
       lines_of(header.substr(begin + 1, header.find("};", begin) - begin)))
    if (const std::string name = word_at(line, 0); !name.empty()) names.insert(name);
  return names;
}

/// @returns the codes with the form of a fault's name in the rows of a table that begin with `| fault |`
Found unknown_faults(std::string_view markdown, const Names& faults) {
  Found unknown;
  for (const std::string& line : lines_of(markdown)) {
    if (!line.starts_with("| fault |")) continue;
    for (const std::string& code : inline_code(line))
      if (std::ranges::all_of(code, [](char c) { return is_lower(c) || c == '_'; }) &&
          !faults.contains(code))
        unknown.push_back(code);
  }
  return unknown;
}

/// @returns the verbs that a source of the program adds
Names verbs_of(std::string_view source) {
  constexpr std::string_view kAdd = " app.add_subcommand(";
  Names verbs;
  for (auto at = source.find(kAdd); at != std::string_view::npos; at = source.find(kAdd, at + 1)) {
    const auto begin = source.find('"', at) + 1;
    verbs.emplace(source.substr(begin, source.find('"', begin) - begin));
  }
  return verbs;
}

/// @returns the calls of the program in code, inline or in a block, as words
std::vector<Found> calls_in(std::string_view markdown) {
  Found codes = inline_code(prose(markdown));
  for (const std::string& line : lines_of(markdown))
    if (line.starts_with("    ")) codes.push_back(line.substr(4));
  std::vector<Found> calls;
  for (const std::string& code : codes) {
    std::istringstream text(code);
    const Found words(std::istream_iterator<std::string>(text), {});
    if (words.size() > 1 && words[0] == "torsio") calls.push_back(words);
  }
  return calls;
}

/// @returns the words after `torsio` that are not a verb
Found unknown_verbs(std::string_view markdown, const Names& verbs) {
  Found unknown;
  for (const Found& call : calls_in(markdown))
    if (is_lower(call[1].front()) && !verbs.contains(call[1])) unknown.push_back(call[1]);
  return unknown;
}

/// @returns the names of the studies in their table
Names studies_of(std::string_view source) {
  constexpr std::string_view kStudy = "StudyInfo{\"";
  Names studies;
  for (auto at = source.find(kStudy); at != std::string_view::npos;
       at = source.find(kStudy, at + 1)) {
    const auto begin = at + kStudy.size();
    studies.emplace(source.substr(begin, source.find('"', begin) - begin));
  }
  return studies;
}

/// @returns the words after `torsio reproduce`, up to an option, that are not a study
Found unknown_studies(std::string_view markdown, const Names& studies) {
  Found unknown;
  for (const Found& call : calls_in(markdown)) {
    if (call[1] != "reproduce") continue;
    for (std::size_t i = 2; i < call.size() && call[i].front() != '-' && call[i] != "#"; ++i)
      if (!is_upper(call[i].front()) && !studies.contains(call[i])) unknown.push_back(call[i]);
  }
  return unknown;
}

// ---------------------------------------------------------------------------------------- files

/// Calls use(path) for the files with this ending below a folder, or for the file.
void for_each_file(const char* place, std::string_view ending,
                   const std::function<void(const fs::path&)>& use) {
  if (!fs::is_directory(kRoot / place)) return use(kRoot / place);
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / place))
    if (entry.is_regular_file() && entry.path().extension() == ending) use(entry.path());
}

void for_each_document(const std::function<void(const fs::path&, const std::string&)>& use) {
  for (const char* place : {"README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs"})
    for_each_file(place, ".md", [&](const fs::path& path) {
      SCOPED_TRACE(fs::relative(path, kRoot).string());
      use(path, file_bytes(path));
    });
}

Names names_in(const char* folder, Names (*names_of)(std::string_view)) {
  Names all;
  for_each_file(folder, ".cpp",
                [&](const fs::path& path) { all.merge(names_of(file_bytes(path))); });
  return all;
}

TEST(Documents, LinksAndAnchorsAreFoundInProse) {
  EXPECT_THAT(links("[a](b.md), [c\nd](e.md#f); [g](https://h.i), `[j](k)`\n\n    [](auto l)\n"
                    "```cpp\n[](int m)\n```\n[n](#o)\n"),
              ElementsAre("b.md", "e.md#f", "#o"));
  EXPECT_THAT(anchors("# The A of `b_c`, d\n## [E](f.md) - 2\n## G\n### G\n```\n# no\n```\n#H\n"),
              ElementsAre("e---2", "g", "g-1", "the-a-of-b_c-d"));
}

TEST(Documents, ALinkThatLeadsNowhereIsFound) {
  const fs::path here = kRoot / "docs/use/limits.md";
  EXPECT_THAT(dangling_links(here,
                             "# A b\n[to](units.md), [up](../README.md), [own](#a-b)\n"
                             "[no](none.md), [wrong](units.md#none), [none](#c)\n"),
              ElementsAre("none.md", "units.md#none", "#c"));
}

TEST(Documents, LinkOnlyToWhatExists) {
  std::size_t count = 0;
  for_each_document([&](const fs::path& path, const std::string& text) {
    EXPECT_THAT(dangling_links(path, text), IsEmpty());
    count += links(text).size();
  });
  EXPECT_GT(count, 300U);
}

TEST(Documents, APageThatIsNotListedIsFound) {
  EXPECT_THAT(unlisted("- [a](use/a.md#b), [c](use/../c.md), [d](d)\n\n    [e](use/e.md)\n",
                       {"c.md", "d/1.md", "use/a.md", "use/e.md", "use/f.md"}),
              ElementsAre("use/e.md", "use/f.md"));
}

TEST(Documents, TheListOfPagesHasEveryPage) {
  const fs::path list = kRoot / "docs/README.md";
  Names pages;
  for_each_file("docs", ".md", [&](const fs::path& path) {
    if (path != list) pages.insert(fs::relative(path, list.parent_path()).string());
  });
  EXPECT_GT(pages.size(), 60U);
  EXPECT_THAT(unlisted(file_bytes(list), pages), IsEmpty());
}

TEST(Documents, APathOfAPageThatDoesNotExistIsFound) {
  EXPECT_THAT(
      missing_pages("// docs/README.md. (docs/none.md), docs/results and docs/use/no-page.md."),
      ElementsAre("docs/none.md", "docs/use/no-page.md"));
}

TEST(Documents, SourcesNameOnlyPagesThatExist) {
  const Names endings = {"", ".c", ".cmake", ".cpp", ".h", ".hpp", ".ipynb", ".py", ".txt"};
  std::size_t count = 0;
  for (const char* folder : {"apps", "benchmarks", "c", "cmake", "examples", "include", "python",
                             "src", "studies", "tests", "tools"})
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      const fs::path& path = entry.path();
      if (!entry.is_regular_file() || !endings.contains(path.extension().string()) ||
          path.string().find("node_modules") != std::string::npos ||
          path.filename() == "references_test.cpp" || path.filename() == "hooks_test.py")
        continue;
      SCOPED_TRACE(fs::relative(path, kRoot).string());
      const std::string text = file_bytes(path);
      EXPECT_THAT(missing_pages(text), IsEmpty());
      count += static_cast<std::size_t>(text.find("docs/") != std::string::npos);
    }
  EXPECT_GT(count, 60U);
}

TEST(Documents, ATestThatDoesNotExistIsFound) {
  const Names tests = tests_of(
      "TEST(A, IsB) {}\nTYPED_TEST(\n    C, Is_2) {}\nTEST_F(D, E)\n"
      "TYPED_TEST_SUITE(F, G);");
  EXPECT_THAT(tests, ElementsAre("A.IsB", "C.Is_2", "D.E"));
  EXPECT_THAT(
      unknown_tests(
          "(`A.IsB`, `C.Is_2`), `A.IsC` and `X.IsB`; `a.B`, `A.b`, `D...`, `C.Is...`, `A.No...`",
          tests),
      ElementsAre("A.IsC", "X.IsB", "A.No..."));
}

TEST(Documents, NameOnlyTestsThatExist) {
  const Names tests = names_in("tests", tests_of);
  EXPECT_GT(tests.size(), 2000U);
  for_each_document([&](const fs::path&, const std::string& text) {
    EXPECT_THAT(unknown_tests(text, tests), IsEmpty());
  });
}

TEST(Documents, AFaultThatDoesNotExistIsFound) {
  const Names faults =
      faults_of("enum class Fault : int {\n  none,  ///< a\n  too_far,\n};\nint x;");
  EXPECT_THAT(faults, ElementsAre("none", "too_far"));
  EXPECT_THAT(unknown_faults("| fault | `too_far`, `out_of_it` | `a/b.hpp` |\n| x | `y` |", faults),
              ElementsAre("out_of_it"));
}

TEST(Documents, TheVocabularyNamesOnlyFaultsThatExist) {
  const std::string vocabulary = file_bytes(kRoot / "docs/vocabulary.md");
  EXPECT_FALSE(unknown_faults(vocabulary, {}).empty()) << "no fault is named";
  EXPECT_THAT(
      unknown_faults(vocabulary, faults_of(file_bytes(kRoot / "include/torsio/core/fault.hpp"))),
      IsEmpty());
}

TEST(Documents, AVerbThatDoesNotExistIsFound) {
  const Names verbs = verbs_of(
      "  auto* a = app.add_subcommand(\n      \"fit\", \"x\");\n"
      "  design.add_subcommand(\"part\");");
  EXPECT_THAT(verbs, ElementsAre("fit"));
  EXPECT_THAT(unknown_verbs("`torsio fit a.csv`, `torsio learn\na.csv`, `torsio --version`\n\n"
                            "    torsio train b.csv\n    torsio fit\n",
                            verbs),
              ElementsAre("learn", "train"));
}

TEST(Documents, CallOnlyVerbsThatExist) {
  const Names verbs = names_in("apps/torsio", verbs_of);
  EXPECT_GT(verbs.size(), 20U);
  for_each_document([&](const fs::path&, const std::string& text) {
    EXPECT_THAT(unknown_verbs(text, verbs), IsEmpty());
  });
}

TEST(Documents, AStudyThatDoesNotExistIsFound) {
  const Names studies = studies_of("kStudies{StudyInfo{\"001-a\", \"b\"},\n StudyInfo{\"few\",");
  EXPECT_THAT(studies, ElementsAre("001-a", "few"));
  EXPECT_THAT(unknown_studies("`torsio reproduce few 002-a --seed 1`, `torsio reproduce ITEM`\n\n"
                              "    torsio reproduce 001-a\n    torsio reproduce 001-b # c\n",
                              studies),
              ElementsAre("002-a", "001-b"));
}

TEST(Documents, ReproduceOnlyStudiesThatExist) {
  const Names studies = studies_of(file_bytes(kRoot / "studies/studies.cpp"));
  EXPECT_GT(studies.size(), 15U);
  for_each_document([&](const fs::path&, const std::string& text) {
    EXPECT_THAT(unknown_studies(text, studies), IsEmpty());
  });
}

}  // namespace
}  // namespace torsio
