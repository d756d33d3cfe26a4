#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/report/document/report_document.hpp"

namespace torsio {

enum class PlotFormat : std::uint8_t { svg, png, pdf };

/// By the ending of a file's name.
/// @throws UsageError with the list of the endings.
[[nodiscard]] PlotFormat plot_format(std::string_view path);

/// The size of each figure; a column of most journals is 85 mm wide.
/// A figure with several panels is made taller where a panel would be less than 22 mm high.
struct PlotSize {
  double width_mm = 85.0;
  double height_mm = 64.0;
  std::size_t columns = 1;  ///< figures beside each other
};
/// @param text such as 85x64mm
/// @throws UsageError unless both are from 40 to 400 mm.
[[nodiscard]] PlotSize plot_size(std::string_view text);

/// No picture is larger, in bytes: fewer points are drawn until it is not.
inline constexpr std::size_t kMaxPlotBytes = 200'000;

[[nodiscard]] const std::string& title_of(const ReportFigure& figure);

/// All figures of a document whose titles contain one of the words, each once, in the order of the words; letters' case
/// does not matter. Without words the first figure, or the first whose title contains `preferred`.
/// @throws UsageError with the list of the titles if a word is in none, or the document has no figure.
[[nodiscard]] std::vector<const ReportFigure*> figures_of(const ReportDocument& document,
                                                          const std::vector<std::string>& words,
                                                          std::string_view preferred = {});

/// Draws figures, in rows of `PlotSize::columns`, as their page shows them at first: the curves with `is_shown`. Text is DejaVu Sans
/// in 7 points. The colours are by Okabe and Ito (2008); dashes distinguish the curves, too. Minima and maxima of a
/// time series stay. The same figures give the same bytes.
/// @return the bytes of a file; PNG has 300 dots per inch or, where it would be too large, fewer; SVG has the texts in
/// its `desc` element, because cairo draws letters as outlines.
/// @throws UsageError if there is no figure or no column, or the file would be larger than `kMaxPlotBytes`; Error if
/// cairo fails.
[[nodiscard]] std::string figure_plot(const std::vector<const ReportFigure*>& figures,
                                      PlotFormat format, const PlotSize& size = {});

}  // namespace torsio
