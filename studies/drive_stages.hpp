#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "study_rows.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"

// Paper 004: the five stages of its Figure 7, with which its sections 4 and 5 train and validate a network.

namespace torsio {

/// The filters of the features that come from the joint's encoder; the paper prints none.
struct DriveFilters {
  double acceleration_Hz = 3.0;
  double gear_twist_Hz = 10.0;
};

using InputSet = std::pair<std::string, std::vector<std::string>>;
/// The inputs of Table 3 ("I", "II", "III"), and II with the speed of the wave generator ("II+", section 5.2).
[[nodiscard]] InputSet drive_inputs(std::string_view set, const DriveFilters& filters = {});

/// A hand that pushes the output to and fro against the impedance controller.
struct Push {
  double torque_Nm = 20.0;
  bool is_impedance_zero = false;
  std::string condition = {};     ///< what a row of the table is called by
  std::uint64_t seed_offset = 0;  ///< the same recording in every comparison of a repeat
};

/// Pushes of 10 to 20 Nm, five torques at equal distances.
[[nodiscard]] std::vector<Push> collected_pushes(bool is_impedance_zero);
/// One push of 15 Nm, which no other stage has.
[[nodiscard]] Push online_push(bool is_impedance_zero);

/// The recordings of some pushes; the names of a dataset differ. 150 s each, assumed: the paper prints no duration.
[[nodiscard]] Dataset recorded_pushes(const DataSheet& sheet, const std::vector<Push>& pushes,
                                      Role role, const StudyOptions& options, std::uint64_t seed,
                                      const Progress& progress);

/// How `--models` asks for the network of Table 2; stride, burn-in, optimiser, rate and clipping are assumed.
[[nodiscard]] std::string papers_network(std::size_t cells);

/// What is recorded in each stage, and which models are trained on it.
struct DriveStages {
  DataSheet sheet;
  std::string name = {};             ///< for the notes; empty: the study has one training only
  std::vector<Push> collected = {};  ///< stage 1: training and folds
  std::vector<Push> online = {};     ///< stage 4
  std::vector<Push> validated = {};  ///< stage 5
  std::vector<InputSet> sets = {};   ///< the first one is that of the models with a rate
  std::string figure = {};           ///< title of the traces; empty: none
  bool has_folds = false;            ///< stage 3 with five folds
  bool runs_without_guards = false;  ///< stage 5 also with the network alone, beyond its range
};

/// Runs the stages in order and adds their rows: the folds, and each model on the pushes of the last stage. The paper's
/// networks also have a row after the online training ("lstm 250, II, online"). Baselines: linear, a static network, a
/// GRU, and models with one more input than II, linear with friction (rate of the twist) and `grey_box` (speed of the
/// wave generator).
/// @param is_first whether this is the repeat that has stage 2, the folds and the figures
void run_stages(Study& study, StudyRows& rows, const DriveStages& stages, std::uint64_t seed,
                bool is_first, const Progress& progress);

}  // namespace torsio
