#include "studies/studies.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "core/did_you_mean.hpp"
#include "published.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::array kStudies{
    StudyInfo{"001-models", "001, Figure 4", "Errors of spring models on a new sweep",
              spring_models_001, 0.6},
    StudyInfo{"001-inverse", "001, section 4.2",
              "Errors of the inverse models, from torque to deflection", inverse_models_001, 0.6},
    StudyInfo{"001-figures",
              "001, Figures 2, 4 and 6",
              "Loops, models and traces of the 50 Nm actuator",
              figures_001,
              0.2,
              {},
              false,
              true},
    StudyInfo{"002-design", "002, section II, Table I",
              "The ring of rubber and the clutch of a torque sensor, sized again", design_002, 0.1},
    StudyInfo{"002-table3", "002, Table III", "Errors of models of a rubber torque sensor",
              sensor_models_002, 2.5, kPublishedSensorModels, false, true},
    StudyInfo{"002-algorithm", "002, Algorithm 1",
              "Algorithm 1 as printed, its misprints and each departure from it", algorithm_002,
              3.5},
    StudyInfo{"002-selection", "002, section III-C",
              "The choice of M, n_y and n_u on samples of the training data", selection_002, 2.3},
    StudyInfo{"002-figures",
              "002, Figures 3, 7 and 8",
              "States, loops and slow turns of the clutched sensor",
              figures_002,
              0.1,
              {},
              false,
              true},
    StudyInfo{"002-drop", "002, section IV-B, Figure 10",
              "A mass falls on the sensor with a fixed input, with and without the clutch",
              drop_002, 0.1},
    StudyInfo{"002-slow", "002, Figure 8", "Slow loops, until its clutch slips and after it",
              slow_loops_002, 0.7},
    StudyInfo{"002-collision", "002, Figure 10", "The same in a fast slip and a collision",
              collision_002, 0.8},
    StudyInfo{"003-coupling",
              "003, section 3, Table 2",
              "Seven geometries of an elastomer coupling by finite elements",
              coupling_003,
              2.3,
              {},
              true,
              true},
    StudyInfo{"003-figures",
              "003, Figure 7, Table 3",
              "Slow cycles of a coupling with and without glue, and fitted coefficients",
              figures_003,
              0.1,
              {},
              false,
              true},
    StudyInfo{"003-models", "003, sections 4.2.1 and 4.3, Table 3",
              "What models of an elastomer coupling explain of its torque", models_003, 0.2,
              kPublishedCouplingModels, false, true},
    StudyInfo{"000-tracking", "000, Figure 8; 001, Figure 6",
              "How well a torque loop follows through a learned inverse of the spring",
              torque_tracking_000, 6.0, kPublishedTracking},
    StudyInfo{"000-figures",
              "000, Figures 8 and 9, section 4",
              "Traces and loops of the four actuators",
              figures_000,
              0.4,
              {},
              false,
              true},
    StudyInfo{"000-brake", "000, section 3.1",
              "How far a person moves a braked link, and how a joint stops", brake_000, 0.1},
    StudyInfo{"000-arm",
              "000, Table 3, Figures 13 and 15",
              "The torque of an arm's joints from motor current, gear and spring",
              arm_000,
              0.4,
              {},
              false,
              true},
    StudyInfo{"000-arm-identification", "000, section 6.4; ours",
              "Payload, links and springs of an arm from its motion", arm_identification_000, 2.0},
    StudyInfo{"000-transfer",
              "000, Figures 10 to 12",
              "A model of one actuator on others",
              transfer_000,
              0.6,
              {},
              false,
              true},
    StudyInfo{"004-encoders", "004, Table 4, Figures 7, 9, 10",
              "Which encoders an LSTM needs to estimate the torque", encoders_004, 8.0,
              kPublishedEncoders, false, true},
    StudyInfo{"004-torque", "004, Table 5, Figure 11",
              "Trained on 10 to 20 Nm, tested on 5 to 50 Nm", torque_levels_004, 1.7,
              kPublishedTorqueLevels, false, true},
    StudyInfo{"004-impedance", "004, section 5.2, Figure 12",
              "Trained under one impedance of the joint, tested under another", impedances_004, 7.0,
              kPublishedImpedances, false, true},
    StudyInfo{"004-tubes", "004, Table 6, Figures 14 and 15", "How soft the torsion tube should be",
              tubes_004, 5.0, kPublishedTubes, false, true},
    StudyInfo{"004-sensitivity",
              "004, Tables 4 and 6",
              "What the paper leaves open, and what it changes in the orders of its tables",
              sensitivity_004,
              12.0,
              {},
              true},
    StudyInfo{"few-data", "ours",
              "A base model on a new joint after 10 s, in one size and across sizes",
              few_data_transfer, 2.0},
    StudyInfo{"known-load", "ours", "A spring learned from a known load instead of a torque sensor",
              known_load_study, 2.0},
    StudyInfo{"arm-external", "ours",
              "The error of an arm's external torque with learned springs and straight lines",
              arm_external, 7.0},
    StudyInfo{"arm-contacts", "ours", "Pushes of 30 N on an arm in motion, and false alarms",
              arm_contacts, 29.0},
    StudyInfo{"arm-collision", "ours",
              "An arm's collision with a plate: forces, reactions, stiff springs", arm_collision,
              4.0},
    StudyInfo{"model-comparison",
              "all",
              "Every family on every simulated actuator and on the real recordings",
              model_comparison,
              25.0,
              {},
              true},
    StudyInfo{"public-benchmarks", "official records",
              "Bouc-Wen and EMPS: our free runs beside published ones", public_benchmarks, 5.0,
              kPublishedBenchmarks, true}};

}  // namespace

std::span<const StudyInfo> studies() noexcept { return kStudies; }

const StudyInfo& find_study(std::string_view name) {
  const auto* const found = std::ranges::find(kStudies, name, &StudyInfo::name);
  if (found != kStudies.end()) return *found;
  std::array<std::string_view, kStudies.size()> names{};
  std::ranges::transform(kStudies, names.begin(), &StudyInfo::name);
  throw UsageError({.problem = fmt::format("no study is called \"{}\"", name),
                    .expected = fmt::format("one of {}", fmt::join(names, ", ")),
                    .advice = did_you_mean(name, names)});
}

}  // namespace torsio
