// What a new family needs besides its model: a row in the table of families and a page. (An example
// in tests/support/examples is asked for by the compiler, the laws come by themselves.)
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "files/known_families.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

std::string test_name(const testing::TestParamInfo<std::string_view>& info) {
  return std::string(info.param);
}

/// The pages of docs/models, joined.
const std::string& model_pages() {
  static const std::string pages = [] {
    std::string text;
    for (const auto& page : std::filesystem::directory_iterator(
             std::filesystem::path(TORSIO_SOURCE) / "docs" / "models")) {
      std::ifstream file(page.path(), std::ios::binary);
      text.append(std::istreambuf_iterator<char>(file), {});
    }
    return text;
  }();
  return pages;
}

bool is_of_a_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// Whether a page has it as a whole word.
bool is_on_a_page(std::string_view name) {
  const std::string& pages = model_pages();
  for (std::size_t at = pages.find(name); at != std::string::npos; at = pages.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if ((at == 0 || !is_of_a_name(pages[at - 1])) &&
        (end == pages.size() || !is_of_a_name(pages[end])))
      return true;
  }
  return false;
}

class ModelFamily : public testing::TestWithParam<std::string_view> {};

TEST_P(ModelFamily, HasTheTraitsThatItsRowsState) {
  KnownFamilies::for_each([&]<class F>(std::type_identity<F> /*family*/) {
    if (F::kFamily != GetParam()) return;
    for (const FamilyInfo& row : families()) {
      if (row.model_family != GetParam()) continue;
      EXPECT_EQ(row.is_spring, detail::traits_of<F>().is_spring) << row.name;
    }
  });
}

TEST_P(ModelFamily, IsFittedByARowOfTheTableOrHasAReason) {
  const std::map<std::string_view, std::string_view> without_row{
      {"mlp_ensemble", "fitted by mlp with members above 1"},
      {"lstm_ensemble", "fitted by lstm with members above 1"},
      {"gru_ensemble", "fitted by gru with members above 1"}};
  const bool has_row =
      std::ranges::find(families(), GetParam(), &FamilyInfo::model_family) != families().end();
  EXPECT_NE(has_row, without_row.contains(GetParam()))
      << (has_row ? "remove it from the reasons above"
                  : "src/fit/families.cpp (or the *_families.cpp of its room) has no row whose "
                    "model_family is ")
      << GetParam();
}

TEST_P(ModelFamily, IsNamedByAPage) {
  EXPECT_TRUE(is_on_a_page(GetParam())) << "no page of docs/models names `" << GetParam() << '`';
}

INSTANTIATE_TEST_SUITE_P(EveryFamily, ModelFamily, testing::ValuesIn(KnownFamilies::kNames),
                         test_name);

std::vector<std::string_view> names_of_the_table() {
  std::vector<std::string_view> names;
  for (const FamilyInfo& family : families()) names.push_back(family.name);
  return names;
}

class FittedFamily : public testing::TestWithParam<std::string_view> {};

TEST_P(FittedFamily, IsNamedByAPageWithItsOptions) {
  EXPECT_TRUE(is_on_a_page(GetParam())) << "no page of docs/models names `" << GetParam() << '`';
  for (const OptionInfo& option : find_family(GetParam()).options)
    EXPECT_TRUE(is_on_a_page(option.name))
        << "no page of docs/models names `" << option.name << "` of " << GetParam();
}

TEST_P(FittedFamily, FitsAFamilyThatModelFilesHold) {
  const auto& names = KnownFamilies::kNames;
  const std::string_view model_family = find_family(GetParam()).model_family;
  EXPECT_NE(std::ranges::find(names, model_family), names.end())
      << "AllFamilies (src/files/known_families.hpp) has no family \"" << model_family << '"';
}

INSTANTIATE_TEST_SUITE_P(EveryRow, FittedFamily, testing::ValuesIn(names_of_the_table()),
                         test_name);

}  // namespace
}  // namespace torsio
