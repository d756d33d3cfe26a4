#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "core/report_progress.hpp"
#include "core/running_mean.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/gaussian_process/fit_parametric_gp.hpp"
#include "fit/gaussian_process/fit_parametric_gp_paper.hpp"
#include "fit/narx/fit_narx.hpp"
#include "paper_figures.hpp"
#include "sensor_bench.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/core/random.hpp"

// Paper 002, section III-C: how many clusters M and past samples n_y, n_u, by the errors one step ahead on samples
// that are drawn from the training data.

namespace torsio {
namespace {

constexpr std::array<std::size_t, 4> kClusterCounts{6, 10, 14, 20};
constexpr std::array<std::size_t, 4> kOrders{4, 6, 8, 10};
constexpr std::size_t kSamples = 2000;  // Q
constexpr std::size_t kPapersClusters = 14;
constexpr std::size_t kPapersOrder = 8;

struct Errors {
  double rmse_percent = 0.0;
  double max_percent = 0.0;
};

constexpr Errors kUnusable{std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::infinity()};

/// (22) and (23): one step ahead, in percent of the full scale.
Errors errors_of(const ParametricGp::Parameters& parameters, const Table& table, Random random) {
  ParametricGp model(parameters);
  double squares = 0.0;
  double largest = 0.0;
  for (std::size_t q = 0; q < kSamples; ++q) {
    const std::size_t n = random.below(table.target.size());
    const Estimate estimate = model.step(table.features.row(n));
    if (estimate.fault != Fault::none) return kUnusable;
    const double error = std::abs(estimate.value - table.target[n]) / kSensorFullScale_Nm;
    squares += error * error;
    largest = std::max(largest, error);
  }
  return {100.0 * std::sqrt(squares / kSamples), 100.0 * largest};
}

struct CellMeans {
  RunningMean rmse;
  RunningMean max;
};

/// One cell of the grid, by Algorithm 1 or by our training.
Errors trained(const TrainingData& data, std::size_t points, bool is_printed, std::size_t updates,
               std::uint64_t seed) {
  const FitContext context{.seed = seed};
  const ParametricGp::Parameters parameters =
      is_printed
          ? fit_parametric_gp_paper(data, {.inducing_points = points, .updates = updates}, context)
                .parameters
          : fit_parametric_gp(data, {.inducing_points = points, .updates = updates}, context)
                .parameters;
  return errors_of(parameters, usable_table(data), Random(seed + kFirstTestSeed));
}

using Grid = std::array<std::array<CellMeans, kOrders.size()>, kClusterCounts.size()>;

/// Every cell by one of the trainings, over the repeats.
Grid measured_grid(bool is_printed, const StudyOptions& options, const Progress& progress) {
  const std::size_t updates = options.is_quick ? 500 : 200'000;
  Grid grid{};
  for (std::size_t k = 0; k < options.repeats; ++k) {
    const std::uint64_t seed = repeat_seed(options, k);
    const SensorBench bench = trained_on_grid(seed);
    const LearningData learning =
        learning_data(bench.dataset, choice_of({.label = {}, .model = "arx"}, bench).features);
    for (std::size_t o = 0; o < kOrders.size(); ++o) {
      report_progress(progress,
                      static_cast<double>(k * kOrders.size() + o) /
                          static_cast<double>(options.repeats * kOrders.size()),
                      "clusters and lags");
      const TrainingData data =
          narx_data(learning.training, {.inputs = kOrders[o] - 1, .outputs = kOrders[o] - 1});
      for (std::size_t p = 0; p < kClusterCounts.size(); ++p) {
        const Errors errors = trained(data, kClusterCounts[p], is_printed, updates, seed);
        grid[p][o].rmse.add(errors.rmse_percent);
        grid[p][o].max.add(errors.max_percent);
      }
    }
  }
  return grid;
}

void add_cells(QuantityTable& table, const char* condition, const Grid& grid) {
  constexpr const char* kCondition = "proposed: 2000 samples of the training data";
  for (std::size_t p = 0; p < kClusterCounts.size(); ++p)
    for (std::size_t o = 0; o < kOrders.size(); ++o) {
      const bool is_papers = kClusterCounts[p] == kPapersClusters && kOrders[o] == kPapersOrder;
      const auto row = [&](const char* quantity, double value,
                           const std::optional<PaperFigure>& published) {
        table.rows.push_back({.condition = condition,
                              .quantity = fmt::format("M = {}, n_y = n_u = {}: {}",
                                                      kClusterCounts[p], kOrders[o], quantity),
                              .value = value,
                              .unit = "%",
                              .published = is_papers ? published : std::nullopt,
                              .remark = std::isfinite(value) ? "" : "unusable in a repeat"});
      };
      row("RMSE", grid[p][o].rmse.mean(), paper_figure("002", "section III-C", kCondition, "RMSE"));
      row("largest error", grid[p][o].max.mean(),
          paper_figure("002", "section III-C", kCondition, "MAE"));
    }
}

std::string best_text(const char* condition, const Grid& grid) {
  double least = std::numeric_limits<double>::infinity();
  std::string text = fmt::format("{}: no cell is usable in every repeat", condition);
  for (std::size_t p = 0; p < kClusterCounts.size(); ++p)
    for (std::size_t o = 0; o < kOrders.size(); ++o) {
      if (!(grid[p][o].rmse.mean() < least)) continue;
      least = grid[p][o].rmse.mean();
      text = fmt::format(
          "{}: the least RMSE, {:.3g} %, has M = {}, n_y = n_u = {}; the paper chose 14 and 8",
          condition, least, kClusterCounts[p], kOrders[o]);
    }
  return text;
}

}  // namespace

Study selection_002(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "improved PGPR with M clusters, n_y - 1 past torques and n_u twists, trained one "
                  "step ahead on the "
                  "grid of sines, by Algorithm 1 and by our training; errors one step ahead on "
                  "2000 samples drawn "
                  "from the training data, in percent of 0.5 Nm",
              .unit = "Nm",
              .options = options,
              .plants = {study_plant(kSensorActuator)}};
  QuantityTable table;
  for (const bool is_printed : {true, false}) {
    const char* const condition = is_printed ? "Algorithm 1" : "our training";
    const Grid grid =
        measured_grid(is_printed, options, nth_of(progress, is_printed ? 0 : 1, 2, condition));
    add_cells(table, condition, grid);
    study.notes.push_back(best_text(condition, grid));
  }
  study.table = std::move(table);
  return study;
}

}  // namespace torsio
