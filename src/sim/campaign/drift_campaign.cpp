#include "sim/campaign/drift_campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "actuator/stage_wear.hpp"
#include "core/fnv_hash.hpp"
#include "files/unit_file.hpp"
#include "numerics/event_bounds.hpp"
#include "numerics/parallel.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kVersion = 2;  // version of the results of units
constexpr std::size_t kMaxSpecimens = 100'000;
constexpr double kTemperatureSpread_K = 10.0;
constexpr double kZeroSpread = 0.01;  // over the range of the load cell
constexpr double kGainSpread = 0.005;
constexpr double kBendingSpread = 0.001;  // over the range of the load cell
constexpr double kLargestTilt_rad = rad_from_deg(2.0);
constexpr double kSmallestStiffness = 0.03;
constexpr double kLargestStiffness = 0.15;
constexpr double kSmallestFriction = 0.10;
constexpr double kLargestFriction = 0.50;
constexpr const char* kStiffness = "stiffness";
constexpr const char* kFriction = "friction";

/// The recordings of the calibration, and those afterwards, which differ in their motion.
std::vector<ExperimentSpec> calibration_motions(const DataSheet& sheet) {
  const auto of = [](const char* experiment) { return ExperimentSpec{.experiment = experiment}; };
  if (sheet.family == ActuatorFamily::elastomer)
    return {of("random-walk"), of("chirp"), of("triangles")};
  std::vector<ExperimentSpec> motions;
  for (const double lever_m : sweep_protocol(sheet).train_lever_m) {
    motions.push_back(of("sweep"));
    motions.back().lever_m = lever_m;
  }
  motions.push_back(of("chirp"));
  motions.push_back(of("random-walk"));
  return motions;
}

std::vector<ExperimentSpec> later_motions(const DataSheet& sheet, Random& random) {
  std::vector<ExperimentSpec> motions;
  if (sheet.family == ActuatorFamily::elastomer) {
    motions.push_back({.experiment = "random-walk"});
    motions.push_back({.experiment = "multisine"});
    return motions;
  }
  const SweepProtocol protocol = sweep_protocol(sheet);
  motions.push_back(
      {.experiment = "sweep",
       .lever_m = random.uniform(protocol.train_lever_m[1], protocol.train_lever_m[2]),
       .inclination_rad = random.uniform(0.0, 0.5)});
  motions.push_back({.experiment = "random-walk"});
  return motions;
}

Dataset recorded(const DataSheet& sheet, std::vector<ExperimentSpec> motions, double temperature_K,
                 Role role, Random& random) {
  Dataset dataset;
  for (ExperimentSpec& spec : motions) {
    spec.seed = random.bits();
    spec.conditions.temperature_K = temperature_K;
    Recording recording = simulate(sheet, spec);
    const std::size_t samples = recording.size();
    dataset.records.push_back({std::move(recording), whole_record(samples, role)});
  }
  return dataset;
}

/// The load cell after it was taken off and mounted again.
struct Mounting {
  double zero_Nm = 0.0;
  double gain = 1.0;
  double bending_Nm = 0.0;

  Mounting(const DataSheet& sheet, Random& random) {
    const double range_Nm = sheet.sensors.torque_range_Nm.value;
    zero_Nm = range_Nm * random.uniform(-kZeroSpread, kZeroSpread);
    gain = random.uniform(1.0 - kGainSpread, 1.0 + kGainSpread) *
           std::cos(random.uniform(0.0, kLargestTilt_rad));
    bending_Nm = range_Nm * random.uniform(-kBendingSpread, kBendingSpread);
  }

  [[nodiscard]] Recording of(const Recording& before) const {
    Recording after(before.name(), before.sample_rate_Hz(), before.time_s(0));
    const std::vector<double>* const joint_rad =
        before.has("joint_angle_rad") ? &before.channel("joint_angle_rad").values : nullptr;
    for (Channel channel : before.channels()) {
      if (channel.name == "torque_Nm")
        for (std::size_t n = 0; n < channel.values.size(); ++n)
          channel.values[n] = gain * channel.values[n] + zero_Nm +
                              (joint_rad == nullptr ? 0.0 : bending_Nm * std::cos((*joint_rad)[n]));
      after.add(std::move(channel));
    }
    after.definitions = before.definitions;
    return after;
  }
};

std::vector<std::string> actuators_of(const DriftCampaignSettings& settings) {
  if (!settings.actuators.empty()) return settings.actuators;
  std::vector<std::string> all;
  for (const DataSheet& sheet : data_sheets())
    if (sheet.family == ActuatorFamily::series_elastic) all.push_back(sheet.name);
  return all;
}

ModelFile calibrated(const DataSheet& sheet, const std::string& family, Random& random) {
  const Dataset dataset = recorded(sheet, calibration_motions(sheet),
                                   OperatingConditions::kReference_K, Role::train, random);
  return train_model(dataset, {.family = family, .features = resolve_inputs(dataset, {})}, 1).file;
}

DriftSpecimen outcome(const Drift& drift, DriftSpecimen specimen) {
  for (const DriftQuantity& of : drift.quantities) {
    if (!of.is_of_joint) continue;
    const bool is_scale = of.name == "stiffness or gain";
    if (is_scale) specimen.scale = of.relative;
    if (of.name == kFriction) specimen.friction = of.relative;
    if (of.name == "backlash") specimen.backlash_rad = of.change;
    const bool is_it = (is_scale && specimen.changed == kStiffness) || of.name == specimen.changed;
    const bool is_reported = of.verdict == DriftVerdict::changed;
    const bool is_of_right_sign = of.relative * specimen.amount > 0.0;
    if (!is_it) {
      specimen.is_other_found |= is_reported;
      continue;
    }
    specimen.is_found = is_reported && is_of_right_sign;
    specimen.estimate = of.relative;
    specimen.is_covered =
        of.lowest <= specimen.amount * of.before && specimen.amount * of.before <= of.highest;
  }
  specimen.is_undetermined = drift.joint == DriftVerdict::undetermined;
  return specimen;
}

/// A serial number of a specimen; it differs with the seed.
std::uint64_t specimen_number(std::uint64_t seed, std::size_t number) {
  constexpr std::uint64_t kSpecimens = 9999;
  return 1 + text_hash(fmt::format("drift specimen {} {}", seed, number)) % kSpecimens;
}

/// The specimen with that number, after a change and, another one, without.
std::array<DriftSpecimen, 2> examined(const DriftCampaignSettings& settings, std::size_t number) {
  const std::vector<std::string> actuators = actuators_of(settings);
  const std::string& actuator = actuators[number % actuators.size()];
  Random random(text_hash(fmt::format("drift {} {}", settings.seed, number)));
  const DataSheet sheet =
      data_sheet(fmt::format("{}#{}", actuator, specimen_number(settings.seed, number)));
  const ModelFile model = calibrated(sheet, settings.family, random);
  const auto examine = [&](const DataSheet& now, DriftSpecimen specimen, bool is_remounted) {
    const double temperature_K = OperatingConditions::kReference_K +
                                 random.uniform(-kTemperatureSpread_K, kTemperatureSpread_K);
    Dataset dataset =
        recorded(now, later_motions(sheet, random), temperature_K, Role::test, random);
    if (is_remounted) {
      const Mounting mounting(sheet, random);
      for (DatasetRecord& record : dataset.records)
        record.recording = mounting.of(record.recording);
    }
    return outcome(detect_drift(model, dataset), std::move(specimen));
  };
  DriftSpecimen changed{.actuator = actuator};
  const double sign = random.uniform() < 0.5 ? -1.0 : 1.0;
  StageWear wear;
  // Each actuator takes turns, so that each gets both.
  if ((number / actuators.size() + number) % 2 == 0) {
    changed.changed = kStiffness;
    changed.amount = sign * random.uniform(kSmallestStiffness, kLargestStiffness);
    wear.stiffness = 1.0 + changed.amount;
  } else {
    changed.changed = kFriction;
    changed.amount = sign * random.uniform(kSmallestFriction, kLargestFriction);
    wear.friction = 1.0 + changed.amount;
  }
  const DriftSpecimen after = examine(worn(sheet, wear), changed, false);
  return {after, examine(sheet, {.actuator = actuator}, true)};
}

Json json_of(const DriftSpecimen& of) {
  return {{"actuator", of.actuator},
          {"changed", of.changed},
          {"amount", of.amount},
          {"estimate", std::isnan(of.estimate) ? Json(nullptr) : Json(of.estimate)},
          {"found", of.is_found},
          {"other_found", of.is_other_found},
          {"undetermined", of.is_undetermined},
          {"covered", of.is_covered},
          {"scale", of.scale},
          {"friction", of.friction},
          {"backlash_rad", of.backlash_rad}};
}

double number(const Json& json) { return json.is_number() ? json.get<double>() : kNotMeasured; }

DriftSpecimen specimen_of(const Json& json) {
  return {.actuator = json.at("actuator"),
          .changed = json.at("changed"),
          .amount = json.at("amount"),
          .estimate = number(json.at("estimate")),
          .is_found = json.at("found"),
          .is_other_found = json.at("other_found"),
          .is_undetermined = json.at("undetermined"),
          .is_covered = json.at("covered"),
          .scale = number(json.at("scale")),
          .friction = number(json.at("friction")),
          .backlash_rad = number(json.at("backlash_rad"))};
}

void add(DriftCampaignResult& result, const DriftSpecimen& of) {
  auto row = std::ranges::find_if(result.rows, [&](const DriftCampaignRow& each) {
    return each.actuator == of.actuator && each.changed == of.changed;
  });
  if (row == result.rows.end())
    row = result.rows.insert(row, {.actuator = of.actuator, .changed = of.changed});
  ++row->specimens;
  row->found += of.is_found ? 1 : 0;
  row->other_found += of.is_other_found ? 1 : 0;
  row->undetermined += of.is_undetermined ? 1 : 0;
  row->covered += of.is_covered ? 1 : 0;
  if (of.changed.empty()) {
    ++result.healthy;
    result.false_alarms += of.is_other_found ? 1 : 0;
  } else {
    ++result.changed;
    result.found += of.is_found ? 1 : 0;
  }
  result.specimens.push_back(of);
}

}  // namespace

DriftCampaignResult run_drift_campaign(const DriftCampaignSettings& settings,
                                       const Progress& progress) {
  if (settings.specimens < 1 || settings.specimens > kMaxSpecimens)
    throw UsageError({.place = "campaign: specimens",
                      .expected = fmt::format("1 to {}", kMaxSpecimens),
                      .found = fmt::format("{}", settings.specimens)});
  for (const std::string& name : actuators_of(settings)) (void)data_sheet(name);
  const Json identity{{"version", kVersion},
                      {"drift_seed", settings.seed},
                      {"actuators", actuators_of(settings)},
                      {"family", settings.family}};
  UnitFile file(settings.resume, identity.dump());
  std::vector<std::string> results(settings.specimens);
  SharedProgress shared(progress, 0.0, 1.0, settings.specimens, "simulating");
  for_each_chunk(settings.specimens, settings.threads, [&](std::size_t i) {
    const std::string unit = fmt::format("specimen {}", i);
    if (const std::string* const known = file.find(unit)) {
      results[i] = *known;
    } else {
      Json both = Json::array();
      for (const DriftSpecimen& of : examined(settings, i)) both.push_back(json_of(of));
      results[i] = both.dump();
      file.add(unit, results[i]);
    }
    shared.tick();
  });
  DriftCampaignResult result{.seed = settings.seed};
  for (const std::string& text : results)
    for (const Json& each : Json::parse(text)) add(result, specimen_of(each));
  result.missed_upper_95 = binomial_upper_95(result.changed - result.found, result.changed);
  result.false_upper_95 = binomial_upper_95(result.false_alarms, result.healthy);
  std::ranges::stable_sort(result.rows, {}, &DriftCampaignRow::actuator);
  return result;
}

}  // namespace torsio
