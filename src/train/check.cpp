#include "torsio/train/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "torsio/core/not_measured.hpp"
#include "torsio/core/units.hpp"
#include "torsio/train/guards.hpp"
#include "torsio/train/inputs.hpp"
#include "torsio/train/training_data.hpp"
#include "train/signal_pair.hpp"

namespace torsio {
namespace {

bool has_segment(const DatasetRecord& record, Role role) {
  return std::ranges::any_of(record.segments,
                             [&](const Segment& segment) { return segment.role == role; });
}

/// Runs the checks one after the other and collects what they find.
class Checker {
 public:
  Checker(const Dataset& dataset, const FeatureSpec& spec)
      : dataset_(dataset), spec_(spec), pipeline_(spec, dataset.sample_rate_Hz()) {
    channels_ = pipeline_.raw_inputs();
    channels_.push_back(dataset.target);
    for (const DatasetRecord& record : dataset.records)
      pairs_.push_back({first_feature(record.recording, spec),
                        bridged(record.recording.channel(dataset.target))});
  }

  std::vector<Finding> run() {
    check_length();
    if (has_failed()) return std::move(findings_);  // too short: nothing else can be said
    check_missing();
    check_constant();
    check_saturation();
    check_frozen();
    check_resolution();
    check_gaps();
    check_delay();
    check_sign();
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
      for_each_channel([&](const Recording& recording, const Channel& channel) {
        if (is_condition(recording, channel.name) || extent_of(channel.values).width() > 0.0)
          return;
        add(Verdict::fail, "constant channels", recording.name(),
            fmt::format("{} never changes from {:g}", channel.name, channel.values.front()),
            "Is the sensor connected? If it is a condition of the record, name it under "
            "conditions: in a manifest.");
      });
    });
  }

  // A range limit shows as many samples in runs exactly at the extreme value.
  void check_saturation() {
    pass_unless_found("saturation", "no channel rests at its extreme value", [&] {
      for_each_channel([&](const Recording& recording, const Channel& channel) {
        const Extent span = extent_of(channel.values);
        if (!(span.width() > 0.0)) return;
        for (const double extreme : {span.lowest, span.highest}) {
          const auto count = static_cast<double>(std::ranges::count(channel.values, extreme));
          const double share = count / static_cast<double>(channel.values.size());
          if (share < kSaturatedShare || approaches_gradually(channel, extreme, span)) continue;
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
      for_each_channel([&](const Recording& recording, const Channel& channel) {
        if (is_condition(recording, channel.name)) return;
        const auto shortest =
            static_cast<std::size_t>(0.5 * kFrozen_s * recording.sample_rate_Hz());
        const std::vector<Rest> rests = rests_of(channel, std::max<std::size_t>(shortest, 2));
        for (const Rest& rest : rests) {
          const auto samples = static_cast<double>(rest.length());
          const double duration_s = samples / recording.sample_rate_Hz();
          // A silent sensor delivers nothing where it should have delivered many times.
          if (duration_s < kFrozen_s || share_fresh(channel) * samples < kFrozenDeliveries ||
              rest.length() == channel.values.size())
            return;
          for (const std::string& name : channels_) {
            const Channel& other = recording.channel(name);
            const double moved = share_moved(other, rest);
            if (name == channel.name ||
                (moved < kMovedMeanwhile && !is_odd_one_out(rest, rests, channel, other)))
              continue;
            add(Verdict::warn, "frozen sensors", recording.name(),
                fmt::format("{} tells {:g} for {:.3g} s from t = {:.4g} s, while {} moves through "
                            "{:.{}f} % of its range",
                            channel.name, channel.values[rest.begin], duration_s,
                            recording.time_s(rest.begin), name, 100.0 * moved, moved < 0.1 ? 1 : 0),
                "Did its bus stall? Cut that part out: a model would learn the stall.");
            return;
          }
        }
      });
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
          if (is_condition(recording, name)) continue;
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

  void check_gaps() {
    pass_unless_found("gaps", "no jump", [&] {
      for_each_channel([&](const Recording& recording, const Channel& channel) {
        if (is_condition(recording, channel.name)) return;
        const std::vector<double> values = bridged(channel);
        const Jump jump = largest_jump(values);
        if (!(jump.height > 0.0) || jump.height < kJumpShare * extent_of(values).width() ||
            jump.height < kJumpOverOthers * jump.next_height)
          return;
        add(Verdict::warn, "gaps", recording.name(),
            fmt::format("{} jumps by {:.3g} at t = {:.4g} s, {} anywhere else", channel.name,
                        jump.height, recording.time_s(jump.sample),
                        jump.next_height > 0.0
                            ? fmt::format("{:.0f} times more than", jump.height / jump.next_height)
                            : "and does not move"),
            "Were samples lost there? Cut the record in two, or resample it with --rate.");
      });
    });
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
    pass_unless_found("sign",
                      fmt::format("{} rises with {}", dataset_.target, spec_.inputs.front()), [&] {
                        for (std::size_t r = 0; r < pairs_.size(); ++r) {
                          const double value = correlation(pairs_[r].input, pairs_[r].target);
                          const std::string& recording = dataset_.records[r].recording.name();
                          if (value < -kClearCorrelation) {
                            add(Verdict::fail, "sign", recording,
                                fmt::format("{} falls with {} (correlation {:.3f})",
                                            dataset_.target, spec_.inputs.front(), value),
                                fmt::format("Mapping: flip one of them with sign: -1 (channels: "
                                            "{{{}: {{from: ..., sign: -1}}}})",
                                            dataset_.target));
                          } else if (value < kClearCorrelation) {
                            add(Verdict::warn, "sign", recording,
                                fmt::format("{} hardly follows {} (correlation {:.3f})",
                                            dataset_.target, spec_.inputs.front(), value),
                                "Is this the channel that the torque comes from?");
                          }
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
      for (const Pair& pair : pairs_) {
        lines.push_back(line_through(pair));
        slope += lines.back().slope / static_cast<double>(pairs_.size());
        spread = std::max(spread, extent_of(pair.target).width());
      }
      if (lines.size() < 2) return;
      std::vector<double> offsets;
      offsets.reserve(lines.size());
      for (const Line& line : lines) offsets.push_back(line.mean_target - slope * line.mean_input);
      std::vector<double> sorted = offsets;
      std::ranges::sort(sorted);
      const double median = sorted[sorted.size() / 2];
      for (std::size_t r = 0; r < offsets.size(); ++r)
        if (std::abs(offsets[r] - median) > kOffsetShare * spread)
          add(Verdict::warn, "offsets", dataset_.records[r].recording.name(),
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
  static constexpr double kFrozen_s = 0.2;
  static constexpr double kFrozenDeliveries = 10.0;
  static constexpr double kMovedMeanwhile = 0.4;  ///< of another channel's range
  static constexpr double kCoarseShare = 0.02;    ///< of the range: 50 codes
  static constexpr double kJumpShare = 0.02;
  static constexpr double kJumpOverOthers = 5.0;
  static constexpr double kLongestDelay_s = 0.1;
  static constexpr double kClearCorrelation = 0.5;
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
  std::vector<Pair> pairs_;
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

std::vector<Finding> check_dataset(const Dataset& dataset, const FeatureSpec& spec) {
  return Checker(dataset, spec).run();
}

}  // namespace torsio
