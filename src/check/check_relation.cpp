#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <string_view>

#include "check/checker.hpp"
#include "check/slow_course.hpp"
#include "data/finest_step.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

namespace {

/// Whether it is a channel of motion or load; others, like a temperature, change the torque at equal motion.
bool is_motion_or_load(std::string_view channel) {
  constexpr auto kUnits = std::to_array<std::string_view>(
      {"rad", "rad_s", "rad_s2", "m", "m_s", "m_s2", "N", "Nm", "Nm_s", "A", "V", "s"});
  const auto parts = split_channel_name(channel);
  return parts && std::ranges::find(kUnits, parts->unit->si_suffix) != kUnits.end();
}

}  // namespace

FeatureSpec Checker::spec_of(std::size_t input) const {
  FeatureSpec spec = spec_;
  spec.inputs = {spec_.inputs[input]};
  return spec;
}

// What a temperature or a pressure explains is what a model shall learn, and no fault of a zero or a gain.
void Checker::take_out_other_inputs() {
  std::vector<OtherInput> others;
  std::set<std::string> met;
  const auto take = [&](const auto& values_of) {
    others.emplace_back();
    for (const DatasetRecord& record : dataset_.records)
      others.back().values.push_back(values_of(record.recording));
  };
  for (std::size_t k = 1; k < spec_.inputs.size(); ++k) {
    const FeatureSpec spec = spec_of(k);
    const FeaturePipeline pipeline(spec, dataset_.sample_rate_Hz());
    if (std::ranges::all_of(pipeline.raw_inputs(), is_motion_or_load)) continue;
    met.insert(pipeline.raw_inputs().begin(), pipeline.raw_inputs().end());
    take([&](const Recording& recording) { return first_feature(recording, spec); });
  }
  if (!dataset_.records.empty())
    for (const std::string& name : dataset_.records.front().recording.conditions())
      if (!met.contains(name) &&
          std::ranges::all_of(dataset_.records, [&](const DatasetRecord& record) {
            return is_condition(record.recording, name);
          }))
        take([&](const Recording& recording) { return recording.channel(name).values; });
  if (!others.empty()) take_out(pairs_, others);
}

void Checker::check_sign_flips() {
  for_each_record([&](std::size_t r) {
    if (const Jump jump = largest_jump(pairs_[r].input); stands_out(jump, pairs_[r].input)) return;
    const Recording& recording = dataset_.records[r].recording;
    double code = 0.0;
    for (const std::string& source : sources_)
      code = std::max(code, finest_step(recording.channel(source)));
    flips_[r] = find_sign_flip(pairs_[r], code, finest_step(recording.channel(dataset_.target)));
  });
}

// Hysteresis makes the torque lead the deflection as well. A delay is what a static curve with
// hysteresis does not explain: it shifts fast parts of the motion more than slow ones.
void Checker::check_delay() {
  const double rate = dataset_.sample_rate_Hz();
  const std::size_t before = findings_.size();
  std::vector<double> shortest_of_s(pairs_.size(), 0.0);
  for_each_record([&](std::size_t r) {
    if (spoiled_[r] != 0 || changes_[r] || check_sides(r)) return;
    const auto delay = estimate_delay(pairs_[r], rate);
    if (delay && delay->course)
      report_clocks(r, *delay->course);
    else if (delay && (is_late(*delay, rate) || is_early(*delay, rate)))
      report_delay(r, *delay);
    else
      shortest_of_s[r] = delay ? delay->shortest_s : HUGE_VAL;
  });
  if (findings_.size() > before) return;
  double shortest_s = 0.0;
  for (const double each_s : shortest_of_s) shortest_s = std::max(shortest_s, each_s);
  add(Verdict::pass, "delay", "",
      fmt::format("{} and {} move together{}", spec_.inputs.front(), dataset_.target,
                  shortest_s > kClearDelay_s
                      ? std::isfinite(shortest_s)
                            ? fmt::format("; delays below {:.0f} ms cannot be determined from so "
                                          "slow a motion",
                                          1e3 * shortest_s)
                            : "; delays cannot be determined from this motion"
                      : ""));
}

/// One of two angles that is late: the difference then contains the speed of the joint.
bool Checker::check_sides(std::size_t r) {
  const Recording& recording = dataset_.records[r].recording;
  const auto& sides = sides_[r];
  if (!sides || !has_late_side(*sides, recording.sample_rate_Hz())) return false;
  const bool is_first = sides->lateness_s > 0.0;
  add(Verdict::warn, "delay", recording.name(),
      fmt::format("{} comes {:.1f} ms after {}", is_first ? sources_[0] : sources_[1],
                  1e3 * std::abs(sides->lateness_s), is_first ? sources_[1] : sources_[0]),
      "The difference of two angles needs both at the same time: check how they are sampled.");
  return true;
}

void Checker::report_clocks(std::size_t r, const LagCourse& course) {
  add(Verdict::warn, "delay", dataset_.records[r].recording.name(),
      fmt::format("{} comes later by {:.3g} ms in each second, by {:.0f} ms in all: two clocks of "
                  "different speed",
                  course.per_second > 0.0 ? dataset_.target : spec_.inputs.front(),
                  1e3 * std::abs(course.per_second), 1e3 * std::abs(course.change_s)),
      "Record both with one clock, or multiply the stamps of one of them before they are joined. A "
      "constant latency: does not remove it.");
}

void Checker::report_delay(std::size_t r, const Delay& delay) {
  add(Verdict::warn, "delay", dataset_.records[r].recording.name(),
      fmt::format("{} comes {:.1f} ms {} {} (unexplained {:.2g} % there, {:.2g} % without shift)",
                  dataset_.target, 1e3 * std::abs(delay.lag_s),
                  delay.lag_s > 0.0 ? "after" : "before", spec_.inputs.front(),
                  100.0 * delay.unexplained, 100.0 * delay.without_shift),
      delay.is_at_end ? "The search ends there: check the loggers' clocks."
      : delay.lag_s > 0.0
          ? fmt::format("Mapping line that removes it: latency: {{{}: {:.1f}ms}}", dataset_.target,
                        1e3 * delay.lag_s)
          : fmt::format("No damping explains so long a lead: {} is late, or the loggers' "
                        "clocks differ.",
                        spec_.inputs.front()));
}

void Checker::check_sign() {
  // Numbers in another coding have no sign yet.
  if (std::ranges::count(coded_, 1) == std::ssize(coded_)) return;
  pass_unless_found(
      "sign", fmt::format("{} rises with {}", dataset_.target, spec_.inputs.front()), [&] {
        std::vector<double> values(pairs_.size());
        for_each_record(
            [&](std::size_t r) { values[r] = correlation(pairs_[r].input, pairs_[r].target); });
        const std::string flipped = flipped_source(values);
        if (!flipped.empty()) std::ranges::fill(spoiled_, std::uint8_t{1});
        const bool some_rise =
            std::ranges::any_of(values, [](double value) { return value > kClearCorrelation; });
        for (std::size_t r = 0; r < values.size(); ++r) {
          if (coded_[r] != 0) continue;
          const std::string& recording = dataset_.records[r].recording.name();
          if (!flipped.empty() && values[r] < kTogether) {
            add(Verdict::fail, "sign", recording,
                fmt::format("{} does not follow {} (correlation {:.3f}), but would with the sign "
                            "of {} inverted",
                            dataset_.target, spec_.inputs.front(), values[r], flipped),
                fmt::format(
                    "Mapping: channels: {{{0}: {{from: ..., sign: -1}}}}, with the column of {0}",
                    flipped));
          } else if (flips_[r] && flipped.empty()) {
            report_flip(r);
          } else if (values[r] < -kClearCorrelation) {
            add(Verdict::fail, "sign", recording,
                fmt::format("{} falls with {} (correlation {:.3f})", dataset_.target,
                            spec_.inputs.front(), values[r]),
                some_rise
                    ? fmt::format("In other recordings it rises: in this one {} has the wrong "
                                  "sign, or every angle has. Give it a mapping with sign: -1 "
                                  "(channels: {{{}: {{from: ..., sign: -1}}}})",
                                  dataset_.target, dataset_.target)
                    : fmt::format("Mapping: invert one of them with sign: -1 (channels: "
                                  "{{{}: {{from: ..., sign: -1}}}})",
                                  dataset_.target));
          } else if (values[r] < kClearCorrelation && has_lost_sign(r)) {
            continue;
          } else if (values[r] < kClearCorrelation && hardly_moves(r)) {
            add(Verdict::warn, "excitation", recording,
                fmt::format("{} hardly moves more than its noise: neither sign nor delay can be "
                            "determined",
                            spec_.inputs.front()),
                "Record a motion that loads the spring.");
          } else if (values[r] < kClearCorrelation) {
            add(Verdict::warn, "sign", recording,
                fmt::format("{} hardly follows {} (correlation {:.3f})", dataset_.target,
                            spec_.inputs.front(), values[r]),
                "Check that the torque depends on this channel.");
          }
        }
      });
}

void Checker::report_flip(std::size_t r) {
  const Recording& recording = dataset_.records[r].recording;
  spoiled_[r] = 1;
  add(Verdict::fail, "sign", recording.name(),
      fmt::format("{0} {1} with {2} until t = {3:.4g} s and {4} with it from there (correlation "
                  "{5:.3f}, then {6:.3f})",
                  dataset_.target, flips_[r]->before > 0.0 ? "rises" : "falls",
                  spec_.inputs.front(), recording.time_s(flips_[r]->sample),
                  flips_[r]->after > 0.0 ? "rises" : "falls", flips_[r]->before, flips_[r]->after),
      "A sign changed while recording: cut the recording in two there, and invert one part.");
}

/// The one of two angles with whose inverted sign the torque follows their difference in every
/// recording, while it does not follow the difference as recorded; empty if there is none.
std::string Checker::flipped_source(const std::vector<double>& values) const {
  if (std::ranges::all_of(values, [](double v) { return v > kTogether; })) return {};
  if (std::ranges::count(coded_, 1) > 0) return {};
  bool is_first_minuend = true;
  double direction = 0.0;
  double narrowest = 1.0;
  for (std::size_t r = 0; r < pairs_.size(); ++r) {
    const int order = order_of_difference(r);
    if (order == 0) return {};
    is_first_minuend = order > 0;
    const Recording& recording = dataset_.records[r].recording;
    const std::vector<double>& first = recording.channel(sources_[0]).values;
    const std::vector<double>& second = recording.channel(sources_[1]).values;
    std::vector<double> sum(first.size());
    std::ranges::transform(first, second, sum.begin(), std::plus());
    const double now = correlation(sum, pairs_[r].target);
    if (std::abs(now) < kTogether || now * direction < 0.0) return {};
    direction = now;
    narrowest = std::min(narrowest, extent_of(sum).width() / extent_of(pairs_[r].input).width());
  }
  // Both sides of a spring turn in the same direction: their difference is small compared with
  // their sum.
  if (narrowest > kNarrow) return {};
  return is_first_minuend == (direction > 0.0) ? sources_[1] : sources_[0];
}

/// 1 if the first input is the first of its two sources minus the second, -1 if it is the second
/// minus the first, 0 if it is not a difference.
int Checker::order_of_difference(std::size_t r) const {
  if (sources_.size() != 2) return 0;
  const Recording& recording = dataset_.records[r].recording;
  const std::vector<double>& input = pairs_[r].input;
  const std::vector<double>& first = recording.channel(sources_[0]).values;
  const std::vector<double>& second = recording.channel(sources_[1]).values;
  const auto is_difference = [&](double sign) {
    for (std::size_t i = 0; i < input.size(); ++i)
      if (std::abs(input[i] - sign * (first[i] - second[i])) >
          1e-9 * (std::abs(first[i]) + std::abs(second[i])))
        return false;
    return true;
  };
  return is_difference(1.0) ? 1 : is_difference(-1.0) ? -1 : 0;
}

// Before the other checks of the relation: they would take a change for a delay or a wrong scale.
void Checker::relate() {
  for_each_record([&](std::size_t r) {
    const Recording& recording = dataset_.records[r].recording;
    changes_[r] = find_relation_change(pairs_[r], recording.sample_rate_Hz());
    if (recording.has(kJointAngle) &&
        std::ranges::find(spec_.inputs, kJointAngle) == spec_.inputs.end())
      positions_[r] = find_position_effect(pairs_[r], recording.channel(kJointAngle).values);
    if (order_of_difference(r) != 0)
      sides_[r] =
          relate_sides(recording.channel(sources_[0]).values, recording.channel(sources_[1]).values,
                       pairs_[r].target, recording.sample_rate_Hz());
  });
}

// Changes without a jump: a zero that drifts, a spring that breaks.
void Checker::check_change() {
  pass_unless_found("change", "each recording has the same relation early and late", [&] {
    for (std::size_t r = 0; r < pairs_.size(); ++r) {
      const auto& change = changes_[r];
      if (spoiled_[r] != 0) continue;
      if (!change) {
        check_course(r);
        continue;
      }
      const Recording& recording = dataset_.records[r].recording;
      const std::string when = change->is_gradual ? std::string("gradually from beginning to end")
                                                  : fmt::format("at about t = {:.3g} s",
                                                                recording.time_s(change->sample));
      add(Verdict::warn, "change", recording.name(),
          change->is_of_slope
              ? fmt::format("at equal {} the slope of {} changes to {:.2g} times, {}",
                            spec_.inputs.front(), dataset_.target, change->slope_ratio, when)
              : fmt::format("at equal {} {} changes by {:.3g} {}, {}", spec_.inputs.front(),
                            dataset_.target, change->offset, unit_label(dataset_.target), when),
          "Check for a zero that slipped or drifted and for a part that broke or crept. A model "
          "would learn the mean of before and after.",
          change->is_gradual
              ? std::vector<SampleRange>{}
              : std::vector<SampleRange>{
                    {change->sample, recording.channel(dataset_.target).values.size()}});
    }
  });
}

// A zero that drifts and returns is neither a trend nor a step.
void Checker::check_course(std::size_t r) {
  const Recording& recording = dataset_.records[r].recording;
  if (positions_[r] || (sides_[r] && has_wrong_scale(*sides_[r]))) return;
  const auto course = find_slow_course(pairs_[r], recording.sample_rate_Hz());
  if (!course) return;
  add(Verdict::warn, "change", recording.name(),
      fmt::format("at equal {} {} changes slowly by {:.3g} {} and returns ({:.2g} % unexplained "
                  "without that course, {:.2g} % with it)",
                  spec_.inputs.front(), dataset_.target, course->range, unit_label(dataset_.target),
                  100.0 * course->unexplained, 100.0 * course->unexplained * course->left),
      "Check for a zero that drifts, as with the temperature, and for another load that the sensor "
      "measures. A model would learn the mean.");
}

// Recordings of one joint have one curve: at common inputs their torques neither differ by a
// constant nor by a factor.
void Checker::check_offsets() {
  pass_unless_found("offsets", "the recordings have the same zero and gain", [&] {
    check_zeros();
    std::vector<const Pair*> pairs;
    std::vector<std::size_t> records;
    std::vector<std::size_t> trained;  // indices into `records`
    double spread = 0.0;
    for (std::size_t r = 0; r < pairs_.size(); ++r) {
      if (spoiled_[r] != 0 || changes_[r]) continue;
      pairs.push_back(&pairs_[r]);
      if (dataset_.records[r].has_role(Role::train)) trained.push_back(records.size());
      records.push_back(r);
      spread = std::max(spread, extent_of(pairs_[r].target).width());
    }
    if (pairs.size() > 1) {
      const std::vector<RecordLine> lines = compare_records(pairs, trained);
      for (std::size_t k = 0; k < lines.size(); ++k) report_line(records[k], lines[k], spread);
    }
    for (const std::size_t r : records)
      if (std::ranges::none_of(findings_, [&](const Finding& found) {
            return found.check == "offsets" &&
                   found.recording == dataset_.records[r].recording.name();
          }))
        check_unloaded(r);
  });
}

/// The same offset as one of the deflection: torque over a deflection that is too large is too small.
std::string Checker::zero_of_input_text(std::size_t r, double offset) const {
  const double slope = line_through(pairs_[r]).slope;
  if (!is_deflection(r) || !(std::abs(slope) > 0.0)) return {};
  return fmt::format(", as if about {:.3g} rad had been added to {}", -offset / slope,
                     spec_.inputs.front());
}

void Checker::report_line(std::size_t r, const RecordLine& line, double spread) {
  if (line.unexplained > kLinesLeave * line.without_lines) return;
  const Recording& recording = dataset_.records[r].recording;
  const std::string_view others = dataset_.records[r].has_role(Role::train)
                                      ? "the other recordings"
                                      : "the training recordings";
  if (std::abs(line.offset) > kOffsetShare * spread)
    add(std::abs(line.offset) > spread ? Verdict::fail : Verdict::warn, "offsets", recording.name(),
        fmt::format("the zero is {:.3g} {} away from that of {}{}{}", line.offset,
                    unit_label(dataset_.target), others,
                    std::abs(line.offset) > spread ? ", more than the range of the torque" : "",
                    zero_of_input_text(r, line.offset)),
        is_deflection(r) && !all_begin_at_rest()
            ? fmt::format("Not all recordings begin at rest, where a zero could be taken: an "
                          "offset: of one of {} corrects it, or of {}, if its sensor drifts; "
                          "evaluate with a model states by how much. Begin recordings at rest "
                          "without load",
                          fmt::join(sources_, ", "), dataset_.target)
        : is_deflection(r)
            ? fmt::format("Remove the zero of each recording in the mapping, at rest without "
                          "load:  {}  or that of {}, if its sensor drifts",
                          zero_line(kUsualRest_s), dataset_.target)
            : "Remove the zero of each recording in the mapping: zero: [{channel: ..., first: "
              "0.1s}]");
  if (std::abs(line.slope - 1.0) > kGainChange && recording.conditions().empty())
    add(Verdict::warn, "offsets", recording.name(),
        fmt::format("{} rises {:.3g} times as steeply with {} as in {}", dataset_.target,
                    line.slope, spec_.inputs.front(), others),
        "Recordings of one joint have one stiffness: check the gain of the torque sensor, or list "
        "what differs under conditions: in a manifest.");
}

}  // namespace torsio
