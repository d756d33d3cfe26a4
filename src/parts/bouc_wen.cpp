#include "parts/bouc_wen.hpp"

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "Bouc-Wen friction";

}  // namespace

BoucWen::BoucWen(const Parameters& parameters)
    : parameters_(parameters),
      per_knee_(1.0 / parameters.knee_rad),
      limit_Nm_(parameters.constant_Nm) {
  require_not_negative(kPlace, "constant_Nm", parameters.constant_Nm);
  require_not_negative(kPlace, "load_factor", parameters.load_factor);
  require_positive(kPlace, "knee_rad", parameters.knee_rad);
}

}  // namespace torsio
