#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "common/interrupt.hpp"
#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "fleet/study_kinds.hpp"
#include "search/study_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"
#include "verbs.hpp"

namespace {

struct WorkFlags {
  WorkerFlags worker;
  bool waits = false;
};

/// The studies that cannot be run here: each is remarked on once, and tried again after a while, since
/// a file that is missing may be copied later.
class Skipped {
 public:
  [[nodiscard]] bool contains(const torsio::StoredStudy& study) const {
    const auto found = studies_.find(study.id);
    return found != studies_.end() && Clock::now() - found->second.since < kPause;
  }
  [[nodiscard]] bool is_empty() const noexcept { return studies_.empty(); }
  void forget(const torsio::StoredStudy& study) { studies_.erase(study.id); }

  void add(const torsio::StoredStudy& study, const torsio::Error& error) {
    Reason& known = studies_[study.id];
    const std::string text = error.what();
    if (known.text != text) remark(fmt::format("study '{}' is left out: {}", study.name, text));
    known = {.text = text, .since = Clock::now()};
  }

 private:
  using Clock = std::chrono::steady_clock;
  struct Reason {
    std::string text;
    Clock::time_point since;
  };
  static constexpr auto kPause = std::chrono::seconds(60);
  std::map<std::int64_t, Reason> studies_;
};

/// What `torsio work` runs trials with.
struct Work {
  const WorkFlags& flags;
  torsio::StudyStore& store;
  torsio::WorkerOptions options;
  torsio::Progress progress;
  Skipped skipped = {};

  /// None: it cannot be run here, which is an error only for a study that was named.
  std::unique_ptr<torsio::StudyKind> load(const torsio::StoredStudy& study) {
    try {
      torsio::refuse_other_version(study, torsio::kVersion, store.address().name());
      auto kind = torsio::make_study_kind(study, progress);
      skipped.forget(study);
      return kind;
    } catch (const torsio::Cancelled&) {
      throw;
    } catch (const torsio::Error& error) {
      if (!flags.worker.study.empty()) throw;
      skipped.add(study, error);
      return nullptr;
    }
  }

  /// @returns whether any trial was run.
  bool work_on(const torsio::StoredStudy& study) {
    if (skipped.contains(study)) return false;
    take_back_of_dead(store, study);
    if (store.counts(study.id).is_complete()) return false;
    const auto kind = load(study);
    if (!kind) return false;
    const torsio::WorkersReport report =
        torsio::run_workers(store, study, *kind, options, progress);
    if (report.finished + report.lost == 0) return false;
    remark(fmt::format(
        "study '{}': {} finished here{}", study.name, counted(report.finished, "trial"),
        report.lost > 0 ? fmt::format(", {} lost to other workers, since this one did not answer "
                                      "within the lease: their results were dropped",
                                      report.lost)
                        : ""));
    return true;
  }

  /// Those to work on. @throws torsio::Error if the one that was named does not exist.
  [[nodiscard]] std::vector<torsio::StoredStudy> studies() {
    std::vector<torsio::StoredStudy> all = store.studies();
    const std::string& wanted = flags.worker.study;
    if (wanted.empty()) return all;
    std::erase_if(all, [&](const torsio::StoredStudy& study) { return study.name != wanted; });
    if (all.empty() && !flags.waits)
      throw torsio::Error({.place = store.address().name(),
                           .problem = fmt::format("there is no study '{}'", wanted),
                           .advice = "Begin it with torsio search, or wait for it with --wait."});
    return all;
  }
};

/// @throws torsio::Cancelled after Ctrl-C.
void pause_2_s() {
  for (int k = 0; k < 20; ++k) {
    if (is_interrupted()) throw torsio::Cancelled();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

/// Opening a SQLite file that does not exist would create it, at a misspelt path too.
void require_store(const torsio::StoreAddress& address, bool waits) {
  const auto is_there = [&] {
    std::error_code absent;
    return address.kind != torsio::StoreAddress::Kind::sqlite ||
           std::filesystem::exists(address.target, absent);
  };
  if (is_there()) return;
  if (!waits)
    throw torsio::Error({.place = address.name(),
                         .problem = "there is no such store",
                         .advice = "Correct the path, or begin a study with torsio search."});
  remark(
      fmt::format("{}: there is no such store yet; waiting until a study is begun there. "
                  "Ctrl-C stops.",
                  address.name()));
  while (!is_there()) pause_2_s();
}

void run(const WorkFlags& flags) {
  torsio::WorkerOptions options = flags.worker.options();
  options.until_complete = false;
  const torsio::StoreAddress address = torsio::store_address(flags.worker.store);
  require_store(address, flags.waits);
  torsio::StudyStore store(address, wait_for_server,
                           flags.waits ? std::numeric_limits<double>::infinity()
                                       : torsio::kWorkerPatience * options.lease_s);
  ProgressBar progress;
  Work work{.flags = flags, .store = store, .options = options, .progress = progress.listener()};
  for (;;) {
    bool has_worked = false;
    for (const torsio::StoredStudy& study : work.studies()) has_worked |= work.work_on(study);
    if (has_worked) continue;
    if (!flags.waits) break;
    pause_2_s();
  }
  remark(work.skipped.is_empty() ? "no trial is waiting"
                                 : "no trial is waiting of the studies that can be run here");
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
  verb->get_option("--store")->required();
  verb->add_flag("--wait", flags->waits,
                 "wait for new trials, and for a store that is not there yet, instead of ending");
  verb->callback([flags] { run(*flags); });
}
