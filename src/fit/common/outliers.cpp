#include "fit/common/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace torsio {
namespace {

constexpr double kShareOutside = 1e-3;  // 99.9 % are inside

struct RobustRange {
  double middle = 0.0;
  double width = 0.0;
};

/// The `count` first values in the given order, sorted.
template <class Before>
std::vector<double> first(std::vector<double>& values, std::size_t count, Before before) {
  const auto end = values.begin() + static_cast<std::ptrdiff_t>(count);
  std::partial_sort(values.begin(), end, values.end(), before);
  return {values.begin(), end};
}

/// The shortest interval without `outside` values. Both lists have one value more than that.
RobustRange shortest_range(const std::vector<double>& lowest, const std::vector<double>& highest) {
  const std::size_t outside = lowest.size() - 1;
  std::size_t best = 0;
  const auto width = [&](std::size_t below) { return highest[outside - below] - lowest[below]; };
  for (std::size_t below = 1; below <= outside; ++below)
    if (width(below) < width(best)) best = below;
  return {.middle = lowest[best] + 0.5 * width(best), .width = width(best)};
}

/// Outliers of one side: how many of the outermost values, and the limit just before them.
struct Side {
  std::size_t outliers = 0;
  double limit = 0.0;
};

/// @param outermost first, the values of one side
/// @param most outliers
Side side_of(const std::vector<double>& outermost, const RobustRange& range, std::size_t most) {
  Side side;
  for (std::size_t i = 0; i < most && i + 1 < outermost.size(); ++i) {
    if (!(std::abs(outermost[i] - range.middle) > 0.5 * kOutlierStretch * range.width)) break;
    if (std::abs(outermost[i] - outermost[i + 1]) >= range.width)
      side = {.outliers = i + 1, .limit = std::nextafter(outermost[i], range.middle)};
  }
  return side;
}

}  // namespace

OutlierLimits outlier_limits(std::vector<double>& values) {
  if (values.size() < kFewestForOutliers) return {};
  const auto samples = static_cast<double>(values.size());
  const auto most = std::clamp<std::size_t>(static_cast<std::size_t>(kShareOfOutliers * samples), 1,
                                            kMaxOutliers);
  const std::size_t outside = static_cast<std::size_t>(kShareOutside * samples) + 1;
  const std::vector<double> lowest = first(values, outside, std::less<>());
  const std::vector<double> highest = first(values, outside, std::greater<>());
  RobustRange range = shortest_range(lowest, highest);
  if (!(range.width > 0.0)) range.width = std::max(1.0, std::abs(range.middle));
  const bool lower_first = range.middle - lowest.front() > highest.front() - range.middle;
  Side below = side_of(lowest, range, lower_first ? most : 0);
  const Side above = side_of(highest, range, most - below.outliers);
  if (!lower_first) below = side_of(lowest, range, most - above.outliers);
  OutlierLimits limits;
  if (below.outliers > 0) limits.lowest = below.limit;
  if (above.outliers > 0) limits.highest = above.limit;
  return limits;
}

}  // namespace torsio
