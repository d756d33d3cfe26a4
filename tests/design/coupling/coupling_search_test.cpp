#include "torsio/design/coupling/coupling_search.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "support/error_message.hpp"
#include "torsio/core/error.hpp"

namespace torsio::design {
namespace {

using testing::HasSubstr;

/// A file with results of the seven geometries, as a search that was stopped leaves it: no solver is needed.
class CouplingSearchLaw : public testing::Test {
 protected:
  CouplingSearchLaw() {
    settings_.shapes = 0;
    settings_.resume = testing::TempDir() + "torsio_shapes.jsonl";
    std::ofstream(settings_.resume)
        << R"({"campaign":{"bulk_ratio":500.0,"layers":0,"length_mm":10.0,"metric":0,)"
        << R"("search":"coupling","shear_modulus_MPa":4.0,"strain":0.6}})"
        << "\n";
  }
  ~CouplingSearchLaw() override { std::filesystem::remove(settings_.resume); }
  CouplingSearchLaw(const CouplingSearchLaw&) = delete;
  CouplingSearchLaw& operator=(const CouplingSearchLaw&) = delete;

  void add(const std::string& unit, const std::string& result) {
    std::ofstream(settings_.resume, std::ios::app)
        << R"({"unit":")" << unit << R"(","result":)" << result << "}\n";
  }
  void add_seven() {
    add("coarse 10 5.5 2 0 11.5 0", "[7.5,13.3,0.82]");
    add("coarse 10 5.5 1.7 20 -20 0.5", "[9.5,15.3,1.15]");
    add("coarse 10 5.5 1.7 20 -10 0", "[9.0,15.6,1.12]");
    add("coarse 10 5.5 1.7 0 0 0", "null");
    add("coarse 10 5.5 1.7 20 0 0", "[9.7,16.6,1.25]");
    add("coarse 10 5.5 1.7 40 0 0", "[11.3,13.9,1.23]");
    add("coarse 10 5.5 1.7 20 -20 0", "[9.6,16.5,1.24]");
  }

  CouplingSearchSettings settings_;
};

TEST_F(CouplingSearchLaw, TakesWhatTheResumeFileHasAndComparesWithTheMostWork) {
  add_seven();
  for (const char* mesh : {"medium", "fine"}) {
    const std::string on = mesh;
    add(on + " 10 5.5 1.7 20 0 0", "[9.8,16.64,1.26]");
    add(on + " 10 5.5 1.7 20 -20 0.5", "null");
    add(on + " 10 5.5 1.7 20 -20 0", "[9.7,16.63,1.25]");
    add(on + " 10 5.5 1.7 20 -10 0", "[9.0,15.6,1.12]");
  }
  settings_.demand.limits.program = "no_such_solver";
  const CouplingSearch search = search_couplings(settings_);
  ASSERT_EQ(search.candidates.size(), 7U);
  EXPECT_EQ(search.candidates[search.reference].name, "epsilon");
  EXPECT_EQ(search.best, search.reference) << "no other one has more torque and more twist";
  EXPECT_FALSE(search.candidates[3].at_limit[2]);
  EXPECT_FALSE(search.candidates[3].is_on_front);
  EXPECT_TRUE(search.candidates[4].is_on_front);
  EXPECT_TRUE(search.candidates[5].is_on_front) << "less torque, more twist";
  EXPECT_FALSE(search.candidates[6].is_on_front);
  ASSERT_EQ(search.gains.size(), 3U);
  EXPECT_EQ(*search.gains[1].gain(), 0.0);
  EXPECT_EQ(*search.gains[2].gain(), 0.0);
  const DesignReport report = coupling_search_report(settings_, search);
  EXPECT_EQ(report.at("fine_mesh", "gain").value, 0.0);
  EXPECT_EQ(report.at("geometries_of_paper_003", "delta_torque").text, "not reached");
  EXPECT_THAT(report.notes.front(), HasSubstr("no gain of 10 %"));
}

TEST_F(CouplingSearchLaw, RefusesResultsOfAnotherSearchAndAMissingSolver) {
  settings_.shear_modulus_MPa = 5.0;
  EXPECT_THROW((void)search_couplings(settings_), Error);
  settings_.shear_modulus_MPa = 4.0;
  settings_.demand.limits.program = "no_such_solver";
  EXPECT_THAT(test::error_message([&] { (void)search_couplings(settings_); }),
              HasSubstr("calculix-ccx"));
}

TEST_F(CouplingSearchLaw, NamesThatNoneOfTheSevenReachesTheLimit) {
  for (const char* shape : {"2 0 11.5 0", "1.7 20 -20 0.5", "1.7 20 -10 0", "1.7 0 0 0",
                            "1.7 20 0 0", "1.7 40 0 0", "1.7 20 -20 0"})
    add(std::string("coarse 10 5.5 ") + shape, "null");
  EXPECT_THAT(test::error_message([&] { (void)search_couplings(settings_); }),
              HasSubstr("none of the seven geometries reaches the strain limit"));
}

TEST(CouplingGain, IsTheLeastOfTorqueAndTwist) {
  const CouplingGain gain{
      .mesh = "fine",
      .best = LimitPoint{.angle_deg = 11.0, .torque_Nm = 24.0, .work_J = 1.0},
      .reference = LimitPoint{.angle_deg = 10.0, .torque_Nm = 20.0, .work_J = 1.0}};
  EXPECT_NEAR(*gain.gain(), 0.1, 1e-12);
  EXPECT_NEAR(*gain.work_gain(), 0.0, 1e-12);
}

}  // namespace
}  // namespace torsio::design
