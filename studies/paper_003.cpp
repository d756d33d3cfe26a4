#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "figure_curves.hpp"
#include "published.hpp"
#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/evaluate/estimate_recording.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

/// A model of the sequence that the paper goes through, or one of ours beside it.
struct ModelStep {
  std::string_view choice;  ///< as `--models` takes it
  std::string_view name;    ///< model name in its rows
};

constexpr std::array kSequence{
    ModelStep{"linear", "linear"},
    ModelStep{"polynomial", "polynomial"},
    ModelStep{"grey_box", "grey_box"},
    ModelStep{"hammerstein_wiener:published=discrete", "Hammerstein-Wiener as printed"},
    ModelStep{"hammerstein_wiener:published=tustin", "its Tustin form as printed"},
    ModelStep{"hammerstein_wiener:published=refined", "refined, as printed"},
    ModelStep{"hammerstein_wiener:structure=given", "Hammerstein-Wiener"},
    ModelStep{"hammerstein_wiener:structure=given:continuous=tustin", "its Tustin form"},
    ModelStep{"hammerstein_wiener:structure=given:continuous=refined",
              "refined in continuous time"},
    ModelStep{"viscoelastic:network=003a:refine=false", "viscoelastic 003a as printed"},
    ModelStep{"viscoelastic:network=003a", "viscoelastic 003a"},
    ModelStep{"viscoelastic:network=003b", "viscoelastic 003b"},
    ModelStep{"viscoelastic:network=003c", "viscoelastic 003c"},
    ModelStep{"viscoelastic:network=003d", "viscoelastic 003d"},
};

/// A bench run that no model was trained on.
struct TestCase {
  const char* experiment;
  const char* condition;
};
constexpr std::array kScored{TestCase{"triangles", "triangles"},
                             TestCase{"random-walk", "random walk"},
                             TestCase{"slow-cycles", "slow cycles"}};
constexpr std::array kCouplings{"bonded", "unbonded"};
constexpr std::uint64_t kTestSeed = 50;

struct ModelSequence {
  Dataset dataset;
  StudyConditions conditions;

  void add(const std::string& coupling, const char* experiment, const std::string& condition,
           std::uint64_t seed, Role role, bool is_quick) {
    ExperimentSpec spec{
        .actuator = "elastomer:" + coupling, .experiment = experiment, .seed = seed};
    // One slow cycle takes 20 s; five of them are sufficient.
    if (experiment == std::string_view("slow-cycles")) spec.duration_s = is_quick ? 20.0 : 100.0;
    Recording recording = simulate(spec);
    conditions.add(recording.name(), condition);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, role)});
  }
};

ModelSequence sequence_of(const std::string& coupling, std::uint64_t seed, bool is_quick) {
  ModelSequence sequence;
  sequence.dataset.initialise_samples = 0;  // every run starts at rest
  sequence.add(coupling, "triangles", {}, seed, Role::train, is_quick);
  for (std::size_t i = 0; i < kScored.size(); ++i)
    sequence.add(coupling, kScored[i].experiment,
                 fmt::format("{}, {}", coupling, kScored[i].condition), seed + kTestSeed + i,
                 Role::test, is_quick);
  return sequence;
}

/// Figure 10 (b): the errors of both steps of the Hammerstein-Wiener model over the triangles of the test.
XyFigure error_figure(const ModelSequence& sequence, const std::vector<ComparedModel>& models) {
  const Recording& recording = sequence.dataset.records.at(1).recording;
  XyFigure figure = trace_figure("Figure 10: error of the torque", "error [Nm]");
  for (std::size_t i = 0; i < models.size(); ++i) {
    const std::string_view name = kSequence.at(i).name;
    if (name != "Hammerstein-Wiener" && name != "refined in continuous time") continue;
    const EstimatedRecording estimated =
        estimate_recording(make_estimator(models[i].file), recording);
    std::vector<double> error_Nm = estimated.channels.channel(estimate_channel("torque_Nm")).values;
    for (std::size_t n = 0; n < error_Nm.size(); ++n)
      error_Nm[n] -= recording.channel("torque_Nm").values[n];
    add_trace(figure, std::string(name), error_Nm, CurveRole::model,
              {.rate_Hz = recording.sample_rate_Hz(), .step = 1});
  }
  return figure;
}

std::string models() {
  std::string text;
  for (const ModelStep& step : kSequence)
    text += fmt::format("{}{}", text.empty() ? "" : ",", step.choice);
  return text;
}

}  // namespace

Study models_003(const StudyOptions& options, const Progress& progress) {
  Study study{.protocol =
                  "elastomer coupling, torsion alone, all runs from rest: trained on triangles of "
                  "0.4 to 4 Hz, tested on the same with other noise, a random walk and slow cycles "
                  "of 6 Nm",
              .unit = "Nm",
              .options = options};
  StudyRows rows(kPublishedCouplingModels);
  for (std::size_t c = 0; c < kCouplings.size(); ++c) {
    study.plants.push_back(study_plant(std::string("elastomer:") + kCouplings[c]));
    for (std::size_t k = 0; k < options.repeats; ++k) {
      const Progress part = nth_of(progress, c * options.repeats + k,
                                   kCouplings.size() * options.repeats, kCouplings[c]);
      const std::uint64_t seed = repeat_seed(options, k);
      ModelSequence sequence = sequence_of(kCouplings[c], seed, options.is_quick);
      const auto choices = model_choices(sequence.dataset, models(), {"spring_deflection_rad"});
      const Comparison compared = compare(sequence.dataset, choices, seed, false, part);
      if (c == 0 && k == 0) study.figures.emplace_back(error_figure(sequence, compared.models));
      rows.add(
          compared.results, sequence.dataset, Role::test,
          [&](const std::string& recording) { return sequence.conditions.of(recording); },
          [&](const ResultRow& row) {
            const auto choice = std::ranges::find_if(choices, [&](const ModelChoice& each) {
              return each.family == row.family && each.variant() == row.variant;
            });
            return std::string(kSequence[static_cast<std::size_t>(choice - choices.begin())].name);
          });
    }
  }
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

}  // namespace torsio
