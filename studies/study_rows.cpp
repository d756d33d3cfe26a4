#include "study_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {

std::string StudyConditions::of(const std::string& recording) const {
  for (const auto& [name, condition] : conditions_)
    if (name == recording) return condition;
  return recording;
}

void show_published(StudyRow& row, std::span<const PaperEntry> published,
                    std::string_view condition, std::string_view model) {
  for (const PaperEntry& entry : published)
    if (entry.condition == condition && entry.model == model)
      row.published.emplace_back(entry.quantity, entry.figure);
}

void StudyRows::Sum::add(const ResultRow& row, double largest_target) {
  const double error = row.score.metrics.rmse;
  rmse.add(error);
  percent.add(100.0 * error / largest_target);
  largest.add(largest_target);
  max_abs = std::max(max_abs, row.score.metrics.max_abs);
  constexpr double kBlank = 5.0;
  if (row.score.metrics.fit_percent < kBlank) ++blank;
  if (row.score.one_step.samples > 0) one_step.add(row.score.one_step.rmse);
  samples += row.score.metrics.samples;
  guarded += row.score.guarded_samples;
  if (row.status == "diverged") ++diverged;
  within.add(row.score.within_std_dev);
  within_2.add(row.score.within_2_std_dev);
  std_dev.add(row.score.mean_std_dev);
  without.add(row.score.without_std_dev);
  step_ns.add(row.score.step_ns_p50);
  fit_percent.add(row.score.metrics.fit_percent);
  fit_seconds.add(row.fit_seconds);
}

void StudyRows::require_fitted(const ResultRow& row) {
  if (row.status != "failed") return;  // a free run that diverged is a result
  throw Error({.place = row.fold.empty() ? row.family : row.family + ", " + row.fold,
               .problem = row.reason});
}

std::string StudyRows::model_of(const ResultRow& row) {
  std::string model = row.family;
  // A network's size is what a reader asks for; the rest of its settings are the study's.
  if (const auto at = row.variant.find("layers="); at != std::string::npos) {
    const auto begin = at + std::string_view("layers=").size();
    model = fmt::format("{} {}", model,
                        row.variant.substr(begin, row.variant.find(',', begin) - begin));
  } else if (!row.variant.empty()) {
    model = fmt::format("{} {}", model, row.variant);
  }
  return row.input_set.empty() ? model : fmt::format("{}, {}", model, row.input_set);
}

StudyRows::Sum& StudyRows::sum_of(Key key) {
  const auto found = std::ranges::find(sums_, key, &std::pair<Key, Sum>::first);
  if (found != sums_.end()) return found->second;
  return sums_.emplace_back(std::move(key), Sum{}).second;
}

void StudyRows::add(const std::string& condition, const std::string& model, const ResultRow& row,
                    const Dataset& dataset) {
  sum_of({condition, model}).add(row, largest_target(dataset, row.recording));
}

void StudyRows::failed(const std::string& condition, const std::string& model,
                       const std::string& reason) {
  sum_of({condition, model}).failure = reason;
}

double StudyRows::largest_target(const Dataset& dataset,
                                 const std::optional<std::string>& recording) {
  double largest = 0.0;
  for (const DatasetRecord& record : dataset.records) {
    if (recording && record.recording.name() != *recording) continue;
    for (const double value : record.recording.channel(dataset.target).values)
      if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

template <class Row, class Fill>
std::vector<Row> StudyRows::rows(const Fill& fill) const {
  std::vector<Row> rows;
  for (const auto& [key, sum] : sums_) {
    Row row;
    row.condition = key.condition;
    row.model = key.model;
    row.runs = sum.rmse.count();
    row.rmse = sum.rmse.mean();
    row.rmse_std = sum.rmse.std_dev();
    show_published(row, published_, key.condition, key.model);
    fill(sum, row);
    rows.push_back(std::move(row));
  }
  std::vector<std::string> order;
  for (const Row& row : rows)
    if (std::ranges::find(order, row.condition) == order.end()) order.push_back(row.condition);
  std::ranges::stable_sort(rows, {}, [&](const Row& row) {
    return std::ranges::find(order, row.condition) - order.begin();
  });
  return rows;
}

std::vector<ErrorRow> StudyRows::errors() const {
  return rows<ErrorRow>([](const Sum& sum, ErrorRow& row) {
    row.percent = sum.percent.mean();
    row.largest = sum.largest.mean();
    row.max_abs = row.runs > 0 ? sum.max_abs : kNotMeasured;
    row.one_step = sum.one_step.mean();
    row.blank = sum.blank;
    row.guarded_percent = 100.0 * static_cast<double>(sum.guarded) /
                          static_cast<double>(std::max<std::size_t>(sum.samples, 1));
    row.diverged = sum.diverged;
    row.fit_percent = sum.fit_percent.mean();
    row.fit_seconds = sum.fit_seconds.mean();
  });
}

std::vector<ComparisonRow> StudyRows::comparisons() const {
  return rows<ComparisonRow>([](const Sum& sum, ComparisonRow& row) {
    row.percent = sum.percent.mean();
    row.step_ns = sum.step_ns.mean();
    row.within_std_dev = sum.within.mean();
    row.within_2_std_dev = sum.within_2.mean();
    row.mean_std_dev = sum.std_dev.mean();
    row.without_std_dev = sum.without.mean();
    row.diverged = sum.diverged;
    row.failure = sum.failure;
  });
}

StudyPlant study_plant(std::string_view actuator) {
  return {std::string(actuator), sheet_hash(data_sheet(actuator))};
}

std::uint64_t repeat_seed(const StudyOptions& options, std::size_t k) noexcept {
  return options.seed + 100 * k;
}

void swap_input_and_target(Dataset& dataset) {
  dataset.target = "spring_deflection_rad";
  for (DatasetRecord& record : dataset.records)
    add_derived(record.recording, {{"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"}});
  dataset.input_sets = {{"",
                         {"torque_Nm", "lowpass(rate(spring_deflection_rad), 10Hz)",
                          "lowpass(rate(joint_angle_rad), 10Hz)"}}};
}

Progress nth_of(const Progress& progress, std::size_t n, std::size_t count,
                std::string_view doing) {
  if (!progress) return {};
  return [&progress, n, count, name = std::string(doing)](double share, std::string_view at) {
    return progress((static_cast<double>(n) + share) / static_cast<double>(count),
                    fmt::format("{}: {}", name, at));
  };
}

}  // namespace torsio
