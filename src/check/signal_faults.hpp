#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// Indices of the samples that are new and finite.
[[nodiscard]] std::vector<std::size_t> new_samples(const Channel& channel);

/// Standard deviation of the white noise of a channel in successive windows, from third
/// differences of new samples: sigma^2 = mean((d3 x)^2) / 20. A motion has small ones.
struct NoiseCourse {
  std::vector<double> sigma;         ///< one for each window
  std::vector<std::size_t> samples;  ///< where the windows begin, and the end of the last one
};
[[nodiscard]] NoiseCourse noise_course(const Channel& channel, double sample_rate_Hz);

/// The median over the windows.
[[nodiscard]] double usual_noise(const NoiseCourse& course);

/// Successive windows of at least 0.3 s whose noise is far above that of nine tenths of the others.
struct Burst {
  std::size_t begin = 0;
  std::size_t end = 0;
  double sigma = 0.0;
  double usual = 0.0;
};
/// @param least noise below which nothing is reported, in the channel's unit
[[nodiscard]] std::optional<Burst> find_burst(const Channel& channel, const NoiseCourse& course,
                                              double sample_rate_Hz, double least);

/// New samples that differ from both neighbours by more than `least`, in the same direction, while
/// the neighbours agree with each other and the signal around is quiet.
[[nodiscard]] std::vector<std::size_t> find_spikes(const Channel& channel, double least);

/// A value to which single samples return, far from their neighbours: what an amplifier writes instead of a measurement.
struct ReturningValue {
  double value = 0.0;
  std::vector<std::size_t> samples;
};
/// The lowest, the highest value or 0, at least five times for at most three samples each.
/// @param least difference from the neighbours
[[nodiscard]] std::optional<ReturningValue> find_returning_value(const Channel& channel,
                                                                 double least);

/// A block of rows in which every channel has exactly the values of an earlier block.
struct RepeatedBlock {
  std::size_t first = 0;
  std::size_t again = 0;
  std::size_t length = 0;
};
/// Blocks of at least `shortest` rows, in the order of time; rows at rest do not count.
[[nodiscard]] std::vector<RepeatedBlock> find_repeats(const std::vector<const Channel*>& channels,
                                                      std::size_t shortest);

/// Rows that are missing before a sample.
struct Cut {
  std::size_t sample = 0;
  double rows = 0.0;  ///< about how many
};
/// At least two channels jump at the same moment, by what they pass through in the same number of
/// rows at their speeds there; nowhere else.
/// @param codes resolution of each channel
[[nodiscard]] std::optional<Cut> find_cut(const std::vector<const Channel*>& channels,
                                          const std::vector<double>& codes);

/// A slow sensor has a new sample in every n-th row, except at one to three places.
struct BrokenCadence {
  std::size_t sample = 0;  ///< the first of these places
  std::size_t usual = 0;   ///< n
  std::size_t found = 0;   ///< rows from the new sample before
};
/// Whole missing samples of the sensor (a multiple of n) do not count. Empty if the new samples are
/// not regular, or in all rows.
[[nodiscard]] std::optional<BrokenCadence> find_broken_cadence(const Channel& channel);

/// A sensor that is slower than the log, whose last value is written in every row: nearly all runs of equal values have
/// one length, and their steps are larger than the codes of the sensor.
/// @returns that length; 0 if there is none, or new samples are marked already
[[nodiscard]] std::size_t held_rows(const Channel& channel);

/// `bridged`, also between the new samples of a channel whose values are held without marks.
[[nodiscard]] std::vector<double> bridged_or_held(const Channel& channel);

/// By how much a channel moves through the first samples: the largest difference of the means of their quarters, less
/// what noise explains. 0 for fewer than 8 samples.
[[nodiscard]] double moved_within(const Channel& channel, std::size_t samples);

}  // namespace torsio
