#include "parts/torque_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "torque curve";

void check_point(const std::vector<TorqueTable::Point>& points, std::size_t at) {
  const TorqueTable::Point& point = points[at];
  const auto found = [&] {
    return fmt::format("{} rad, {} Nm as point {}", point.deflection_rad, point.torque_Nm, at + 1);
  };
  if (!std::isfinite(point.deflection_rad + point.torque_Nm))
    throw Error({.place = kPlace, .expected = "finite numbers", .found = found()});
  if (at == 0 || (point.deflection_rad > points[at - 1].deflection_rad &&
                  point.torque_Nm > points[at - 1].torque_Nm))
    return;
  throw Error({.place = kPlace,
               .expected = fmt::format("deflections and torques that increase from point to point, "
                                       "above {} rad and {} Nm",
                                       points[at - 1].deflection_rad, points[at - 1].torque_Nm),
               .found = found(),
               .advice = "A measured hysteresis loop has two branches: give their mean, in the "
                         "order of the deflection."});
}

void check(const std::vector<TorqueTable::Point>& points) {
  if (points.size() < 2 || points.size() > TorqueTable::kMaxPoints)
    throw Error({.place = kPlace,
                 .expected = fmt::format("2 to {} points", TorqueTable::kMaxPoints),
                 .found = fmt::format("{}", points.size())});
  for (std::size_t at = 0; at < points.size(); ++at) check_point(points, at);
  const TorqueTable::Point& first = points.front();
  const TorqueTable::Point& last = points.back();
  if (first.deflection_rad <= 0.0 && last.deflection_rad >= 0.0 && first.torque_Nm <= 0.0 &&
      last.torque_Nm >= 0.0)
    return;
  throw Error({.place = kPlace,
               .expected = "points on both sides of zero deflection and zero torque",
               .found = fmt::format("{} to {} rad, {} to {} Nm", first.deflection_rad,
                                    last.deflection_rad, first.torque_Nm, last.torque_Nm),
               .advice = "Give both halves of a symmetric spring."});
}

}  // namespace

TorqueTable::TorqueTable(const std::vector<Point>& points) {
  check(points);
  double energy_J = 0.0;
  for (std::size_t at = 0; at + 1 < points.size(); ++at) {
    const double width_rad = points[at + 1].deflection_rad - points[at].deflection_rad;
    const double slope_Nm_rad = (points[at + 1].torque_Nm - points[at].torque_Nm) / width_rad;
    if (!(slope_Nm_rad > 0.0 && std::isfinite(slope_Nm_rad)))
      throw Error({.place = kPlace,
                   .expected = "a finite slope above 0",
                   .found = fmt::format("{} Nm/rad after point {}", slope_Nm_rad, at + 1)});
    segments_.push_back({points[at].deflection_rad, points[at].torque_Nm, slope_Nm_rad, energy_J});
    energy_J += 0.5 * width_rad * (points[at].torque_Nm + points[at + 1].torque_Nm);
    steepest_Nm_rad_ = std::max(steepest_Nm_rad_, slope_Nm_rad);
    flattest_Nm_rad_ = std::min(flattest_Nm_rad_, slope_Nm_rad);
  }
  energy_at_zero_J_ = energy_from_first(0.0);
}

namespace {

/// The segment of a value of one coordinate, which increases; the outermost ones beyond the points.
template <class Segments, class Coordinate>
const auto& segment_at(const Segments& segments, double value, Coordinate coordinate) noexcept {
  const auto after = std::ranges::upper_bound(segments, value, {}, coordinate);
  return after == segments.begin() ? segments.front() : *(after - 1);
}

}  // namespace

double TorqueTable::torque(double deflection_rad) const noexcept {
  const Segment& segment = segment_at(segments_, deflection_rad, &Segment::deflection_rad);
  return segment.torque_Nm + segment.slope_Nm_rad * (deflection_rad - segment.deflection_rad);
}

double TorqueTable::deflection(double torque_Nm) const noexcept {
  const Segment& segment = segment_at(segments_, torque_Nm, &Segment::torque_Nm);
  return segment.deflection_rad + (torque_Nm - segment.torque_Nm) / segment.slope_Nm_rad;
}

double TorqueTable::energy_from_first(double deflection_rad) const noexcept {
  const Segment& segment = segment_at(segments_, deflection_rad, &Segment::deflection_rad);
  const double twist_rad = deflection_rad - segment.deflection_rad;
  return segment.energy_J +
         twist_rad * (segment.torque_Nm + 0.5 * segment.slope_Nm_rad * twist_rad);
}

double TorqueTable::energy(double deflection_rad) const noexcept {
  return energy_from_first(deflection_rad) - energy_at_zero_J_;
}

}  // namespace torsio
