#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "studies/study.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// What is shown of a study that has run.
struct StudyOutcome {
  std::string text;                        ///< `study_text`
  std::string json;                        ///< `study_json`
  std::vector<ReportFigure> figures = {};  ///< `Study::figures`
  std::size_t figure_columns = 1;
  double seconds = 0.0;  ///< how long it ran
};

/// Outcomes of studies in a folder: one file for each study and its options. An outcome is valid for the program that made
/// it only, since any change of its sources may change a figure. A study that `must_be_named` is never kept: it depends on
/// recordings or on another program.
class StudyCache {
 public:
  /// @param folder created when the first outcome is kept
  /// @param program hash of the program that runs the studies (`running_program_hash`)
  StudyCache(std::filesystem::path folder, std::uint64_t program);

  /// @returns none if there is no outcome of this program
  /// @throws Error naming the file if it is damaged or has another format
  [[nodiscard]] std::optional<StudyOutcome> find(const StudyInfo& study,
                                                 const StudyOptions& options) const;
  /// Writes the file completely or not at all. @throws Error if it cannot be written
  void keep(const StudyInfo& study, const StudyOptions& options, const StudyOutcome& outcome) const;

  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  [[nodiscard]] std::filesystem::path path_of(const StudyInfo& study,
                                              const StudyOptions& options) const;

  std::filesystem::path folder_;
  std::uint64_t program_;
};

/// $XDG_CACHE_HOME/torsio/studies, else ~/.cache/torsio/studies; empty if neither variable is set.
[[nodiscard]] std::filesystem::path study_cache_folder();

/// A hash of the bytes of the running program. @throws Error if they cannot be read
[[nodiscard]] std::uint64_t running_program_hash();

}  // namespace torsio
