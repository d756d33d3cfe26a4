#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/data_flags.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "common/report_output.hpp"
#include "studies/study.hpp"
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
  std::string plot;
  JsonOutput json;
  ReportOutput report;
};

void list() {
  torsio::TextTable table;
  table.header({"item", "paper", "question"});
  for (const torsio::StudyInfo& info : torsio::studies())
    table.row({std::string(info.name), std::string(info.paper), std::string(info.title)});
  print(table.text());
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

void run(const ReproduceFlags& flags) {
  if (flags.list) return list();
  std::vector<const torsio::StudyInfo*> wanted;
  for (const std::string& item : flags.items) wanted.push_back(&torsio::find_study(item));
  if (wanted.empty())
    for (const torsio::StudyInfo& info : torsio::studies())
      if (!info.must_be_named) wanted.push_back(&info);
  check_plot(flags, wanted);
  DataFlags().check_outputs({flags.json.destination, flags.plot, flags.report.destination});
  if (!flags.plot.empty()) static_cast<void>(torsio::plot_format(flags.plot));
  auto documents = nlohmann::ordered_json::array();
  torsio::ReportDocument report{
      .title = "Experiments of the papers",
      .summary =
          {fmt::format(
               "{} experiment(s) on the simulated benches, our figures beside the published ones.",
               wanted.size()),
           "The benches are models: agreement shows that a method works there, not on a real "
           "joint."},
      .sections = {},
      .origin = {{"seed", fmt::format("{}", flags.options.seed)},
                 {"repeats", fmt::format("{}", flags.options.repeats)}}};
  for (const torsio::StudyInfo* info : wanted) {
    ProgressBar progress;
    const torsio::Study study = torsio::run_study(*info, flags.options, progress.listener());
    if (!flags.plot.empty()) {
      std::vector<const torsio::ReportFigure*> figures;
      for (const torsio::ReportFigure& figure : study.figures) figures.push_back(&figure);
      write_text(flags.plot, torsio::figure_plot(figures, torsio::plot_format(flags.plot),
                                                 {.columns = study.figure_columns}));
    }
    documents.push_back(nlohmann::ordered_json::parse(torsio::study_json(*info, study)));
    torsio::ReportSection section{.heading = std::string(info->name),
                                  .text = std::string(info->title),
                                  .preformatted = torsio::study_text(*info, study)};
    section.figures = study.figures;
    report.sections.push_back(std::move(section));
    if (flags.json.wants_tables()) {
      print(torsio::study_text(*info, study) + "\n");
      flags.json.write(documents.dump(2) + "\n");  // after each: the next may take an hour
    }
  }
  if (!flags.json.wants_tables()) flags.json.write(documents.dump(2) + "\n");
  if (flags.report.is_wanted()) flags.report.write(std::move(report));
}

}  // namespace

void add_reproduce(CLI::App& app) {
  auto flags = std::make_shared<ReproduceFlags>();
  CLI::App* verb = app.add_subcommand(
      "reproduce", "run the papers' experiments and compare the published figures with ours");
  verb->footer(
      "Example: torsio reproduce 001-models --repeats 1\n"
      "Without an item all experiments that need no recordings or solver are run: almost an hour "
      "on "
      "two cores. public-benchmarks and model-comparison read recordings in TORSIO_DATA or "
      "../shared/data; 003-coupling runs CalculiX (apt-get install calculix-ccx).");
  verb->add_option("ITEM", flags->items, "name of an experiment; --list shows them");
  verb->add_flag("--list", flags->list, "show the experiments");
  verb->add_flag("--quick", flags->options.is_quick,
                 "shorter recordings and smaller networks, as a quick test");
  verb->add_option("--repeats", flags->options.repeats, "repeats with different seeds")
      ->capture_default_str();
  add_seed(*verb, flags->options.seed, "seed of the first repeat");
  verb->add_option("--json", flags->json.destination,
                   "write the figures as JSON to a file, or - for standard output");
  verb->add_option("--plot", flags->plot,
                   "draw the figure of an experiment that has one: SVG, PNG or PDF");
  flags->report.add_page(*verb);
  verb->callback([flags] { run(*flags); });
}
