#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/core/provenance.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// A channel made from one column: `channel = sign * scale * SI(decoded column) + offset`. With a gear ratio n
/// the column is of the motor's side of a gear and the channel of its output: an angle or a rate of
/// one is divided by n, a torque or its rate multiplied by n.
struct ChannelRule {
  std::string name;  ///< with a unit; inside torsio it becomes the SI one
  std::string from;  ///< column
  std::string unit;  ///< unit of the column; empty: its suffix, else that of `name`
  double sign = 1.0;
  double scale = 1.0;  ///< from SI to SI; needed where the quantities differ
  double offset = 0.0;
  double gear_ratio = 1.0;
  // As the column has them, before all others; 0: not coded so.
  double sign_bit = 0.0;  ///< from this number on negative: -(number - sign_bit)
  double modulus = 0.0;   ///< from half of it on negative: number - modulus
  double unwrap = 0.0;    ///< the span after which a counter or an angle begins again
};

/// How the time stamps are used. Default: they must be uniform.
struct ClockRule {
  bool rebuild = false;          ///< spread the samples evenly between first and last stamp
  double max_stray_steps = 2.0;  ///< with rebuild: how far a stamp may be from there
  /// Interpolate from uneven stamps onto this rate; samples that share a stamp are first spread
  /// evenly up to the next one. 0: no.
  double resample_Hz = 0.0;
  /// With resample: the longest interval that is interpolated over. 0: five usual ones, a period of the new rate, or
  /// as long as straight lines follow the channels elsewhere in the log.
  double max_gap_s = 0.0;
  /// Each part between two longer intervals, and from a stamp that is earlier than the one before, becomes a
  /// recording. 0: no.
  double split_at_gaps_s = 0.0;
  bool sort =
      false;  ///< rows are brought into the order of their stamps, however far they are from it
  std::string format = {};  ///< how a CSV file writes dates, for strptime; empty: ISO 8601
};

/// A channel and the latency of its sensor.
struct LatencyRule {
  std::string channel;
  double latency_s = 0.0;
};

/// What the sensor of a channel is wrong by in all recordings alike:
///
///     u(y)^2 = (class range)^2 / 3 + zero^2 + (gain^2 + mounting^2) y^2
///
/// A class is a limit of the error, every value within which is equally likely; the others are standard
/// uncertainties. Percentages are kept as they are written, so that `mapping_text` repeats them.
struct UncertaintyRule {
  std::string channel;
  double class_percent = 0.0;  ///< share of `range`
  double range = 0.0;          ///< unit of the channel
  double gain_percent = 0.0;   ///< share of the reading, as the next
  double mounting_percent = 0.0;
  double zero = 0.0;  ///< unit of the channel

  [[nodiscard]] SensorUncertainty combined() const noexcept;
};

/// From the columns of a foreign log to channels. See docs/use/recordings.md for the file format.
struct Mapping {
  std::string file;  ///< for messages; empty: no mapping
  std::vector<ChannelRule> channels;
  std::vector<ChannelDefinition> derive;
  std::vector<std::string> drop;     ///< columns; '*' is any text
  std::vector<std::string> missing;  ///< cells of a CSV file where nothing was measured
  std::string
      decimal;  ///< "comma" or "point" before the decimals of a CSV file; empty: found by itself
  std::size_t skip_lines = 0;  ///< lines of a CSV file above its header; 0: found by itself
  std::string split_by;        ///< column; each run of equal values becomes a record
  std::vector<double> keep;    ///< values of `split_by` that are kept; empty: all
  ClockRule clock;
  double rate_Hz = 0.0;  ///< sample rate of a log without clock; 0: not given
  // The part of the log that is used, from its first sample on.
  double from_s = 0.0;
  double to_s = std::numeric_limits<double>::infinity();
  std::vector<ZeroRule> zero;
  std::vector<std::string> hold;
  std::vector<LatencyRule> latency;
  std::vector<UncertaintyRule> uncertainty;
  std::map<std::string, std::vector<std::string>> computed_from;
};

/// @param path a file, or where there is none of that name one of `ready_mapping_names`
/// @param joint whose names replace the placeholders of a mapping for several joints; empty: the only
/// one
/// @throws Error naming file, line, key, the known keys and the nearest one; UsageError if the mapping
/// is for several joints and none of them is chosen; Cancelled.
[[nodiscard]] Mapping read_mapping(const std::string& path, const Progress& progress = {},
                                   const std::string& joint = {});
[[nodiscard]] Mapping parse_mapping(std::string_view text, const std::string& name,
                                    const std::string& joint = {});

/// The joints that a mapping lists; none if it is for one.
[[nodiscard]] std::vector<std::string> joints_of_mapping(const std::string& path,
                                                         const Progress& progress = {});

/// The mappings for known logs that come with torsio: "cycloidal_drive".
[[nodiscard]] std::vector<std::string> ready_mapping_names();

/// The mapping as YAML that `parse_mapping` reads back, without its file and without `keep`, `from` and `to`, which
/// select parts of one log. Empty if nothing else is set.
[[nodiscard]] std::string mapping_text(const Mapping& mapping);

/// Evaluates the definitions over the recording and adds them as channels. Where a channel that one
/// uses is NaN, so is the result, as long as the expression has no memory.
/// @throws Error if a channel is missing, or is NaN and goes into a filter, difference or lag.
void add_derived(Recording& recording, const std::vector<ChannelDefinition>& definitions);

}  // namespace torsio
