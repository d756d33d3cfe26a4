// The sets of the board with their recordings: what is scored, and a participant's way from template to score.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "studies/board_data.hpp"
#include "studies/board_predictions.hpp"
#include "studies/board_rows.hpp"
#include "torsio/evaluate/comparison.hpp"

namespace torsio {
namespace {

/// The recordings beside the checkout, where TORSIO_DATA does not name a folder; empty: none.
std::string folder_of_recordings() {
  if (!board_folder().empty()) return board_folder();
  const std::string beside = std::string(TORSIO_REAL_DATA) + "/../../../shared/data";
  if (!std::filesystem::exists(beside)) return {};
  // NOLINTNEXTLINE(concurrency-mt-unsafe): before any thread
  setenv("TORSIO_DATA", beside.c_str(), 1);
  return beside;
}

class Board : public testing::TestWithParam<std::string> {
 protected:
  [[nodiscard]] static const BoardSet& set() { return find_board_set(GetParam(), "test"); }
  void SetUp() override {
    const std::string reason = why_left_out(source_of(set()), folder_of_recordings());
    if (!reason.empty()) GTEST_SKIP() << reason;
  }
};

TEST_P(Board, ScoresTheSamplesThatItStates) {
  const ComparisonCase data = board_case(set());
  std::size_t samples = 0;
  for (const BoardTarget& target : board_targets(set(), data.dataset))
    samples += target.samples.size();
  EXPECT_EQ(samples, set().scored_samples);
}

TEST_P(Board, ScoresAFileThatIsWrittenFromItsTemplate) {
  const BoardSet& set = Board::set();
  const ComparisonCase data = board_case(set);
  const std::vector<BoardTarget> targets = board_targets(set, data.dataset);
  // Every scored sample of the template is predicted as 0: the score is the size of the target.
  std::istringstream lines(board_samples(set, data.dataset, BoardPart::test));
  std::string line;
  std::getline(lines, line);
  std::string file = "set,recording,sample,prediction_" + std::string(set.unit) + "\n";
  while (std::getline(lines, line)) {
    std::vector<std::string> fields;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) fields.push_back(cell);
    ASSERT_GE(fields.size(), 5U);
    if (fields[4] == "0") continue;
    EXPECT_EQ(line.back(), ',') << "the target of a scored sample is in the template";
    file += fields[0] + "," + fields[1] + "," + fields[2] + ",0\n";
  }
  const PredictionFile predictions = parse_predictions(file, "zero.csv");
  const BoardScore score =
      board_score(set, targets, matched_predictions(predictions, data.dataset, targets));
  EXPECT_EQ(score.samples, set.scored_samples);
  double square_sum = 0.0;
  double mean_abs = 0.0;
  for (const BoardTarget& target : targets)
    for (const double value : target.values) {
      square_sum += value * value;
      mean_abs += std::abs(value) / static_cast<double>(target.values.size() * targets.size());
    }
  const double expected = set.measure == BoardMeasure::rmse
                              ? std::sqrt(square_sum / static_cast<double>(set.scored_samples))
                              : mean_abs;
  EXPECT_NEAR(score.error, expected, 1e-9 * expected);
}

// The duty of a servo's drive is its position error times the gain.
TEST(BoardOfTheServo, HidesWhatFollowsFromTheAngle) {
  const BoardSet& set = find_board_set("xl330_gain", "test");
  if (!why_left_out(source_of(set), folder_of_recordings()).empty())
    GTEST_SKIP() << "set TORSIO_DATA to the folder of the recordings";
  const ComparisonCase data = board_case(set);
  const std::string test = board_samples(set, data.dataset, BoardPart::test);
  const std::string header = test.substr(0, test.find('\n'));
  EXPECT_EQ(header.find("duty_1"), std::string::npos);
  EXPECT_EQ(header.find("joint_speed_rad_s"), std::string::npos);
  EXPECT_NE(header.find("goal_angle_rad"), std::string::npos);
  const std::string training = board_samples(set, data.dataset, BoardPart::training);
  EXPECT_NE(training.substr(0, training.find('\n')).find("duty_1"), std::string::npos);
}

TEST_P(Board, HasTheTrainingSamplesOfItsSplit) {
  const ComparisonCase data = board_case(set());
  const std::string csv = board_samples(set(), data.dataset, BoardPart::training);
  EXPECT_TRUE(csv.starts_with("set,recording,sample,t_s,train_1,"));
  EXPECT_GT(std::ranges::count(csv, '\n'), 1000);
}

std::vector<std::string> set_names() {
  std::vector<std::string> names;
  names.reserve(board_sets().size());
  for (const BoardSet& set : board_sets()) names.emplace_back(set.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(OfPublicRecordings, Board, testing::ValuesIn(set_names()),
                         [](const auto& of) { return of.param; });

// The recorded figures are those of this code: a model whose fit takes milliseconds is fitted again.
TEST(BoardOfEmps, HasTheErrorOfTheLinearModel) {
  const BoardSet& set = find_board_set("emps", "test");
  if (!why_left_out(source_of(set), folder_of_recordings()).empty())
    GTEST_SKIP() << "set TORSIO_DATA to the folder of the recordings";
  const ComparisonCase data = board_case(set);
  const auto choices = model_choices(data.dataset, "linear", data.inputs);
  const Results results = compare(data.dataset, choices, 1, false).results;
  const auto row = std::ranges::find_if(results.rows, [](const ResultRow& each) {
    return each.split == Role::test && each.recording.has_value();
  });
  ASSERT_NE(row, results.rows.end());
  const std::vector<BoardRow> rows = rows_of(set, recorded_board_rows());
  const auto recorded = std::ranges::find(rows, "linear", &BoardRow::model);
  ASSERT_NE(recorded, rows.end());
  EXPECT_NEAR(recorded->error, row->score.metrics.rmse, 1e-3 * recorded->error);
}

}  // namespace
}  // namespace torsio
