#include "fit/mixture/dgmm_spread.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <limits>
#include <mutex>
#include <numeric>

#include "core/report_progress.hpp"
#include "fit/common/folds.hpp"
#include "numerics/parallel.hpp"
#include "torsio/estimate/estimator_settings.hpp"

namespace torsio {
namespace {

constexpr std::array kSpreads{0.1, kDefaultSpread, 0.25, 0.4, 0.6, 1.0};
constexpr std::size_t kDefault = 1;  // index in kSpreads

// The search looks at every n-th sample, so that it is given no more than these.
constexpr std::size_t kMaxSearched = 16000;

// Mean square errors, one for each fold that could be evaluated.
using FoldErrors = std::vector<double>;

struct Fold {
  Matrix kept;
  Matrix left_out;  ///< only what lies within the range of `kept`
};

struct Folds {
  std::vector<Fold> folds;
  bool of_records = false;
};

void append_row(Matrix& matrix, std::span<const double> row) {
  matrix.values.insert(matrix.values.end(), row.begin(), row.end());
  matrix.columns = row.size();
  ++matrix.rows;
}

// The record of every usable sample, counted from 0 without records that have none.
std::vector<std::size_t> record_of_samples(const TrainingData& data) {
  std::vector<std::size_t> records;
  std::size_t record = 0;
  for (const Sequence& sequence : data.sequences) {
    const auto usable = static_cast<std::size_t>(
        std::ranges::count_if(sequence.use, [](std::uint8_t use) { return use != 0; }));
    records.insert(records.end(), usable, record);
    if (usable > 0) ++record;
  }
  return records;
}

// Leaves in `samples` those whose inputs (all columns but the first) lie within `reference`'s.
Matrix within_range(const Matrix& samples, const Matrix& reference) {
  const double margin = FeatureRanges{}.margin;
  std::vector<double> low(samples.columns, -std::numeric_limits<double>::infinity());
  std::vector<double> high(samples.columns, std::numeric_limits<double>::infinity());
  for (std::size_t j = 1; j < samples.columns; ++j) {
    low[j] = high[j] = reference(0, j);
    for (std::size_t i = 1; i < reference.rows; ++i) {
      low[j] = std::min(low[j], reference(i, j));
      high[j] = std::max(high[j], reference(i, j));
    }
    const double slack = margin * (high[j] - low[j]);
    low[j] -= slack;
    high[j] += slack;
  }
  Matrix inside;
  for (std::size_t i = 0; i < samples.rows; ++i) {
    bool is_inside = true;
    for (std::size_t j = 1; j < samples.columns; ++j)
      is_inside &= samples(i, j) >= low[j] && samples(i, j) <= high[j];
    if (is_inside) append_row(inside, samples.row(i));
  }
  return inside;
}

Folds folds_of(const Matrix& samples, const TrainingData& data) {
  const std::vector<std::size_t> records = record_of_samples(data);
  const std::size_t count = records.back() + 1;
  Folds result{.folds = {}, .of_records = count > 1};
  const std::size_t stride = (samples.rows + kMaxSearched - 1) / kMaxSearched;
  for (std::size_t fold = 0; fold < (result.of_records ? count : kFolds); ++fold) {
    Fold split;
    Matrix left_out;
    for (std::size_t i = 0; i < samples.rows; i += stride) {
      const std::size_t own = result.of_records ? records[i] : interleaved_fold(i, samples.rows);
      append_row(own == fold ? left_out : split.kept, samples.row(i));
    }
    if (split.kept.rows == 0 || left_out.rows == 0) continue;
    split.left_out = within_range(left_out, split.kept);
    if (split.left_out.rows > 0) result.folds.push_back(std::move(split));
  }
  return result;
}

double mean_square_error(Dgmm model, const Matrix& samples) {
  double sum = 0.0;
  for (std::size_t i = 0; i < samples.rows; ++i) {
    const double error = model.step(samples.row(i).subspan(1)).value - samples(i, 0);
    sum += error * error;
  }
  return sum / static_cast<double>(samples.rows);
}

double mean_of(const FoldErrors& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Whether `errors` lie below those of the default by two standard errors of the gain. One is not
// enough: with three records chance alone gives that once in five times.
bool is_clearly_better(const FoldErrors& errors, const FoldErrors& at_default) {
  FoldErrors gains(errors.size());
  std::ranges::transform(at_default, errors, gains.begin(), std::minus<>());
  const double mean = mean_of(gains);
  double square = 0.0;
  for (const double gain : gains) square += (gain - mean) * (gain - mean);
  const auto count = static_cast<double>(gains.size());
  return mean > 2.0 * std::sqrt(square / (count * (count - 1.0)));
}

}  // namespace

SpreadChoice choose_spread(const Matrix& samples, const TrainingData& data,
                           const FitWithSpread& fit, std::size_t threads,
                           const Progress& progress) {
  const Folds split = folds_of(samples, data);
  const std::vector<Fold>& folds = split.folds;
  if (folds.size() < 2)
    return {.note = fmt::format("initial_spread {}: fewer than two records lie within the range of "
                                "the others, so none could be chosen by leaving one out",
                                kDefaultSpread)};
  std::array<FoldErrors, kSpreads.size()> errors;
  std::string scores;
  std::mutex reporting;
  for (std::size_t k = 0; k < kSpreads.size(); ++k) {
    // The fits ask as well: one of them with many iterations takes hours.
    const Progress within = [&, k](double /*of_one_fit*/, std::string_view /*doing*/) {
      const std::scoped_lock lock(reporting);
      report_progress(progress, static_cast<double>(k) / static_cast<double>(kSpreads.size()),
                      "choosing the spread");
      return true;
    };
    errors[k].resize(folds.size());
    for_each_chunk(folds.size(), threads, [&, k](std::size_t fold) {
      errors[k][fold] =
          mean_square_error(Dgmm(fit(folds[fold].kept, kSpreads[k], within)), folds[fold].left_out);
    });
    scores +=
        fmt::format("{}{}: {:.4g}", k == 0 ? "" : ", ", kSpreads[k], std::sqrt(mean_of(errors[k])));
  }
  const auto best =
      static_cast<std::size_t>(std::ranges::min_element(errors, {}, mean_of) - errors.begin());
  const bool is_clear = best != kDefault && is_clearly_better(errors[best], errors[kDefault]);
  const double spread = is_clear ? kSpreads[best] : kDefaultSpread;
  return {
      .spread = spread,
      .note = fmt::format(
          "initial_spread {} {} leaving out {}; RMSE there: {}", spread,
          best == kDefault || is_clear ? "chosen by" : "kept, none is clearly better when",
          split.of_records ? "one record at a time" : "a fifth of the record at a time", scores)};
}

}  // namespace torsio
