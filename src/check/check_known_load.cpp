// A target that is the torque of a known load.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "check/checker.hpp"

namespace torsio {
namespace {

constexpr const char* kKnownLoad = "known load";
constexpr double kOverError = 3.0;      ///< the torque must change by so many of its errors
constexpr double kSameSize = 0.02;      ///< share by which loads must differ to be two
constexpr double kErrorOfFacts = 0.03;  ///< share of the torque's standard deviation

/// Standard deviation of the target in the training recordings.
double spread_of_target(const Dataset& dataset) {
  double sum = 0.0;
  double squares = 0.0;
  double count = 0.0;
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(Role::train)) continue;
    for (const double value : record.recording.channel(dataset.target).values)
      if (std::isfinite(value)) {
        sum += value;
        squares += value * value;
        count += 1.0;
      }
  }
  const double mean = sum / std::max(count, 1.0);
  return std::sqrt(std::max(0.0, squares / std::max(count, 1.0) - mean * mean));
}

bool are_one_load(const LoadTarget& target) {
  const auto differs = [&](double LoadTarget::OfRecording::*member) {
    const auto [least, most] =
        std::ranges::minmax(target.loads, {}, [member](const auto& load) { return load.*member; });
    return most.*member - least.*member > kSameSize * most.*member;
  };
  return target.loads.empty() || (!differs(&LoadTarget::OfRecording::gravity_Nm) &&
                                  !differs(&LoadTarget::OfRecording::inertia_kg_m2));
}

std::string load_summary(const LoadTarget& target) {
  const auto [least, most] =
      std::ranges::minmax(target.loads, {}, &LoadTarget::OfRecording::gravity_Nm);
  return fmt::format(
      "gravity of {:.3g} to {:.3g} Nm; error of the torque {:.2g} Nm from the motion, {:.2g} Nm "
      "from "
      "the facts of the load",
      least.gravity_Nm, most.gravity_Nm, target.motion_error_Nm, target.load_error_Nm);
}

}  // namespace

void Checker::check_known_load() {
  const LoadTarget& target = dataset_.load_target;
  if (!target.is_used() || target.loads.empty()) return;
  pass_unless_found(kKnownLoad, load_summary(target), [&] {
    const double spread_Nm = spread_of_target(dataset_);
    if (!(spread_Nm > kOverError * target.motion_error_Nm))
      add(Verdict::fail, kKnownLoad, "",
          fmt::format(
              "its torque changes by {:.3g} Nm (standard deviation), and is known to {:.2g} Nm",
              spread_Nm, target.motion_error_Nm),
          "Move a larger mass, on a longer lever or through a larger angle.");
    if (target.facts.empty())
      add(Verdict::warn, kKnownLoad, "", "no load_uncertainty: its facts are taken as exact",
          "State the standard error of each fact in " + target.file + ".");
    else if (target.load_error_Nm > kErrorOfFacts * spread_Nm) {
      const auto largest = std::ranges::max(target.facts, {}, &LoadTarget::OfFact::error_Nm);
      add(Verdict::warn, kKnownLoad, "",
          fmt::format(
              "the errors of its facts are {:.2g} Nm of {:.3g} Nm (standard deviation of the "
              "torque); most is that of {}",
              target.load_error_Nm, spread_Nm, largest.fact),
          "Measure " + largest.fact + " more accurately.");
    }
    if (are_one_load(target))
      add(Verdict::warn, kKnownLoad, "",
          "all training recordings have one load: whether its inertia and zero are right does not "
          "show",
          "Record another lever or mass as well.");
  });
}

}  // namespace torsio
