#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/sim/experiment.hpp"
#include "torsio/train/comparison.hpp"

namespace torsio {
namespace {

/// A step of the paper's ladder: settings, and what its row is called.
struct Step {
  const char* family;
  const char* settings;  ///< as `--models` takes them
  const char* variant;   ///< the same as a result has them
  const char* name;
};

// The order of the linear part with which a first-order hold of two poles can be met: two zeros.
constexpr std::array kSteps{
    Step{"linear", "", "", "linear"},
    Step{"arx", "", "", "arx"},
    Step{"hammerstein_wiener", ":published=discrete", "published=discrete", "HW (5) as printed"},
    Step{"hammerstein_wiener", ":published=tustin", "published=tustin",
         "HW (8), its Tustin form, as printed"},
    Step{"hammerstein_wiener", ":published=refined", "published=refined",
         "HW (10), refined, as printed"},
    Step{"hammerstein_wiener", ":structure=given", "structure=given", "HW discrete"},
    Step{"hammerstein_wiener", ":structure=given:continuous=tustin",
         "continuous=tustin,structure=given", "HW discrete, its Tustin form"},
    Step{"hammerstein_wiener", ":structure=given:continuous=refined",
         "continuous=refined,structure=given", "HW refined in continuous time"},
    Step{"hammerstein_wiener", "", "", "HW, structure searched"}};

constexpr std::uint64_t kJudged = 50;  // seeds of recordings to be judged on

Dataset triangles(const std::string& actuator, const StudyOptions& options, std::uint64_t seed,
                  const Progress& progress) {
  Dataset dataset;
  dataset.initialise_samples = 0;  // the bench begins at rest
  const auto record = [&](const ExperimentSpec& spec, Role role) {
    Recording recording = simulate(spec, progress);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, role)});
  };
  record({.actuator = actuator, .experiment = "triangles", .seed = seed}, Role::train);
  std::vector<double> frequencies_Hz{0.5, 1.2, 3.0};
  if (options.is_quick) frequencies_Hz.resize(1);
  for (std::size_t k = 0; k < frequencies_Hz.size(); ++k)
    record({.actuator = actuator,
            .experiment = "triangles",
            .seed = seed + kJudged + k,
            .duration_s = options.is_quick ? 10.0 : 30.0,
            .frequency_Hz = frequencies_Hz[k]},
           Role::test);
  return dataset;
}

}  // namespace

Study hammerstein_wiener_003(const StudyOptions& options, const Progress& progress) {
  Study study{
      .protocol =
          "the coupling's torque from its torsion: trained on triangles of 0.4 to 4 Hz, judged "
          "on triangles of 0.5, 1.2 and 3 Hz, all from rest",
      .unit = "Nm",
      .options = options};
  constexpr std::array kVariants{"bonded", "unbonded"};
  StudyRows rows;
  std::string models;
  for (const Step& step : kSteps) {
    if (options.is_quick && step.name == kSteps.back().name) continue;  // the search takes longest
    rows.call(step.family, step.variant, step.name);
    models += fmt::format("{}{}{}", models.empty() ? "" : ",", step.family, step.settings);
  }
  // The paper's fits of its own bonded coupling (SPEC section 5): identified, and refined.
  rows.paper_fit("bonded", "HW discrete", 77.73);
  rows.paper_fit("bonded", "HW refined in continuous time", 86.13);
  for (std::size_t v = 0; v < kVariants.size(); ++v) {
    const std::string actuator = fmt::format("elastomer:{}", kVariants[v]);
    study.plants.push_back(study_plant(actuator));
    for (std::size_t k = 0; k < options.repeats; ++k) {
      const Progress part = nth_of(progress, v * options.repeats + k,
                                   kVariants.size() * options.repeats, kVariants[v]);
      const std::uint64_t seed = repeat_seed(options, k);
      const Dataset dataset = triangles(actuator, options, seed, part);
      const auto choices = model_choices(dataset, models, {"spring_deflection_rad"});
      rows.add(compare(dataset, choices, seed, false, part).results, dataset, Role::test,
               [&](const std::string&) { return std::string(kVariants[v]); });
    }
  }
  study.rows = rows.rows();
  return study;
}

}  // namespace torsio
