#include "studies/study_cache.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <variant>

#include "studies/studies.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "support/temporary_folder.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr std::uint64_t kProgram = 7;

StudyOutcome outcome_with_figures() {
  XyFigure plane{.title = "loops", .x = {.label = "rad"}, .y = {.label = "Nm"}, .series = {}};
  plane.series.push_back({.label = "spring",
                          .style = CurveStyle::points,
                          .role = CurveRole::measured,
                          .x = {1.0, std::nan(""), 3.0},
                          .y = {0.1, 1e300, -0.0},
                          .names = {"a", "b", "c"}});
  TimeFigure time{.title = "course", .rate_Hz = 500.0, .samples = 2, .marks = {{.label = "stop"}}};
  time.panels.push_back(
      {.label = "Nm", .series = {{.label = "sensor", .overview = {1.5F, 2.5F}, .detail = {}}}});
  FieldFigure field{.title = "strain", .value_label = "1", .highest = 0.4, .areas = {}};
  field.areas.push_back({.corners = {{{0.0, 1.0}}, {{2.0, 3.0}}}, .value = 0.2});
  return {.text = "table\n",
          .json = "{}\n",
          .figures = {plane, time, field},
          .figure_columns = 2,
          .seconds = 12.5};
}

class StudyCaches : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path only_file() const {
    return std::filesystem::directory_iterator(cache_.folder())->path();
  }
  /// The message about the kept file with other bytes.
  std::string message_with(const std::string& bytes) {
    cache_.keep(study_, {}, outcome_with_figures());
    std::ofstream(only_file(), std::ios::binary) << bytes;
    return test::error_message([&] { (void)cache_.find(study_, {}); });
  }

  TemporaryFolder folder_;
  const StudyInfo& study_ = find_study("002-design");
  StudyCache cache_{folder_.path("cache"), kProgram};
};

TEST_F(StudyCaches, ReturnWhatWasKept) {
  EXPECT_FALSE(cache_.find(study_, {}));
  const StudyOutcome kept = outcome_with_figures();
  cache_.keep(study_, {}, kept);
  const auto found = cache_.find(study_, {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->text, kept.text);
  EXPECT_EQ(found->json, kept.json);
  EXPECT_EQ(found->figure_columns, kept.figure_columns);
  EXPECT_EQ(found->seconds, kept.seconds);
  ASSERT_EQ(found->figures.size(), 3U);
  const auto& plane = std::get<XyFigure>(found->figures[0]);
  EXPECT_EQ(plane.title, "loops");
  EXPECT_EQ(plane.series[0].style, CurveStyle::points);
  EXPECT_EQ(plane.series[0].role, CurveRole::measured);
  EXPECT_TRUE(std::isnan(plane.series[0].x[1]));
  EXPECT_EQ(plane.series[0].y[1], 1e300);
  EXPECT_TRUE(std::signbit(plane.series[0].y[2]));
  EXPECT_EQ(plane.series[0].names[2], "c");
  const auto& time = std::get<TimeFigure>(found->figures[1]);
  EXPECT_EQ(time.rate_Hz, 500.0);
  EXPECT_EQ(time.marks[0].label, "stop");
  EXPECT_EQ(time.panels[0].series[0].overview[1], 2.5F);
  const auto& field = std::get<FieldFigure>(found->figures[2]);
  EXPECT_EQ(field.areas[0].corners[1][1], 3.0);
}

TEST_F(StudyCaches, KnowOnlyTheSameStudyOptionsAndProgram) {
  cache_.keep(study_, {}, outcome_with_figures());
  EXPECT_FALSE(cache_.find(find_study("000-brake"), {}));
  EXPECT_FALSE(cache_.find(study_, {.seed = 2}));
  EXPECT_FALSE(cache_.find(study_, {.repeats = 4}));
  EXPECT_FALSE(cache_.find(study_, {.is_quick = true}));
  EXPECT_FALSE(StudyCache(cache_.folder(), kProgram + 1).find(study_, {}));
  // Another program's outcome takes the place of the old one: the folder does not grow with each build.
  StudyCache(cache_.folder(), kProgram + 1).keep(study_, {}, outcome_with_figures());
  EXPECT_FALSE(cache_.find(study_, {}));
  EXPECT_TRUE(std::filesystem::is_regular_file(only_file()));
}

TEST_F(StudyCaches, KeepNoStudyThatDependsOnRecordingsOrAnotherProgram) {
  cache_.keep(find_study("model-comparison"), {}, outcome_with_figures());
  EXPECT_FALSE(std::filesystem::exists(cache_.folder()));
  EXPECT_FALSE(cache_.find(find_study("model-comparison"), {}));
}

TEST_F(StudyCaches, RefuseADamagedFileAndAnotherFormat) {
  EXPECT_THAT(message_with("not CBOR"), AllOf(HasSubstr("002-design"), HasSubstr("damaged")));
  EXPECT_THAT(message_with(""), HasSubstr("damaged"));
  const std::string whole = test::file_bytes(only_file().string());
  for (const std::size_t size : {std::size_t{1}, whole.size() / 2})
    EXPECT_THAT(message_with(whole.substr(0, size)), HasSubstr("damaged"));
  const auto bytes = nlohmann::json::to_cbor({{"format", "torsio study"}, {"format_version", 99}});
  EXPECT_THAT(message_with({bytes.begin(), bytes.end()}), HasSubstr("another format"));
  // A file of this format with an entry of another kind.
  const auto wrong = nlohmann::json::to_cbor(
      {{"format", "torsio study"}, {"format_version", 1}, {"program", "seven"}});
  EXPECT_THAT(message_with({wrong.begin(), wrong.end()}), HasSubstr("damaged"));
}

TEST_F(StudyCaches, CannotKeepInAFolderThatIsAFile) {
  folder_.file("file", "x");
  const StudyCache blocked(folder_.path("file"), kProgram);
  EXPECT_THAT(test::error_message([&] { blocked.keep(study_, {}, outcome_with_figures()); }),
              HasSubstr("file"));
}

TEST(StudyCacheFolder, IsThatOfTheUser) {
  ::setenv("HOME", "/home/somebody", 1);
  ::unsetenv("XDG_CACHE_HOME");
  EXPECT_EQ(study_cache_folder(), "/home/somebody/.cache/torsio/studies");
  ::setenv("XDG_CACHE_HOME", "/elsewhere", 1);
  EXPECT_EQ(study_cache_folder(), "/elsewhere/torsio/studies");
  ::setenv("XDG_CACHE_HOME", "relative", 1);
  EXPECT_EQ(study_cache_folder(), "/home/somebody/.cache/torsio/studies");
  ::unsetenv("XDG_CACHE_HOME");
  ::unsetenv("HOME");
  EXPECT_TRUE(study_cache_folder().empty());
}

TEST(RunningProgramHash, IsThatOfItsBytes) {
  EXPECT_EQ(running_program_hash(), running_program_hash());
  EXPECT_NE(running_program_hash(), 0U);
}

}  // namespace
}  // namespace torsio
