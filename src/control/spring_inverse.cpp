#include "torsio/control/spring_inverse.hpp"

#include <cmath>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "spring inverse";

}  // namespace

LinearInverse::LinearInverse(double stiffness_Nm_rad, double offset_Nm)
    : stiffness_Nm_rad_(stiffness_Nm_rad), offset_Nm_(offset_Nm) {
  require_positive(kPlace, "stiffness_Nm_rad", stiffness_Nm_rad);
  require_parameter(std::isfinite(offset_Nm), kPlace, "a finite offset", offset_Nm);
}

}  // namespace torsio
