#include "torsio/train/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>

#include "torsio/core/not_measured.hpp"
#include "torsio/core/units.hpp"
#include "torsio/train/guards.hpp"
#include "torsio/train/inputs.hpp"
#include "torsio/train/training_data.hpp"
#include "train/signal_pair.hpp"
#include "train/torque_relation.hpp"

namespace torsio {
namespace {

bool has_segment(const DatasetRecord& record, Role role) {
  return std::ranges::any_of(record.segments,
                             [&](const Segment& segment) { return segment.role == role; });
}

constexpr double kClearCorrelation = 0.5;

/// Runs the checks one after the other and collects what they find.
class Checker {
 public:
  Checker(const Dataset& dataset, const FeatureSpec& spec)
      : dataset_(dataset), spec_(spec), pipeline_(spec, dataset.sample_rate_Hz()) {
    channels_ = pipeline_.raw_inputs();
    FeatureSpec first = spec;
    first.inputs.resize(1);
    sources_ = FeaturePipeline(first, dataset.sample_rate_Hz()).raw_inputs();
    channels_.push_back(dataset.target);
    for (const DatasetRecord& record : dataset.records)
      pairs_.push_back({first_feature(record.recording, spec),
                        bridged(record.recording.channel(dataset.target))});
    spoiled_.resize(pairs_.size());
  }

  std::vector<Finding> run() {
    check_length();
    if (has_failed()) return std::move(findings_);  // too short: nothing else can be said
    check_missing();
    check_constant();
    check_saturation();
    check_frozen();
    check_resolution();
    check_units();
    check_sign_flips();
    check_gaps();
    check_delay();
    check_sign();
    check_change();
    check_excitation();
    check_offsets();
    check_leak();
    check_range();
    return std::move(findings_);
  }

 private:
  void add(Verdict verdict, std::string check, std::string recording, std::string message,
           std::string advice = {}) {
    findings_.push_back(
        {verdict, std::move(check), std::move(recording), std::move(message), std::move(advice)});
  }

  /// Adds a PASS unless the check that ran meanwhile found something.
  void pass_unless_found(const std::string& check, std::string message,
                         const std::function<void()>& body) {
    const std::size_t before = findings_.size();
    body();
    if (findings_.size() == before) add(Verdict::pass, check, "", std::move(message));
  }

  template <class Body>
  void for_each_channel(Body&& body) {
    for (const DatasetRecord& record : dataset_.records)
      for (const std::string& channel : channels_)
        body(record.recording, record.recording.channel(channel));
  }

  /// As above, without what stands still by design.
  template <class Body>
  void for_each_moving_channel(Body&& body) {
    for (std::size_t r = 0; r < pairs_.size(); ++r) {
      const Recording& recording = dataset_.records[r].recording;
      for (const std::string& channel : channels_)
        if (!stands_still(r, channel)) body(r, recording, recording.channel(channel));
    }
  }

  // A locked output: next to the deflection the channel does not move, and the torque follows that
  // deflection, as it would not if a sensor were dead while its side moved.
  [[nodiscard]] bool stands_still(std::size_t r, const std::string& name) const {
    const Recording& recording = dataset_.records[r].recording;
    if (sources_.size() < 2 || name == dataset_.target || is_condition(recording, name) ||
        std::ranges::find(sources_, name) == sources_.end())
      return false;
    const Pair& pair = pairs_[r];
    return extent_of(recording.channel(name).values).width() <
               kStandstillShare * extent_of(pair.input).width() &&
           std::abs(correlation(pair.input, pair.target)) > kFollows;
  }

  [[nodiscard]] static bool is_condition(const Recording& recording, const std::string& channel) {
    return std::ranges::find(recording.conditions(), channel) != recording.conditions().end();
  }

  void check_length() {
    pass_unless_found(
        "length",
        fmt::format("{} recordings at {:g} Hz", dataset_.records.size(), dataset_.sample_rate_Hz()),
        [&] {
          for (const DatasetRecord& record : dataset_.records)
            if (record.recording.size() < kFewSamples)
              add(Verdict::fail, "length", record.recording.name(),
                  fmt::format("{} samples", record.recording.size()),
                  fmt::format("Record at least {} samples.", kFewSamples));
        });
  }

  void check_missing() {
    pass_unless_found("missing values", "none", [&] {
      for_each_channel([&](const Recording& recording, const Channel& channel) {
        const auto missing = static_cast<std::size_t>(
            std::ranges::count_if(channel.values, [](double v) { return !is_finite(v); }));
        if (missing == 0) return;
        const bool is_target = channel.name == dataset_.target;
        const double share =
            static_cast<double>(missing) / static_cast<double>(channel.values.size());
        add(is_target && share < 1.0 ? Verdict::warn : Verdict::fail, "missing values",
            recording.name(),
            fmt::format("{}: {} of {} samples are NaN", channel.name, missing,
                        channel.values.size()),
            is_target
                ? "They are neither trained on nor scored."
                : fmt::format("An input may not be missing. If it is a slower sensor: hold: [{}]",
                              channel.name));
      });
    });
  }

  void check_constant() {
    pass_unless_found("constant channels", "every input and the target move", [&] {
      for_each_moving_channel([&](std::size_t, const Recording& recording, const Channel& channel) {
        if (is_condition(recording, channel.name) || extent_of(channel.values).width() > 0.0)
          return;
        add(Verdict::fail, "constant channels", recording.name(),
            fmt::format("{} never changes from {:g}", channel.name, channel.values.front()),
            "Is the sensor connected? If it is a condition of the record, name it under "
            "conditions: in a manifest.");
      });
      for (std::size_t r = 0; r < pairs_.size(); ++r)
        for (const std::string& name : channels_)
          if (stands_still(r, name))
            add(Verdict::pass, "constant channels", dataset_.records[r].recording.name(),
                fmt::format("{} stands still, as behind a lock, and {} follows {}", name,
                            dataset_.target, spec_.inputs.front()));
    });
  }

  // A range limit shows as many samples in runs exactly at the extreme value.
  void check_saturation() {
    pass_unless_found("saturation", "no channel rests at its extreme value", [&] {
      for_each_moving_channel([&](std::size_t, const Recording& recording, const Channel& channel) {
        const Extent span = extent_of(channel.values);
        if (!(span.width() > 0.0)) return;
        // A motion that turns within the last of few codes rests there, too.
        const double by_code = kCodesAtATurn * finest_step(channel.values) / span.width();
        for (const double extreme : {span.lowest, span.highest}) {
          const auto count = static_cast<double>(std::ranges::count(channel.values, extreme));
          const double share = count / static_cast<double>(channel.values.size());
          if (share < std::max(kSaturatedShare, by_code) ||
              approaches_gradually(channel, extreme, span))
            continue;
          add(Verdict::warn, "saturation", recording.name(),
              fmt::format("{}: {:.1f} % of the samples are exactly {:g}", channel.name,
                          100.0 * share, extreme),
              "Is that the sensor's limit? Then cut those parts out, or use a sensor of larger "
              "range.");
        }
      });
    });
  }

  // A signal that turns round at its extreme spends time near it too; one that is cut off sits
  // exactly on it.
  [[nodiscard]] static bool approaches_gradually(const Channel& channel, double extreme,
                                                 const Extent& span) {
    std::size_t at_extreme = 0;
    std::size_t near_extreme = 0;
    for (const double value : channel.values) {
      if (value == extreme) ++at_extreme;
      if (std::abs(value - extreme) < 0.01 * span.width()) ++near_extreme;
    }
    return 2 * at_extreme < near_extreme;
  }

  // A sensor that tells one number while the others move on is stuck; at a standstill it is right.
  void check_frozen() {
    pass_unless_found("frozen sensors", "none rests while the others move", [&] {
      for_each_moving_channel([&](std::size_t r, const Recording& recording,
                                  const Channel& channel) {
        if (is_condition(recording, channel.name)) return;
        const auto shortest =
            static_cast<std::size_t>(0.5 * kFrozen_s * recording.sample_rate_Hz());
        const std::vector<Rest> rests = rests_of(channel, std::max<std::size_t>(shortest, 2));
        if (rests.empty()) return;
        const std::vector<Channel> others = others_of(r, channel.name);
        for (const Rest& rest : rests) {
          const auto samples = static_cast<double>(rest.length());
          const double duration_s = samples / recording.sample_rate_Hz();
          // A silent sensor delivers nothing where it should have delivered many times.
          if (duration_s < kFrozen_s || share_fresh(channel) * samples < kFrozenDeliveries ||
              rest.length() == channel.values.size())
            return;
          for (const Channel& other : others) {
            const double moved = share_moved(other, rest);
            if ((moved < kMovedMeanwhile && !stands_out(channel, rests, rest, other, moved)))
              continue;
            add(Verdict::warn, "frozen sensors", recording.name(),
                fmt::format("{} tells {:g} for {:.3g} s from t = {:.4g} s, while {} moves through "
                            "{:.{}f} % of its range",
                            channel.name, channel.values[rest.begin], duration_s,
                            recording.time_s(rest.begin), other.name, 100.0 * moved,
                            moved < 0.1 ? 1 : 0),
                "Did its bus stall? Cut that part out: a model would learn the stall.");
            leave_out(r, rest);
            return;
          }
        }
      });
    });
  }

  /// What should move where a channel does; the target goes with the first input rather than with
  /// what that is made of.
  [[nodiscard]] std::vector<Channel> others_of(std::size_t r, const std::string& name) const {
    std::vector<Channel> others;
    for (const std::string& each : channels_)
      if (each != name) others.push_back(dataset_.records[r].recording.channel(each));
    if (name == dataset_.target && sources_.size() > 1)
      others.push_back({.name = spec_.inputs.front(), .values = pairs_[r].input});
    return others;
  }

  /// What a stall tells of the other checks' questions is wrong.
  void leave_out(std::size_t r, const Rest& rest) {
    for (std::size_t i = rest.begin; i < std::min(rest.end + 1, pairs_[r].input.size()); ++i)
      pairs_[r].input[i] = kNotMeasured;
    stalls_.emplace_back(r, rest);
  }

  [[nodiscard]] bool is_end_of_stall(std::size_t r, std::size_t sample) const {
    return std::ranges::any_of(stalls_, [&](const auto& stall) {
      return stall.first == r && sample >= stall.second.end && sample <= stall.second.end + 1;
    });
  }

  // A stall while little moves: the channel goes with another everywhere else, and nowhere else did it
  // stay behind like that, as a joint does that sticks at every turn.
  [[nodiscard]] static bool stands_out(const Channel& channel, const std::vector<Rest>& rests,
                                       const Rest& rest, const Channel& other, double moved) {
    return moved >= kMovedALittle &&
           moved * extent_of(channel.values).width() >= kFewCodes * finest_step(channel.values) &&
           std::abs(correlation(channel.values, other.values)) >= kTogether &&
           std::ranges::none_of(rests, [&](const Rest& each) {
             return !(each == rest) && 2 * each.length() >= rest.length() &&
                    2.0 * share_moved(other, each) >= moved;
           });
  }

  // What the first input is made of may move through much more than it does: codes of a gear's angle
  // are to be judged by the deflection.
  void check_resolution() {
    const auto unit_of = [](const std::string& name) {
      const auto parts = split_channel_name(name);
      return parts ? parts->unit->si_suffix : std::string_view();
    };
    pass_unless_found("resolution", "no sensor's codes are coarse", [&] {
      for (std::size_t r = 0; r < pairs_.size(); ++r) {
        const Recording& recording = dataset_.records[r].recording;
        const double first_input = extent_of(pairs_[r].input).width();
        for (const std::string& name : channels_) {
          if (is_condition(recording, name) || stands_still(r, name)) continue;
          const std::vector<double>& values = recording.channel(name).values;
          double range = extent_of(values).width();
          if (first_input > 0.0 && unit_of(name) == unit_of(channels_.front()) &&
              name != dataset_.target)
            range = std::min(range, first_input);
          const double code = finest_step(values);
          if (!(range > 0.0) || code < kCoarseShare * range) continue;
          add(Verdict::warn, "resolution", recording.name(),
              fmt::format(
                  "{} tells in steps of {:.3g}: {:.0f} of them are all that {} moves through", name,
                  code, range / code, range == first_input ? spec_.inputs.front() : name),
              "Has the sensor lost bits, or its log digits? A model cannot see finer.");
        }
      }
    });
  }

  // The sensors of both sides of a spring turn alike, so one of them in another unit turns by a unit's factor as
  // much; and records of one joint have one stiffness.
  void check_units() {
    pass_unless_found("units", "the records agree", [&] {
      for (std::size_t r = 0; r < pairs_.size(); ++r) check_units_within(r);
      if (pairs_.size() < 2) return;
      std::vector<double> slopes;
      for (std::size_t r = 0; r < pairs_.size(); ++r)
        slopes.push_back(is_clear(r) ? std::abs(line_through(pairs_[r]).slope) : 0.0);
      const std::size_t usual = usual_slope(slopes);
      const auto near_usual = std::ranges::count_if(slopes, [&](double slope) {
        return slope > 0.0 && ratio_of(slope, slopes[usual]) < kSlopeRatio;
      });
      for (std::size_t r = 0; r < pairs_.size(); ++r)
        if (slopes[r] > 0.0 && ratio_of(slopes[r], slopes[usual]) >= kSlopeRatio)
          report_slope(r, slopes[r], usual, slopes[usual], near_usual > 1);
    });
  }

  void report_slope(std::size_t r, double slope, std::size_t usual, double usual_slope,
                    bool is_majority) {
    const std::string_view mistake = unit_mistake(slope / usual_slope);
    const Recording& other = dataset_.records[usual].recording;
    if (mistake.empty() && !other.conditions().empty()) return;  // the condition explains it
    const double torque_ratio =
        extent_of(pairs_[r].target).width() / extent_of(pairs_[usual].target).width();
    const bool by_torque =
        std::abs(std::log(torque_ratio)) > 0.5 * std::log(ratio_of(slope, usual_slope));
    spoiled_[r] = 1;
    const std::string& own = dataset_.records[r].recording.name();
    add(mistake.empty() ? Verdict::warn : Verdict::fail, "units",
        is_majority ? own : own + " or " + other.name(),
        fmt::format("the slope of {} over {} is {:.4g} times {} in {} than in {}{}",
                    dataset_.target, spec_.inputs.front(), ratio_of(slope, usual_slope),
                    slope > usual_slope ? "larger" : "smaller", own,
                    is_majority ? "the other records, as in " : "", other.name()),
        mistake.empty()
            ? "Another spring, or another unit? Records of one joint have one stiffness."
            : fmt::format(
                  "That is the factor between {}: look at the unit of {} in {}, and say it in "
                  "the column's name or with unit: in a mapping.",
                  mistake, by_torque ? dataset_.target : spec_.inputs.front(),
                  is_majority ? "this record"
                              : "both records (they alone cannot tell which is right)"));
  }

  /// The record whose slope most others share; the first of equals.
  [[nodiscard]] static std::size_t usual_slope(const std::vector<double>& slopes) {
    const auto company = [&](double slope) {
      return slope > 0.0
                 ? std::ranges::count_if(slopes,
                                         [&](double each) {
                                           return each > 0.0 && ratio_of(each, slope) < kSlopeRatio;
                                         })
                 : 0;
    };
    return static_cast<std::size_t>(std::ranges::max_element(slopes, {}, company) - slopes.begin());
  }

  [[nodiscard]] static double ratio_of(double a, double b) { return std::max(a / b, b / a); }

  [[nodiscard]] bool is_clear(std::size_t r) const {
    return spoiled_[r] == 0 &&
           std::abs(correlation(pairs_[r].input, pairs_[r].target)) > kClearCorrelation;
  }

  void check_units_within(std::size_t r) {
    const Recording& recording = dataset_.records[r].recording;
    if (order_of_difference(r) == 0) return;
    const Pair sides{recording.channel(sources_[0]).values, recording.channel(sources_[1]).values};
    if (correlation(sides.input, sides.target) < kOneMotion) return;
    const double slope = line_through(sides).slope;
    const std::string_view mistake = unit_mistake(slope);
    if (mistake.empty()) return;
    spoiled_[r] = 1;
    add(Verdict::fail, "units", recording.name(),
        fmt::format("{} moves {:.4g} times as far as {}", slope > 1.0 ? sources_[1] : sources_[0],
                    std::max(slope, 1.0 / slope), slope > 1.0 ? sources_[0] : sources_[1]),
        fmt::format("That is the factor between {}: say the column's unit in its name or with "
                    "unit: in a mapping.",
                    mistake));
  }

  void check_sign_flips() {
    flips_.resize(pairs_.size());
    for (std::size_t r = 0; r < pairs_.size(); ++r)
      if (const Jump jump = largest_jump(pairs_[r].input); !stands_out(jump, pairs_[r].input))
        flips_[r] = find_sign_flip(pairs_[r]);
  }

  [[nodiscard]] static bool stands_out(const Jump& jump, const std::vector<double>& values) {
    return jump.height > 0.0 && jump.height >= kJumpShare * extent_of(values).width() &&
           jump.height >= kJumpOverOthers * jump.next_height;
  }

  void check_gaps() {
    pass_unless_found("gaps", "no jump", [&] {
      for (std::size_t r = 0; r < pairs_.size(); ++r) {
        check_jump_of_input(r);
        const Recording& recording = dataset_.records[r].recording;
        for (const std::string& name : channels_) {
          const Channel& channel = recording.channel(name);
          if (is_condition(recording, name) || stands_still(r, name)) continue;
          const std::vector<double> values = bridged(channel);
          const Jump jump = largest_jump(values);
          if (!stands_out(jump, values) || is_end_of_stall(r, jump.sample) ||
              is_sign_flip(r, name, jump) || (spoiled_[r] != 0 && is_source(name)))
            continue;
          add(Verdict::warn, "gaps", recording.name(), jump_text(recording, name, jump),
              "Were samples lost there, or did the sensor slip? Cut the record in two.");
        }
      }
    });
  }

  // A step that is small for an angle can be all that the deflection between two of them ever does.
  void check_jump_of_input(std::size_t r) {
    const std::vector<double>& input = pairs_[r].input;
    const Jump jump = largest_jump(input);
    if (sources_.size() < 2 || !stands_out(jump, input) ||
        jump.height < kInputJumpShare * extent_of(input).width())
      return;
    const Recording& recording = dataset_.records[r].recording;
    spoiled_[r] = 1;
    add(Verdict::warn, "gaps", recording.name(),
        jump_text(recording, spec_.inputs.front(), jump) +
            fmt::format("; it comes from {}", source_of(recording, jump)),
        "Did that sensor slip, lose counts or samples, or did a part break? Cut the record in two "
        "there, and take each part's zero anew.");
  }

  [[nodiscard]] static std::string jump_text(const Recording& recording, const std::string& name,
                                             const Jump& jump) {
    return fmt::format("{} jumps by {:.3g} at t = {:.4g} s, {} anywhere else", name, jump.height,
                       recording.time_s(jump.sample),
                       jump.next_height > 0.0
                           ? fmt::format("{:.0f} times more than", jump.height / jump.next_height)
                           : "and does not move");
  }

  /// The channel that steps most beyond its steps next to a jump of the first input.
  [[nodiscard]] const std::string& source_of(const Recording& recording, const Jump& jump) const {
    const auto excess = [&](const std::string& name) {
      const std::vector<double>& values = recording.channel(name).values;
      const auto step = [&](std::size_t i) {
        return i > 0 && i < values.size() ? values[i] - values[i - 1] : 0.0;
      };
      return std::abs(step(jump.sample) - 0.5 * (step(jump.sample - 1) + step(jump.sample + 1)));
    };
    return *std::ranges::max_element(sources_, {}, excess);
  }

  [[nodiscard]] bool is_source(const std::string& name) const {
    return std::ranges::find(sources_, name) != sources_.end();
  }

  [[nodiscard]] bool is_sign_flip(std::size_t r, const std::string& name, const Jump& jump) const {
    const double apart_s =
        flips_[r]
            ? std::abs(static_cast<double>(jump.sample) - static_cast<double>(flips_[r]->sample)) /
                  dataset_.sample_rate_Hz()
            : kNotMeasured;
    return name == dataset_.target && apart_s < kSameMoment_s;
  }

  // Friction makes the torque lead the deflection, so a bare cross-correlation would call every
  // hysteretic spring early. The delay is therefore the shift at which spring and friction together
  // explain the torque best.
  void check_delay() {
    const double rate = dataset_.sample_rate_Hz();
    const auto longest = static_cast<std::ptrdiff_t>(std::round(kLongestDelay_s * rate));
    pass_unless_found(
        "delay", fmt::format("{} and {} move together", spec_.inputs.front(), dataset_.target),
        [&] {
          for (std::size_t r = 0; r < pairs_.size(); ++r) {
            const ShiftedFit fit(pairs_[r], rate);
            const double at_zero = fit.unexplained(0);
            std::ptrdiff_t best = 0;
            double least = at_zero;
            for (std::ptrdiff_t lag = -longest; lag <= longest; ++lag)
              if (const double share = fit.unexplained(lag); share < least)
                best = lag, least = share;
            if (least > kExplainsLittle || least > kDelayGain * at_zero) continue;
            const double delay_ms = 1e3 * static_cast<double>(best) / rate;
            add(Verdict::warn, "delay", dataset_.records[r].recording.name(),
                fmt::format(
                    "{} comes {:.1f} ms {} {} (unexplained {:.2f} % there, {:.2f} % without shift)",
                    dataset_.target, std::abs(delay_ms), delay_ms > 0 ? "after" : "before",
                    spec_.inputs.front(), 100.0 * least, 100.0 * at_zero),
                delay_ms > 0 && best < longest
                    ? fmt::format("Mapping line that takes it out: latency: {{{}: {:.1f}ms}}",
                                  dataset_.target, delay_ms)
                : best == longest
                    ? "The search ends there: look at the loggers' clocks."
                    : "Look at the loggers' clocks: a torque cannot precede its deflection.");
          }
        });
  }

  void check_sign() {
    pass_unless_found(
        "sign", fmt::format("{} rises with {}", dataset_.target, spec_.inputs.front()), [&] {
          std::vector<double> values;
          for (const Pair& pair : pairs_) values.push_back(correlation(pair.input, pair.target));
          const std::string flipped = flipped_source(values);
          const bool some_rise =
              std::ranges::any_of(values, [](double value) { return value > kClearCorrelation; });
          for (std::size_t r = 0; r < values.size(); ++r) {
            const std::string& recording = dataset_.records[r].recording.name();
            if (flips_[r]) {
              report_flip(r);
            } else if (!flipped.empty() && values[r] < kTogether) {
              add(Verdict::fail, "sign", recording,
                  fmt::format(
                      "{} does not follow {} (correlation {:.3f}), but would with {} turned "
                      "round",
                      dataset_.target, spec_.inputs.front(), values[r], flipped),
                  fmt::format(
                      "Mapping: channels: {{{0}: {{from: ..., sign: -1}}}}, with the column of {0}",
                      flipped));
            } else if (values[r] < -kClearCorrelation) {
              add(Verdict::fail, "sign", recording,
                  fmt::format("{} falls with {} (correlation {:.3f})", dataset_.target,
                              spec_.inputs.front(), values[r]),
                  some_rise
                      ? fmt::format("In other records it rises: in this one {} has the wrong "
                                    "sign, or every angle has. Give it a mapping with sign: -1 "
                                    "(channels: {{{}: {{from: ..., sign: -1}}}})",
                                    dataset_.target, dataset_.target)
                      : fmt::format("Mapping: flip one of them with sign: -1 (channels: "
                                    "{{{}: {{from: ..., sign: -1}}}})",
                                    dataset_.target));
            } else if (values[r] < kClearCorrelation) {
              add(Verdict::warn, "sign", recording,
                  fmt::format("{} hardly follows {} (correlation {:.3f})", dataset_.target,
                              spec_.inputs.front(), values[r]),
                  "Is this the channel that the torque comes from?");
            }
          }
        });
  }

  void report_flip(std::size_t r) {
    const Recording& recording = dataset_.records[r].recording;
    spoiled_[r] = 1;
    add(Verdict::fail, "sign", recording.name(),
        fmt::format("{0} {1} with {2} until t = {3:.4g} s and {4} with it from there (correlation "
                    "{5:.3f}, then {6:.3f})",
                    dataset_.target, flips_[r]->before > 0.0 ? "rises" : "falls",
                    spec_.inputs.front(), recording.time_s(flips_[r]->sample),
                    flips_[r]->after > 0.0 ? "rises" : "falls", flips_[r]->before,
                    flips_[r]->after),
        "A sign changed while recording: cut the record in two there, and turn one part round.");
  }

  /// The one of two angles with which, turned round, the torque follows their difference in every
  /// record, while it does not as they are; empty if there is none.
  [[nodiscard]] std::string flipped_source(const std::vector<double>& values) const {
    if (std::ranges::all_of(values, [](double v) { return v > kTogether; })) return {};
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
    // Two sides of a spring turn alike: their difference is small beside their sum.
    if (narrowest > kNarrow) return {};
    return is_first_minuend == (direction > 0.0) ? sources_[1] : sources_[0];
  }

  /// 1 if the first input is the first of its two sources less the second, -1 the other way round, 0
  /// if it is no difference.
  [[nodiscard]] int order_of_difference(std::size_t r) const {
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

  // What no jump shows: a zero that creeps away, a spring that breaks.
  void check_change() {
    pass_unless_found("change", "each record is the same early and late", [&] {
      for (std::size_t r = 0; r < pairs_.size(); ++r) {
        if (spoiled_[r] != 0) continue;
        const auto change = find_relation_change(pairs_[r], dataset_.sample_rate_Hz());
        if (!change) continue;
        const Recording& recording = dataset_.records[r].recording;
        const std::string when =
            change->is_gradual
                ? std::string("little by little from beginning to end")
                : fmt::format("at about t = {:.3g} s", recording.time_s(change->sample));
        add(Verdict::warn, "change", recording.name(),
            change->is_of_slope
                ? fmt::format("at equal {} and speed the slope of {} changes to {:.2g} times, {}",
                              spec_.inputs.front(), dataset_.target, change->slope_ratio, when)
                : fmt::format("at equal {} and speed {} changes by {:.3g} {}, {}",
                              spec_.inputs.front(), dataset_.target, change->offset,
                              unit_label(dataset_.target), when),
            "Did a sensor's zero slip or drift, a part break or creep? Look at the record there; a "
            "model would learn the mean of before and after.");
      }
    });
  }

  // Hysteresis shows only at reversals; a rate that never changes cannot be told from a constant.
  void check_excitation() {
    std::size_t reversals = 0;
    Extent speeds;
    const auto window = static_cast<std::size_t>(
        std::max(1.0, std::round(kSpeedHalfWindow_s * dataset_.sample_rate_Hz())));
    for (std::size_t r = 0; r < pairs_.size(); ++r) {
      if (!has_segment(dataset_.records[r], Role::train)) continue;
      reversals += count_reversals(pairs_[r].input);
      for (const double speed : typical_speeds(movement(pairs_[r].input, window)))
        speeds.include(speed);
    }
    if (speeds.width() < 0.0) return;  // nothing to train on: another check says so
    if (reversals < kFewReversals)
      add(Verdict::warn, "excitation", "",
          fmt::format("{} reversals of {} in training", reversals, spec_.inputs.front()),
          "Hysteresis shows only where the motion turns back: load and unload several times.");
    if (speeds.highest < kSpeedRatio * speeds.lowest)
      add(Verdict::warn, "excitation", "", "the training data move at one speed only",
          "A model cannot learn what speed does; add recordings that are twice as slow and twice "
          "as fast.");
    if (findings_.empty() || findings_.back().check != "excitation")
      add(Verdict::pass, "excitation", "",
          fmt::format("{} reversals, several speeds in training", reversals));
  }

  // Two records of one joint whose torques differ by a constant at the same deflection disagree
  // about zero.
  void check_offsets() {
    pass_unless_found("offsets", "the records agree about zero", [&] {
      double slope = 0.0;
      double spread = 0.0;
      std::vector<Line> lines;
      std::vector<std::size_t> records;
      for (std::size_t r = 0; r < pairs_.size(); ++r) {
        if (spoiled_[r] != 0) continue;
        records.push_back(r);
        lines.push_back(line_through(pairs_[r]));
        slope += lines.back().slope;
        spread = std::max(spread, extent_of(pairs_[r].target).width());
      }
      if (lines.size() < 2) return;
      slope /= static_cast<double>(lines.size());
      std::vector<double> offsets;
      offsets.reserve(lines.size());
      for (const Line& line : lines) offsets.push_back(line.mean_target - slope * line.mean_input);
      std::vector<double> sorted = offsets;
      std::ranges::sort(sorted);
      const double median = sorted[sorted.size() / 2];
      for (std::size_t r = 0; r < offsets.size(); ++r)
        if (std::abs(offsets[r] - median) > kOffsetShare * spread)
          add(Verdict::warn, "offsets", dataset_.records[records[r]].recording.name(),
              fmt::format("zero lies {:.3g} {} away from the other records'", offsets[r] - median,
                          unit_label(dataset_.target)),
              "Take each record's own zero in the mapping: zero: [{channel: ..., first: 0.1s}]");
    });
  }

  void check_leak() {
    const std::string leak = find_leak(dataset_, spec_);
    if (leak.empty()) {
      add(Verdict::pass, "leak", "", "the target was not computed from an input");
    } else {
      add(Verdict::fail, "leak", "",
          leak.starts_with(kTruthPrefix)
              ? fmt::format("{} is truth that no sensor sees", leak)
              : fmt::format("{} was computed from {}", dataset_.target, leak),
          "Leave it out of --inputs: a model would learn the formula, not the spring.");
    }
  }

  // The guard acts on features, so features are compared; what cannot be learned from at all has failed above.
  void check_range() {
    if (!dataset_.has_role(Role::test) || !dataset_.has_role(Role::train) || has_failed()) return;
    const FeatureRanges trained = feature_ranges(training_data(dataset_, spec_, Role::train));
    const FeatureRanges tested = feature_ranges(training_data(dataset_, spec_, Role::test));
    pass_unless_found("range", "the test data lie inside the training range", [&] {
      for (std::size_t j = 0; j < spec_.inputs.size(); ++j) {
        const double slack = trained.margin * (trained.highest[j] - trained.lowest[j]);
        if (tested.lowest[j] >= trained.lowest[j] - slack &&
            tested.highest[j] <= trained.highest[j] + slack)
          continue;
        add(Verdict::warn, "range", "",
            fmt::format("{}: tested on {:.4g} to {:.4g}, trained on {:.4g} to {:.4g}",
                        spec_.inputs[j], tested.lowest[j], tested.highest[j], trained.lowest[j],
                        trained.highest[j]),
            "Models guess out there: the range guard answers with its linear fallback.");
      }
    });
  }

  [[nodiscard]] bool has_failed() const {
    return std::ranges::any_of(findings_, [](const Finding& finding) {
      return finding.verdict == Verdict::fail && finding.check != "sign" && finding.check != "leak";
    });
  }

  static constexpr std::size_t kFewSamples = 100;
  static constexpr double kSaturatedShare = 0.005;
  static constexpr double kCodesAtATurn = 2.0;
  static constexpr double kFrozen_s = 0.2;
  static constexpr double kFrozenDeliveries = 10.0;
  static constexpr double kMovedMeanwhile = 0.4;  ///< of another channel's range
  static constexpr double kMovedALittle = 0.02;
  static constexpr double kTogether = 0.9;  ///< correlation
  static constexpr double kFewCodes = 5.0;
  static constexpr double kCoarseShare = 0.02;  ///< of the range: 50 codes
  static constexpr double kJumpShare = 0.02;
  static constexpr double kJumpOverOthers = 5.0;
  static constexpr double kInputJumpShare = 0.05;
  static constexpr double kSameMoment_s = 0.05;
  static constexpr double kStandstillShare = 0.02;  ///< of the first input's range
  static constexpr double kFollows = 0.8;           ///< correlation
  static constexpr double kOneMotion = 0.99;        ///< correlation
  static constexpr double kNarrow = 0.5;
  static constexpr double kSlopeRatio = 5.0;
  static constexpr double kLongestDelay_s = 0.1;
  static constexpr double kExplainsLittle =
      0.2;  ///< of the variance: a fit that leaves more tells no delay
  static constexpr double kDelayGain = 0.7;  ///< of what is unexplained without shift
  static constexpr std::size_t kFewReversals = 3;
  static constexpr double kSpeedHalfWindow_s = 0.05;
  static constexpr double kSpeedRatio = 2.0;
  static constexpr double kOffsetShare = 0.05;

  const Dataset& dataset_;
  const FeatureSpec& spec_;
  FeaturePipeline pipeline_;
  std::vector<std::string> channels_;  ///< raw inputs and the target
  std::vector<std::string> sources_;   ///< what the first input is made of
  std::vector<Pair> pairs_;
  std::vector<std::uint8_t> spoiled_;  ///< by record: its relation is known to be wrong
  std::vector<std::pair<std::size_t, Rest>> stalls_;  ///< record, samples
  std::vector<std::optional<SignFlip>> flips_;        ///< by record
  std::vector<Finding> findings_;
};

}  // namespace

std::string_view name(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::pass: return "PASS";
    case Verdict::warn: return "WARN";
    case Verdict::fail: return "FAIL";
  }
  return "unknown";
}

std::string unit_doubt(const Recording& recording, const EstimatorSettings& trained) {
  if (trained.fallback.slope.empty() || !recording.has(trained.target)) return {};
  const Pair pair{first_feature(recording, trained.features),
                  bridged(recording.channel(trained.target))};
  if (std::abs(correlation(pair.input, pair.target)) < kClearCorrelation) return {};
  return std::string(unit_mistake(std::abs(line_through(pair).slope / trained.fallback.slope[0])));
}

std::vector<Finding> check_dataset(const Dataset& dataset, const FeatureSpec& spec) {
  return Checker(dataset, spec).run();
}

}  // namespace torsio
