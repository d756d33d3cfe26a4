#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "studies/figure_curves.hpp"
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

const QuantityRow& row_of(const QuantityTable& table, std::string_view condition,
                          std::string_view quantity) {
  const auto found = std::ranges::find_if(table.rows, [&](const QuantityRow& row) {
    return row.condition == condition && row.quantity == quantity;
  });
  if (found == table.rows.end())
    throw std::out_of_range(fmt::format("no row {}, {}", condition, quantity));
  return *found;
}

TEST(SensorFigures, LoopsAreOpenAndTheDesignedClutchSlipsAtItsTorque) {
  const Study study = run_study(find_study("002-figures"), kShort);
  const auto& table = std::get<QuantityTable>(study.table);
  for (const char* condition : {"Figure 7, 4 deg, 0.4 Hz", "Figure 7, 5 deg, 1 Hz"}) {
    EXPECT_GT(row_of(table, condition, "width of the loop at 0 deg").value, 1e-3) << condition;
    EXPECT_GT(row_of(table, condition, "work of a loop").value, 0.0) << condition;
  }
  // The torque of (5); the angle that of the rubber by (1) and of the cable.
  constexpr const char* kUp = "Figure 8, rubber-clutch:designed, positive direction";
  EXPECT_NEAR(row_of(table, kUp, "torque when it slips").value, 0.4998, 0.005);
  EXPECT_NEAR(row_of(table, kUp, "angle of the input when the clutch slips").value,
              0.4998 / 1.9359 * 180.0 / std::numbers::pi + 0.57, 1.0);
  EXPECT_LT(row_of(table, kUp, "mean torque while it slides").value, 0.49);
  EXPECT_NEAR(row_of(table, "Figure 3 (b), turned without load", "torque").value, 0.0, 0.01);
  EXPECT_GT(row_of(table, "Figure 3 (d), turned beyond it", "slip of the clutch").value, 1.0);
  EXPECT_EQ(
      row_of(table, "Figure 3 (c), turned below the clutch's torque", "slip of the clutch").value,
      0.0);
}

TEST(SensorDrop, TheClutchNeverRaisesTheForceAndTheContactBoundsIt) {
  const Study study = run_study(find_study("002-drop"), kShort);
  const auto& table = std::get<QuantityTable>(study.table);
  EXPECT_GT(row_of(table, "all", "reduction of the largest force, lowest").value, -1.0);
  // At most v sqrt(k m), with a little for the damping.
  const double bound_N = std::sqrt(2.0 * 9.81 * 0.3) * std::sqrt(1e3 * 2.5) * 1.1;
  EXPECT_LT(row_of(table, "contact of 1 N/mm", "largest force without, highest").value, bound_N);
}

TEST(FigureCurves, MeasureALoopOfKnownWidth) {
  std::vector<double> deflection_deg;
  std::vector<double> torque_Nm;
  for (int n = 0; n < 4000; ++n) {
    const double phase = 2.0 * std::numbers::pi * n / 1000.0;
    deflection_deg.push_back(std::sin(phase));
    torque_Nm.push_back(10.0 * std::sin(phase) + std::copysign(0.5, std::cos(phase)));
  }
  const LoopMeasures of = loop_measures(deflection_deg, torque_Nm);
  EXPECT_NEAR(of.width_Nm, 1.0, 0.02);
  EXPECT_LT(of.nonlinear_Nm, 0.1);
}

TEST(FigureCurves, GiveTheRmsOfTheSamplesInEachBandOfAChirp) {
  std::vector<double> values(1000, 0.0);
  for (std::size_t n = 500; n < 1000; ++n) values[n] = n % 2 == 0 ? 2.0 : -2.0;
  constexpr std::array kEdges_Hz{0.0, 1.0, 2.0, 3.0};
  const auto bands = rms_by_frequency(
      values, 100.0, {.amplitude = 1.0, .start_Hz = 0.0, .end_Hz = 2.0, .duration_s = 10.0},
      kEdges_Hz);
  ASSERT_EQ(bands.size(), 3U);
  EXPECT_EQ(bands[0].second, 0.0);
  EXPECT_EQ(bands[1].first, 1.5);
  EXPECT_EQ(bands[1].second, 2.0);
  EXPECT_TRUE(std::isnan(bands[2].second));
}

TEST(KnownLoadStudy, LearnsABetterSpringThanALateSensorAndContainsItsErrors) {
  const Study study = run_study(find_study("known-load"), kShort);
  const auto& table = std::get<QuantityTable>(study.table);
  for (const char* const test :
       {"sweep, new lever, tilted", "chirp, locked", "random walk, locked"}) {
    const std::string condition = std::string("dfki-50, ") + test;
    const auto rmse_Nm = [&](const char* name) {
      return row_of(table, condition, std::string("RMSE, ") + name).value;
    };
    EXPECT_LT(rmse_Nm("known load"), rmse_Nm("sensor")) << test;
    EXPECT_LT(rmse_Nm("known load"), 0.1) << test;
    const QuantityRow& wrong = row_of(table, condition, "RMSE, known load, these three wrong");
    EXPECT_GT(wrong.value, rmse_Nm("known load")) << test;
    // "error bar 0.3 Nm, ..": each fact is one standard error wrong, all in the direction of more torque.
    const double bar_Nm = std::stod(wrong.remark.substr(std::string("error bar ").size()));
    EXPECT_GT(2.0 * bar_Nm, wrong.value) << test;
    EXPECT_LT(bar_Nm, 4.0 * wrong.value) << test;
  }
}

INSTANTIATE_TEST_SUITE_P(OfAll, ShortStudies,
                         testing::Values("001-inverse", "001-figures", "002-design", "002-slow",
                                         "002-algorithm", "002-selection", "002-figures",
                                         "002-drop", "003-figures", "000-brake", "000-figures",
                                         "000-transfer", "004-impedance", "004-tubes", "few-data"),
                         name_of);
INSTANTIATE_TEST_SUITE_P(OfArms, ShortStudies, testing::Values("arm-external"), name_of);

}  // namespace
}  // namespace torsio
