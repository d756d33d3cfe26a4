#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "report/document/decimation.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// Values of a time figure: about 5 bytes each in the page.
inline constexpr std::size_t kValuesOfFigure = 300'000;
/// The same for a recording with more than a million samples.
inline constexpr std::size_t kValuesOfLongFigure = 1'500'000;
[[nodiscard]] std::size_t values_of_figure(std::size_t samples) noexcept;

/// Makes a `TimeFigure` series by series, each of which is reduced at once.
class TimeFigureBuilder {
 public:
  /// @param recording whose clock all series have
  /// @param series their number
  TimeFigureBuilder(std::string title, const Recording& recording, std::size_t series,
                    const std::vector<PlaceOfInterest>& places, std::size_t max_values);

  void panel(std::string label);
  /// To the last panel.
  void add(std::string label, CurveRole role, bool is_shown, std::span<const double> values);
  /// Shades the ranges in which `flags` is not 0; at most a few hundred, nearby ones together.
  void mark(std::span<const std::uint8_t> flags, const std::string& label);
  void mark(TimeMark mark) { figure_.marks.push_back(std::move(mark)); }
  /// A panel for each unit of the channels, in their order, but not of those that are left out.
  void add_channels(const Recording& recording, const std::vector<std::string>& left_out);

  [[nodiscard]] TimeFigure finish() { return std::move(figure_); }

 private:
  TimeFigure figure_;
};

/// All channels of a recording; full resolution at the places and at the first and last reversal of
/// `motion` (may be empty).
[[nodiscard]] TimeFigure channels_figure(const Recording& recording, std::string title,
                                         std::vector<PlaceOfInterest> places,
                                         std::span<const double> motion);

}  // namespace torsio
