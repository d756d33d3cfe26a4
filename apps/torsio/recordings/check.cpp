#include "torsio/check/check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "check/draft/mapping_draft.hpp"
#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "data/log_summary.hpp"
#include "data/read_log.hpp"
#include "recordings/check_drive.hpp"
#include "report/identify.hpp"
#include "report/log_summary.hpp"
#include "torsio/check/advise/advice.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/load.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/report/check.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "verbs.hpp"

namespace {

struct CheckFlags {
  DataFlags data;
  std::vector<std::string> test;
  bool advise = false;
  bool list = false;
  std::vector<std::string> want;
  std::string drive;        ///< drive file, for the advice on a drive
  std::size_t threads = 0;  ///< that identify it
  JsonOutput json;
  ReportOutput report;
};

std::string text_of(const std::vector<torsio::Finding>& findings) {
  std::string text;
  for (const torsio::Finding& finding : findings) {
    text += fmt::format("{}  {}: {}{}\n", torsio::name(finding.verdict), finding.check,
                        finding.recording.empty() ? "" : finding.recording + ": ", finding.message);
    if (!finding.advice.empty()) text += fmt::format("      -> {}\n", finding.advice);
  }
  return text;
}

struct Checked {
  std::vector<torsio::Finding> findings;
  std::optional<torsio::Advice> advice;
  std::optional<torsio::Dataset> dataset = {};  ///< none: it could not be read
  torsio::FeatureSpec spec = {};
  std::vector<torsio::DriveAdvice> drive_advice = {};
};

void add_drive(CheckedDrive drive, Checked& result) {
  std::ranges::move(drive.findings, std::back_inserter(result.findings));
  result.drive_advice = std::move(drive.advice);
}

/// The drive of recordings of a spring: what is wrong with it does not concern the model of the spring.
void check_drive_too(const CheckFlags& flags, const torsio::DriveSheet& law,
                     const torsio::Progress& progress, Checked& result) {
  try {
    add_drive(checked_drive(*result.dataset, flags.data.load_file, law, flags.threads, progress),
              result);
  } catch (const torsio::Cancelled&) {
    throw;
  } catch (const torsio::Error& error) {
    result.findings.push_back({torsio::Verdict::warn, "drive", "", error.what(), ""});
  }
}

std::vector<torsio::WantedRange> wanted_of(const CheckFlags& flags, const torsio::Dataset& dataset,
                                           const torsio::FeatureSpec& spec) {
  std::vector<torsio::WantedRange> wanted;
  for (const std::string& text : flags.want)
    wanted.push_back(torsio::parse_wanted(text, dataset, spec));
  return wanted;
}

/// A recording whose clock is not uniform cannot be read: that is a finding, too.
Checked checked(const CheckFlags& flags) {
  try {
    ProgressBar progress;
    torsio::Dataset dataset = flags.data.load({}, flags.test, progress.listener());
    std::optional<torsio::DriveSheet> law;
    if (!flags.data.load_file.empty()) law = law_to_check(dataset, flags.drive, flags.advise);
    if (law && !flags.advise) {
      remark(
          "note: the recordings are those of a drive, too; --advise checks them for torsio "
          "identify and proposes its next recording");
      law.reset();
    }
    if (law && lacks_deflection(dataset)) {
      Checked result{.findings = {{torsio::Verdict::pass, "clock", "", "uniform", ""}},
                     .advice = {}};
      add_drive(
          checked_drive(dataset, flags.data.load_file, *law, flags.threads, progress.listener()),
          result);
      return result;
    }
    const torsio::FeatureSpec spec = torsio::resolve_inputs(dataset, flags.data.wanted_inputs());
    for (const torsio::DatasetRecord& record : dataset.records)
      if (!record.recording.labels.empty()) remark(torsio::labels_text(record.recording));
    flags.data.compute_target(dataset, spec);
    const auto wanted = wanted_of(flags, dataset, spec);  // a wrong call before any work
    Checked result{.findings = {{torsio::Verdict::pass, "clock", "", "uniform", ""}}, .advice = {}};
    std::ranges::move(torsio::check_dataset(dataset, spec), std::back_inserter(result.findings));
    if (flags.advise && torsio::worst(result.findings) != torsio::Verdict::fail)
      result.advice = torsio::advise(dataset, spec, wanted, progress.listener());
    result.dataset = std::move(dataset);
    result.spec = spec;
    if (law && torsio::worst(result.findings) != torsio::Verdict::fail)
      check_drive_too(flags, *law, progress.listener(), result);
    return result;
  } catch (const torsio::ClockError& error) {
    const std::string_view message = error.what();
    return {
        .findings = {{torsio::Verdict::fail, "clock", "",
                      std::string(message.substr(0, message.find('\n'))), error.report().advice}},
        .advice = {}};
  }
}

/// Topics and fields instead of findings: what a mapping can name.
void list(CheckFlags& flags) {
  const std::vector<std::string>& files = flags.data.recordings;
  if (files.empty())
    throw torsio::UsageError({.place = "--list",
                              .expected = "a recording to list, such as  torsio check --list "
                                          "log.csv",
                              .found = "none"});
  flags.data.check_outputs({flags.json.destination}, flags.test);
  std::vector<std::pair<std::string, torsio::LogSummary>> summaries;
  for (const std::string& file : files) {
    torsio::LogSummary summary = [&] {
      ProgressBar progress;
      return torsio::list_log(file, progress.listener());
    }();
    if (!summary.columns.empty() && summary.clock.empty() && file != "-")
      torsio::state_clock(torsio::read_log(file, {.csv = {.leaves_out_texts = true}}), summary);
    if (flags.json.wants_tables())
      print((files.size() == 1 ? "" : fmt::format("{}{}:\n", summaries.empty() ? "" : "\n", file)) +
            torsio::log_summary_text(summary));
    summaries.emplace_back(file, std::move(summary));
  }
  flags.json.write(files.size() == 1 ? torsio::log_summary_json(summaries.front().second)
                                     : torsio::log_summaries_json(summaries));
}

void run(CheckFlags& flags) {
  if (flags.list) return list(flags);
  if (!flags.want.empty() && !flags.advise)
    throw torsio::UsageError({.place = "--want",
                              .problem = "it states the intended use for --advise",
                              .advice = "Add --advise."});
  if (!flags.drive.empty() && (!flags.advise || flags.data.load_file.empty()))
    throw torsio::UsageError({.place = "--drive",
                              .problem = "it states the drive whose next recording is proposed",
                              .advice = "Add --advise and --load load.yaml."});
  std::vector<std::string> inputs = flags.test;
  if (!flags.drive.empty()) inputs.push_back(flags.drive);
  flags.data.check_outputs({flags.json.destination, flags.report.destination, flags.report.plot},
                           inputs);
  const Checked result = checked(flags);
  const torsio::Verdict verdict = torsio::worst(result.findings);
  if (flags.json.wants_tables()) {
    print(text_of(result.findings) +
          fmt::format("{}: {}\n", torsio::name(verdict),
                      verdict == torsio::Verdict::fail   ? "fix this before training"
                      : verdict == torsio::Verdict::warn ? "a model can be trained; read the "
                                                           "warnings"
                                                         : "a model can be trained on this"));
    if (result.advice) print("\n" + torsio::advice_text(*result.advice));
    if (!result.drive_advice.empty())
      print("\nwhat to record next for torsio identify\n" +
            torsio::drive_advice_text(result.drive_advice));
  }
  const torsio::Advice* const advice = result.advice ? &*result.advice : nullptr;
  flags.json.write(torsio::check_json(result.findings, advice, result.drive_advice));
  if (flags.report.is_wanted())
    flags.report.write(torsio::check_report(result.findings,
                                            result.dataset ? &*result.dataset : nullptr,
                                            result.spec, advice, result.drive_advice));
  if (verdict == torsio::Verdict::fail)
    throw torsio::Error({.problem = "the recordings did not pass",
                         .advice = flags.advise ? "There is no advice on further recordings until "
                                                  "they do: its errors would be those of the fault."
                                                : ""});
}

}  // namespace

void add_check(CLI::App& app) {
  auto flags = std::make_shared<CheckFlags>();
  CLI::App* verb =
      app.add_subcommand("check", "check whether a model can be trained on recordings");
  verb->footer(
      "Example: torsio check sweep1.csv sweep2.csv --test other_lever.csv\n"
      "         torsio check sweep*.csv --advise --want input=-5deg:5deg --want "
      "frequency=0.05Hz:2Hz\n"
      "--advise divides the recordings into strokes and fits a quick model with some of them left\n"
      "out: docs/use/advise.md. With --load it also proposes recordings for torsio identify.");
  flags->data.add_recordings(*verb, "recordings, or a manifest");
  flags->data.add_mapping(*verb);
  flags->data.add_target_and_inputs(*verb);
  flags->data.add_load(*verb,
                       "load file: the target is the torque of this known load "
                       "(docs/use/known_load.md)");
  verb->add_option("--drive", flags->drive,
                   "with --advise and --load: file of the drive's law (default: by the channels)");
  verb->add_option("--threads", flags->threads,
                   "with --advise and --load: threads that identify the drive; the result does not "
                   "depend on it (default: all)")
      ->check(CLI::Range(0, 1024));
  verb->add_option("--test", flags->test,
                   "held-out recordings: are they inside the training range?");
  verb->add_flag(
      "--list", flags->list,
      "topics, rates, gaps and fields of an MCAP file or rosbag2 folder, for a mapping; columns, "
      "units, ranges and rates of CSV, .npz and .mat; of a log of BAM its columns, conditions and "
      "labels");
  verb->add_flag("--advise", flags->advise,
                 "what to record next: the motion or condition whose absence costs most");
  verb->add_option(
          "--want", flags->want,
          "range that the model is used in, QUANTITY=LOWEST:HIGHEST with input, frequency, "
          "speed (of the first input) or a condition (default: the range of the "
          "recordings)")
      ->allow_extra_args(false);
  flags->json.add(*verb, "the findings");
  flags->report.add(*verb);
  verb->callback([flags] { run(*flags); });
}
