#include "report/plot/label_places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace torsio {
namespace {

constexpr std::array<double, 6> kDistances = {3.5, 8.0, 14.0, 21.0, 29.0, 38.0};
/// To the right first, then up, down and to the left.
constexpr std::array<double, 12> kDirections_deg = {0.0,   -45.0, 45.0,  180.0, -135.0, 135.0,
                                                    -90.0, 90.0,  -20.0, 20.0,  160.0,  -160.0};
constexpr double kPointRadius = 2.0;
constexpr double kTurnCost = 0.5;
constexpr double kLineCost = 6.0;
/// A label that another point is nearly as close to as its own.
constexpr double kDoubtCost = 12.0;
constexpr double kDoubtRadius = 4.0;
/// A line from a label to its point that crosses another label or point.
constexpr double kLeaderCost = 10.0;

bool do_overlap(const PlotArea& a, const PlotArea& b) {
  return a.left < b.left + b.width && b.left < a.left + a.width && a.top < b.top + b.height &&
         b.top < a.top + a.height;
}

bool contains(const PlotArea& area, const PlotArea& box) {
  return box.left >= area.left && box.top >= area.top &&
         box.left + box.width <= area.left + area.width &&
         box.top + box.height <= area.top + area.height;
}

/// Whether a segment touches a box (clipping by Liang and Barsky, 1984).
bool do_cross(const PlotArea& box, const PlotPoint& from, const PlotPoint& to) {
  struct Limit {
    double step = 0.0;
    double room = 0.0;
  };
  const std::array<Limit, 4> limits = {
      {{.step = from.x - to.x, .room = from.x - box.left},
       {.step = to.x - from.x, .room = box.left + box.width - from.x},
       {.step = from.y - to.y, .room = from.y - box.top},
       {.step = to.y - from.y, .room = box.top + box.height - from.y}}};
  double begin = 0.0;
  double end = 1.0;
  for (const auto& [step, room] : limits) {
    if (step == 0.0 && room < 0.0) return false;
    if (step < 0.0) begin = std::max(begin, room / step);
    if (step > 0.0) end = std::min(end, room / step);
  }
  return begin <= end;
}

/// Where an extent begins whose near end is at the distance; in the middle across the direction.
double beginning(double at, double share, double distance, double extent) {
  if (std::abs(share) < 0.1) return at - 0.5 * extent;
  return share > 0.0 ? at + share * distance : at + share * distance - extent;
}

PlotArea box_at(const PlotPoint& point, double direction_deg, double distance,
                const LabelSize& size) {
  const double angle_rad = direction_deg / 180.0 * std::numbers::pi;
  return {.left = beginning(point.x, std::cos(angle_rad), distance, size.width),
          .top = beginning(point.y, std::sin(angle_rad), distance, size.height),
          .width = size.width,
          .height = size.height};
}

}  // namespace

std::vector<std::optional<LabelPlace>> place_labels(
    const std::vector<PlotPoint>& points, const std::vector<LabelSize>& sizes, const PlotArea& area,
    const std::vector<std::pair<PlotPoint, PlotPoint>>& lines) {
  std::vector<PlotArea> taken;
  taken.reserve(2 * points.size());
  for (const PlotPoint& point : points)
    taken.push_back({.left = point.x - kPointRadius,
                     .top = point.y - kPointRadius,
                     .width = 2.0 * kPointRadius,
                     .height = 2.0 * kPointRadius});
  std::vector<std::optional<LabelPlace>> places(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto is_free = [&](const PlotArea& box) {
      return contains(area, box) && std::ranges::none_of(taken, [&](const PlotArea& other) {
               return do_overlap(box, other);
             });
    };
    const auto cost_of = [&](const PlotArea& box, bool is_far) {
      PlotArea near = box;
      near.left -= kDoubtRadius;
      near.width += 2.0 * kDoubtRadius;
      double cost = 0.0;
      for (const auto& [from, to] : lines) cost += do_cross(box, from, to) ? kLineCost : 0.0;
      for (std::size_t k = 0; k < points.size(); ++k)
        if (k != i && do_cross(near, points[k], points[k])) cost += kDoubtCost;
      const PlotPoint middle{box.left + 0.5 * box.width, box.top + 0.5 * box.height};
      for (std::size_t k = 0; k < taken.size() && is_far; ++k)
        if (k != i && do_cross(taken[k], points[i], middle)) cost += kLeaderCost;
      return cost;
    };
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t ring = 0; ring < kDistances.size(); ++ring)
      for (std::size_t turn = 0; turn < kDirections_deg.size(); ++turn) {
        const PlotArea box = box_at(points[i], kDirections_deg[turn], kDistances[ring], sizes[i]);
        if (!is_free(box)) continue;
        const double cost =
            kDistances[ring] + kTurnCost * static_cast<double>(turn) + cost_of(box, ring > 0);
        if (cost >= least) continue;
        least = cost;
        places[i] = LabelPlace{.box = box, .is_far = ring > 0};
      }
    if (places[i]) taken.push_back(places[i]->box);
  }
  return places;
}

}  // namespace torsio
