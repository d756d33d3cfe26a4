#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "check/draft/mapping_draft.hpp"
#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "data/names.hpp"
#include "data/read_log.hpp"
#include "report/mapping_draft.hpp"
#include "torsio/core/error.hpp"
#include "verbs.hpp"

namespace {

struct MapFlags {
  DataFlags data;
  std::vector<std::string> inputs;
  std::string output;
  bool yes = false;
  JsonOutput json;
};

std::string question(const torsio::ColumnGuess& guess) {
  std::string text = fmt::format("\n'{}': {:.5g} .. {:.5g}", torsio::printable(guess.summary.name),
                                 guess.summary.lowest, guess.summary.highest);
  for (const std::string& reason : guess.reasons) text += "\n  " + reason;
  if (!guess.missing.empty()) text += "\n  not shown by the data: " + guess.missing;
  if (guess.channel.empty())
    return text + "\n  No guess. Enter: none; CHANNEL_UNIT such as joint_angle_deg > ";
  return text + fmt::format(
                    "\n  {} in {}? Enter: yes{}; CHANNEL_UNIT such as joint_angle_deg; "
                    "-: none > ",
                    guess.channel, guess.unit.empty() ? "?" : guess.unit,
                    guess.missing.empty() ? "" : " (as a comment)");
}

/// Asks until the answer is one; the end of the input takes the guesses as they are.
/// @returns whether the input continues
bool ask(torsio::MappingDraft& draft, std::size_t column) {
  std::string line;
  for (;;) {
    remark(question(draft.columns[column]));
    if (!std::getline(std::cin, line)) return false;
    try {
      torsio::answer(draft, column, line);
      return true;
    } catch (const torsio::UsageError& error) {
      remark(error.what());
    }
  }
}

void ask_for_unsure(torsio::MappingDraft& draft) {
  constexpr std::size_t kMaxOpenQuestions = 8;
  std::size_t questions = 0;
  for (std::size_t i = 0; i < draft.columns.size(); ++i) {
    const torsio::ColumnGuess& guess = draft.columns[i];
    const bool is_unsure = guess.certainty == torsio::Certainty::unsure || !guess.missing.empty();
    // Where something is missing, a column without a guess may be it.
    const bool may_be_missing = guess.channel.empty() && guess.summary.fresh > 1 &&
                                !draft.remarks.empty() && questions < kMaxOpenQuestions;
    if (may_be_missing) ++questions;
    if (((is_unsure && !guess.channel.empty()) || may_be_missing) && !ask(draft, i)) return;
  }
}

std::size_t unsure_guesses(const torsio::MappingDraft& draft) {
  std::size_t count = 0;
  for (const torsio::ColumnGuess& guess : draft.columns)
    if (guess.is_written() && guess.certainty == torsio::Certainty::unsure) ++count;
  return count;
}

/// The table goes where the mapping does not.
void show(const MapFlags& flags, const std::string& text) {
  if (flags.output.empty() || !flags.json.wants_tables())
    remark(text);
  else
    print(text);
}

void run(MapFlags& flags) {
  flags.data.check_outputs({flags.output, flags.json.destination}, flags.inputs);
  if (!flags.output.empty()) require_ending("--output", flags.output, {".yaml", ".yml"});
  ProgressBar progress;
  std::vector<torsio::LogTable> tables;
  for (const std::string& input : flags.inputs)
    tables.push_back(torsio::read_log(
        input, {.progress = progress.listener(), .csv = {.leaves_out_texts = true}}));
  torsio::MappingDraft draft = torsio::draft_mapping(tables);
  show(flags, torsio::mapping_draft_picture(tables.front(), draft));
  const bool uses_input = std::ranges::find(flags.inputs, "-") != flags.inputs.end();
  if (!flags.yes && !uses_input && isatty(STDIN_FILENO) != 0) ask_for_unsure(draft);
  torsio::try_draft(tables, draft);
  show(flags, torsio::mapping_draft_text(draft));
  if (const std::size_t unsure = unsure_guesses(draft); unsure > 0)
    remark(fmt::format("unsure guesses, to be confirmed in the draft before a model is trained: {}",
                       unsure));
  flags.json.write(torsio::mapping_draft_json(draft));
  if (!flags.output.empty()) {
    write_text(flags.output, draft.yaml());
    remark(fmt::format("{}: next  torsio check {} --mapping {}", flags.output, draft.file,
                       flags.output));
  } else if (flags.json.wants_tables()) {
    print(draft.yaml());
  }
}

}  // namespace

void add_map(CLI::App& app) {
  auto flags = std::make_shared<MapFlags>();
  CLI::App* verb =
      app.add_subcommand("map", "write a draft of the mapping for a log of unknown columns");
  verb->footer(
      "Example: torsio map log.csv -o mapping.yaml\n"
      "         torsio check log.csv --mapping mapping.yaml\n"
      "Guesses channel, unit, sign, gear ratio and mask of each column from names and values, and\n"
      "states how sure each is and why. At a terminal it asks for what is unsure: docs/use/map.md");
  verb->add_option(
          "recording", flags->inputs,
          "CSV, .npz, .mat, MCAP, rosbag2 or ROS 1 bag; - for standard input. Further logs "
          "of the same joint and columns, such as one that moves freely, determine the "
          "gear ratio")
      ->required();
  verb->add_option(
      "-o,--output", flags->output,
      "mapping to write, .yaml (default: standard output, the table on standard error)");
  verb->add_flag("--yes", flags->yes, "do not ask: take the best guesses, which the draft marks");
  flags->json.add(*verb, "guesses and mapping");
  verb->callback([flags] { run(*flags); });
}
