#include "torsio/fit/common/load_target.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <variant>

#include "joint_load/fit_load_facts.hpp"
#include "joint_load/load_motion.hpp"
#include "numerics/parallel.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/inputs.hpp"

namespace torsio {
namespace {

constexpr const char* kInertiaFact = "joint_inertia";
constexpr const char* kZeroFact = "zero";

/// "torque_Nm" -> "torque_load_error_Nm". @throws UsageError for what is not a torque.
std::string error_channel_of(const std::string& target) {
  const auto name = split_channel_name(target);
  if (!name || name->unit->si_suffix != "Nm")
    throw UsageError({.place = "target",
                      .expected = "a torque, whose name ends in _Nm, for a known load",
                      .found = "'" + target + "'"});
  return std::string(name->quantity) + "_load_error_Nm";
}

void refuse_measured(const Dataset& dataset) {
  for (const DatasetRecord& record : dataset.records)
    if (record.recording.has(dataset.target))
      throw UsageError(
          {.place = record.recording.name() + ": " + dataset.target,
           .problem = "the recording has this channel, and the torque of the known load would "
                      "replace it",
           .advice = "Give the computed torque another name, such as --target load_torque_Nm."});
}

/// One recording on the way to its target.
struct Loaded {
  Recording* recording = nullptr;
  bool trains = false;
  KnownLoad known = {};
  std::vector<double> angle_rad = {};
  LoadMotion motion = {};
  AccelerationError acceleration = {};
};

std::vector<Loaded> loaded_recordings(Dataset& dataset, const LoadSheet& sheet) {
  const bool has_training = dataset.has_role(Role::train);
  std::vector<Loaded> all;
  for (DatasetRecord& record : dataset.records)
    all.push_back({.recording = &record.recording,
                   .trains = !has_training || record.has_role(Role::train),
                   .known = known_load(sheet, record.recording),
                   .angle_rad = load_angle(record.recording)});
  return all;
}

/// @returns the half-width in samples
std::size_t add_motions(std::vector<Loaded>& all, double sample_rate_Hz) {
  std::vector<WeightedAngle> angles;
  for (const Loaded& of : all)
    if (of.trains) angles.push_back({of.angle_rad, std::max(of.known.load.inertia_kg_m2, 1e-12)});
  const std::size_t half_width = choose_half_width(angles, sample_rate_Hz);
  for_each_chunk(all.size(), 0, [&](std::size_t a) {
    all[a].motion = load_motion(all[a].angle_rad, half_width, sample_rate_Hz);
    all[a].acceleration = acceleration_error(all[a].angle_rad, half_width, sample_rate_Hz);
  });
  return half_width;
}

std::vector<LoadedMotion> motions_for_fit(const std::vector<Loaded>& all, std::size_t half_width,
                                          const FeatureSpec& features) {
  std::vector<LoadedMotion> motions;
  for (const Loaded& of : all) {
    if (!of.trains) continue;
    motions.push_back({.recording = of.recording->name(),
                       .load = of.known.load,
                       .motion = of.motion,
                       .deflection = first_feature(*of.recording, features),
                       .half_width = half_width});
  }
  return motions;
}

/// The facts that the sheet fits, from the model's card where it has all of them.
std::vector<LoadTarget::Fitted> fitted_facts(const std::vector<Loaded>& all, const LoadSheet& sheet,
                                             std::size_t half_width, const FeatureSpec& features,
                                             const LoadTarget& before) {
  std::vector<LoadTarget::Fitted> fitted;
  std::vector<std::string> wanted;
  if (sheet.fits_joint_inertia) wanted.emplace_back(kInertiaFact);
  if (sheet.fits_zero) wanted.emplace_back(kZeroFact);
  for (const std::string& fact : wanted)
    std::ranges::copy_if(before.fitted, std::back_inserter(fitted),
                         [&](const LoadTarget::Fitted& known) { return known.fact == fact; });
  if (fitted.size() == wanted.size()) return fitted;
  const FittedFacts facts = fit_load_facts(motions_for_fit(all, half_width, features), sheet);
  fitted.clear();
  if (sheet.fits_joint_inertia)
    fitted.push_back(
        {kInertiaFact, facts.joint_inertia_kg_m2.value, facts.joint_inertia_kg_m2.standard_error});
  if (sheet.fits_zero)
    fitted.push_back({kZeroFact, facts.zero_rad.value, facts.zero_rad.standard_error});
  return fitted;
}

void apply(const std::vector<LoadTarget::Fitted>& fitted, const LoadSheet& sheet,
           std::vector<Loaded>& all) {
  for (Loaded& of : all) {
    for (const LoadTarget::Fitted& fact : fitted) {
      const bool is_zero = fact.fact == kZeroFact;
      (is_zero ? of.known.load.zero_rad : of.known.load.inertia_kg_m2) += fact.value;
      JointLoad change;
      (is_zero ? change.zero_rad : change.inertia_kg_m2) = fact.standard_error;
      of.known.errors.push_back({fact.fact, change});
    }
    if (!(of.known.load.inertia_kg_m2 > 0.0))
      throw Error({.place = of.recording->name(),
                   .expected = "a load with an inertia",
                   .found = fmt::format("{:.4g} kg m2 with the joint_inertia that was fitted",
                                        of.known.load.inertia_kg_m2),
                   .advice = "State joint_inertia in " + sheet.file + "."});
  }
}

/// What the facts' errors change in the torque at one sample.
double torque_change(const JointLoad& load, const JointLoad& change, double angle_rad,
                     double acceleration_rad_s2) {
  const double at_rad = angle_rad + load.zero_rad;
  return change.gravity_Nm * std::sin(at_rad) +
         load.gravity_Nm * std::cos(at_rad) * change.zero_rad +
         change.inertia_kg_m2 * acceleration_rad_s2;
}

/// Sums of squares over the samples, for the RMS of each fact.
struct FactSums {
  std::vector<std::pair<std::string, double>> squares;  ///< in the order of the facts
  double samples = 0.0;

  void add(const std::string& fact, double square) {
    const auto known = std::ranges::find(squares, fact, &std::pair<std::string, double>::first);
    if (known == squares.end())
      squares.emplace_back(fact, square);
    else
      known->second += square;
  }
};

double motion_error_of(const Loaded& of) {
  return of.known.load.inertia_kg_m2 * std::sqrt(of.acceleration.square());
}

/// Adds target and error to the recording.
void add_channels(Loaded& of, const std::string& target, const std::string& error, FactSums& sums) {
  const JointLoad& load = of.known.load;
  const std::size_t samples = of.motion.angle_rad.size();
  std::vector<double> torque_Nm(samples, kNotMeasured);
  std::vector<double> variance(samples, kNotMeasured);
  const double motion_error_Nm = motion_error_of(of);
  for (std::size_t n = 0; n < samples; ++n) {
    const double acceleration_rad_s2 = of.motion.acceleration_rad_s2[n];
    if (!std::isfinite(acceleration_rad_s2)) continue;
    torque_Nm[n] = load.gravity_Nm * std::sin(of.motion.angle_rad[n] + load.zero_rad) +
                   load.inertia_kg_m2 * acceleration_rad_s2;
    variance[n] = motion_error_Nm * motion_error_Nm;
    if (of.trains) sums.samples += 1.0;
    for (const LoadError& fact : of.known.errors) {
      const double change =
          torque_change(load, fact.change, of.motion.angle_rad[n], acceleration_rad_s2);
      variance[n] += change * change;
      if (of.trains) sums.add(fact.fact, change * change);
    }
  }
  for (double& value : variance) value = std::sqrt(value);
  of.recording->add({target, std::move(torque_Nm)});
  of.recording->add({error, std::move(variance)});
}

std::vector<std::string> sources_of(const LoadSheet& sheet) {
  std::vector<std::string> sources = {kLoadAngle};
  const auto add = [&](const LoadFact& fact) {
    if (!fact.condition.empty()) sources.push_back(fact.condition);
  };
  if (const auto* const pendulum = std::get_if<PendulumFacts>(&sheet.facts))
    for (const LoadFact* const fact : {&pendulum->mass_kg, &pendulum->length_m,
                                       &pendulum->arm_mass_kg, &pendulum->inclination_rad})
      add(*fact);
  else
    add(std::get<UrdfFacts>(sheet.facts).payload_mass_kg);
  add(sheet.joint_inertia_kg_m2);
  add(sheet.zero_rad);
  return sources;
}

void state_errors(const std::vector<Loaded>& all, const FactSums& sums, LoadTarget& target) {
  double square = 0.0;
  double samples = 0.0;
  for (const Loaded& of : all) {
    if (!of.trains) continue;
    const double error_Nm = motion_error_of(of);
    const JointLoad& load = of.known.load;
    target.loads.push_back(
        {of.recording->name(), load.gravity_Nm, load.inertia_kg_m2, load.zero_rad, error_Nm});
    const auto size = static_cast<double>(of.angle_rad.size());
    square += size * error_Nm * error_Nm;
    samples += size;
  }
  target.motion_error_Nm = std::sqrt(square / std::max(samples, 1.0));
  double facts = 0.0;
  for (const auto& [fact, squares] : sums.squares) {
    target.facts.push_back({fact, std::sqrt(squares / std::max(sums.samples, 1.0))});
    facts += squares;
  }
  target.load_error_Nm = std::sqrt(facts / std::max(sums.samples, 1.0));
}

}  // namespace

void add_load_target(Dataset& dataset, const LoadSheet& sheet, const FeatureSpec& features,
                     const LoadTarget& before) {
  const std::string error = error_channel_of(dataset.target);
  refuse_measured(dataset);
  const double rate_Hz = dataset.sample_rate_Hz();
  std::vector<Loaded> all = loaded_recordings(dataset, sheet);
  const std::size_t half_width = add_motions(all, rate_Hz);
  LoadTarget target{.file = sheet.file,
                    .computed_from = sources_of(sheet),
                    .half_width_s = static_cast<double>(half_width) / rate_Hz};
  target.fitted = fitted_facts(all, sheet, half_width, features, before);
  apply(target.fitted, sheet, all);
  FactSums sums;
  for (Loaded& of : all) add_channels(of, dataset.target, error, sums);
  state_errors(all, sums, target);
  dataset.load_target = std::move(target);
  dataset.target_error = error;
  dataset.check();
}

std::vector<std::string> load_target_notes(const LoadTarget& target) {
  std::vector<std::string> notes;
  notes.push_back(fmt::format(
      "the target is the torque of the load in {}, computed from {} with the acceleration over "
      "+-{:.3g} ms; its error: {:.2g} Nm from the motion, {:.2g} Nm from the facts of the load",
      target.file, fmt::join(target.computed_from, ", "), 1e3 * target.half_width_s,
      target.motion_error_Nm, target.load_error_Nm));
  for (const LoadTarget::Fitted& fact : target.fitted)
    notes.push_back(fact.fact == kZeroFact
                        ? fmt::format("fitted: zero = {:.3g} +- {:.2g} deg",
                                      deg_from_rad(fact.value), deg_from_rad(fact.standard_error))
                        : fmt::format("fitted: {} = {:.4g} +- {:.2g} kg m2", fact.fact, fact.value,
                                      fact.standard_error));
  if (target.facts.empty())
    notes.emplace_back(
        "warning: the load file states no load_uncertainty, so that the error bars take its facts "
        "as exact");
  return notes;
}

}  // namespace torsio
