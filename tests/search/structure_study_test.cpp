#include "torsio/search/structure_study.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <set>

#include "fit/common/passes.hpp"
#include "fleet/study_kinds.hpp"
#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/write.hpp"
#include "torsio/search/workers.hpp"

namespace torsio {
namespace {

using testing::AnyOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr const char* kModels =
    "linear,polynomial:degree=1,polynomial:degree=2,polynomial:degree=3,polynomial:degree=5,"
    "maxwell_slip:thresholds=2,maxwell_slip:thresholds=4,linear_coulomb";

Dataset three_recordings(std::size_t samples = 12'000) {
  Dataset dataset;
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    test::add_record(
        dataset,
        test::bench_recording(fmt::format("record {}", seed), {.samples = samples, .seed = seed}),
        Role::train);
  return dataset;
}

/// The scores that do not depend on the machine.
std::string table_of(const CrossValidation& validation) {
  std::string text;
  for (const FoldSummary& summary : validation.ranking)
    text +=
        fmt::format("{} {} {} {} {:a} {:a} {:a} {} {}\n", summary.family, summary.variant,
                    summary.status, summary.reason, summary.rmse.mean, summary.common_rmse.mean,
                    summary.common_max_abs.std_dev, summary.worst_fold, summary.parameter_count);
  for (const ResultRow& row : validation.results.rows)
    text += fmt::format("{} {} {} {} {:a} {:a}\n", row.family, row.variant, row.fold,
                        row.recording.value_or(""), row.score.metrics.rmse, row.score.common.rmse);
  return text;
}

TEST(StructureSearch, WithoutHalvingItIsTheCrossValidation) {
  const Dataset dataset = three_recordings();
  const auto choices = model_choices(dataset, kModels, {});
  const StructureSearch search =
      search_structures(dataset, choices, {.halving = Halving::off}, {}, 2);
  EXPECT_EQ(table_of(search.scores),
            table_of(cross_validate(dataset, choices, {.folds = kSearchFolds}, 1, false)));
}

TEST(StructureSearch, IsTheSameForAnyNumberOfThreads) {
  const Dataset dataset = three_recordings();
  const auto choices = model_choices(dataset, kModels, {});
  const std::string alone =
      table_of(search_structures(dataset, choices, {.halve_from_s = 0.0}, {}, 1).scores);
  EXPECT_EQ(alone,
            table_of(search_structures(dataset, choices, {.halve_from_s = 0.0}, {}, 2).scores));
  EXPECT_EQ(alone,
            table_of(search_structures(dataset, choices, {.halve_from_s = 0.0}, {}, 5).scores));
}

std::map<std::string, int> by_status(const StructureSearch& search, const std::string& family) {
  std::map<std::string, int> counts;
  for (const FoldSummary& summary : search.scores.ranking)
    if (family.empty() || summary.family == family) ++counts[summary.status];
  return counts;
}

TEST(StructureSearch, HalvingKeepsTheBetterHalfOfEachFamilyAndStatesWhy) {
  const Dataset dataset = three_recordings();
  const auto choices = model_choices(dataset, kModels, {});
  const StructureSearch all = search_structures(dataset, choices, {.halving = Halving::off});
  const StructureSearch halved = search_structures(dataset, choices, {.halve_from_s = 0.0});
  EXPECT_THAT(halved.winners, SizeIs(all.winners.size()));
  EXPECT_EQ(halved.winners.front().family, all.winners.front().family);
  EXPECT_EQ(halved.winners.front().variant(), all.winners.front().variant());
  EXPECT_EQ(by_status(halved, "polynomial"),
            (std::map<std::string, int>{{"ok", 2}, {"pruned", 2}}));
  EXPECT_EQ(by_status(halved, "linear"), (std::map<std::string, int>{{"ok", 1}}));
  for (const FoldSummary& summary : halved.scores.ranking)
    if (summary.status == "pruned") {
      EXPECT_THAT(summary.reason, testing::AllOf(HasSubstr("halving step 1"), HasSubstr("RMSE")));
    }
}

TEST(StructureSearch, HalvingOfAllMayLoseFamiliesButKeepsTheBest) {
  const Dataset dataset = three_recordings();
  const auto choices = model_choices(dataset, kModels, {});
  const StructureSearch all = search_structures(dataset, choices, {.halving = Halving::off});
  const StructureSearch halved = search_structures(dataset, choices, {.halving = Halving::by_all});
  EXPECT_EQ(by_status(halved, ""), (std::map<std::string, int>{{"ok", 2}, {"pruned", 6}}));
  EXPECT_EQ(halved.winners.front().variant(), all.winners.front().variant());
}

TEST(StructureSearch, QuickFamiliesAreNotHalved) {
  const Dataset dataset = three_recordings();
  const StructureSearch search =
      search_structures(dataset, model_choices(dataset, kModels, {}), {});
  EXPECT_FALSE(by_status(search, "").contains("pruned"));
}

TEST(StructureSearch, TheSearchOfAFitIsCutWhereItHasALimit) {
  const Dataset dataset = three_recordings();
  const auto choices = model_choices(dataset, "mlp:layers=2,mlp:layers=8-8", {});
  const StructureSearch search = search_structures(dataset, choices, {.halve_from_s = 0.0});
  EXPECT_EQ(by_status(search, ""), (std::map<std::string, int>{{"ok", 1}, {"pruned", 1}}));
  EXPECT_THAT(search.scores.ranking.back().reason, HasSubstr("25 % of the epochs"));
}

TEST(StructureSearch, ShortRecordingsAreNotHalved) {
  const Dataset dataset = three_recordings(2500);
  const StructureSearch search =
      search_structures(dataset, model_choices(dataset, kModels, {}), {.halve_from_s = 0.0});
  EXPECT_FALSE(by_status(search, "").contains("pruned"));
}

TEST(StructureStudy, AFitThatFailsOnAPartOfTheSamplesContinues) {
  StructureStudy kind(
      three_recordings(),
      model_choices(three_recordings(),
                    "polynomial:degree=1,polynomial:degree=2,polynomial:degree=3", {}),
      {.halve_from_s = 0.0});
  std::vector<TrialRecord> records;
  const std::vector<Trial> trials = kind.first_trials();
  ASSERT_THAT(trials, SizeIs(3));
  for (const double value : {0.3, kNotMeasured, 0.2}) {
    TrialRecord& record = records.emplace_back();
    record.id = static_cast<std::int64_t>(records.size());
    record.trial = trials[records.size() - 1];
    record.result.value = value;
  }
  const HalvingDecision decision = kind.decide("polynomial", 0, records);
  ASSERT_THAT(decision.pruned, SizeIs(1));
  EXPECT_EQ(decision.pruned[0].trial, 1);
  EXPECT_THAT(decision.pruned[0].reason, HasSubstr("RMSE 0.3, place 2 of 2"));
  std::set<std::string> next;
  for (const Trial& trial : decision.next) next.insert(trial.key.substr(0, trial.key.find('|')));
  EXPECT_EQ(next, (std::set<std::string>{"polynomial[degree=2]", "polynomial[degree=3]"}));
}

TEST(StructureSearch, AWrongSettingEndsIt) {
  const Dataset dataset = three_recordings();
  std::vector<ModelChoice> choices = model_choices(dataset, "linear,viscoelastic", {});
  choices.back().options["network"] = "series(kv(k1=1";
  EXPECT_THROW((void)search_structures(dataset, choices, {}), UsageError);
}

TEST(StructureSearch, SearchesForALeakOnceForAllFoldsAndSteps) {
  const Dataset dataset = three_recordings();
  const auto choices = model_choices(dataset, kModels, {});
  const std::size_t before = passes().leak_searches;
  (void)search_structures(dataset, choices, {.halve_from_s = 0.0}, {}, 2);
  EXPECT_EQ(passes().leak_searches - before, 1U);
}

TEST(StructureSearch, StopsWhenAsked) {
  const Dataset dataset = three_recordings();
  const auto choices = model_choices(dataset, "mlp:epochs=100000:patience=0", {});
  std::atomic<int> calls = 0;
  EXPECT_THROW((void)search_structures(dataset, choices, {},
                                       [&](double, std::string_view) { return ++calls < 3; }),
               Cancelled);
}

/// Three recordings as files, and a study over them.
class KeptStudy : public testing::Test {
 protected:
  void SetUp() override {
    for (const DatasetRecord& record : three_recordings().records) {
      request_.recordings.push_back(folder_.path(record.recording.name() + ".csv"));
      write_recording(record.recording, request_.recordings.back());
    }
    request_.models = kModels;
    request_.settings.halve_from_s = 0.0;
  }

  [[nodiscard]] StudyStore store() const {
    return StudyStore(store_address(folder_.path("studies.sqlite")));
  }

  StoredStudy begin(StudyStore& store) {
    const Dataset dataset = load_search_data(request_);
    StructureStudy kind(dataset, search_choices(dataset, request_), request_.settings);
    return store.create_or_resume({.name = "elbow",
                                   .kind = std::string(kStructureStudy),
                                   .spec = request_text(request_, dataset),
                                   .torsio_version = "1"},
                                  kind.first_trials());
  }

  TemporaryFolder folder_;
  SearchRequest request_;
};

TEST_F(KeptStudy, AStoppedStudyGoesOnWithoutRepeatingATrial) {
  StudyStore first = store();
  const StoredStudy study = begin(first);
  const auto kind = make_study_kind(study);
  constexpr int kDone = 4;
  for (int k = 0; k < kDone; ++k) {
    const auto claim = first.claim(study.id, "stopped", 60.0);
    ASSERT_TRUE(claim);
    EXPECT_TRUE(first.finish(*claim, kind->run(*claim, {})));
  }
  StudyStore second = store();
  EXPECT_EQ(begin(second).id, study.id);
  const auto again = structure_study(*second.find_study("elbow"));
  const WorkersReport report = run_workers(second, study, *again, {.threads = 2});
  const auto trials = second.trials(study.id);
  EXPECT_EQ(report.finished, trials.size() - kDone);
  for (const TrialRecord& trial : trials) EXPECT_EQ(trial.attempt, 1) << trial.trial.key;
  const Dataset dataset = load_search_data(request_);
  EXPECT_EQ(
      table_of(again->result(second, study.id).scores),
      table_of(
          search_structures(dataset, search_choices(dataset, request_), request_.settings).scores));
}

TEST_F(KeptStudy, ARecordingThatChangedIsRefused) {
  StudyStore kept = store();
  const StoredStudy study = begin(kept);
  write_recording(test::bench_recording("record 2", {.seed = 9}), request_.recordings[1]);
  EXPECT_THAT(test::error_message([&] { (void)make_study_kind(study); }),
              testing::AllOf(HasSubstr("record 2.csv"), HasSubstr("has changed")));
}

TEST_F(KeptStudy, AnotherKindIsRefused) {
  EXPECT_THAT(
      test::error_message([] {
        (void)make_study_kind({.name = "x", .kind = "later", .spec = {}, .torsio_version = "9.9"});
      }),
      HasSubstr("9.9"));
}

TEST_F(KeptStudy, InputSetsAreCompared) {
  request_.models = "linear";
  request_.inputs = {{"spring_deflection_rad"},
                     {"spring_deflection_rad", "lowpass(spring_deflection_rate_rad_s, 10Hz)"}};
  const Dataset dataset = load_search_data(request_);
  const StructureSearch search =
      search_structures(dataset, search_choices(dataset, request_), {.halving = Halving::off});
  ASSERT_THAT(search.scores.ranking, SizeIs(2));
  EXPECT_NE(search.scores.ranking[0].input_set, search.scores.ranking[1].input_set);
}

}  // namespace
}  // namespace torsio
