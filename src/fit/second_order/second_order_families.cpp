#include "fit/second_order/second_order_families.hpp"

#include "fit/common/fitted_model.hpp"
#include "fit/second_order/fit_dynamic_bouc_wen.hpp"
#include "fit/second_order/fit_rigid_drive.hpp"

namespace torsio {

std::vector<FamilyInfo> second_order_families() {
  return {family_of<fit_dynamic_bouc_wen>(
              {.name = DynamicBoucWen::kFamily,
               .summary = "mass, damper and spring beside a Bouc-Wen element, driven by a force",
               .is_spring = traits_of<DynamicBoucWen>().is_spring,
               .only_if_named = true}),
          family_of<fit_rigid_drive>(
              {.name = RigidDrive::kFamily,
               .summary = "inertia with viscous and dry friction, driven by a force",
               .is_spring = traits_of<RigidDrive>().is_spring,
               .only_if_named = true})};
}

}  // namespace torsio
