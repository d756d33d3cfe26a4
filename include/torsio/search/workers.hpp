#pragma once

#include <cstddef>
#include <string>

#include "torsio/core/progress.hpp"
#include "torsio/search/study_kind.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

/// For how many leases a worker waits for a trial, or for a server that cannot be reached.
inline constexpr double kWorkerPatience = 1.5;

struct WorkerOptions {
  /// Trials that run at the same time; 0: one for each core that the process may use. When fewer
  /// trials are left, each may use more threads.
  std::size_t threads = 0;
  /// A worker that is not heard of for this time loses its trial. A third of it passes between two
  /// extensions.
  double lease_s = 60.0;
  /// Return only when every trial of the study has finished, also those of other workers; else when
  /// none could be claimed for `kWorkerPatience` leases: those of a worker that was killed can be.
  bool until_complete = true;
  /// Which worker this is, in the store: a name that no other process has; empty: `worker_name`.
  std::string name = {};
};

struct WorkersReport {
  std::size_t finished = 0;  ///< trials whose results were written
  std::size_t lost = 0;      ///< whose lease was lost: the results were dropped
};

/// Claims trials of a study, runs them and writes their results, on several threads, while leases
/// are extended by another one with its own connection.
/// @throws Cancelled if `progress` asks to stop: the running trials are given back. Error as
/// `StudyKind::run` and `StudyStore`.
WorkersReport run_workers(StudyStore& store, const StoredStudy& study, StudyKind& kind,
                          const WorkerOptions& options, const Progress& progress = {});

/// Enters the decisions of `kind` on halving steps that are complete. @returns whether there were any.
bool advance(StudyStore& store, const StoredStudy& study, StudyKind& kind);

/// "host:1234:9f3a1c2e": the number of the process, and one that no process before it had.
[[nodiscard]] std::string worker_name();

}  // namespace torsio
