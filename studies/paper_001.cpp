#include <array>
#include <cstddef>
#include <string>

#include "studies.hpp"
#include "study_rows.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

constexpr const char* kModels =
    "linear,linear_coulomb,polynomial,dgmm,mlp:layers=50-20-10,mlp:layers=50-10-5";
constexpr std::array kVariants{"maxwell-slip", "bouc-wen", "lugre"};

Study sweep_study(Study study, bool is_inverse, const Progress& progress) {
  const StudyOptions& options = study.options;
  StudyRows rows;
  const std::size_t variants = options.is_quick ? 1 : kVariants.size();
  for (std::size_t v = 0; v < variants; ++v) {
    const std::string actuator = std::string("dfki-50:") + kVariants[v];
    study.plants.push_back(study_plant(actuator));
    for (std::size_t k = 0; k < options.repeats; ++k) {
      const Progress part =
          nth_of(progress, v * options.repeats + k, variants * options.repeats, actuator);
      const std::uint64_t seed = repeat_seed(options, k);
      Dataset dataset = sweep_dataset(actuator, seed, part);
      if (is_inverse) swap_input_and_target(dataset);
      const Results results =
          compare(dataset, model_choices(dataset, kModels, {}), seed, false, part).results;
      rows.add(results, dataset, Role::test, [&](const std::string&) { return kVariants[v]; });
    }
  }
  study.table = ErrorTable{.rows = rows.errors()};
  return study;
}

}  // namespace

Study spring_models_001(const StudyOptions& options, const Progress& progress) {
  return sweep_study(
      {.protocol = "dfki-50, three kinds of inner friction: trained on sweeps of +-170 "
                   "deg at 10 deg/s with three levers, tested on a fourth lever in a "
                   "plane inclined by 37.8 deg",
       .unit = "Nm",
       .options = options},
      false, progress);
}

Study inverse_models_001(const StudyOptions& options, const Progress& progress) {
  return sweep_study(
      {.protocol = "the same sweeps; the deflection from the torque, the deflection's "
                   "measured rate and "
                   "the joint's speed",
       .unit = "rad",
       .options = options},
      true, progress);
}

}  // namespace torsio
