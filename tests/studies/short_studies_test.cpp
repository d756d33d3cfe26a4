#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

#include "studies/study.hpp"

namespace torsio {
namespace {

constexpr StudyOptions kShort{.seed = 3, .repeats = 1, .is_quick = true};

/// Studies with short recordings: every row of a table has a figure of ours, or only a published one.
class ShortStudies : public testing::TestWithParam<std::string_view> {
 protected:
  template <class Row>
  static bool is_measured(const Row& row) {
    if constexpr (std::is_same_v<Row, QuantityRow>)
      return std::isfinite(row.value) || !row.remark.empty();
    else if constexpr (std::is_same_v<Row, LoopRow>)
      return std::isfinite(row.rmse) || row.stopped > 0;
    else
      return std::isfinite(row.rmse) || row.diverged > 0;
  }
};

std::string name_of(const testing::TestParamInfo<std::string_view>& study) {
  std::string name(study.param);
  std::erase(name, '-');
  return name;
}

TEST_P(ShortStudies, MeasureEveryRow) {
  const StudyInfo& info = find_study(GetParam());
  const Study study = run_study(info, kShort);
  EXPECT_FALSE(study.protocol.empty());
  EXPECT_TRUE(info.name == "002-design" || !study.plants.empty());
  std::size_t published = 0;
  std::visit(
      [&](const auto& table) {
        EXPECT_FALSE(table.rows.empty());
        for (const auto& row : table.rows) {
          if constexpr (std::is_same_v<std::decay_t<decltype(row)>, QuantityRow>) {
            EXPECT_TRUE(is_measured(row)) << row.condition << " " << row.quantity;
            published += row.published ? 1U : 0U;
          } else {
            EXPECT_TRUE(row.runs == 0 || is_measured(row)) << row.condition << " " << row.model;
            EXPECT_TRUE(row.runs > 0 || !row.published.empty()) << row.condition << row.model;
            published += row.published.size();
          }
        }
      },
      study.table);
  EXPECT_TRUE(info.published.empty() || published > 0);
}

INSTANTIATE_TEST_SUITE_P(OfThePapers, ShortStudies,
                         testing::Values("002-design", "002-slow", "000-brake", "000-transfer",
                                         "001-inverse", "004-impedance", "few-data"),
                         name_of);
// These take a quarter of a minute and more.
INSTANTIATE_TEST_SUITE_P(Long, ShortStudies,
                         testing::Values("004-encoders", "004-tubes", "arm-external"), name_of);

}  // namespace
}  // namespace torsio
