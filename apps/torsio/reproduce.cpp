#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "reproduce_board.hpp"
#include "studies/paper_items.hpp"
#include "studies/studies.hpp"
#include "studies/study_cache.hpp"
#include "studies/study_report.hpp"
#include "torsio/core/error.hpp"
#include "torsio/report/document/report_document.hpp"
#include "torsio/report/plot/figure_plot.hpp"
#include "torsio/report/text_table.hpp"
#include "verbs.hpp"

namespace {

struct ReproduceFlags {
  std::vector<std::string> items;
  torsio::StudyOptions options;
  bool list = false;
  bool is_fresh = false;
  std::string plot;
  std::string page;
  JsonOutput json;
  ReportOutput report;
  BoardFlags board;
};

constexpr std::string_view kPaperTitles =
    "000  Design, Modelling and Control of Novel Series-Elastic Actuators for Industrial Robots\n"
    "001  Learning the Elasticity of a Series-Elastic Actuator for Accurate Torque Control\n"
    "002  Design and Hysteresis Modeling of a Miniaturized Elastomer-Based Clutched Torque Sensor\n"
    "003  A self-contained, elastic joint drive for robotics applications based on a sensorized\n"
    "     elastomer coupling - Design and identification\n"
    "004  Learning-Based Torque Estimation for Harmonic Drive Actuators\n";

std::string studies_text() {
  torsio::TextTable table;
  table.header({"item", "paper", "question", "time"});
  for (const torsio::StudyInfo& info : torsio::studies())
    table.row({std::string(info.name), std::string(info.paper), std::string(info.title),
               torsio::duration_text(60.0 * info.minutes)});
  return table.text();
}

void list(const ReproduceFlags& flags) {
  DataFlags().check_outputs({flags.json.destination, flags.page});
  if (!flags.page.empty()) write_text(flags.page, torsio::paper_items_page());
  if (flags.json.wants_tables())
    print("What torsio reproduce can run; the times are those of two cores:\n\n" + studies_text() +
          fmt::format("\nThe papers (docs/development/sources.md):\n\n{}", kPaperTitles) +
          "\nEvery item of the five papers:\n\n" + torsio::paper_items_text());
  flags.json.write(torsio::paper_items_json());
}

/// --plot is for one study that has a picture.
void check_plot(const ReproduceFlags& flags, const std::vector<const torsio::StudyInfo*>& wanted) {
  if (flags.plot.empty() || (wanted.size() == 1 && wanted.front()->has_figures)) return;
  std::string known;
  for (const torsio::StudyInfo& info : torsio::studies())
    if (info.has_figures) known += fmt::format("{}{}", known.empty() ? "" : ", ", info.name);
  throw torsio::UsageError({.place = "torsio reproduce --plot",
                            .expected = "one item that has a figure: " + known,
                            .found = wanted.size() == 1 ? std::string(wanted.front()->name)
                                                        : fmt::format("{} items", wanted.size())});
}

/// The outcomes of this program that earlier calls kept. What the cache cannot do is a remark: the studies run anyway.
class KnownOutcomes {
 public:
  explicit KnownOutcomes(bool is_fresh) : is_fresh_(is_fresh) {
    const std::filesystem::path folder = torsio::study_cache_folder();
    if (folder.empty()) {
      remark("Outcomes are not kept: neither XDG_CACHE_HOME nor HOME names a folder.");
      return;
    }
    try {
      cache_.emplace(folder, torsio::running_program_hash());
    } catch (const torsio::Error& error) {
      remark(fmt::format("Outcomes are not kept: {}", error.what()));
    }
  }

  [[nodiscard]] std::optional<torsio::StudyOutcome> find(
      const torsio::StudyInfo& study, const torsio::StudyOptions& options) const {
    if (!cache_ || is_fresh_) return std::nullopt;
    try {
      return cache_->find(study, options);
    } catch (const torsio::Error& error) {
      remark(fmt::format("{} runs again: {}", study.name, error.what()));
      return std::nullopt;
    }
  }

  void keep(const torsio::StudyInfo& study, const torsio::StudyOptions& options,
            const torsio::StudyOutcome& outcome) {
    if (!cache_) return;
    try {
      cache_->keep(study, options, outcome);
    } catch (const torsio::Error& error) {
      remark(fmt::format("Outcomes are not kept: {}", error.what()));
      cache_.reset();
    }
  }

 private:
  bool is_fresh_;
  std::optional<torsio::StudyCache> cache_ = {};
};

torsio::StudyOutcome outcome_of(const torsio::StudyInfo& info,
                                const torsio::StudyOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  ProgressBar progress;
  torsio::Study study = torsio::run_study(info, options, progress.listener());
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  return {.text = torsio::study_text(info, study),
          .json = torsio::study_json(info, study),
          .figures = std::move(study.figures),
          .figure_columns = study.figure_columns,
          .seconds = spent.count()};
}

/// Prints how many outcomes are known and how long the other items take, before the first begins.
void announce(const std::vector<const torsio::StudyInfo*>& wanted,
              const std::vector<std::optional<torsio::StudyOutcome>>& outcomes,
              const torsio::StudyOptions& options) {
  double minutes = 0.0;
  std::size_t known = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (outcomes[i])
      ++known;
    else
      minutes += wanted[i]->minutes;
  }
  std::string text = fmt::format("{} item(s)", wanted.size());
  if (known > 0)
    text +=
        fmt::format(", of which this program has run {} before (--fresh runs them again)", known);
  if (minutes > 0.0 && !options.is_quick)
    text +=
        fmt::format("; about {} on two cores",
                    torsio::duration_text(60.0 * minutes * static_cast<double>(options.repeats) /
                                          static_cast<double>(torsio::StudyOptions().repeats)));
  remark(text);
}

/// The items that exist; the others are in `failed`, after a remark about each.
std::vector<const torsio::StudyInfo*> wanted_studies(const ReproduceFlags& flags,
                                                     std::vector<std::string>& failed) {
  std::vector<const torsio::StudyInfo*> wanted;
  for (const std::string& item : flags.items) {
    try {
      wanted.push_back(&torsio::find_study(item));
    } catch (const torsio::UsageError& error) {
      if (flags.items.size() == 1) throw;
      remark(error.what());
      failed.push_back(item);
    }
  }
  if (flags.items.empty())
    for (const torsio::StudyInfo& info : torsio::studies())
      if (!info.must_be_named) wanted.push_back(&info);
  return wanted;
}

torsio::ReportDocument report_of(const ReproduceFlags& flags,
                                 std::vector<torsio::ReportSection> sections) {
  const std::size_t count = sections.size();
  return {
      .title = "Experiments of the papers",
      .summary =
          {fmt::format(
               "{} experiment(s) on the simulated benches, our figures beside the published ones.",
               count),
           "The benches are models: agreement shows that a method works there, not on a real "
           "joint."},
      .sections = std::move(sections),
      .origin = {{"seed", fmt::format("{}", flags.options.seed)},
                 {"repeats", fmt::format("{}", flags.options.repeats)}}};
}

void write_plot(const std::string& path, const torsio::StudyOutcome& outcome) {
  std::vector<const torsio::ReportFigure*> figures;
  for (const torsio::ReportFigure& figure : outcome.figures) figures.push_back(&figure);
  write_text(path, torsio::figure_plot(figures, torsio::plot_format(path),
                                       {.columns = outcome.figure_columns}));
}

void run(const ReproduceFlags& flags) {
  if (flags.list) return list(flags);
  if (flags.board.is_used() ||
      (!flags.page.empty() && flags.items == std::vector<std::string>{"board"})) {
    if (flags.report.is_wanted() || !flags.plot.empty())
      throw torsio::UsageError(
          {.place = "torsio reproduce --report and --plot",
           .problem =
               "they show the run of an experiment, and these options of the item board write "
               "tables or files instead",
           .advice = "Leave them out; --page writes docs/board.md."});
    return reproduce_board(flags.board, flags.items, flags.options, flags.page, flags.json);
  }
  if (!flags.page.empty())
    throw torsio::UsageError({.place = "torsio reproduce --page",
                              .problem = "it needs --list, or the item board alone"});
  std::vector<std::string> failed;
  const std::vector<const torsio::StudyInfo*> wanted = wanted_studies(flags, failed);
  check_plot(flags, wanted);
  DataFlags().check_outputs({flags.json.destination, flags.plot, flags.report.destination});
  if (!flags.plot.empty()) static_cast<void>(torsio::plot_format(flags.plot));
  KnownOutcomes known(flags.is_fresh);
  std::vector<std::optional<torsio::StudyOutcome>> outcomes;
  outcomes.reserve(wanted.size());
  for (const torsio::StudyInfo* info : wanted) outcomes.push_back(known.find(*info, flags.options));
  announce(wanted, outcomes, flags.options);
  auto documents = nlohmann::ordered_json::array();
  std::vector<torsio::ReportSection> sections;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const torsio::StudyInfo* const info = wanted[i];
    std::optional<torsio::StudyOutcome>& outcome = outcomes[i];
    if (!outcome) {
      try {
        outcome = outcome_of(*info, flags.options);
      } catch (const torsio::Cancelled&) {
        throw;
      } catch (const torsio::Error& error) {
        if (wanted.size() == 1) throw;
        remark(fmt::format("{}: {}", info->name, error.what()));
        failed.emplace_back(info->name);
        continue;
      }
      known.keep(*info, flags.options, *outcome);
      remark(fmt::format("{} took {}", info->name, torsio::duration_text(outcome->seconds)));
    }
    if (!flags.plot.empty()) write_plot(flags.plot, *outcome);
    documents.push_back(nlohmann::ordered_json::parse(outcome->json));
    torsio::ReportSection section{.heading = std::string(info->name),
                                  .text = std::string(info->title),
                                  .preformatted = outcome->text};
    section.figures = outcome->figures;
    sections.push_back(std::move(section));
    if (flags.json.wants_tables()) {
      print(outcome->text + "\n");
      flags.json.write(documents.dump(2) + "\n");  // after each: the next may take an hour
    }
  }
  if (!flags.json.wants_tables()) flags.json.write(documents.dump(2) + "\n");
  if (flags.report.is_wanted()) flags.report.write(report_of(flags, std::move(sections)));
  if (!failed.empty())
    throw torsio::Error(
        {.place = "torsio reproduce",
         .problem = fmt::format("{} of {} items failed: {}", failed.size(),
                                failed.size() + documents.size(), fmt::join(failed, ", ")),
         .advice = "The reasons are above."});
}

}  // namespace

void add_reproduce(CLI::App& app) {
  auto flags = std::make_shared<ReproduceFlags>();
  CLI::App* verb = app.add_subcommand(
      "reproduce", "run the papers' experiments and compare the published figures with ours");
  verb->footer(
      "Example: torsio reproduce 001-models --repeats 1\n"
      "Without an item all experiments that need no recordings or solver are run: about two hours "
      "on two cores. Outcomes are kept in XDG_CACHE_HOME or ~/.cache, so that an interrupted call "
      "continues where it was; another build of the program does not use them. "
      "board, public-benchmarks and model-comparison read recordings in TORSIO_DATA or "
      "../shared/data; 003-coupling runs CalculiX (apt-get install calculix-ccx); 004-sensitivity "
      "takes a quarter of an hour.");
  verb->add_option("ITEM", flags->items, "name of an experiment; --list shows them");
  verb->add_flag("--list", flags->list,
                 "show the experiments and every item of the papers with its status");
  verb->add_option("--page", flags->page,
                   "with --list: write the items as a page: docs/papers.md; with the item board: "
                   "docs/board.md");
  verb->add_flag("--fresh", flags->is_fresh, "run also what this program has run before");
  verb->add_flag(
      "--quick", flags->options.is_quick,
      "shorter recordings and smaller networks, as a quick test; the published figures beside "
      "them are those of the full sizes");
  verb->add_option("--repeats", flags->options.repeats, "repeats with different seeds")
      ->capture_default_str();
  add_seed(*verb, flags->options.seed, "seed of the first repeat");
  flags->json.add(*verb, "the figures");
  verb->add_option("--plot", flags->plot,
                   "draw the figure of an experiment that has one: SVG, PNG or PDF");
  flags->report.add_page(*verb);
  flags->board.add(*verb);
  verb->callback([flags] { run(*flags); });
}
