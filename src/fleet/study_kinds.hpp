#pragma once

#include <memory>

#include "torsio/core/progress.hpp"
#include "torsio/search/study_kind.hpp"
#include "torsio/store/study_store.hpp"

namespace torsio {

/// What runs the trials of a study, from its kind and spec: recordings are read.
/// @throws Error for a kind that this version does not know, or as the kind's own function.
[[nodiscard]] std::unique_ptr<StudyKind> make_study_kind(const StoredStudy& study,
                                                         const Progress& progress = {});

}  // namespace torsio
