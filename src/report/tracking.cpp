#include "torsio/report/tracking.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "core/running_mean.hpp"
#include "files/json_text.hpp"
#include "report/json_text.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

using Json = nlohmann::ordered_json;

std::string_view name(JointOutput output) {
  return output == JointOutput::locked ? "locked" : "free";
}

/// "-" if there is no run.
std::string text(const RunningMean& of) {
  return of.count() == 0 ? std::string("-") : fmt::format("{:.4g}", of.mean());
}
std::string text(const RunningMean& of, int decimals) {
  return of.count() == 0 ? std::string("-") : fixed_text(of.mean(), decimals);
}

/// Empty for fewer than two runs.
std::string spread(const RunningMean& of) {
  return of.count() < 2 ? std::string() : fmt::format("{:.2g}", of.std_dev());
}

/// The bandwidth, or the reason why there is none.
std::string_view bandwidth_outcome(const TrackingRow& row) {
  if (!row.bandwidth_Hz) return "not_measured";
  if (*row.bandwidth_Hz == 0.0) return "below_sweep";
  return std::isfinite(*row.bandwidth_Hz) ? "measured" : "above_sweep";
}

/// Means over the completed runs of one model.
struct ModelMeans {
  RunningMean mad, std_abs, rmse, to_linear, error_ratio, bandwidth, overshoot, limit_events,
      faults;
  std::size_t cycles = 0;
  std::vector<std::string> remarks;

  void add(const TrackingRow& row) {
    if (row.status != "ok")
      remarks.push_back(
          fmt::format("{}, seed {}: {}: {}", row.model, row.seed, row.status, row.reason));
    if (row.status != "ok") return;
    mad.add(row.score.mad);
    std_abs.add(row.score.std_abs);
    rmse.add(row.score.rmse);
    to_linear.add(row.mad_to_linear);
    error_ratio.add(row.score.error_ratio);
    const std::string_view outcome = bandwidth_outcome(row);
    if (outcome == "measured") bandwidth.add(row.bandwidth_Hz);
    if (outcome == "below_sweep" || outcome == "above_sweep")
      remarks.push_back(fmt::format("{}, seed {}: bandwidth {} the sweep's frequencies", row.model,
                                    row.seed, outcome.substr(0, 5)));
    overshoot.add(row.score.overshoot);
    limit_events.add(static_cast<double>(row.score.limit_events));
    faults.add(static_cast<double>(row.score.inverse_faults));
    if (!row.score.limit_cycle) return;
    ++cycles;
    remarks.push_back(fmt::format("{}, seed {}: limit cycle of {:.3g} Hz, {:.2g} Nm", row.model,
                                  row.seed, row.score.limit_cycle->frequency_Hz,
                                  row.score.limit_cycle->amplitude));
  }
};

Json optional(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

std::string window_of(const FaultDetection& fault) {
  return fault.end_s ? fmt::format("{:g} to {:g} s", fault.start_s, *fault.end_s)
                     : fmt::format("from {:g} s", fault.start_s);
}

/// One injected fault over the runs of one model.
struct FaultTally {
  std::string what;
  std::string window;
  std::size_t runs = 0;
  std::size_t detected = 0;
  double latest_s = 0.0;  ///< from the start of the fault to its detection
  std::set<std::string> names;
  std::optional<double> largest_Nm = {};
  std::optional<double> sound_Nm = {};

  void add(const FaultDetection& fault) {
    ++runs;
    if (fault.detected_s) {
      ++detected;
      latest_s = std::max(latest_s, *fault.detected_s - fault.start_s);
      names.emplace(name(fault.detected_as));
    }
    if (fault.largest_unreported_error_Nm)
      largest_Nm = std::max(largest_Nm.value_or(0.0), *fault.largest_unreported_error_Nm);
    if (fault.error_without_fault_Nm)
      sound_Nm = std::max(sound_Nm.value_or(0.0), *fault.error_without_fault_Nm);
  }
};

/// By model, in the order of the rows, and by fault, in the order of the schedule.
std::vector<std::pair<std::string, std::vector<FaultTally>>> fault_tallies(
    std::span<const TrackingRow> rows) {
  std::vector<std::pair<std::string, std::vector<FaultTally>>> models;
  for (const TrackingRow& row : rows) {
    auto model = std::ranges::find(models, row.model, [](const auto& each) { return each.first; });
    if (model == models.end()) model = models.insert(model, {row.model, {}});
    for (const FaultDetection& fault : row.faults) {
      auto& tallies = model->second;
      const std::string window = window_of(fault);
      auto tally = std::ranges::find_if(tallies, [&](const FaultTally& each) {
        return each.what == fault.what && each.window == window;
      });
      if (tally == tallies.end())
        tally = tallies.insert(tally, {.what = fault.what, .window = window, .names = {}});
      tally->add(fault);
    }
  }
  return models;
}

std::string newtonmetres(const std::optional<double>& value) {
  return value ? fmt::format("{:.3g}", *value) : "-";
}

/// A table of the injected faults, and a line for each that was not reported in every run.
std::string fault_text(std::span<const TrackingRow> rows) {
  TextTable table;
  table.header(
      {"injected fault", "time", "model", "reported in", "after s", "as", "max|e|", "without it"});
  std::string undetected;
  bool has_rows = false;
  for (const auto& [model, faults] : fault_tallies(rows)) {
    for (const FaultTally& fault : faults) {
      has_rows = true;
      table.row({fault.what, fault.window, model,
                 fmt::format("{} of {}", fault.detected, fault.runs),
                 fault.detected > 0 ? fmt::format("{:.3g}", fault.latest_s) : "-",
                 fault.detected > 0 ? fmt::format("{}", fmt::join(fault.names, ", ")) : "-",
                 newtonmetres(fault.largest_Nm), newtonmetres(fault.sound_Nm)});
      if (fault.detected < fault.runs)
        undetected += fmt::format(
            "UNDETECTED: {} reports no fault in {} of {} runs with {} ({}); error up to {} Nm, "
            "without the injected fault {} Nm\n",
            model, fault.runs - fault.detected, fault.runs, fault.what, fault.window,
            newtonmetres(fault.largest_Nm), newtonmetres(fault.sound_Nm));
    }
  }
  if (!has_rows) return {};
  return fmt::format(
      "\n{}max|e|: largest error in Nm within the time of the fault while no fault was reported; "
      "without it: of the\nsame run without injected faults; after s: the latest of all runs\n{}",
      table.text(), undetected);
}

/// The loop that was closed, where it is not the default one.
std::string loop_text(const TrackingRow& row) {
  std::string text = fmt::format(", bandwidth {:.4g} rad/s", row.bandwidth_rad_s);
  if (row.velocity_rad_s)
    text += fmt::format(" on a velocity loop of {:.4g} rad/s", *row.velocity_rad_s);
  return text;
}

std::string bound_text(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : std::string("none");
}

bool are_kept(const DriveLimits& limits, const DriveRange& range) {
  return range.lowest_rad >= limits.lowest_rad && range.highest_rad <= limits.highest_rad &&
         range.fastest_rad_s <= limits.speed_rad_s;
}

/// A line for each run with limits.
std::string drive_text(std::span<const TrackingRow> rows) {
  std::string text;
  for (const TrackingRow& row : rows) {
    if (!row.limits || !row.drive) continue;
    const DriveLimits& limits = *row.limits;
    text += fmt::format(
        "{}, seed {}: rotor over gear ratio {:.4g} to {:.4g} rad (limits {} to {}), up to {:.4g} "
        "rad/s (limit {}): {}; a limit was active for {:.3g} s\n",
        row.model, row.seed, row.drive->lowest_rad, row.drive->highest_rad,
        bound_text(limits.lowest_rad), bound_text(limits.highest_rad), row.drive->fastest_rad_s,
        bound_text(limits.speed_rad_s), are_kept(limits, *row.drive) ? "kept" : "NOT KEPT",
        row.drive->limited_s);
    if (row.drive->largest_spring_Nm > row.drive->allowed_spring_Nm)
      text += fmt::format(
          "{}, seed {}: the spring had {:.4g} Nm; the limits are guaranteed up to {:.4g} Nm (60 % "
          "of "
          "the torque at rated current)\n",
          row.model, row.seed, row.drive->largest_spring_Nm, row.drive->allowed_spring_Nm);
  }
  return text;
}

Json drive_json(const TrackingRow& row) {
  if (!row.limits || !row.drive) return nullptr;
  return {{"lowest_rad", row.drive->lowest_rad},
          {"highest_rad", row.drive->highest_rad},
          {"fastest_rad_s", row.drive->fastest_rad_s},
          {"largest_spring_Nm", row.drive->largest_spring_Nm},
          {"allowed_spring_Nm", row.drive->allowed_spring_Nm},
          {"limited_s", row.drive->limited_s},
          {"limits",
           {{"lowest_rad", json_number(row.limits->lowest_rad)},
            {"highest_rad", json_number(row.limits->highest_rad)},
            {"speed_rad_s", json_number(row.limits->speed_rad_s)}}},
          {"kept", are_kept(*row.limits, *row.drive)}};
}

Json faults_json(const std::vector<FaultDetection>& faults) {
  Json list = Json::array();
  for (const FaultDetection& fault : faults)
    list.push_back(
        {{"fault", fault.what},
         {"start_s", fault.start_s},
         {"end_s", optional(fault.end_s)},
         {"detected", fault.detected_s.has_value()},
         {"detected_s", optional(fault.detected_s)},
         {"detected_as", fault.detected_s ? Json(name(fault.detected_as)) : Json(nullptr)},
         {"largest_unreported_error_Nm", optional(fault.largest_unreported_error_Nm)},
         {"error_without_fault_Nm", optional(fault.error_without_fault_Nm)}});
  return list;
}

Json row_json(const TrackingRow& row) {
  const TrackingScore& score = row.score;
  const bool has_score = row.status == "ok";
  const bool is_measured = bandwidth_outcome(row) == "measured";
  const auto number = [&](double value) { return has_score ? Json(value) : Json(nullptr); };
  const auto count = [&](std::size_t value) { return has_score ? Json(value) : Json(nullptr); };
  return {
      {"actuator", row.actuator},
      {"variant", row.variant},
      {"output", name(row.output)},
      {"reference", row.reference},
      {"amplitude_Nm", row.amplitude_Nm},
      {"model", row.model},
      {"seed", row.seed},
      {"mad", number(score.mad)},
      {"std_abs", number(score.std_abs)},
      {"rmse", number(score.rmse)},
      {"mad_to_linear", optional(row.mad_to_linear)},
      {"bandwidth_Hz", is_measured ? Json(*row.bandwidth_Hz) : Json(nullptr)},
      {"limit_events", count(score.limit_events)},
      {"status", row.status},
      {"reason", row.reason},
      {"bandwidth", bandwidth_outcome(row)},
      {"max_abs", number(score.max_abs)},
      {"error_ratio", number(score.error_ratio)},
      {"load_cell_mad", number(score.load_cell_mad)},
      {"load_cell_rmse", number(score.load_cell_rmse)},
      {"overshoot", optional(score.overshoot)},
      {"limited_s", number(score.limited_s)},
      {"limit_cycle", score.limit_cycle ? Json{{"frequency_Hz", score.limit_cycle->frequency_Hz},
                                               {"amplitude_Nm", score.limit_cycle->amplitude}}
                                        : Json(nullptr)},
      {"inverse_faults", count(score.inverse_faults)},
      {"loop_faults", count(score.loop_faults)},
      {"acts_on", row.velocity_rad_s ? "velocity" : "current"},
      {"bandwidth_rad_s", row.bandwidth_rad_s},
      {"velocity_bandwidth_rad_s", optional(row.velocity_rad_s)},
      {"drive", drive_json(row)},
      {"faults", faults_json(row.faults)}};
}

}  // namespace

std::string tracking_text(std::span<const TrackingRow> rows) {
  if (rows.empty()) return "";
  const TrackingRow& first = rows.front();
  std::vector<std::pair<std::string, ModelMeans>> models;
  for (const TrackingRow& row : rows) {
    const auto found =
        std::ranges::find(models, row.model, [](const auto& model) { return model.first; });
    (found != models.end() ? *found : models.emplace_back(row.model, ModelMeans{})).second.add(row);
  }
  const bool has_overshoot = std::ranges::any_of(
      rows, [](const TrackingRow& row) { return row.score.overshoot.has_value(); });
  TextTable table;
  table.header({"model", "MAD Nm", "+-", "STD |e|", "RMSE", "/ linear", "MAD/A", "-3 dB Hz",
                "limits", "fallback", "cycles"});
  if (has_overshoot) table.header({"overshoot"});
  std::string remarks;
  for (const auto& [model, means] : models) {
    table.row({model, text(means.mad), spread(means.mad), text(means.std_abs), text(means.rmse),
               text(means.to_linear, 3), text(means.error_ratio, 3), text(means.bandwidth, 2),
               text(means.limit_events, 0), text(means.faults, 0), fmt::format("{}", means.cycles),
               text(means.overshoot, 2)});
    for (const std::string& remark : means.remarks) remarks += remark + "\n";
  }
  const std::string summary = fmt::format(
      "{} ({}), output {}, {} of {:.4g} Nm{}, {} run{} per model\n{}{}errors: of the joint's "
      "torque "
      "without noise, without the first 2 s; limits: number of limit events;\nfallback: steps with "
      "a "
      "fault of the inverse; cycles: runs with a limit cycle;\n"
      "-3 dB Hz: frequency at which the response to a sweep has fallen to 0.71, - if it has not, "
      "or never was above\n",
      first.actuator, first.variant, name(first.output), first.reference, first.amplitude_Nm,
      loop_text(first), rows.size() / models.size(), rows.size() == models.size() ? "" : "s",
      table.text(), remarks);
  return summary + drive_text(rows) + fault_text(rows);
}

std::string tracking_json(std::span<const TrackingRow> rows) {
  Json document{{"results", Json::array()}};
  for (const TrackingRow& row : rows) document["results"].push_back(row_json(row));
  return json_text(document);
}

}  // namespace torsio
