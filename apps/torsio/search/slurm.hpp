#pragma once

#include <CLI/App.hpp>
#include <cstddef>
#include <string>
#include <vector>

#include "search/study_flags.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/search/study_kind.hpp"
#include "torsio/store/study_store.hpp"

/// `--engine slurm`: a job array whose tasks are workers.
struct SlurmFlags {
  std::size_t workers = 4;
  std::vector<std::string> options;
  bool only_submits = false;

  void add(CLI::App& verb);
};

/// Writes the job's script and submits it; then waits until every trial has finished, unless the
/// user asked only to submit.
/// @returns whether the study is complete.
/// @throws torsio::Error if sbatch fails, or if no worker is left while trials are; Cancelled.
[[nodiscard]] bool run_on_slurm(const SlurmFlags& flags, const WorkerFlags& worker,
                                torsio::StudyStore& store, const torsio::StoredStudy& study,
                                torsio::StudyKind& kind, const torsio::Progress& progress);
