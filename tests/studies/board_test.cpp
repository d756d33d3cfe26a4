// The board without its recordings: sets, page, scores, and the refusals of files of predictions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "data/byte_source.hpp"
#include "studies/board_data.hpp"
#include "studies/board_predictions.hpp"
#include "studies/board_rows.hpp"
#include "studies/board_run.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string text_of_file(const std::string& relative) {
  std::ostringstream text;
  text << std::ifstream(std::filesystem::path(TORSIO_SOURCE) / relative).rdbuf();
  return text.str();
}

std::vector<BoardRow> all_rows() {
  std::vector<BoardRow> rows = recorded_board_rows();
  std::ranges::move(published_board_rows(), std::back_inserter(rows));
  return rows;
}

TEST(BoardPage, IsThatOfTheSetsAndRows) {
  EXPECT_EQ(text_of_file("docs/board.md"), board_page(all_rows()))
      << "write it again: torsio reproduce board --recorded --page docs/board.md";
}

TEST(BoardRows, AreWrittenAsTheyAreRead) {
  EXPECT_EQ(text_of_file("studies/board_rows.csv"), board_rows_csv(recorded_board_rows()));
}

TEST(BoardRows, AreOfEverySetAndOfEveryFamilyThatSuits) {
  for (const BoardSet& set : board_sets()) {
    SCOPED_TRACE(set.name);
    const std::vector<BoardRow> rows = rows_of(set, recorded_board_rows());
    const auto has = [&](const std::string& model) {
      return std::ranges::find(rows, model, &BoardRow::model) != rows.end();
    };
    if (set.folder == "xl330_pendulum") {
      EXPECT_TRUE(has("identify; terms chosen within the three gains"));
      continue;
    }
    EXPECT_TRUE(has("linear") && has("arx"));
    EXPECT_TRUE(has(set.folder == "boucwen" ? "dynamic_bouc_wen"
                    : set.folder == "emps"  ? "rigid_drive; 4 numbers"
                                            : "grey_box"));
  }
  for (const BoardRow& row : all_rows())
    EXPECT_NO_THROW(static_cast<void>(find_board_set(row.set, "a row")));
}

TEST(BoardRows, AreSortedWithFailuresLast) {
  const BoardSet& set = find_board_set("emps", "test");
  const std::vector<BoardRow> rows =
      rows_of(set, std::vector<BoardRow>{
                       measured_row("emps", "failed", BoardOrigin::measured, kNotMeasured),
                       measured_row("emps", "second", BoardOrigin::measured, 2.0),
                       measured_row("boucwen_multisine", "elsewhere", BoardOrigin::measured, 0.5),
                       measured_row("emps", "first", BoardOrigin::joined, 1.23456)});
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].model, "first");
  EXPECT_EQ(rows[0].text, "1.235");
  EXPECT_EQ(rows[1].model, "second");
  EXPECT_EQ(rows[2].model, "failed");
  EXPECT_THAT(board_table(set, rows), AllOf(HasSubstr("joined"), HasSubstr("RMSE m")));
}

TEST(BoardSets, HaveSourcesAndFilesWithHashes) {
  std::set<std::string_view> names;
  for (const BoardSet& set : board_sets()) {
    SCOPED_TRACE(set.name);
    EXPECT_TRUE(names.insert(set.name).second);
    EXPECT_EQ(source_of(set).folder, set.folder);
    EXPECT_GT(set.scored_samples, 0U);
    EXPECT_TRUE(set.is_split_official == set.split.starts_with("official"));
  }
  for (const BoardSource& source : board_sources())
    EXPECT_GT(std::ranges::count(board_files(), source.folder, &BoardFile::folder), 1)
        << source.folder;
  for (const BoardFile& file : board_files()) {
    EXPECT_EQ(file.sha256.size(), 64U) << file.file;
    EXPECT_TRUE(std::ranges::all_of(file.sha256, [](unsigned char letter) {
      return std::isxdigit(letter) != 0;
    })) << file.file;
  }
}

TEST(BoardSources, AreLeftOutWithTheAddressOfWhatIsMissing) {
  ::unsetenv("TORSIO_DATA");
  const TemporaryFolder folder;
  const BoardSource& source = source_of(find_board_set("emps", "test"));
  EXPECT_THAT(
      why_left_out(source, folder.path("")),
      AllOf(HasSubstr("emps/emps_est.csv.gz is missing"), HasSubstr("helonayala/narmax"),
            HasSubstr("/emps with  tools/board_files ORIGINALS "), HasSubstr("(TORSIO_DATA is")));
  EXPECT_THAT(why_left_out(source, ""),
              HasSubstr("$TORSIO_DATA/emps with  tools/board_files ORIGINALS $TORSIO_DATA  "
                        "(TORSIO_DATA is not set)"));
}

/// The message of the error that a call throws.
template <class Failure = Error>
std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Failure& error) {
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(BoardSources, RefuseAFileWithAnotherContent) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path("emps"));
  std::ofstream(folder.path("emps/emps_est.csv.gz")) << "t_s,vir_V,qm_m\n0,0,0\n";
  const BoardSource& source = source_of(find_board_set("emps", "test"));
  EXPECT_THAT(message_of([&] { static_cast<void>(why_left_out(source, folder.path(""))); }),
              AllOf(HasSubstr("emps_est.csv.gz"), HasSubstr("expected SHA-256 45c38edf079b"),
                    HasSubstr("found " + sha256_hex("t_s,vir_V,qm_m\n0,0,0\n")),
                    HasSubstr("Fetch it again from https://github.com/helonayala/narmax"),
                    HasSubstr("tools/board_files ORIGINALS FOLDER")));
}

/// A test recording of 30 samples at 1 kHz, of which the set scores 10.
Dataset small_dataset() {
  Dataset dataset;
  dataset.target = "qm_m";
  Recording recording("emps_val", 1000.0);
  std::vector<double> position_m;
  std::vector<double> voltage_V;
  constexpr std::size_t kSamples = 30;
  position_m.reserve(kSamples);
  voltage_V.reserve(kSamples);
  for (std::size_t n = 0; n < kSamples; ++n) {
    position_m.push_back(0.5 * static_cast<double>(n));
    voltage_V.push_back(static_cast<double>(n % 3));
  }
  recording.add({.name = "vir_V", .values = voltage_V});
  recording.add({.name = "qm_m", .values = position_m});
  dataset.records.push_back({std::move(recording), whole_record(kSamples, Role::test)});
  return dataset;
}

class BoardPredictions : public testing::Test {
 protected:
  /// Predictions that are too large by `error`, with one line for each scored sample.
  [[nodiscard]] static std::string file_of(
      double error, const std::string& head = "set,recording,sample,prediction_m",
      std::size_t first = 20, std::size_t end = 30) {
    std::string text = head + "\n";
    for (std::size_t n = first; n < end; ++n)
      text += "emps,emps_val," + std::to_string(n) + "," +
              std::to_string(0.5 * static_cast<double>(n) + error) + "\n";
    return text;
  }

  [[nodiscard]] BoardScore score(const std::string& text) const {
    const PredictionFile file = parse_predictions(text, "mine.csv");
    const std::vector<BoardTarget> targets = board_targets(*file.set, dataset_);
    return board_score(*file.set, targets, matched_predictions(file, dataset_, targets));
  }

  [[nodiscard]] std::string refusal(const std::string& text) const {
    return message_of([&] { static_cast<void>(score(text)); });
  }

  Dataset dataset_ = small_dataset();
};

TEST_F(BoardPredictions, AreScoredAtTheSamplesAfterTheStart) {
  const BoardScore scored = score(file_of(0.25));
  EXPECT_EQ(scored.samples, 10U);
  EXPECT_EQ(scored.without, 0U);
  EXPECT_NEAR(scored.error, 0.25, 1e-12);
  // What is predicted of the start is not scored.
  EXPECT_NEAR(score(file_of(0.25, "set,recording,sample,prediction_m", 0)).error, 0.25, 1e-12);
}

TEST_F(BoardPredictions, MayBeInAnyOrderWithCommentsAndFurtherColumns) {
  std::string text = "# by hand\nprediction_m, note, sample, set, recording\r\n";
  for (std::size_t n = 30; n-- > 20;)
    text += std::to_string(0.5 * static_cast<double>(n) + (n == 25 ? 1.0 : 0.0)) + ", x, " +
            std::to_string(n) + ", emps, emps_val\r\n";
  EXPECT_NEAR(score(text).error, std::sqrt(0.1), 1e-12);
}

TEST_F(BoardPredictions, MayBeGivenByTime) {
  std::string text = "set,recording,t_s,prediction_m\n";
  for (std::size_t n = 20; n < 30; ++n)
    text += "emps,emps_val,0.0" + std::to_string(n) + "," +
            std::to_string(0.5 * static_cast<double>(n)) + "\n";
  EXPECT_NEAR(score(text).error, 0.0, 1e-12);
  EXPECT_THAT(refusal("set,recording,t_s,prediction_m\nemps,emps_val,0.0205,1\n"),
              AllOf(HasSubstr("mine.csv: line 2, column t_s"), HasSubstr("no sample of emps_val"),
                    HasSubstr("found 0.0205")));
}

TEST_F(BoardPredictions, MayBeWrittenByAnySpreadsheetOrLanguage) {
  const std::string plain = file_of(0.25);
  EXPECT_NEAR(score("\xEF\xBB\xBF" + plain).error, 0.25, 1e-12);
  std::string old_ends = plain;
  std::ranges::replace(old_ends, '\n', '\r');
  EXPECT_NEAR(score(old_ends).error, 0.25, 1e-12);
  // R quotes text and names of columns; a table of real numbers has real sample numbers.
  std::string quoted = "\"set\",\"recording\",\"sample\",\"prediction_m\"\n";
  for (std::size_t n = 20; n < 30; ++n)
    quoted += "\"emps\",\"emps_val\"," + std::to_string(n) + ".0,+" +
              std::to_string(0.5 * static_cast<double>(n) + 0.25) + "\n";
  EXPECT_NEAR(score(quoted).error, 0.25, 1e-12);
  EXPECT_THAT(refusal("\xFF\xFEs"), HasSubstr("encoded in UTF-16"));
  EXPECT_THAT(refusal("set\trecording\tsample\tprediction_m\nemps\temps_val\t20\t1\n"),
              HasSubstr("line 1: the fields are separated by tabs"));
  EXPECT_THAT(refusal("set,recording,sample,prediction_m\nemps,emps_val,20.5,1\n"),
              HasSubstr("a whole number"));
}

TEST_F(BoardPredictions, HaveNoColumnThatContradictsAnother) {
  EXPECT_THAT(refusal("set,recording,sample,prediction_m,prediction_m\nemps,emps_val,20,1,2\n"),
              AllOf(HasSubstr("line 1: a column is there twice"), HasSubstr("one file for each")));
  EXPECT_THAT(refusal("set,recording,sample,sample,prediction_m\nemps,emps_val,20,21,2\n"),
              HasSubstr("a column is there twice"));
  EXPECT_THAT(refusal("set,recording,sample,t_s,prediction_m\nemps,emps_val,20,0.021,2\n"),
              AllOf(HasSubstr("line 2: sample and t_s contradict each other"),
                    HasSubstr("sample 21 at 0.021 s"), HasSubstr("found sample 20")));
  std::string both = "set,recording,sample,t_s,prediction_m\n";
  for (std::size_t n = 20; n < 30; ++n)
    both += "emps,emps_val," + std::to_string(n) + ",0.0" + std::to_string(n) + "," +
            std::to_string(0.5 * static_cast<double>(n)) + "\n";
  EXPECT_NEAR(score(both).error, 0.0, 1e-12);
}

TEST_F(BoardPredictions, MayBeLeftEmptyWhereNothingIsScored) {
  EXPECT_NEAR(score(file_of(0.0) + "emps,emps_val,3,\n").error, 0.0, 1e-12);
  EXPECT_THAT(refusal("set,recording,sample,prediction_m\nemps,emps_val,20,\n"),
              AllOf(HasSubstr("line 2"), HasSubstr("is empty or not finite")));
}

TEST_F(BoardPredictions, NeedTheirColumnsAndUnit) {
  EXPECT_THAT(refusal(file_of(0.0, "set,recording,prediction_m,x")),
              AllOf(HasSubstr("line 1"), HasSubstr("the column sample is missing"),
                    HasSubstr("--template")));
  EXPECT_THAT(refusal(file_of(0.0, "set,recording,sample,prediction")),
              HasSubstr("the column prediction_UNIT is missing"));
  EXPECT_THAT(refusal(file_of(0.0, "set,recording,sample,prediction_mm")),
              AllOf(HasSubstr("line 1: the predictions have another unit than the set emps"),
                    HasSubstr("expected a column prediction_m"), HasSubstr("found prediction_mm")));
  EXPECT_THAT(refusal("set,recording,sample,prediction_m\n"), HasSubstr("no predictions"));
  EXPECT_THAT(refusal("set;recording;sample;prediction_m\nemps;emps_val;20;0,5\n"),
              HasSubstr("line 1: the fields are separated by semicolons"));
}

TEST_F(BoardPredictions, AreOfOneKnownSetAndRecording) {
  EXPECT_THAT(
      message_of<UsageError>([&] {
        static_cast<void>(score("set,recording,sample,prediction_m\nempz,emps_val,20,1\n"));
      }),
      AllOf(HasSubstr("mine.csv: line 2"), HasSubstr("no set \"empz\""), HasSubstr("emps")));
  EXPECT_THAT(refusal(file_of(0.0) + "boucwen_multisine,test_multisine,0,1\n"),
              AllOf(HasSubstr("line 12"), HasSubstr("a file of predictions is for one set"),
                    HasSubstr("found boucwen_multisine")));
  EXPECT_THAT(refusal(file_of(0.0) + "emps,emps_est,0,1\n"),
              AllOf(HasSubstr("line 12, column recording"), HasSubstr("no such test recording"),
                    HasSubstr("emps_val"), HasSubstr("found \"emps_est\"")));
}

TEST_F(BoardPredictions, AreCompleteOnceAndFinite) {
  EXPECT_THAT(refusal(file_of(0.0, "set,recording,sample,prediction_m", 22)),
              HasSubstr("2 of 10 scored samples have no prediction, the first is sample 20 of "
                        "emps_val"));
  EXPECT_THAT(refusal(file_of(0.0) + "emps,emps_val,25,1\n"),
              AllOf(HasSubstr("line 12"), HasSubstr("sample 25 of emps_val is predicted twice, "
                                                    "first in line 7")));
  EXPECT_THAT(
      refusal(file_of(0.0, "set,recording,sample,prediction_m", 21) + "emps,emps_val,20,nan\n"),
      AllOf(HasSubstr("line 11"), HasSubstr("is empty or not finite")));
  EXPECT_THAT(refusal("set,recording,sample,prediction_m\nemps,emps_val,20,1 mm\n"),
              AllOf(HasSubstr("line 2, column prediction_m"), HasSubstr("found \"1 mm\"")));
  EXPECT_THAT(refusal("set,recording,sample,prediction_m\nemps,emps_val,-1,1\n"),
              AllOf(HasSubstr("line 2, column sample"), HasSubstr("a whole number")));
  EXPECT_THAT(refusal(file_of(0.0) + "emps,emps_val,30,1\n"),
              AllOf(HasSubstr("emps_val has no sample 30"), HasSubstr("expected 0 to 29")));
  EXPECT_THAT(refusal("set,recording,sample,prediction_m\nemps,emps_val,20\n"),
              AllOf(HasSubstr("line 2"), HasSubstr("expected 4"), HasSubstr("found 3")));
}

TEST(BoardScores, AreMeansOverRecordingsWhereTheSetAsksForIt) {
  const BoardSet& servo = find_board_set("xl330_gain", "test");
  const std::vector<BoardTarget> targets{{"a", {1, 2}, {0.0, 0.0}}, {"b", {1}, {0.0}}};
  const std::vector<std::vector<double>> predictions{{1.0, -3.0}, {4.0}};
  EXPECT_DOUBLE_EQ(board_score(servo, targets, predictions).error, 3.0);
  const BoardSet& emps = find_board_set("emps", "test");
  EXPECT_DOUBLE_EQ(board_score(emps, targets, predictions).error, std::sqrt(26.0 / 3.0));
  const std::vector<std::vector<double>> unsettled{{kNotMeasured, -3.0}, {3.0}};
  const BoardScore score = board_score(emps, targets, unsettled);
  EXPECT_DOUBLE_EQ(score.error, 3.0);
  EXPECT_EQ(score.without, 1U);
}

TEST(BoardSamples, HideTheTargetWhereItIsScored) {
  const BoardSet& set = find_board_set("emps", "test");
  const std::string csv = board_samples(set, small_dataset(), BoardPart::test);
  EXPECT_TRUE(csv.starts_with("set,recording,sample,t_s,scored_1,vir_V,qm_m\n"));
  EXPECT_THAT(csv, AllOf(HasSubstr("\nemps,emps_val,19,0.019,0,1,9.5\n"),
                         HasSubstr("\nemps,emps_val,20,0.02,1,2,\n"),
                         HasSubstr("\nemps,emps_val,29,0.029,1,2,\n")));
  EXPECT_EQ(board_samples(set, small_dataset(), BoardPart::training), "");
}

TEST(BoardSamples, OfBlocksHaveTheTargetsOfTheTraining) {
  Dataset dataset = small_dataset();
  dataset.records.front().segments = {{0, 22, Role::train}, {24, 30, Role::test}};
  const BoardSet& set = find_board_set("emps", "test");
  const std::string test = board_samples(set, dataset, BoardPart::test);
  EXPECT_THAT(test, AllOf(HasSubstr(",21,0.021,0,0,10.5\n"), HasSubstr(",22,0.022,0,1,\n"),
                          HasSubstr(",24,0.024,1,0,\n")));
  const std::string training = board_samples(set, dataset, BoardPart::training);
  EXPECT_THAT(training, AllOf(HasSubstr("t_s,train_1,vir_V"), HasSubstr(",21,0.021,1,0,10.5\n"),
                              HasSubstr(",24,0.024,0,0,\n")));
}

TEST(BoardNames, HaveNoSignThatSeparatesFields) {
  EXPECT_NO_THROW(require_board_name("my network (64 units)", "--name"));
  for (const char* name : {"", "  ", "a,b", "a|b", "a\"b", "a\nb"})
    EXPECT_THROW(require_board_name(name, "--name"), UsageError) << name;
  EXPECT_EQ(board_model_name("lstm, 32 cells"), "lstm; 32 cells");
}

}  // namespace
}  // namespace torsio
