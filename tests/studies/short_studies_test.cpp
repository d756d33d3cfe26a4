#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

#include "studies/studies.hpp"

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
  std::visit(
      [&](const auto& table) {
        EXPECT_FALSE(table.rows.empty());
        for (const auto& row : table.rows) {
          if constexpr (std::is_same_v<std::decay_t<decltype(row)>, QuantityRow>) {
            EXPECT_TRUE(is_measured(row)) << row.condition << " " << row.quantity;
          } else {
            EXPECT_TRUE(row.runs == 0 || is_measured(row)) << row.condition << " " << row.model;
            EXPECT_TRUE(row.runs > 0 || !row.published.empty()) << row.condition << row.model;
          }
        }
      },
      study.table);
}

INSTANTIATE_TEST_SUITE_P(OfAll, ShortStudies,
                         testing::Values("001-inverse", "002-design", "002-slow", "000-brake",
                                         "000-transfer", "004-encoders", "004-impedance",
                                         "004-tubes", "few-data"),
                         name_of);
INSTANTIATE_TEST_SUITE_P(OfArms, ShortStudies, testing::Values("arm-external"), name_of);

}  // namespace
}  // namespace torsio
