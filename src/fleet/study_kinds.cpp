#include "fleet/study_kinds.hpp"

#include <fmt/format.h>

#include "fleet/calibration.hpp"
#include "search/specimen_study.hpp"
#include "torsio/core/error.hpp"
#include "torsio/search/structure_study.hpp"

namespace torsio {

std::unique_ptr<StudyKind> make_study_kind(const StoredStudy& study, const Progress& progress) {
  if (study.kind == kStructureStudy) return structure_study(study, progress);
  if (study.kind == kSpecimenStudy) return specimen_study(study);
  if (study.kind == kCalibrationStudy) return calibration_study(study);
  throw Error(
      {.place = "study " + study.name,
       .problem = fmt::format("this version of torsio cannot run its kind, '{}'", study.kind),
       .advice = "Use the torsio that began it: " + study.torsio_version + "."});
}

}  // namespace torsio
