#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/running_mean.hpp"
#include "drive_stages.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/comparison.hpp"

// What paper 004 leaves open, and whether one of its possible values brings out the orders of its Tables 4 and 6.

namespace torsio {
namespace {

constexpr std::array kBits{12.0, 13.0, 14.0, 17.0};
// Half of the log rate, 50 Hz, is not a cut-off; 49 Hz filters hardly anything.
constexpr std::array kFilters_Hz{2.0, 10.0, 49.0};
constexpr std::array kFriction{1.0, 2.0};
constexpr std::size_t kCells = 64;  // the paper has 250, which takes six times as long

/// The drive with another joint encoder and more dry friction in its gear.
DataSheet drive_with(const std::string& actuator, double bits, double friction) {
  DataSheet sheet = data_sheet(actuator);
  sheet.sensors.joint_encoder_bits.value = bits;
  sheet.friction.coulomb_Nm.value *= friction;
  return sheet;
}

/// RMSE of the network [Nm] with each set, trained on pushes of 10 to 20 Nm, on one of 20 Nm.
std::vector<double> errors_of(const DataSheet& sheet, const std::vector<InputSet>& sets,
                              const StudyOptions& options, std::uint64_t seed,
                              const Progress& progress) {
  Dataset dataset =
      recorded_pushes(sheet, collected_pushes(false), Role::train, options, seed, progress);
  const Push tested{.torque_Nm = 20.0, .seed_offset = kFirstTestSeed};
  dataset.records.push_back(
      recorded_pushes(sheet, {tested}, Role::test, options, seed, progress).records.front());
  dataset.input_sets = sets;
  const std::string network = papers_network(options.is_quick ? 8 : kCells);
  const Results results =
      compare(dataset, model_choices(dataset, network, {}), seed, false, progress).results;
  std::vector<double> errors_Nm;
  for (const ResultRow& row : results.rows)
    if (row.split == Role::test && !row.recording) errors_Nm.push_back(row.score.metrics.rmse);
  return errors_Nm;
}

/// The errors under one combination, over the repeats.
struct Combination {
  double bits = 0.0;
  double filter_Hz = 0.0;
  double friction = 0.0;
  RunningMean set_1 = {};
  RunningMean set_2 = {};
  RunningMean set_3 = {};
  RunningMean rigid = {};

  [[nodiscard]] bool has_papers_order() const {
    return set_2.mean() < set_1.mean() && set_1.mean() < set_3.mean();
  }
  /// In Table 6 the rigid tube has 1.9 times the error of the stiff one.
  [[nodiscard]] double rigid_ratio() const { return rigid.mean() / set_2.mean(); }
  [[nodiscard]] std::string name() const {
    return fmt::format("{:g} bit, {:g} Hz, friction {:g}", bits, filter_Hz, friction);
  }
};

std::vector<Combination> combinations(bool is_quick) {
  std::vector<Combination> all;
  for (const double friction : kFriction)
    for (const double bits : kBits)
      for (const double filter_Hz : kFilters_Hz) {
        if (is_quick && (friction != 1.0 || bits < 13.0 || bits == 14.0 || filter_Hz != 10.0))
          continue;
        all.push_back({.bits = bits, .filter_Hz = filter_Hz, .friction = friction});
      }
  return all;
}

/// All combinations with one drive; the filters need no recordings of their own.
void add_errors(std::vector<Combination>& all, double bits, double friction,
                const StudyOptions& options, std::uint64_t seed, const Progress& progress) {
  std::vector<Combination*> own;
  std::vector<InputSet> stiff_sets{drive_inputs("II")};
  std::vector<InputSet> rigid_sets;
  for (Combination& of : all) {
    if (of.bits != bits || of.friction != friction) continue;
    own.push_back(&of);
    const DriveFilters filters{.acceleration_Hz = of.filter_Hz, .gear_twist_Hz = of.filter_Hz};
    for (const char* const set : {"I", "III"}) {
      InputSet inputs = drive_inputs(set, filters);
      inputs.first = fmt::format("{} {:g} Hz", set, of.filter_Hz);
      if (set == std::string_view("III")) rigid_sets.push_back(inputs);
      stiff_sets.push_back(std::move(inputs));
    }
  }
  if (own.empty()) return;
  const std::vector<double> stiff = errors_of(drive_with("harmonic-drive:stiff", bits, friction),
                                              stiff_sets, options, seed, progress);
  const std::vector<double> rigid = errors_of(drive_with("harmonic-drive:rigid", bits, friction),
                                              rigid_sets, options, seed, progress);
  for (std::size_t i = 0; i < own.size(); ++i) {
    own[i]->set_2.add(stiff.at(0));
    own[i]->set_1.add(stiff.at(1 + 2 * i));
    own[i]->set_3.add(stiff.at(2 + 2 * i));
    own[i]->rigid.add(rigid.at(i));
  }
}

/// "3 of 24: ...".
template <class Holds>
std::string those_where(const std::vector<Combination>& all, const Holds& holds) {
  std::size_t count = 0;
  std::string names;
  for (const Combination& of : all) {
    if (!holds(of)) continue;
    ++count;
    names += fmt::format("{}{}", names.empty() ? "" : "; ", of.name());
  }
  return fmt::format("{} of {} combinations{}{}", count, all.size(), names.empty() ? "" : ": ",
                     names);
}

}  // namespace

Study sensitivity_004(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol = fmt::format("stiff tube and rigid tube, high impedance: an LSTM of {} "
                                      "cells (the paper: 250), trained offline on "
                                      "pushes of 10 to 20 Nm, tested on 20 Nm, with another "
                                      "resolution of the joint's encoder, another "
                                      "filter of what comes from it (twist of tube and gear, "
                                      "acceleration), and the dry friction of the "
                                      "gear times a factor. None of them is printed",
                                      options.is_quick ? 8 : kCells),
              .unit = "Nm",
              .options = options,
              .plants = {study_plant("harmonic-drive:stiff"), study_plant("harmonic-drive:rigid")}};
  std::vector<Combination> all = combinations(options.is_quick);
  const std::size_t runs = options.repeats * kBits.size() * kFriction.size();
  std::size_t run = 0;
  for (std::size_t k = 0; k < options.repeats; ++k)
    for (const double friction : kFriction)
      for (const double bits : kBits)
        add_errors(all, bits, friction, options, repeat_seed(options, k),
                   nth_of(progress, run++, runs, fmt::format("{:g} bit", bits)));
  QuantityTable table;
  for (const Combination& of : all) {
    const auto row = [&](const char* quantity, double value, const char* unit,
                         std::string remark = {}) {
      table.rows.push_back({.condition = of.name(),
                            .quantity = quantity,
                            .value = value,
                            .unit = unit,
                            .remark = std::move(remark)});
    };
    row("RMSE, set I", of.set_1.mean(), "Nm");
    row("RMSE, set II", of.set_2.mean(), "Nm");
    row("RMSE, set III", of.set_3.mean(), "Nm",
        of.has_papers_order() ? "II < I < III, as in Table 4" : "");
    row("rigid tube (III) over stiff tube (II)", of.rigid_ratio(), "-", "1.90 in Table 6");
  }
  study.table = std::move(table);
  study.notes.push_back("II < I < III in " + those_where(all, [](const Combination& of) {
                          return of.has_papers_order();
                        }));
  study.notes.push_back(
      "rigid tube at least 1.5 times as bad as the stiff one in " +
      those_where(all, [](const Combination& of) { return of.rigid_ratio() >= 1.5; }));
  return study;
}

}  // namespace torsio
