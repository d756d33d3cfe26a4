#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "report/plot/simplified_line.hpp"

namespace torsio {

/// A part of a picture, in points of 1/72 inch.
struct PlotArea {
  double left = 0.0;
  double top = 0.0;
  double width = 0.0;
  double height = 0.0;
};

struct LabelPlace {
  PlotArea box;
  bool is_far = false;  ///< a line to its point is drawn
};

struct LabelSize {
  double width = 0.0;
  double height = 0.0;
};

/// Where the names of points are written: beside their points, within the area, and not over each other, as
/// web/src/label_places.ts does for a page.
/// @param sizes of the names, one for each point
/// @param lines that a name does not cross where there is another place
/// @returns none for a name without a free place
[[nodiscard]] std::vector<std::optional<LabelPlace>> place_labels(
    const std::vector<PlotPoint>& points, const std::vector<LabelSize>& sizes, const PlotArea& area,
    const std::vector<std::pair<PlotPoint, PlotPoint>>& lines);

}  // namespace torsio
