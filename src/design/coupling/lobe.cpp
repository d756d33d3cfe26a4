#include "torsio/design/coupling/lobe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/checks.hpp"

namespace torsio::design {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLobePitch_rad = std::numbers::pi / 6.0;  // half of the pitch of six lobes
constexpr int kRadiiChecked = 64;

struct Point {
  double x_mm = 0.0;
  double y_mm = 0.0;
};

Point on_chord(const LobeShape& shape, double radius_mm) {
  const double slope = std::tan(0.5 * shape.slot_angle_deg * kDegree);
  const double offset_mm = shape.half_width_mm - shape.root_radius_mm * slope;
  const double a = 1.0 + slope * slope;
  const double b = slope * offset_mm;
  const double c = offset_mm * offset_mm - radius_mm * radius_mm;
  const double x_mm = (-b + std::sqrt(b * b - a * c)) / a;
  return {x_mm, offset_mm + slope * x_mm};
}

[[noreturn]] void refuse_shape(std::string_view expected, std::string_view found,
                               std::string_view advice = {}) {
  refuse<UsageError>("geometry of the lobe", expected, found, advice);
}

void check_numbers(const LobeShape& s) {
  for (const double value : {s.outer_radius_mm, s.root_radius_mm, s.half_width_mm, s.slot_angle_deg,
                             s.flank_radius_mm, s.taper_mm, s.ring_radius_mm})
    if (!std::isfinite(value)) refuse_shape("finite numbers", as_text(value));
  if (!(s.root_radius_mm > 0.0 && s.outer_radius_mm > s.root_radius_mm))
    refuse_shape("0 < root radius < outer radius",
                 fmt::format("root {} mm, outer {} mm", s.root_radius_mm, s.outer_radius_mm),
                 "exchange or correct the radii");
  if (!(s.half_width_mm > 0.0 && s.half_width_mm < s.root_radius_mm))
    refuse_shape("0 < half width < root radius", fmt::format("{} mm", s.half_width_mm),
                 "choose a narrower slot");
  if (!(std::abs(s.slot_angle_deg) < 90.0))
    refuse_shape("a slot angle between -90 and 90 degrees",
                 fmt::format("{} degrees", s.slot_angle_deg), "choose a smaller angle");
  if (!(s.taper_mm >= 0.0 && s.taper_mm < 0.5 * (s.outer_radius_mm - s.root_radius_mm)))
    refuse_shape("a taper from 0 to half of the lobe's height", fmt::format("{} mm", s.taper_mm),
                 "choose a smaller taper");
  if (!(s.ring_radius_mm >= 0.0 && s.ring_radius_mm < 0.95 * s.root_radius_mm))
    refuse_shape("a radius of the ring from 0 (no ring) to 0.95 times the root radius",
                 fmt::format("{} mm", s.ring_radius_mm), "choose a smaller radius");
}

}  // namespace

const std::vector<NamedLobe>& paper_lobes() {
  static const std::vector<NamedLobe> lobes = {
      {"alpha", {.half_width_mm = 2.0, .flank_radius_mm = 11.5}},
      {"beta", {.slot_angle_deg = 20.0, .flank_radius_mm = -20.0, .taper_mm = 0.5}},
      {"gamma", {.slot_angle_deg = 20.0, .flank_radius_mm = -10.0}},
      {"delta", {}},
      {"epsilon", {.slot_angle_deg = 20.0}},
      {"zeta", {.slot_angle_deg = 40.0}},
      {"eta", {.slot_angle_deg = 20.0, .flank_radius_mm = -20.0}},
  };
  return lobes;
}

const LobeShape& paper_lobe(std::string_view name) {
  const auto& lobes = paper_lobes();
  const auto found = std::find_if(lobes.begin(), lobes.end(),
                                  [&](const NamedLobe& lobe) { return lobe.name == name; });
  if (found == lobes.end())
    refuse_shape("alpha, beta, gamma, delta, epsilon, zeta or eta", std::string(name),
                 "choose one of these names");
  return found->shape;
}

double flank_angle_rad(const LobeShape& shape, double radius_mm) {
  if (shape.flank_radius_mm == 0.0) {
    const Point point = on_chord(shape, radius_mm);
    return std::atan2(point.y_mm, point.x_mm);
  }
  const Point a = on_chord(shape, shape.root_radius_mm);
  const Point b = on_chord(shape, shape.outer_radius_mm);
  const double chord_mm = std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm);
  const double arc_mm = std::abs(shape.flank_radius_mm);
  const double height_mm = std::sqrt(arc_mm * arc_mm - 0.25 * chord_mm * chord_mm);
  // The arc's centre lies inside the lobe where the flank bulges, beyond the flank where it does
  // not.
  const double side = shape.flank_radius_mm > 0.0 ? -1.0 : 1.0;
  const double centre_x_mm =
      0.5 * (a.x_mm + b.x_mm) - side * height_mm * (b.y_mm - a.y_mm) / chord_mm;
  const double centre_y_mm =
      0.5 * (a.y_mm + b.y_mm) + side * height_mm * (b.x_mm - a.x_mm) / chord_mm;
  // Law of cosines in the triangle origin, centre, point of the flank.
  const double centre_mm = std::hypot(centre_x_mm, centre_y_mm);
  const double cosine = (radius_mm * radius_mm + centre_mm * centre_mm - arc_mm * arc_mm) /
                        (2.0 * radius_mm * centre_mm);
  const double direction_rad = std::atan2(centre_y_mm, centre_x_mm);
  return direction_rad - side * std::acos(std::clamp(cosine, -1.0, 1.0));
}

double thinnest_jaw_mm(const LobeShape& shape) {
  double thinnest_mm = shape.outer_radius_mm;
  for (int i = 0; i <= kRadiiChecked; ++i) {
    const double radius_mm = std::lerp(shape.root_radius_mm, shape.outer_radius_mm,
                                       static_cast<double>(i) / kRadiiChecked);
    const double half_rad = kLobePitch_rad - flank_angle_rad(shape, radius_mm);
    thinnest_mm = std::min(thinnest_mm, 2.0 * radius_mm * std::sin(half_rad));
  }
  return thinnest_mm;
}

void check_lobe(const LobeShape& shape, double least_jaw_mm) {
  check_numbers(shape);
  const Point a = on_chord(shape, shape.root_radius_mm);
  const Point b = on_chord(shape, shape.outer_radius_mm);
  const double chord_mm = std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm);
  if (shape.flank_radius_mm != 0.0 && std::abs(shape.flank_radius_mm) < 0.5 * chord_mm)
    refuse_shape("a flank radius of at least half the flank's chord",
                 fmt::format("{} mm for a chord of {:.3f} mm", shape.flank_radius_mm, chord_mm),
                 "choose a larger flank radius, or 0 for a straight flank");
  for (int i = 0; i <= kRadiiChecked; ++i) {
    const double radius_mm = std::lerp(shape.root_radius_mm, shape.outer_radius_mm,
                                       static_cast<double>(i) / kRadiiChecked);
    if (!(flank_angle_rad(shape, radius_mm) > 0.0))
      refuse_shape("flanks that do not cross the lobe's axis",
                   fmt::format("no rubber left at radius {:.3f} mm", radius_mm),
                   "choose a wider slot, a larger flank radius or a larger angle");
  }
  const double jaw_mm = thinnest_jaw_mm(shape);
  if (!(jaw_mm >= least_jaw_mm))
    refuse_shape("jaws between the lobes",
                 fmt::format("{:.3f} mm, at least {} mm are needed", jaw_mm, least_jaw_mm),
                 "choose a narrower slot or a smaller slot angle");
}

}  // namespace torsio::design
