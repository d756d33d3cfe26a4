#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "common/interrupt.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "search/study_flags.hpp"
#include "search/study_kinds.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"
#include "verbs.hpp"

namespace {

struct WorkFlags {
  WorkerFlags worker;
  bool waits = false;
};

bool is_of_this_version(const torsio::StoredStudy& study, const torsio::StudyStore& store,
                        bool is_named) {
  if (study.torsio_version == torsio::kVersion) return true;
  const torsio::ErrorReport report{
      .place = store.address().name(),
      .problem = fmt::format("study '{}' was begun by another version of torsio, and this one may "
                             "give other last digits",
                             study.name),
      .expected = study.torsio_version,
      .found = torsio::kVersion,
      .advice = "Install that version on this machine."};
  if (is_named) throw torsio::Error(report);
  remark(torsio::Error(report).what());
  return false;
}

/// @returns whether any trial was run.
bool work_on(const torsio::StoredStudy& study, torsio::StudyStore& store,
             const torsio::WorkerOptions& options, const torsio::Progress& progress) {
  take_back_of_dead(store, study);
  if (store.counts(study.id).is_complete()) return false;
  const auto kind = torsio::make_study_kind(study, progress);
  const torsio::WorkersReport report = torsio::run_workers(store, study, *kind, options, progress);
  if (report.finished + report.lost == 0) return false;
  remark(fmt::format("study '{}': {} trials finished here{}", study.name, report.finished,
                     report.lost > 0
                         ? fmt::format(", {} lost to other workers, since this one did not answer "
                                       "within the lease: their results were dropped",
                                       report.lost)
                         : ""));
  return true;
}

void run(const WorkFlags& flags) {
  if (flags.worker.store.empty())
    throw torsio::UsageError(
        {.place = "--store", .expected = "a SQLite file or a postgresql:// URL", .found = "none"});
  torsio::WorkerOptions options = flags.worker.options();
  options.until_complete = false;
  torsio::StudyStore store(torsio::store_address(flags.worker.store), wait_for_server);
  ProgressBar progress;
  for (;;) {
    std::vector<torsio::StoredStudy> studies = store.studies();
    if (!flags.worker.study.empty()) {
      std::erase_if(studies, [&](const torsio::StoredStudy& study) {
        return study.name != flags.worker.study;
      });
      if (studies.empty() && !flags.waits)
        throw torsio::Error({.place = store.address().name(),
                             .problem = fmt::format("there is no study '{}'", flags.worker.study),
                             .advice = "Begin it with torsio search, or wait for it with --wait."});
    }
    bool has_worked = false;
    for (const torsio::StoredStudy& study : studies)
      if (is_of_this_version(study, store, !flags.worker.study.empty()))
        has_worked |= work_on(study, store, options, progress.listener());
    if (has_worked) continue;
    if (!flags.waits) break;
    for (int k = 0; k < 20; ++k) {
      if (is_interrupted()) throw torsio::Cancelled();
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  remark("no trial is waiting");
}

}  // namespace

void add_work(CLI::App& app) {
  auto flags = std::make_shared<WorkFlags>();
  CLI::App* verb =
      app.add_subcommand("work", "run trials of the studies of a store until none is waiting");
  verb->footer(
      "Example: torsio work --store postgresql://robot@server/torsio --threads 4\n"
      "Start as many as there are machines: docs/search.md.");
  flags->worker.add(*verb, "SQLite file or postgresql:// URL of the studies",
                    "only this study (default: all of the store)");
  verb->add_flag("--wait", flags->waits, "wait for new trials instead of ending");
  verb->callback([flags] { run(*flags); });
}
