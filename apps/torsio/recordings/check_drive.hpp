#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "torsio/check/check.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

// `check --advise --load`: what the recordings lack for `torsio identify`, and what to record next for it.

struct CheckedDrive {
  std::vector<torsio::Finding> findings;
  std::vector<torsio::DriveAdvice> advice;
};

/// Whether no recording has the deflection of a spring, so that only a drive can be learned from them.
[[nodiscard]] bool lacks_deflection(const torsio::Dataset& dataset);

/// The drive file, or the law that the channels suggest; empty: they suggest none.
[[nodiscard]] std::optional<torsio::DriveSheet> law_to_check(const torsio::Dataset& dataset,
                                                             const std::string& drive_file,
                                                             bool wants_advice);

/// Identifies the drive of the training recordings, with the terms that every drive of its law may have and without
/// standard errors, and asks for its advice.
/// @param threads 0: as many as the machine has; the result does not depend on them
/// @throws torsio::Error if they do not determine a model.
[[nodiscard]] CheckedDrive checked_drive(const torsio::Dataset& dataset,
                                         const std::string& load_file,
                                         const torsio::DriveSheet& drive, std::size_t threads,
                                         const torsio::Progress& progress);
