#include "report/plot/simplified_line.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace torsio {
namespace {

double distance(const PlotPoint& point, const PlotPoint& begin, const PlotPoint& end) {
  const double along_x = end.x - begin.x;
  const double along_y = end.y - begin.y;
  const double length = std::hypot(along_x, along_y);
  if (length < 1e-9) return std::hypot(point.x - begin.x, point.y - begin.y);
  const double share = std::clamp(
      ((point.x - begin.x) * along_x + (point.y - begin.y) * along_y) / (length * length), 0.0,
      1.0);
  return std::hypot(point.x - begin.x - share * along_x, point.y - begin.y - share * along_y);
}

}  // namespace

std::vector<PlotPoint> simplified(const std::vector<PlotPoint>& points, double deviation) {
  std::vector<bool> is_kept(points.size(), false);
  is_kept.front() = true;
  is_kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open = {{0, points.size() - 1}};
  while (!open.empty()) {
    const auto [begin, end] = open.back();
    open.pop_back();
    double largest = deviation;
    std::size_t farthest = begin;
    for (std::size_t i = begin + 1; i < end; ++i) {
      const double away = distance(points[i], points[begin], points[end]);
      if (away <= largest) continue;
      largest = away;
      farthest = i;
    }
    if (farthest == begin) continue;
    is_kept[farthest] = true;
    open.emplace_back(begin, farthest);
    open.emplace_back(farthest, end);
  }
  std::vector<PlotPoint> kept;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (is_kept[i]) kept.push_back(points[i]);
  return kept;
}

}  // namespace torsio
