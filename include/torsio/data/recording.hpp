#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/provenance.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// Channels of a simulation that no sensor measures are called truth_...
inline constexpr std::string_view kTruthPrefix = "truth_";

/// One measured quantity on the recording's clock, in SI; the name ends in the SI unit.
struct Channel {
  std::string name;
  std::vector<double> values;
  /// 1 where the sensor measured again, 0 where the last value is held (a load cell at 125 Hz
  /// in a log of 1 kHz). Empty: every sample is new.
  std::vector<std::uint8_t> fresh = {};
  /// The smallest step between two samples before they were resampled, which hides the codes of a
  /// sensor; 0: not resampled.
  double step_before_resampling = 0.0;

  [[nodiscard]] bool is_fresh(std::size_t sample) const {
    return fresh.empty() || fresh[sample] != 0;
  }
};

/// The column of a file that a channel was read from.
struct ColumnOfChannel {
  std::string channel;
  std::string column;
  std::string unit;  ///< suffix of the unit that its numbers were read in
};

/// Channels by name on one uniform clock. All channels have `size()` samples; names are unique.
class Recording {
 public:
  /// @throws Error if the rate is not positive and finite.
  Recording(std::string name, double sample_rate_Hz, double start_s = 0.0);

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  void rename(std::string name) { name_ = std::move(name); }
  [[nodiscard]] double sample_rate_Hz() const noexcept { return sample_rate_Hz_; }
  [[nodiscard]] double time_s(std::size_t sample) const noexcept {
    return start_s_ + static_cast<double>(sample) / sample_rate_Hz_;
  }
  [[nodiscard]] std::size_t size() const noexcept {
    return channels_.empty() ? 0 : channels_.front().values.size();
  }

  [[nodiscard]] const std::vector<Channel>& channels() const noexcept { return channels_; }
  [[nodiscard]] bool has(std::string_view channel) const noexcept;
  /// @throws Error that lists the channels if there is none of that name.
  [[nodiscard]] const Channel& channel(std::string_view name) const;

  /// @throws Error if the length differs from the other channels', the name exists, or it does not
  /// end in an SI unit.
  void add(Channel channel);
  /// Marks the samples of a channel at which its sensor measured again (`Channel::fresh`).
  /// @throws Error that lists the channels if there is none of that name, or another length is expected.
  void mark_fresh(std::string_view channel, std::vector<std::uint8_t> fresh);
  /// A condition of the whole record (support position, temperature): a constant channel.
  void add_condition(std::string name, double value);
  [[nodiscard]] const std::vector<std::string>& conditions() const noexcept { return conditions_; }

  /// A recording of the samples [begin, end) alone, with all that is known about this one.
  [[nodiscard]] Recording part(std::size_t begin, std::size_t end) const;

  Source source;
  /// Channels of this recording that a mapping computed from others, so that a model's inputs go
  /// back to measured ones.
  std::vector<ChannelDefinition> definitions;
  std::vector<ZeroRule> zeros;  ///< already applied to the values
  /// By channel, as a mapping states them.
  std::map<std::string, SensorUncertainty> uncertainties;
  /// For advice on a mapping; the clock is `t_s`. Empty for a recording that was not read from a file.
  std::vector<ColumnOfChannel> columns;
  std::string mapping;  ///< `mapping_text` of the mapping that it was read with; empty: none
  /// What the file states about the run in words, to group recordings by: {"trajectory", "sin_sin"}.
  std::vector<std::pair<std::string, std::string>> labels;
  std::vector<std::string> notes;  ///< what reading the file assumed, in sentences
  std::vector<std::string>
      not_read;  ///< arrays of the file that are not read: "z (complex numbers)"
  /// Its recorder was stopped before it closed the file, or the file is truncated.
  bool is_unfinished = false;

 private:
  std::string name_;
  double sample_rate_Hz_;
  double start_s_;
  std::vector<Channel> channels_;
  std::vector<std::string> conditions_;
};

}  // namespace torsio
