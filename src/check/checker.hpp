#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "check/delay.hpp"
#include "check/relation_change.hpp"
#include "check/signal_faults.hpp"
#include "check/signal_pair.hpp"
#include "check/torque_faults.hpp"
#include "check/torque_relation.hpp"
#include "data/mapping/number_coding.hpp"
#include "torsio/check/check.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// Runs the checks one after the other and collects what they find.
class Checker {
 public:
  /// @param leak `find_leak(dataset, spec)`, if it is known
  Checker(const Dataset& dataset, const FeatureSpec& spec, std::optional<std::string> leak = {})
      : dataset_(dataset),
        spec_(spec),
        pipeline_(spec, dataset.sample_rate_Hz()),
        leak_(std::move(leak)) {
    channels_ = pipeline_.raw_inputs();
    FeatureSpec first = spec;
    first.inputs.resize(1);
    sources_ = FeaturePipeline(first, dataset.sample_rate_Hz()).raw_inputs();
    channels_.push_back(dataset.target);
    pairs_.resize(dataset.records.size());
    for_each_record([&](std::size_t r) {
      const Recording& recording = dataset.records[r].recording;
      pairs_[r] = {first_feature(recording, spec),
                   bridged_or_held(recording.channel(dataset.target))};
    });
    take_out_other_inputs();
    spoiled_.resize(pairs_.size());
    coded_.resize(pairs_.size());
    stalls_.resize(pairs_.size());
    flips_.resize(pairs_.size());
    changes_.resize(pairs_.size());
    sides_.resize(pairs_.size());
    positions_.resize(pairs_.size());
    spikes_.resize(pairs_.size());
  }

  std::vector<Finding> run();
  /// The FAIL findings of `run`: without the checks that can only warn and change nothing for those
  /// after them.
  std::vector<Finding> run_for_failures();
  /// What `run` made for the check of the training data; see `FitCheck::data`.
  [[nodiscard]] std::optional<LearningData> take_data() { return std::move(data_); }

 private:
  void add(Verdict verdict, std::string check, std::string recording, std::string message,
           std::string advice = {}, std::vector<SampleRange> places = {});
  void pass_unless_found(const std::string& check, std::string message,
                         const std::function<void()>& body);
  /// Calls body(r) for each recording, some at the same time; what they find comes in the order of
  /// the recordings.
  void for_each_record(const std::function<void(std::size_t)>& body);
  template <class Body>
  void for_each_channel(const Body& body) {
    for_each_record([&](std::size_t r) {
      const Recording& recording = dataset_.records[r].recording;
      for (const std::string& channel : channels_) body(recording, recording.channel(channel));
    });
  }

  /// As above, without channels that are constant by design.
  template <class Body>
  void for_each_moving_channel(const Body& body) {
    for_each_record([&](std::size_t r) {
      const Recording& recording = dataset_.records[r].recording;
      for (const std::string& channel : channels_)
        if (!stands_still(r, channel)) body(r, recording, recording.channel(channel));
    });
  }

  [[nodiscard]] bool stands_still(std::size_t r, const std::string& name) const;
  [[nodiscard]] static bool is_condition(const Recording& recording, const std::string& channel);
  void run_checks(bool with_warnings);
  void check_ends();
  void check_length();
  void check_clock();
  void check_rates_of(std::size_t r);
  void report_rate(std::size_t r, const std::string& name, double factor, double together);
  void check_missing();
  void check_constant();
  void check_saturation();
  [[nodiscard]] static bool approaches_gradually(const Channel& channel, double extreme,
                                                 const Extent& span);
  [[nodiscard]] bool is_turn(std::size_t r, const Channel& channel, double extreme) const;
  void check_frozen();
  [[nodiscard]] static bool is_stop_of_motion(const Channel& channel, const Rest& rest);
  [[nodiscard]] std::vector<Channel> others_of(std::size_t r, const std::string& name) const;
  void check_gaps_of(std::size_t r, bool with_warnings);
  void check_columns_of(std::size_t r);
  void check_resolution_of(std::size_t r);
  void leave_out(std::size_t r, const Rest& rest);
  [[nodiscard]] bool is_end_of_stall(std::size_t r, std::size_t sample) const;
  void check_coding();
  [[nodiscard]] std::string coding_advice(std::size_t r, const std::string& name,
                                          const CodedNumbers& coded) const;
  [[nodiscard]] double spans_between_sources(std::size_t r, double span) const;
  [[nodiscard]] bool is_offset_on(std::size_t r, const std::string& name) const;
  void check_held();
  void check_switched_off();
  void check_dead_angle(std::size_t r);
  [[nodiscard]] bool has_lost_sign(std::size_t r);
  void check_limit(std::size_t r);
  void check_hidden_torque();
  [[nodiscard]] std::optional<double> noise_of_target(std::size_t r) const;
  void report_plateau(std::size_t r, const Plateau& plateau);
  void check_position();
  [[nodiscard]] std::optional<double> farthest_travel() const;
  void check_zeros();
  void check_unloaded(std::size_t r);
  [[nodiscard]] bool is_deflection(std::size_t r) const;
  [[nodiscard]] std::string zero_line(double first_s) const;
  [[nodiscard]] bool begins_at_rest(std::size_t r) const;
  [[nodiscard]] bool all_begin_at_rest() const;
  [[nodiscard]] std::string zero_of_input_text(std::size_t r, double offset) const;
  void take_out_other_inputs();
  void check_explanation();
  [[nodiscard]] FeatureSpec spec_of(std::size_t input) const;
  void check_resolution();
  void check_columns();
  [[nodiscard]] bool may_be_target(const Recording& recording, const Channel& channel) const;
  [[nodiscard]] std::vector<std::string> computed_from() const;
  void check_noise();
  void check_noise_of(std::size_t r, const Channel& channel, double range);
  void check_spikes();
  void report_returning(std::size_t r, const Channel& channel, const ReturningValue& returning);
  [[nodiscard]] bool hardly_moves(std::size_t r) const;
  void check_repeats();
  [[nodiscard]] bool check_cut(std::size_t r);
  void check_cadence(std::size_t r);
  [[nodiscard]] double range_in_use(std::size_t r, const std::string& name) const;
  [[nodiscard]] bool is_spike(std::size_t r, std::size_t sample) const;
  void check_units();
  [[nodiscard]] static double inner_range(const std::vector<double>& values);
  void check_twist(std::size_t r);
  void check_turns_between(std::size_t r);
  void check_load(std::size_t r);
  void check_scale(std::size_t r);
  void compare_slopes();
  void report_slope(std::size_t r, double slope, std::size_t usual, double usual_slope,
                    bool is_majority);
  [[nodiscard]] static std::size_t usual_slope(const std::vector<double>& slopes);
  [[nodiscard]] static double ratio_of(double a, double b);
  [[nodiscard]] bool is_clear(std::size_t r) const;
  void check_units_within(std::size_t r);
  void check_sign_flips();
  [[nodiscard]] static bool stands_out(const Jump& jump, const std::vector<double>& values);
  void check_gaps(bool with_warnings);
  void check_jump_of_input(std::size_t r);
  [[nodiscard]] bool check_jumps(std::size_t r, const Channel& channel,
                                 const std::vector<std::size_t>& samples,
                                 const std::vector<double>& values);
  [[nodiscard]] bool check_jumps_of_input(std::size_t r);
  [[nodiscard]] bool check_dropouts(std::size_t r, const Channel& channel);
  [[nodiscard]] static std::string jump_text(const Recording& recording, const std::string& name,
                                             const Jump& jump);
  [[nodiscard]] const std::string& source_of(const Recording& recording, const Jump& jump) const;
  [[nodiscard]] bool is_source(const std::string& name) const;
  [[nodiscard]] bool is_sign_flip(std::size_t r, const std::string& name, const Jump& jump) const;
  void check_delay();
  [[nodiscard]] bool check_sides(std::size_t r);
  void report_clocks(std::size_t r, const LagCourse& course);
  void report_delay(std::size_t r, const Delay& delay);
  void check_sign();
  void report_flip(std::size_t r);
  [[nodiscard]] std::string flipped_source(const std::vector<double>& values) const;
  [[nodiscard]] int order_of_difference(std::size_t r) const;
  void relate();
  void check_change();
  void check_course(std::size_t r);
  void check_excitation();
  void check_offsets();
  void report_line(std::size_t r, const RecordLine& line, double spread);
  void check_leak();
  void check_known_load();
  void check_training();
  [[nodiscard]] bool check_determination(const TrainingData& data);
  void check_range();
  [[nodiscard]] bool has_failed() const;
  static constexpr const char* kJointAngle = "joint_angle_rad";
  static constexpr std::size_t kFewSamples = 100;
  static constexpr double kSaturatedShare = 0.005;
  static constexpr double kCodesAtATurn = 2.0;
  static constexpr double kFrozen_s = 0.2;
  static constexpr double kFrozenDeliveries = 10.0;
  static constexpr double kMovedMeanwhile = 0.4;  ///< share of another channel's range
  static constexpr double kTogether = 0.9;        ///< correlation
  static constexpr double kCoarseShare = 0.02;    ///< share of the range: 50 codes
  static constexpr double kJumpShare = 0.02;
  static constexpr double kJumpOverOthers = 5.0;
  static constexpr double kInputJumpShare = 0.05;
  static constexpr double kSameMoment_s = 0.05;
  static constexpr double kRestShare = 0.02;  ///< share of the first input's range
  static constexpr double kFollows = 0.8;     ///< correlation
  static constexpr double kOneMotion = 0.99;  ///< correlation
  static constexpr double kNarrow = 0.5;
  static constexpr double kSlopeRatio = 5.0;
  static constexpr double kLowestGearRatio = 3.0;
  static constexpr double kSpeedHalfWindow_s = 0.05;
  static constexpr double kSpeedRatio = 2.0;
  static constexpr double kScaleOfAGear = 0.03;
  static constexpr double kOffsetShare = 0.05;
  static constexpr double kZeroShare = 0.02;      ///< share of the range
  static constexpr double kUsualRest_s = 0.1;     ///< at the beginning of a recording
  static constexpr double kMaxUnexplained = 0.5;  ///< share of the variance
  static constexpr double kGainChange = 0.12;
  static constexpr double kClearDelay_s = 0.03;
  static constexpr double kLinesLeave = 0.5;    ///< share of what one common curve does not explain
  static constexpr double kBeyondShare = 0.06;  ///< share of the range
  static constexpr double kApproachShare = 0.2;  ///< share of the range
  static constexpr double kStepShare = 0.005;    ///< share of the range
  static constexpr double kNoiseShare = 0.025;   ///< share of the range
  static constexpr double kMotionOverNoise = 10.0;
  static constexpr double kBurstShare = 0.01;  ///< share of the range
  static constexpr double kSpikeShare = 0.05;  ///< share of the range
  static constexpr double kRepeat_s = 0.25;
  static constexpr std::size_t kRepeatRows = 50;
  static constexpr double kWidestTwist_rad = 1.5;
  static constexpr double kSmallTwist = 0.25;  ///< share of a turn
  static constexpr double kLargestZero_rad =
      0.3;  ///< a deflection that is a whole turn off is as near to it
  static constexpr double kHighestLoad_Nm = 3000.0;
  static constexpr double kOuter = 0.01;          ///< share of the samples on either side
  static constexpr double kOtherExplained = 0.3;  ///< share of what is unexplained of the target
  static constexpr double kDetermined = 0.9;      ///< share of the error of a constant
  static constexpr double kWellExplained = 0.02;  ///< share of the variance

  const Dataset& dataset_;
  const FeatureSpec& spec_;
  FeaturePipeline pipeline_;
  std::optional<std::string> leak_;
  std::optional<LearningData> data_;
  std::vector<std::string> channels_;           ///< raw inputs and the target
  std::vector<std::string> sources_;            ///< channels of the first input's expression
  std::vector<Pair> pairs_;                     ///< without what `take_out_other_inputs` finds
  std::vector<std::uint8_t> spoiled_;           ///< by record: its relation is known to be wrong
  std::vector<std::uint8_t> coded_;             ///< by record: numbers of it are in another coding
  std::vector<std::vector<Rest>> stalls_;       ///< by record
  std::vector<std::optional<SignFlip>> flips_;  ///< by record
  std::vector<std::optional<RelationChange>> changes_;    ///< by record
  std::vector<std::optional<TwoSides>> sides_;            ///< by record
  std::vector<std::optional<PositionEffect>> positions_;  ///< by record
  std::vector<std::vector<std::size_t>> spikes_;          ///< by record: samples
  std::mutex adding_;
  std::vector<Finding> findings_;
};

}  // namespace torsio
