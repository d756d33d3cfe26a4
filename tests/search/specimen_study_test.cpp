#include "search/specimen_study.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/search/workers.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

TEST(SpecimenRange, IsAnActuatorWithTwoSerialNumbers) {
  const SpecimenRequest request = specimen_range("dfki-50#0003..#12");
  EXPECT_EQ(request.actuator, "dfki-50");
  EXPECT_EQ(request.first, 3U);
  EXPECT_EQ(request.last, 12U);
  for (const char* wrong : {"", "dfki-50", "dfki-50#1", "dfki-50#1..", "dfki-50#1..#x",
                            "dfki-50#..#2", "dfki-50#5..#2", "dfki-50#1..#99999999"})
    EXPECT_THAT(test::error_message([&] { (void)specimen_range(wrong); }), HasSubstr("--specimens"))
        << wrong;
}

TEST(SpecimenStudy, RefusesSeveralModels) {
  for (const char* several : {"linear,mlp", "all", "search", ""})
    EXPECT_THAT(test::error_message([&] { SpecimenStudy({.model = several}); }),
                HasSubstr("--models: expected one model"))
        << several;
  EXPECT_THAT(test::error_message([&] { SpecimenStudy({.model = "greybox"}); }),
              HasSubstr("grey_box"));
  EXPECT_NO_THROW(SpecimenStudy({.model = "mlp:layers=16-16:epochs=20"}));
}

std::vector<double> values_of(const SpecimenRequest& request, std::size_t threads) {
  SpecimenStudy kind(request);
  StudyStore store({});
  const StoredStudy study = store.create_or_resume({.name = "line",
                                                    .kind = std::string(kSpecimenStudy),
                                                    .spec = request_text(request),
                                                    .torsio_version = "1"},
                                                   kind.first_trials());
  run_workers(store, study, *specimen_study(study), {.threads = threads});
  std::vector<double> values;
  for (const TrialRecord& record : store.trials(study.id)) values.push_back(record.result.value);
  return values;
}

TEST(SpecimenStudy, IsTheSameForAnyNumberOfThreads) {
  const SpecimenRequest request{.first = 1, .last = 4, .duration_s = 4.0, .model = "linear"};
  const auto alone = values_of(request, 1);
  ASSERT_THAT(alone, SizeIs(4));
  for (const double value : alone) EXPECT_GT(value, 0.0);
  EXPECT_NE(alone[0], alone[1]);
  EXPECT_EQ(alone, values_of(request, 3));
}

TEST(SpecimenStudy, AnUnknownActuatorEndsTheWorker) {
  EXPECT_THAT(
      test::error_message([] { (void)values_of({.actuator = "dfki-51", .model = "linear"}, 2); }),
      HasSubstr("dfki-51"));
}

}  // namespace
}  // namespace torsio
