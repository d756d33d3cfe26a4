#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "paper_figures.hpp"

// Where the figures of paper_figures.csv belong in the tables of the studies. A study shows a figure only where its
// condition is the paper's; where the protocols differ, docs/results/studies.md states how.

namespace torsio {

/// A row of a study, and what the paper calls its condition.
struct PublishedRow {
  std::string_view condition;
  std::string_view model;
  std::string_view papers_condition;
};

/// The two quantities that a paper prints of each row.
template <std::size_t rows>
consteval std::array<PaperEntry, 2 * rows> entries_of(
    std::string_view paper, std::string_view item, const std::array<PublishedRow, rows>& of,
    const std::array<RowQuantity, 2>& quantities, const std::array<std::string_view, 2>& names) {
  std::array<PaperEntry, 2 * rows> entries{};
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t q = 0; q < 2; ++q)
      entries[2 * i + q] = {of[i].condition, of[i].model, quantities[q],
                            paper_figure(paper, item, of[i].papers_condition, names[q])};
  return entries;
}

/// Paper 004: RMSE [Nm], and RMSE in percent of the largest measured torque; of the network after the online training,
/// as the paper validates it.
template <std::size_t rows>
consteval auto entries_of_004(std::string_view item, const std::array<PublishedRow, rows>& of) {
  return entries_of("004", item, of, {RowQuantity::rmse, RowQuantity::percent_of_max},
                    {"RMSE", "error percentage"});
}

inline constexpr auto kPublishedEncoders = entries_of_004(
    "Table 4", std::to_array<PublishedRow>({{"20 Nm", "lstm 250, I, online", "set I"},
                                            {"20 Nm", "lstm 250, II, online", "set II"},
                                            {"20 Nm", "lstm 250, III, online", "set III"}}));
inline constexpr auto kPublishedTorqueLevels = entries_of_004(
    "Table 5", std::to_array<PublishedRow>({{"5 Nm", "lstm 250, II, online, alone", "5 Nm"},
                                            {"20 Nm", "lstm 250, II, online, alone", "20 Nm"},
                                            {"30 Nm", "lstm 250, II, online, alone", "30 Nm"},
                                            {"40 Nm", "lstm 250, II, online, alone", "40 Nm"},
                                            {"50 Nm", "lstm 250, II, online, alone", "50 Nm"}}));
inline constexpr auto kPublishedImpedances = entries_of_004(
    "section 5.2", std::to_array<PublishedRow>(
                       {{"trained both, tested high", "lstm 250, II+, online", "high impedance"},
                        {"trained both, tested zero", "lstm 250, II+, online", "zero impedance"}}));
inline constexpr auto kPublishedTubes = entries_of_004(
    "Table 6", std::to_array<PublishedRow>({{"soft", "lstm 250, II, online", "soft tube"},
                                            {"stiff", "lstm 250, II, online", "stiff tube"},
                                            {"rigid", "lstm 250, III, online", "rigid tube"}}));

/// Paper 002: percent; it names no normaliser. Its "MAE" is the largest error.
inline constexpr auto kPublishedSensorModels =
    entries_of("002", "Table III",
               std::to_array<PublishedRow>({{"multisine", "GP", "GP"},
                                            {"multisine", "NN", "NN"},
                                            {"multisine", "PGPR", "PGPR"},
                                            {"multisine", "LSTM", "LSTM"},
                                            {"multisine", "improved PGPR", "proposed"}}),
               {RowQuantity::rmse_percent, RowQuantity::max_percent}, {"RMSE", "MAE"});

consteval PaperEntry best_fit(std::string_view model, std::string_view item,
                              std::string_view papers_model) {
  return {"bonded, triangles", model, RowQuantity::fit_percent,
          paper_figure("003", item, papers_model, "BF")};
}
/// The paper validates on another record of triangles, with a coupling of its own.
inline constexpr std::array kPublishedCouplingModels{
    best_fit("Hammerstein-Wiener", "section 4.2.1", "Hammerstein-Wiener"),
    best_fit("refined in continuous time", "section 4.3", "Hammerstein-Wiener"),
    best_fit("viscoelastic 003a", "Table 3", "model (a)"),
    best_fit("viscoelastic 003b", "Table 3", "model (b)"),
    best_fit("viscoelastic 003c", "Table 3", "model (c)"),
    best_fit("viscoelastic 003d", "Table 3", "model (d)")};

consteval PaperEntry tracking_rmse(std::string_view condition, std::string_view model,
                                   std::string_view papers_condition) {
  return {condition, model, RowQuantity::rmse,
          paper_figure("001", "Fig. 6", papers_condition, "RMSE")};
}
consteval std::array<PaperEntry, 3> tracking_errors(std::string_view condition,
                                                    std::string_view model,
                                                    std::string_view papers_condition) {
  return {PaperEntry{condition, model, RowQuantity::mad,
                     paper_figure("000", "Fig. 8", papers_condition, "MAD")},
          PaperEntry{condition, model, RowQuantity::std_abs,
                     paper_figure("000", "Fig. 8", papers_condition, "STD")},
          PaperEntry{condition, model, RowQuantity::mad_percent,
                     paper_figure("000", "section 6.1", papers_condition, "mean error ratio")}};
}
consteval PaperEntry tracking_ratio(std::string_view condition, std::string_view papers_condition) {
  return {condition, "dgmm", RowQuantity::mad_to_linear,
          paper_figure("000", "section 6.1", papers_condition, "MAD ratio")};
}
inline constexpr auto kLinear20 = tracking_errors("dfki-120, 20 Nm, chirp", "linear",
                                                  "chirp of 20 Nm on the 120 Nm actuator: linear");
inline constexpr auto kMixture20 = tracking_errors("dfki-120, 20 Nm, chirp", "dgmm",
                                                   "chirp of 20 Nm on the 120 Nm actuator: DGMM");
inline constexpr auto kLinear70 = tracking_errors("dfki-120, 70 Nm, chirp", "linear",
                                                  "chirp of 70 Nm on the 120 Nm actuator: linear");
inline constexpr auto kMixture70 = tracking_errors("dfki-120, 70 Nm, chirp", "dgmm",
                                                   "chirp of 70 Nm on the 120 Nm actuator: DGMM");
/// By actuator, amplitude and reference: the papers do not print whether the output was locked. 13 Nm is ours; paper
/// 001 prints no amplitude (the axis of its Figure 6 ends at 15 Nm).
inline constexpr std::array kPublishedTracking{
    kLinear20[0],
    kLinear20[1],
    kLinear20[2],
    kMixture20[0],
    kMixture20[1],
    kMixture20[2],
    tracking_ratio("dfki-120, 20 Nm, chirp", "chirp of 20 Nm on the 120 Nm actuator"),
    kLinear70[0],
    kLinear70[1],
    kLinear70[2],
    kMixture70[0],
    kMixture70[1],
    kMixture70[2],
    tracking_ratio("dfki-120, 70 Nm, chirp", "chirp of 70 Nm on the 120 Nm actuator"),
    tracking_rmse("dfki-50, 13 Nm, chirp", "linear", "chirp: linear"),
    tracking_rmse("dfki-50, 13 Nm, chirp", "dgmm", "chirp: DGMM"),
    tracking_rmse("dfki-50, 13 Nm, chirp", "mlp", "chirp: NN"),
    tracking_rmse("dfki-50, 13 Nm, random-walk", "linear", "random walk: linear"),
    tracking_rmse("dfki-50, 13 Nm, random-walk", "dgmm", "random walk: DGMM"),
    tracking_rmse("dfki-50, 13 Nm, random-walk", "mlp", "random walk: NN")};

consteval std::size_t count_of(std::string_view paper) {
  std::size_t count = 0;
  for (const PaperFigure& figure : kPaperFigures) count += figure.paper == paper ? 1 : 0;
  return count;
}
/// Free runs of others on the official test record [m]; sources: docs/results/benchmarks.md.
template <std::size_t count>
consteval std::array<PaperEntry, count> published_runs(std::string_view benchmark,
                                                       std::string_view condition) {
  std::array<PaperEntry, count> entries{};
  std::size_t i = 0;
  for (const PaperFigure& figure : kPaperFigures)
    if (figure.paper == benchmark)
      entries[i++] = {condition, figure.condition, RowQuantity::rmse, figure};
  return entries;
}
inline constexpr auto kPublishedBoucWen =
    published_runs<count_of("boucwen")>("boucwen", "boucwen, published");
inline constexpr auto kPublishedEmps = published_runs<count_of("emps")>("emps", "emps, published");
inline constexpr auto kPublishedBenchmarks = [] {
  std::array<PaperEntry, kPublishedBoucWen.size() + kPublishedEmps.size()> all{};
  std::size_t i = 0;
  for (const PaperEntry& entry : kPublishedBoucWen) all[i++] = entry;
  for (const PaperEntry& entry : kPublishedEmps) all[i++] = entry;
  return all;
}();

}  // namespace torsio
