#include "sim/campaign/fault_campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/checks.hpp"
#include "core/fnv_hash.hpp"
#include "fault_classes.hpp"
#include "fault_free_run.hpp"
#include "files/unit_file.hpp"
#include "injection_run.hpp"
#include "numerics/event_bounds.hpp"
#include "numerics/parallel.hpp"
#include "numerics/quantile.hpp"
#include "numerics/shared_progress.hpp"
#include "sim/campaign/duty_recording.hpp"
#include "sim/experiments/experiment_table.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kResultVersion = 5;  // version of the results of units
constexpr std::size_t kInjectionsAUnit = 32;
constexpr std::size_t kJointsAUnit = 16;
constexpr double kUnitHours = 1.0;  // hours of each joint
constexpr double kTicksAnHour = 3600.0 * kBenchRate_Hz;
constexpr double kLowLoad = 0.05;  // share of the largest torque
constexpr double kRequiredShare = 0.2;
constexpr double kHysteresisSpread = 0.25;
constexpr double kLargestGain = 1e-3;
constexpr double kMaxHours = 1e6;
constexpr std::size_t kMaxInjections = 1'000'000;

/// Sizes over the rated torque, and the ends of their ranges.
struct SizeRange {
  double size;
  double lowest;
  double highest;
};
constexpr auto kSizes = std::to_array<SizeRange>(
    {{0.025, 0.0125, 0.0375}, {0.05, 0.0375, 0.075}, {0.1, 0.075, 0.125}, {0.15, 0.125, 0.175}});

struct Group {
  const CampaignGroup* of;
  JointMonitor monitor;
  std::vector<FaultClass> classes;
  double limit_share;  ///< see `ClassResult`
};

struct WorkUnit {
  enum class Kind { injections, sizes, work, low_load };
  std::string name;
  Kind kind = Kind::injections;
  std::size_t group = 0;
  std::size_t fault = 0;  ///< index of the class
  double size = 0.0;
  std::size_t first = 0;
  std::size_t count = 0;  ///< injections or joints
};

void check(const CampaignSettings& settings, const std::vector<CampaignGroup>& groups) {
  constexpr std::string_view kPlace = "campaign";
  const auto hours = [&](const char* what, double value) {
    require<UsageError>(value >= 0.0 && value <= kMaxHours, {kPlace, what},
                        fmt::format("0 to {:g} h", kMaxHours), value);
  };
  const auto count = [&](const char* what, std::size_t value) {
    require<UsageError>(value <= kMaxInjections, {kPlace, what},
                        fmt::format("at most {}", kMaxInjections), static_cast<double>(value));
  };
  require<UsageError>(!groups.empty(), {kPlace, "groups"}, "at least one", 0.0);
  if (!settings.resume.empty())
    for (const CampaignGroup& group : groups)
      if (group.monitor_hash.empty())
        throw UsageError({.place = fmt::format("campaign: resume: {}", group.name),
                          .expected = "what identifies its monitor: results of monitors that are "
                                      "calibrated differently do not mix",
                          .found = "no monitor_hash"});
  hours("fault-free hours", settings.fault_free_hours);
  hours("hours under little load", settings.low_load_hours);
  count("injections", settings.injections);
  count("injections of a size", settings.injections_of_a_size);
}

bool is_wanted(const CampaignSettings& settings, const std::string& name) {
  return settings.classes.empty() ||
         std::ranges::any_of(settings.classes,
                             [&](const std::string& begin) { return name.starts_with(begin); });
}

/// Two sources that are within their threshold of each other may hide as much again.
double limit_share(const MonitoredTorque& monitored, const DataSheet& sheet) {
  const std::vector<PairLimits>& pairs = monitored.monitor().settings().pairs;
  if (pairs.size() != 1) return kRequiredShare;
  const double hidden_Nm = 2.2 * pairs.front().floor_Nm;
  return std::max(kRequiredShare, hidden_Nm / sheet.rating.torque_Nm.value);
}

std::vector<Group> groups_of(const std::vector<CampaignGroup>& from,
                             const CampaignSettings& settings) {
  std::vector<Group> groups;
  std::size_t classes = 0;
  std::vector<std::string> known;
  for (const CampaignGroup& of : from) {
    MonitoredTorque monitored = of.monitor();
    std::vector<FaultClass> all = fault_classes(of.sheet, monitored);
    for (const FaultClass& fault : all) known.push_back(fault.name);
    std::erase_if(all, [&](const FaultClass& fault) { return !is_wanted(settings, fault.name); });
    classes += all.size();
    const double share = limit_share(monitored, of.sheet);
    groups.push_back({&of, JointMonitor(std::move(monitored), of.sheet, settings.is_electrical),
                      std::move(all), share});
  }
  if (classes == 0 && settings.injections > 0) {
    std::ranges::sort(known);
    known.erase(std::unique(known.begin(), known.end()), known.end());
    throw UsageError(
        {.place = "campaign: classes",
         .expected = fmt::format("the beginning of one of: {}", fmt::join(known, ", ")),
         .found = fmt::format("{}", fmt::join(settings.classes, ", "))});
  }
  return groups;
}

/// Independent of the other classes and groups of the campaign.
std::uint64_t unit_seed(std::uint64_t seed, const std::string& group, const std::string& what) {
  return text_hash(fmt::format("{} {} {}", seed, group, what));
}

std::vector<WorkUnit> units_of(const std::vector<Group>& groups, const CampaignSettings& settings) {
  std::vector<WorkUnit> units;
  const auto add_parts = [&](WorkUnit unit, std::size_t total, std::size_t part) {
    const std::string name = unit.name;
    for (std::size_t first = 0; first < total; first += part) {
      unit.first = first;
      unit.count = std::min(part, total - first);
      unit.name = fmt::format("{} {}", name, first);
      units.push_back(unit);
    }
  };
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (std::size_t c = 0; c < groups[g].classes.size(); ++c) {
      const FaultClass& fault = groups[g].classes[c];
      const std::string name = fmt::format("{}: {}", groups[g].of->name, fault.name);
      add_parts({.name = name, .group = g, .fault = c}, settings.injections, kInjectionsAUnit);
      if (!fault.has_size) continue;
      for (const SizeRange& range : kSizes)
        add_parts({.name = fmt::format("{} of {}", name, range.size),
                   .kind = WorkUnit::Kind::sizes,
                   .group = g,
                   .fault = c,
                   .size = range.size},
                  settings.injections_of_a_size, kInjectionsAUnit);
    }
  }
  const auto joints = [&](double hours) {
    return static_cast<std::size_t>(
        std::ceil(hours / kUnitHours / static_cast<double>(groups.size()) - 1e-9));
  };
  for (std::size_t g = 0; g < groups.size(); ++g) {
    add_parts({.name = groups[g].of->name + ": work", .kind = WorkUnit::Kind::work, .group = g},
              joints(settings.fault_free_hours), kJointsAUnit);
    add_parts(
        {.name = groups[g].of->name + ": low load", .kind = WorkUnit::Kind::low_load, .group = g},
        joints(settings.low_load_hours), kJointsAUnit);
  }
  return units;
}

std::string campaign_identity(const std::vector<Group>& groups, const CampaignSettings& settings) {
  Json identity{{"version", kResultVersion},
                {"seed", settings.seed},
                {"injections", settings.injections},
                {"injections_of_a_size", settings.injections_of_a_size},
                {"fault_free_hours", settings.fault_free_hours},
                {"low_load_hours", settings.low_load_hours},
                {"classes", settings.classes},
                {"electrical", settings.is_electrical},
                {"groups", Json::array()}};
  for (const Group& group : groups)
    identity["groups"].push_back(
        {group.of->name, sheet_hash(group.of->sheet), group.of->monitor_hash});
  return identity.dump();
}

Json json_of(const std::vector<InjectionOutcome>& outcomes) {
  Json all = Json::array();
  for (const InjectionOutcome& of : outcomes)
    all.push_back({static_cast<int>(of.kind), of.latency_ticks, of.attempts, of.check,
                   of.near_impact, of.disagreement, of.energy_gain, of.brief});
  return all;
}

std::vector<InjectionOutcome> outcomes_of(const Json& all) {
  std::vector<InjectionOutcome> outcomes;
  for (const Json& of : all)
    outcomes.push_back({.kind = static_cast<InjectionOutcome::Kind>(of.at(0).get<int>()),
                        .latency_ticks = of.at(1),
                        .attempts = of.at(2),
                        .check = of.at(3),
                        .brief = of.at(7),
                        .near_impact = of.at(4),
                        .disagreement = of.at(5),
                        .energy_gain = of.at(6).is_null() ? kNotMeasured : of.at(6).get<double>()});
  return outcomes;
}

Json json_of(const FaultFreeOutcome& of) {
  return {{"ticks", of.ticks},
          {"watched", of.watched_ticks},
          {"impacts", of.impacts},
          {"alarms", of.alarms}};
}

/// Factor on the hysteresis of a joint under little load: evenly between its bounds, for any number of joints.
double hysteresis_factor(std::size_t joint) {
  constexpr double kGolden = 0.6180339887498949;
  const double share = std::fmod(kGolden * static_cast<double>(joint + 1), 1.0);
  return 1.0 + kHysteresisSpread * (2.0 * share - 1.0);
}

std::string done(const WorkUnit& unit, const Group& group, const CampaignSettings& settings) {
  const CampaignGroup& of = *group.of;
  if (unit.kind == WorkUnit::Kind::injections || unit.kind == WorkUnit::Kind::sizes) {
    const FaultClass& fault = group.classes[unit.fault];
    return json_of(run_injections({.sheet = of.sheet,
                                   .monitor = group.monitor,
                                   .fault = fault,
                                   .seed = unit_seed(settings.seed, of.name,
                                                     fmt::format("{} {}", fault.name, unit.size)),
                                   .first = unit.first,
                                   .count = unit.count,
                                   .limit_share = group.limit_share,
                                   .size = unit.size,
                                   .is_electrical = settings.is_electrical}))
        .dump();
  }
  FaultFreeRun run{.sheets = {},
                   .monitor = group.monitor,
                   .ticks = static_cast<std::size_t>(kUnitHours * kTicksAnHour),
                   .is_electrical = settings.is_electrical};
  const bool is_low = unit.kind == WorkUnit::Kind::low_load;
  run.seed = unit_seed(settings.seed, of.name, is_low ? "low load" : "work") + unit.first;
  if (is_low) {
    run.settings.gravity_share = kLowLoad;
    run.settings.impacts_per_min = 0.0;
  }
  for (std::size_t i = 0; i < unit.count; ++i)
    run.sheets.push_back(is_low ? with_hysteresis(of.sheet, hysteresis_factor(unit.first + i))
                                : of.sheet);
  return json_of(run_fault_free(run)).dump();
}

Latencies latencies_of(const std::vector<double>& all_ms) {
  if (all_ms.empty()) return {};
  return {.p50_ms = quantile(all_ms, 0.5),
          .p99_ms = quantile(all_ms, 0.99),
          .longest_ms = *std::ranges::max_element(all_ms)};
}

ClassResult class_result(const FaultClass& fault, const Group& group,
                         const std::vector<InjectionOutcome>& outcomes) {
  using Kind = InjectionOutcome::Kind;
  ClassResult result{.name = fault.name,
                     .group = group.of->name,
                     .row = fault.row,
                     .limit_share = group.limit_share,
                     .must_stop = fault.must_stop,
                     .limit_ms = 1e3 * fault.limit_s};
  std::vector<double> all_ms;
  std::vector<double> near_ms;
  for (const InjectionOutcome& of : outcomes) {
    result.redrawn += static_cast<std::size_t>(of.attempts - 1);
    if (of.kind == Kind::unreached) {
      ++result.unreached;
      continue;
    }
    ++result.injected;
    result.brief += of.brief > 0 ? 1 : 0;
    result.near_impact += of.near_impact ? 1 : 0;
    if (of.kind != Kind::detected && of.kind != Kind::stopped) continue;
    const double latency_ms = 1e3 * of.latency_ticks / kBenchRate_Hz;
    ++result.detected;
    all_ms.push_back(latency_ms);
    if (latency_ms > result.limit_ms) ++result.late;
    if (of.near_impact) {
      ++result.near_impact_detected;
      near_ms.push_back(latency_ms);
    }
    if (of.check >= 0) ++result.checks[std::string(name(static_cast<MonitorCheck>(of.check)))];
    if (std::isnan(of.energy_gain)) continue;
    ++result.stops;
    result.stops_with_gain += of.energy_gain > kLargestGain ? 1 : 0;
    if (!(result.largest_gain >= of.energy_gain)) result.largest_gain = of.energy_gain;
  }
  result.missed_upper_95 = binomial_upper_95(result.injected - result.detected, result.injected);
  result.latency = latencies_of(all_ms);
  result.near_impact_latency = latencies_of(near_ms);
  return result;
}

/// Each injection counts where its largest disagreement was.
void add_sizes(std::vector<SizeResult>& sizes, const std::string& name, const std::string& group,
               const std::vector<InjectionOutcome>& outcomes) {
  for (const SizeRange& range : kSizes) {
    SizeResult result{.name = name, .group = group, .size = range.size};
    for (const InjectionOutcome& of : outcomes) {
      if (of.kind == InjectionOutcome::Kind::unreached) continue;
      if (!(of.disagreement >= range.lowest && of.disagreement < range.highest)) continue;
      ++result.injected;
      result.detected += of.kind == InjectionOutcome::Kind::detected ? 1 : 0;
    }
    sizes.push_back(std::move(result));
  }
}

void add(FaultFreeResult& to, const FaultFreeResult& more) {
  to.joint_hours += more.joint_hours;
  to.simulated_hours += more.simulated_hours;
  to.false_alarms += more.false_alarms;
  to.impacts += more.impacts;
  for (const auto& [cause, count] : more.causes) to.causes[cause] += count;
}

FaultFreeResult fault_free_of(const Json& json, const std::string& group, bool is_low_load) {
  FaultFreeResult result{.group = group,
                         .is_low_load = is_low_load,
                         .joint_hours = json.at("watched").get<double>() / kTicksAnHour,
                         .simulated_hours = json.at("ticks").get<double>() / kTicksAnHour,
                         .impacts = json.at("impacts")};
  for (const auto& [cause, count] : json.at("alarms").items()) {
    result.causes[cause] = count;
    result.false_alarms += count.get<std::size_t>();
  }
  return result;
}

void bound(FaultFreeResult& result) {
  if (result.joint_hours > 0.0)
    result.upper_95 = poisson_upper_95(result.false_alarms) / result.joint_hours;
}

/// Puts the results of the units together, in their order.
class Merge {
 public:
  Merge(const std::vector<Group>& groups, const std::vector<WorkUnit>& units,
        const std::vector<std::string>& results)
      : groups_(groups), units_(units), results_(results) {}

  CampaignResult result(std::uint64_t seed) const {
    CampaignResult all{.seed = seed};
    all.low_load.is_low_load = true;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const std::string& group = groups_[g].of->name;
      for (std::size_t c = 0; c < groups_[g].classes.size(); ++c) {
        const FaultClass& fault = groups_[g].classes[c];
        const auto injected = outcomes(WorkUnit::Kind::injections, g, c);
        if (!injected.empty()) all.classes.push_back(class_result(fault, groups_[g], injected));
        const auto sized = outcomes(WorkUnit::Kind::sizes, g, c);
        if (!sized.empty()) add_sizes(all.sizes, fault.name, group, sized);
      }
      add_fault_free(all, g, WorkUnit::Kind::work, all.work);
      add_fault_free(all, g, WorkUnit::Kind::low_load, all.low_load);
    }
    bound(all.work);
    bound(all.low_load);
    return all;
  }

 private:
  template <class Visit>
  void each(WorkUnit::Kind kind, std::size_t group, std::size_t fault, const Visit& visit) const {
    for (std::size_t i = 0; i < units_.size(); ++i)
      if (units_[i].kind == kind && units_[i].group == group && units_[i].fault == fault)
        visit(Json::parse(results_[i]));
  }
  std::vector<InjectionOutcome> outcomes(WorkUnit::Kind kind, std::size_t group,
                                         std::size_t fault) const {
    std::vector<InjectionOutcome> all;
    each(kind, group, fault,
         [&](const Json& json) { std::ranges::move(outcomes_of(json), std::back_inserter(all)); });
    return all;
  }
  void add_fault_free(CampaignResult& all, std::size_t group, WorkUnit::Kind kind,
                      FaultFreeResult& total) const {
    const bool is_low = kind == WorkUnit::Kind::low_load;
    FaultFreeResult result{.group = groups_[group].of->name, .is_low_load = is_low};
    each(kind, group, 0,
         [&](const Json& json) { add(result, fault_free_of(json, result.group, is_low)); });
    if (result.simulated_hours == 0.0) return;
    add(total, result);
    bound(result);
    all.fault_free.push_back(std::move(result));
  }

  const std::vector<Group>& groups_;
  const std::vector<WorkUnit>& units_;
  const std::vector<std::string>& results_;
};

}  // namespace

CampaignResult run_fault_campaign(const std::vector<CampaignGroup>& groups,
                                  const CampaignSettings& settings, const Progress& progress) {
  check(settings, groups);
  const std::vector<Group> prepared = groups_of(groups, settings);
  const std::vector<WorkUnit> units = units_of(prepared, settings);
  UnitFile file(settings.resume, campaign_identity(prepared, settings));
  std::vector<std::string> results(units.size());
  SharedProgress shared(progress, 0.0, 1.0, std::max<std::size_t>(units.size(), 1), "simulating");
  for_each_chunk(units.size(), settings.threads, [&](std::size_t i) {
    const WorkUnit& unit = units[i];
    if (const std::string* const known = file.find(unit.name)) {
      results[i] = *known;
    } else {
      results[i] = done(unit, prepared[unit.group], settings);
      file.add(unit.name, results[i]);
    }
    shared.tick();
  });
  return Merge(prepared, units, results).result(settings.seed);
}

std::vector<std::string> campaign_classes(const CampaignGroup& group) {
  std::vector<std::string> names;
  for (const FaultClass& fault : fault_classes(group.sheet, group.monitor()))
    names.push_back(fault.name);
  return names;
}

}  // namespace torsio
