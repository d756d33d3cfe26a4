#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/data/dataset.hpp"
#include "torsio/studies/study.hpp"
#include "torsio/train/results.hpp"

namespace torsio {

/// Gathers a study's rows from the results of its fits.
class StudyRows {
 public:
  /// What the paper found under this condition.
  void paper(const std::string& condition, const std::string& model, double rmse);
  /// The same as a best fit; the study then tells its own, too.
  void paper_fit(const std::string& condition, const std::string& model, double percent);
  /// What a row of the table is called for a family with these settings, as `ModelChoice::variant` has them.
  void call(const std::string& family, const std::string& variant, const std::string& model);

  /// The rows of single recordings in a split, each under its condition.
  /// @param condition_of (recording) -> condition
  /// @throws Error if a fit failed: a study has no holes. A free run that diverged counts with its error.
  template <class ConditionOf>
  void add(const Results& results, const Dataset& dataset, Role split,
           const ConditionOf& condition_of) {
    for (const ResultRow& row : results.rows)
      if (row.split == split) add_row(row, dataset, condition_of);
  }

  [[nodiscard]] std::vector<StudyRow> rows() const;

 private:
  struct Sum {
    std::size_t runs = 0;
    double mean = 0.0;
    double squares = 0.0;  ///< deviations from the mean
    double percent = 0.0;
    double largest = 0.0;
    double fit_percent = 0.0;
    void add(const Metrics& metrics, double largest_target);
  };
  struct Key {
    std::string condition;
    std::string model;
    bool operator==(const Key&) const = default;
  };

  static void require_fitted(const ResultRow& row);
  struct Name {
    std::string family;
    std::string variant;
    std::string model;
  };
  [[nodiscard]] std::string model_of(const ResultRow& row) const;
  Sum& sum_of(Key key);

  template <class ConditionOf>
  void add_row(const ResultRow& row, const Dataset& dataset, const ConditionOf& condition_of) {
    require_fitted(row);
    if (!row.recording) return;
    sum_of({condition_of(*row.recording), model_of(row)})
        .add(row.score.metrics, largest_target(dataset, *row.recording));
  }
  static double largest_target(const Dataset& dataset, const std::string& recording);

  std::vector<std::pair<Key, Sum>> sums_;
  std::vector<std::pair<Key, double>> papers_;
  std::vector<std::pair<Key, double>> paper_fits_;
  std::vector<Name> names_;
};

/// A hash of all numbers in the data sheet of an actuator.
[[nodiscard]] StudyPlant study_plant(std::string_view actuator);

/// Of the k-th repeat; far enough apart for a dataset to count on from it.
[[nodiscard]] std::uint64_t repeat_seed(const StudyOptions& options, std::size_t k) noexcept;

/// The share of one fit's progress among so many.
[[nodiscard]] Progress nth_of(const Progress& progress, std::size_t n, std::size_t count,
                              std::string_view doing);

}  // namespace torsio
