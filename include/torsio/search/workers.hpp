#pragma once

#include <cstddef>
#include <string>

#include "torsio/core/progress.hpp"
#include "torsio/search/study_kind.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

struct WorkerOptions {
  /// Trials that run at the same time; 0: one for each core that the process may use. When fewer
  /// trials are left, each may use more threads.
  std::size_t threads = 0;
  /// A worker that is not heard of for this time loses its trial. A third of it passes between two
  /// extensions.
  double lease_s = 60.0;
  /// Return only when every trial of the study has finished, also those of other workers; else when
  /// none could be claimed for one and a half leases: those of a worker that was killed can be.
  bool until_complete = true;
  /// Which worker this is, in the store; empty: host and number of the process.
  std::string name = {};
  StudyStore::OnWait on_wait = {};  ///< for the connection that extends the leases
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

/// "host:1234"
[[nodiscard]] std::string worker_name();

}  // namespace torsio
