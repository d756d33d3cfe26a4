#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/running_mean.hpp"
#include "studies/study.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/results.hpp"

namespace torsio {

/// Under which condition of a study a recording is scored.
class StudyConditions {
 public:
  void add(const std::string& recording, const std::string& condition) {
    conditions_.emplace_back(recording, condition);
  }
  /// The recording's own name if it was not added.
  [[nodiscard]] std::string of(const std::string& recording) const;
  [[nodiscard]] std::size_t size() const noexcept { return conditions_.size(); }

 private:
  std::vector<std::pair<std::string, std::string>> conditions_;
};

/// Adds to a row the published figures of its condition and model.
void show_published(StudyRow& row, std::span<const PaperEntry> published,
                    std::string_view condition, std::string_view model);

/// Gathers a study's rows from the results of its fits.
class StudyRows {
 public:
  /// @param published figures to be shown in the rows of their condition and model
  explicit StudyRows(std::span<const PaperEntry> published = {}) : published_(published) {}

  /// The rows of single recordings in a split, each under its condition.
  /// @param condition_of (recording) -> condition
  /// @param model_of (row) -> name of its model in the study
  /// @throws Error if a fit failed. A free run that diverged counts with its error.
  template <class ConditionOf, class ModelOf>
  void add(const Results& results, const Dataset& dataset, Role split,
           const ConditionOf& condition_of, const ModelOf& model_of) {
    for (const ResultRow& row : results.rows) {
      if (row.split != split) continue;
      require_fitted(row);
      if (!row.recording) continue;
      sum_of({condition_of(*row.recording), model_of(row)})
          .add(row, largest_target(dataset, *row.recording));
    }
  }
  /// The same with families' own names.
  template <class ConditionOf>
  void add(const Results& results, const Dataset& dataset, Role split,
           const ConditionOf& condition_of) {
    add(results, dataset, split, condition_of, model_of);
  }

  /// One row, whatever its split.
  void add(const std::string& condition, const std::string& model, const ResultRow& row,
           const Dataset& dataset);
  /// Adds a row for a failed fit with its reason. Only a study that compares all families has such
  /// rows.
  void failed(const std::string& condition, const std::string& model, const std::string& reason);

  [[nodiscard]] std::vector<ErrorRow> errors() const;
  [[nodiscard]] std::vector<ComparisonRow> comparisons() const;

 private:
  struct Sum {
    RunningMean rmse, percent, largest, one_step, fit_percent, fit_seconds, within, within_2,
        std_dev, without, step_ns;
    double max_abs = 0.0;
    std::size_t blank = 0;
    std::size_t samples = 0;
    std::size_t guarded = 0;
    std::size_t diverged = 0;
    std::string failure;
    void add(const ResultRow& row, double largest_target);
  };
  struct Key {
    std::string condition;
    std::string model;
    bool operator==(const Key&) const = default;
  };

  /// Condition by condition, in the order of their first row. @param fill writes the row's own
  /// fields.
  template <class Row, class Fill>
  [[nodiscard]] std::vector<Row> rows(const Fill& fill) const;

  static void require_fitted(const ResultRow& row);
  static std::string model_of(const ResultRow& row);
  Sum& sum_of(Key key);

  /// The largest |target| of one recording, or of all.
  static double largest_target(const Dataset& dataset, const std::optional<std::string>& recording);

  std::vector<std::pair<Key, Sum>> sums_;
  std::span<const PaperEntry> published_;
};

/// The name, and the hash of the data sheet (`sheet_hash`), which covers variant and numbers.
[[nodiscard]] StudyPlant study_plant(std::string_view actuator);

/// Seed of the k-th repeat; the distance leaves room for the following seeds of a dataset.
[[nodiscard]] std::uint64_t repeat_seed(const StudyOptions& options, std::size_t k) noexcept;

/// The deflection becomes the torque's function, with the rates of the forward models.
void swap_input_and_target(Dataset& dataset);

/// The share of one fit's progress among so many.
[[nodiscard]] Progress nth_of(const Progress& progress, std::size_t n, std::size_t count,
                              std::string_view doing);

}  // namespace torsio
