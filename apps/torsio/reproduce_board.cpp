#include "reproduce_board.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include "common/data_flags.hpp"
#include "common/progress_bar.hpp"
#include "core/running_mean.hpp"
#include "studies/board_data.hpp"
#include "studies/board_predictions.hpp"
#include "studies/board_rows.hpp"
#include "studies/board_run.hpp"
#include "studies/studies.hpp"
#include "studies/study_report.hpp"
#include "torsio/core/error.hpp"

namespace {

constexpr std::string_view kBoard = "board";

[[noreturn]] void refuse_board(std::string_view option, std::string problem) {
  throw torsio::UsageError(
      {.place = fmt::format("torsio reproduce board{}{}", option.empty() ? "" : " ", option),
       .problem = std::move(problem)});
}

/// The rows of this program, with those of others.
std::vector<torsio::BoardRow> known_rows() {
  std::vector<torsio::BoardRow> rows = torsio::recorded_board_rows();
  std::ranges::move(torsio::published_board_rows(), std::back_inserter(rows));
  return rows;
}

/// Refuses to replace a file of rows by one without those that were added to it since this program was built.
void require_its_rows(const std::string& file, const std::vector<torsio::BoardRow>& rows) {
  std::ifstream stream(file);
  const std::string text = torsio::board_rows_csv(rows);
  std::string line;
  // Another file, or none, is replaced as that of any -o.
  if (!std::getline(stream, line) || line != text.substr(0, text.find('\n'))) return;
  const auto key_of = [](const std::string& row) {
    return row.substr(0, row.find(',', row.find(',') + 1));
  };
  std::set<std::string> known;
  std::istringstream own(text);
  while (std::getline(own, line)) known.insert(key_of(line));
  for (std::size_t number = 2; std::getline(stream, line); ++number)
    if (!line.empty() && !known.contains(key_of(line)))
      throw torsio::Error({.place = fmt::format("{}:{}", file, number),
                           .problem = "this program does not have the row, which would be lost",
                           .found = line,
                           .advice =
                               "Build the program again: it reads studies/board_rows.csv when it "
                               "is built. Or write to another file."});
}

/// Removes the row of an earlier prediction of that name; that of a family or a publication is refused.
void give_way(std::vector<torsio::BoardRow>& rows, const torsio::BoardSet& set,
              const std::string& name) {
  const auto same = std::ranges::find_if(
      rows, [&](const torsio::BoardRow& row) { return row.set == set.name && row.model == name; });
  if (same == rows.end()) return;
  if (same->origin != torsio::BoardOrigin::joined)
    throw torsio::UsageError(
        {.place = "torsio reproduce board --name",
         .problem = fmt::format("the set {} has a row of this name, which is {}", set.name,
                                torsio::name(same->origin)),
         .found = name,
         .advice = "Choose a name that states what is different."});
  rows.erase(same);
}

/// What a wrong unit or sign looks like, else nothing.
std::string remark_on(const torsio::BoardSet& set, const std::vector<torsio::BoardTarget>& targets,
                      double error) {
  torsio::RunningMean mean;
  for (const torsio::BoardTarget& target : targets)
    for (const double value : target.values) mean.add(value);
  std::vector<std::vector<double>> constant;
  constant.reserve(targets.size());
  for (const torsio::BoardTarget& target : targets)
    constant.emplace_back(target.values.size(), mean.mean());
  const double of_mean = torsio::board_score(set, targets, constant).error;
  if (error <= of_mean) return {};
  return fmt::format(
      "The error is larger than {:.4g} {}, that of predicting the mean of the target: are unit and "
      "sign right?\n",
      of_mean, set.unit);
}

nlohmann::ordered_json board_json(const torsio::BoardSet& set,
                                  const std::vector<torsio::BoardRow>& rows) {
  auto array = nlohmann::ordered_json::array();
  for (const torsio::BoardRow& row : torsio::rows_of(set, rows)) {
    nlohmann::ordered_json error = nullptr;
    if (std::isfinite(row.error)) error = row.error;
    array.push_back({{"model", row.model},
                     {"error", error},
                     {"runs", row.runs},
                     {"origin", torsio::name(row.origin)},
                     {"remark", row.remark}});
  }
  return {{"set", set.name},
          {"title", set.title},
          {"unit", set.unit},
          {"measure", torsio::name(set.measure)},
          {"rows", std::move(array)}};
}

void show_sets(const std::vector<const torsio::BoardSet*>& sets,
               const std::vector<torsio::BoardRow>& rows, const JsonOutput& json) {
  auto document = nlohmann::ordered_json::array();
  for (const torsio::BoardSet* set : sets) {
    if (json.wants_tables()) print(torsio::board_table(*set, rows) + "\n");
    document.push_back(board_json(*set, rows));
  }
  json.write(document.dump(2) + "\n");
}

/// A file of `board_samples`, whose lines after the header are the samples.
void write_samples(const std::string& path, const std::string& csv, const std::string& use) {
  write_text(path, csv);
  remark(fmt::format("{}: {} samples{}", path, std::ranges::count(csv, '\n') - 1, use));
}

void write_samples(const BoardFlags& flags) {
  const torsio::BoardSet& set = torsio::find_board_set(flags.set, "torsio reproduce board --set");
  ProgressBar progress;
  const torsio::ComparisonCase data = torsio::board_case(set, progress.listener());
  if (!flags.test_samples.empty()) {
    std::size_t scored = 0;
    for (const torsio::BoardTarget& target : torsio::board_targets(set, data.dataset))
      scored += target.samples.size();
    write_samples(flags.test_samples,
                  torsio::board_samples(set, data.dataset, torsio::BoardPart::test),
                  fmt::format(", {} of them to be predicted", scored));
  }
  if (!flags.training_samples.empty())
    write_samples(flags.training_samples,
                  torsio::board_samples(set, data.dataset, torsio::BoardPart::training),
                  ", for training");
}

void score_predictions(const BoardFlags& flags, const JsonOutput& json) {
  torsio::require_board_name(flags.name, "torsio reproduce board --name");
  const torsio::PredictionFile file = torsio::read_predictions(flags.predictions);
  const torsio::BoardSet& set = *file.set;
  std::vector<torsio::BoardRow> rows = known_rows();
  give_way(rows, set, flags.name);
  ProgressBar progress;
  const torsio::ComparisonCase data = torsio::board_case(set, progress.listener());
  const std::vector<torsio::BoardTarget> targets = torsio::board_targets(set, data.dataset);
  const torsio::BoardScore score =
      torsio::board_score(set, targets, torsio::matched_predictions(file, data.dataset, targets));
  if (!std::isfinite(score.error))
    throw torsio::Error({.place = flags.predictions,
                         .problem = "the error is not finite: a prediction is too large"});
  const torsio::BoardRow row =
      torsio::measured_row(set.name, flags.name, torsio::BoardOrigin::added, score.error);
  rows.push_back(row);
  show_sets({&set}, rows, json);
  if (json.wants_tables())
    print(fmt::format(
        "{}{} samples were scored. The line for studies/board_rows.csv, without the "
        "address of a description:\n{}\n",
        remark_on(set, targets, score.error), score.samples, torsio::board_row_csv(row)));
}

void show_recorded(const BoardFlags& flags, const std::string& page, const JsonOutput& json) {
  const std::vector<torsio::BoardRow> rows = known_rows();
  if (!flags.rows.empty()) require_its_rows(flags.rows, rows);
  if (!flags.rows.empty()) write_text(flags.rows, torsio::board_rows_csv(rows));
  if (!page.empty()) write_text(page, torsio::board_page(rows));
  if (!flags.rows.empty() || !page.empty()) return;
  std::vector<const torsio::BoardSet*> sets;
  for (const torsio::BoardSet& set : torsio::board_sets()) sets.push_back(&set);
  show_sets(sets, rows, json);
}

/// Runs every family, and writes page and rows with those of others and of the sets that were left out.
void run_all(const BoardFlags& flags, const torsio::StudyOptions& options, const std::string& page,
             const JsonOutput& json) {
  if (options.is_quick) refuse_board("--quick", "a page needs the full run");
  if (!flags.rows.empty()) require_its_rows(flags.rows, known_rows());
  ProgressBar progress;
  const torsio::BoardRun run = torsio::run_board(options, progress.listener());
  const torsio::StudyInfo& info = torsio::find_study(kBoard);
  const torsio::Study study = torsio::board_study(options, run);
  if (json.wants_tables()) print(torsio::study_text(info, study) + "\n");
  json.write(torsio::study_json(info, study));
  std::vector<torsio::BoardRow> rows = run.rows;
  const auto is_run = [&](const torsio::BoardRow& row) {
    return std::ranges::find(run.rows, row.set, &torsio::BoardRow::set) != run.rows.end();
  };
  // Sets without recordings here keep their rows.
  for (const torsio::BoardRow& row : torsio::recorded_board_rows())
    if (row.origin == torsio::BoardOrigin::joined || !is_run(row)) rows.push_back(row);
  if (!flags.rows.empty()) write_text(flags.rows, torsio::board_rows_csv(rows));
  std::ranges::move(torsio::published_board_rows(), std::back_inserter(rows));
  if (!page.empty()) write_text(page, torsio::board_page(rows));
}

}  // namespace

void BoardFlags::add(CLI::App& verb) {
  constexpr const char* kGroup = "board";
  verb.add_option("--set", set, "a set of docs/board.md, for --template and --training")
      ->group(kGroup);
  verb.add_option("--template", test_samples,
                  "write the samples of a set that are to be predicted, with their inputs: CSV")
      ->group(kGroup);
  verb.add_option("--training", training_samples,
                  "write the samples of a set that a model may be trained on: CSV")
      ->group(kGroup);
  verb.add_option("--predictions", predictions,
                  "score predictions and show them in the table of their set: CSV")
      ->group(kGroup);
  verb.add_option("--name", name, "name of the row of --predictions")->group(kGroup);
  verb.add_flag("--recorded", is_recorded,
                "show the tables of docs/board.md, or write that page, without a run")
      ->group(kGroup);
  verb.add_option(
          "--rows", rows,
          "write the rows of a run, or with --recorded those of the program in their order: "
          "studies/board_rows.csv")
      ->group(kGroup);
}

bool BoardFlags::is_used() const {
  return !set.empty() || !test_samples.empty() || !training_samples.empty() ||
         !predictions.empty() || !name.empty() || !rows.empty() || is_recorded;
}

void reproduce_board(const BoardFlags& flags, const std::vector<std::string>& items,
                     const torsio::StudyOptions& options, const std::string& page,
                     const JsonOutput& json) {
  if (items != std::vector<std::string>{std::string(kBoard)})
    throw torsio::UsageError(
        {.place = "torsio reproduce",
         .problem = "--set, --template, --training, --predictions, --name, --recorded and --rows "
                    "are for the item board alone",
         .expected = "torsio reproduce board",
         .found = fmt::format("{}", fmt::join(items, " "))});
  DataFlags().check_outputs(
      {json.destination, page, flags.rows, flags.test_samples, flags.training_samples});
  const bool writes_samples = !flags.test_samples.empty() || !flags.training_samples.empty();
  const int jobs = (writes_samples ? 1 : 0) + (flags.predictions.empty() ? 0 : 1) +
                   (flags.is_recorded || !flags.rows.empty() ? 1 : 0);
  if (jobs > 1)
    refuse_board("",
                 "these exclude each other: --predictions; --template with --training; --recorded "
                 "with --rows");
  if (writes_samples == flags.set.empty())
    refuse_board("--set", "it belongs to --template or --training, and they need it");
  if (flags.predictions.empty() != flags.name.empty())
    refuse_board("--predictions", "it needs --name, and --name belongs to it");
  if (!page.empty() && (writes_samples || !flags.predictions.empty()))
    refuse_board("--page", "it is written from a run, or with --recorded");
  if (writes_samples) return write_samples(flags);
  if (!flags.predictions.empty()) return score_predictions(flags, json);
  if (flags.is_recorded) return show_recorded(flags, page, json);
  run_all(flags, options, page, json);
}
