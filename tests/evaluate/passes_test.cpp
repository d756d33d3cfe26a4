// How often a verb runs its recordings: each pass over a long recording takes as long as the fit of a
// simple model.
#include "fit/common/passes.hpp"

#include <gtest/gtest.h>

#include "support/bench_dataset.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/fit_report.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/report/html/verb_reports.hpp"

namespace torsio {
namespace {

/// The passes since this was made.
class PassesSince {
 public:
  [[nodiscard]] std::size_t training_data() const { return passes().training_data - data_; }
  [[nodiscard]] std::size_t predictions() const { return passes().predictions - predictions_; }
  [[nodiscard]] std::size_t leak_searches() const { return passes().leak_searches - searches_; }

 private:
  std::size_t data_ = passes().training_data;
  std::size_t predictions_ = passes().predictions;
  std::size_t searches_ = passes().leak_searches;
};

/// Two recordings for training, one of each other role, and one that has parts of two roles.
Dataset dataset_of_all_roles() {
  Dataset dataset = test::bench_dataset();
  test::add_record(dataset, test::bench_recording("validation"), Role::validation);
  Recording divided = test::bench_recording("divided");
  const std::size_t half = divided.size() / 2;
  dataset.records.push_back({.recording = std::move(divided),
                             .segments = {{0, half, Role::train}, {half, 2 * half, Role::test}}});
  return dataset;
}

TEST(Passes, AFitWithItsPageRunsEachRecordingOnce) {
  const Dataset dataset = dataset_of_all_roles();
  const FeatureSpec features = resolve_inputs(dataset, {});
  const PassesSince made;
  const FitCheck check = check_for_fit(dataset, features, false);
  const ReportedFit fit = fit_and_report(dataset, check, {"linear", {}, "", features}, {.seed = 1});
  EXPECT_EQ(fit_page(fit, "m.safetensors", dataset).sections.front().heading, "Scores");
  EXPECT_EQ(made.leak_searches(), 1U);
  EXPECT_EQ(made.training_data(), 3U);  // one for each role
  EXPECT_EQ(made.predictions(), dataset.records.size());
}

TEST(Passes, AnEvaluationWithItsPageRunsEachRecordingOnce) {
  const Dataset dataset = dataset_of_all_roles();
  const ModelFile file =
      train_model(dataset, {"linear", {}, "", resolve_inputs(dataset, {})}, 1).file;
  const PassesSince made;
  const auto runs = scored_runs(make_estimator(file), dataset);
  const Results results = evaluate_model(file, dataset, runs);
  (void)evaluation_report(results, runs, file, "m.safetensors", dataset);
  EXPECT_EQ(made.training_data(), 0U);
  EXPECT_EQ(made.predictions(), dataset.records.size());
}

TEST(Passes, AScoreOfSeveralRolesRunsEachRecordingOnce) {
  const Dataset dataset = dataset_of_all_roles();
  const ModelFile file =
      train_model(dataset, {"linear", {}, "", resolve_inputs(dataset, {})}, 1).file;
  const PassesSince made;
  const Results results = evaluate_model(file, dataset);
  EXPECT_EQ(made.predictions(), dataset.records.size());
  EXPECT_EQ(results.rows.size(),
            evaluate_model(file, dataset, scored_runs(make_estimator(file), dataset)).rows.size());
}

}  // namespace
}  // namespace torsio
