#pragma once

#include <span>
#include <string_view>

#include "studies/study.hpp"

namespace torsio {

/// What `torsio reproduce` can run, in the papers' order. Claims to be tested, not targets
/// (specification 5).
[[nodiscard]] std::span<const StudyInfo> studies() noexcept;
/// @throws UsageError that lists them.
[[nodiscard]] const StudyInfo& find_study(std::string_view name);

// One function a study, in the file of its paper.

Study spring_models_001(const StudyOptions& options, const Progress& progress);
Study inverse_models_001(const StudyOptions& options, const Progress& progress);
Study figures_001(const StudyOptions& options, const Progress& progress);
Study design_002(const StudyOptions& options, const Progress& progress);
Study sensor_models_002(const StudyOptions& options, const Progress& progress);
Study algorithm_002(const StudyOptions& options, const Progress& progress);
Study selection_002(const StudyOptions& options, const Progress& progress);
Study figures_002(const StudyOptions& options, const Progress& progress);
Study drop_002(const StudyOptions& options, const Progress& progress);
Study slow_loops_002(const StudyOptions& options, const Progress& progress);
Study collision_002(const StudyOptions& options, const Progress& progress);
Study coupling_003(const StudyOptions& options, const Progress& progress);
Study figures_003(const StudyOptions& options, const Progress& progress);
Study models_003(const StudyOptions& options, const Progress& progress);
Study arm_000(const StudyOptions& options, const Progress& progress);
Study arm_identification_000(const StudyOptions& options, const Progress& progress);
Study transfer_000(const StudyOptions& options, const Progress& progress);
Study brake_000(const StudyOptions& options, const Progress& progress);
Study figures_000(const StudyOptions& options, const Progress& progress);
Study torque_tracking_000(const StudyOptions& options, const Progress& progress);
Study encoders_004(const StudyOptions& options, const Progress& progress);
Study torque_levels_004(const StudyOptions& options, const Progress& progress);
Study impedances_004(const StudyOptions& options, const Progress& progress);
Study tubes_004(const StudyOptions& options, const Progress& progress);
Study sensitivity_004(const StudyOptions& options, const Progress& progress);
Study arm_external(const StudyOptions& options, const Progress& progress);
Study arm_contacts(const StudyOptions& options, const Progress& progress);
Study arm_collision(const StudyOptions& options, const Progress& progress);
Study identify_servo_study(const StudyOptions& options, const Progress& progress);
Study identify_spring_study(const StudyOptions& options, const Progress& progress);
Study known_load_study(const StudyOptions& options, const Progress& progress);
Study few_data_transfer(const StudyOptions& options, const Progress& progress);
Study model_comparison(const StudyOptions& options, const Progress& progress);
Study error_bars(const StudyOptions& options, const Progress& progress);
Study public_benchmarks(const StudyOptions& options, const Progress& progress);
Study board(const StudyOptions& options, const Progress& progress);

}  // namespace torsio
