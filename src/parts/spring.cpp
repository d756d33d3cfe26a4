#include "parts/spring.hpp"

#include "core/checks.hpp"

namespace torsio {
namespace {

struct FrictionOf {
  SpringFriction operator()(const MaxwellSlip<4>::Parameters& of) const {
    return MaxwellSlip<4>(of);
  }
  SpringFriction operator()(const BoucWen::Parameters& of) const { return BoucWen(of); }
  SpringFriction operator()(const LuGreSlip::Parameters& of) const { return LuGreSlip(of); }
};

std::optional<TorqueTable> table_of(const std::vector<TorqueTable::Point>& points) {
  if (points.empty()) return std::nullopt;
  return TorqueTable(points);
}

}  // namespace

Spring::Spring(const Parameters& parameters)
    : elastic_(parameters.elastic),
      table_(table_of(parameters.table)),
      friction_(std::visit(FrictionOf{}, parameters.friction)),
      viscosity_Nms_rad_(parameters.viscosity_Nms_rad) {
  require_not_negative("spring", "viscosity_Nms_rad", parameters.viscosity_Nms_rad);
}

void Spring::reset(double deflection_rad) noexcept {
  last_deflection_rad_ = deflection_rad;
  friction_Nm_ = 0.0;
  detail::dispatch(friction_, [](auto& friction) {
    friction.reset();
    return 0.0;
  });
}

double Spring::friction_energy() const noexcept {
  return detail::dispatch(friction_, [](const auto& friction) { return friction.energy(); });
}

double Spring::steepest(double load_Nm) const noexcept {
  const double elastic_Nm_rad = table_ ? table_->steepest() : elastic_.steepest();
  return elastic_Nm_rad + detail::dispatch(friction_, [=](const auto& friction) {
           return friction.stiffness(load_Nm);
         });
}

}  // namespace torsio
