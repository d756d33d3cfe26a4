#include "torsio/design/coupling/coupling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <future>

#include "torsio/core/error.hpp"

namespace torsio::design {
namespace {

constexpr double kStep_deg = 1.0;
constexpr std::size_t kLobes = 2;

void check(const CouplingDemand& d) {
  const auto within = [](const char* what, const char* unit, double value, double low,
                         double high) {
    if (!(value >= low && value <= high))
      throw UsageError({.place = what,
                        .expected = fmt::format("{} to {}{}", low, high, unit),
                        .found = fmt::format("{:.6g}{}", value, unit)});
  };
  within("angle of the coupling", " degrees", d.angle_deg, 0.01, 30.0);
  within("length of the coupling", " mm", d.length_mm, 0.1, 1000.0);
  if (!(d.bulk_ratio >= 20.0 && d.bulk_ratio <= 10000.0))
    throw UsageError({.place = "bulk ratio",
                      .expected = "20 to 10000, the bulk modulus over the shear modulus",
                      .found = fmt::format("{:.6g}", d.bulk_ratio),
                      .advice = "the bulk modulus of rubber is about 2000 MPa, a ratio of 500"});
  if (d.layers < 0 || d.layers > 20)
    throw UsageError({.place = "layers of elements",
                      .expected = "0 (plane strain) to 20",
                      .found = fmt::format("{}", d.layers)});
  check_lobe(d.shape);
}

std::vector<double> twists_to(double angle_deg) {
  std::vector<double> twists;
  for (double twist = kStep_deg; std::abs(twist) < std::abs(angle_deg) - 1e-9; twist += kStep_deg)
    twists.push_back(std::copysign(twist, angle_deg));
  twists.push_back(angle_deg);
  return twists;
}

LobeCurve best_curve(const CouplingDemand& demand, double angle_deg, const std::stop_token& stop) {
  const Rubber rubber{.shear_modulus_MPa = 1.0, .bulk_modulus_MPa = demand.bulk_ratio};
  const auto& meshes = coupling_meshes();
  LobeCurve best;
  for (std::size_t i = std::min(demand.finest_mesh, meshes.size() - 1); i < meshes.size(); ++i) {
    LobeMesh mesh = mesh_lobe(demand.shape, meshes[i]);
    mesh.layers = demand.layers;
    mesh.half_length_mm = 0.5 * demand.length_mm;
    TwistCurve curve = twist_lobe(mesh, rubber, twists_to(angle_deg), demand.limits, stop);
    const bool is_whole = curve.stopped_by.empty();
    if (best.mesh.nodes.empty() || curve.steps.size() > best.curve.steps.size())
      best = {std::move(curve), meshes[i], std::move(mesh)};
    if (is_whole) break;
  }
  return best;
}

}  // namespace

StrainMetric strain_metric(std::string_view name) {
  if (name == "0.8mm") return StrainMetric::outside_800um;
  if (name == "0.3mm") return StrainMetric::outside_300um;
  if (name == "all") return StrainMetric::everywhere;
  throw UsageError(
      {.place = "strain metric", .expected = "0.8mm, 0.3mm or all", .found = std::string(name)});
}

double strain_of(const TwistStep& step, StrainMetric metric) noexcept {
  if (metric == StrainMetric::outside_800um) return step.strain_outside_800um;
  return metric == StrainMetric::outside_300um ? step.strain_outside_300um : step.strain;
}

const std::vector<MeshDensity>& coupling_meshes() {
  static const std::vector<MeshDensity> meshes = {{.radial = 20, .across = 14, .grading = 1.2},
                                                  {.radial = 12, .across = 8, .grading = 1.0},
                                                  {.radial = 8, .across = 6, .grading = 1.0}};
  return meshes;
}

CouplingTwist twist_coupling(const CouplingDemand& demand, const Progress& progress) {
  check(demand);
  if (demand.jobs < 1) throw UsageError({.place = "jobs", .expected = "1 or more", .found = "0"});
  std::stop_source stop;
  CouplingTwist twist;
  const std::array<LobeCurve*, kLobes> targets{&twist.compressed, &twist.stretched};
  // The first lobe runs beside the second one, or before it.
  std::vector<std::future<LobeCurve>> runs;
  const auto start = [&](std::size_t lobe) {
    const double angle_deg = lobe == 0 ? demand.angle_deg : -demand.angle_deg;
    runs.push_back(
        std::async(std::launch::async, best_curve, std::cref(demand), angle_deg, stop.get_token()));
  };
  for (std::size_t lobe = 0; lobe < std::min(demand.jobs, kLobes); ++lobe) start(lobe);
  for (std::size_t lobe = 0; lobe < kLobes; ++lobe) {
    if (lobe == runs.size()) start(lobe);
    while (runs[lobe].wait_for(std::chrono::milliseconds(20)) != std::future_status::ready)
      if (progress && !progress(static_cast<double>(lobe) / kLobes,
                                lobe == 0 ? "compressed lobe" : "stretched lobe"))
        stop.request_stop();
    try {
      *targets.at(lobe) = runs[lobe].get();
    } catch (...) {
      stop.request_stop();  // the futures wait for their ends
      throw;
    }
  }
  return twist;
}

std::vector<std::pair<double, double>> torque_curve(const CouplingTwist& twist, double length_mm,
                                                    double shear_modulus_MPa) {
  const auto& compressed = twist.compressed.curve.steps;
  const auto& stretched = twist.stretched.curve.steps;
  std::vector<std::pair<double, double>> curve = {{0.0, 0.0}};
  for (std::size_t i = 0; i < std::min(compressed.size(), stretched.size()); ++i)
    curve.emplace_back(compressed[i].twist_deg,
                       3.0e-3 * length_mm * shear_modulus_MPa *
                           (std::abs(compressed[i].torque_N) + std::abs(stretched[i].torque_N)));
  return curve;
}

std::optional<double> torque_at(const std::vector<std::pair<double, double>>& curve,
                                double angle_deg) {
  for (std::size_t i = 1; i < curve.size(); ++i) {
    const auto& [a, low] = curve[i - 1];
    const auto& [b, high] = curve[i];
    if (angle_deg >= a && angle_deg <= b + 1e-9)
      return std::lerp(low, high, std::min((angle_deg - a) / (b - a), 1.0));
  }
  return std::nullopt;
}

std::optional<double> angle_at_strain(const CouplingTwist& twist, double strain,
                                      StrainMetric metric) {
  std::optional<double> least_deg;
  for (const LobeCurve* lobe : {&twist.compressed, &twist.stretched}) {
    double last_deg = 0.0;
    double last = 0.0;
    for (const TwistStep& step : lobe->curve.steps) {
      const double now_deg = std::abs(step.twist_deg);
      const double now = strain_of(step, metric);
      if (now >= strain) {
        const double at_deg = std::lerp(last_deg, now_deg, (strain - last) / (now - last));
        least_deg = std::min(at_deg, least_deg.value_or(at_deg));
        break;
      }
      last_deg = now_deg;
      last = now;
    }
  }
  // Beyond the last twist of the other lobe its strain is unknown, and so is the torque.
  const std::size_t both =
      std::min(twist.compressed.curve.steps.size(), twist.stretched.curve.steps.size());
  if (!least_deg || both == 0 ||
      *least_deg > std::abs(twist.compressed.curve.steps[both - 1].twist_deg))
    return std::nullopt;
  return least_deg;
}

}  // namespace torsio::design
