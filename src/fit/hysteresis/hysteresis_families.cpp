#include "fit/hysteresis/hysteresis_families.hpp"

#include "fit/common/fitted_model.hpp"
#include "fit/hysteresis/fit_hysteresis.hpp"

namespace torsio {

std::vector<FamilyInfo> hysteresis_families() {
  return {family_of<fit_maxwell_slip>(
              {.name = MaxwellSlipModel::kFamily,
               .summary = "line and springs that slip: b + sum k x + sum clip(F + c dx)",
               .variations = {{"thresholds", "4"}, {"thresholds", "16"}}}),
          family_of<fit_prandtl_ishlinskii>(
              {.name = PrandtlIshlinskii::kFamily,
               .summary = "line and play operators: b + sum k x + sum w P[x]",
               .variations = {{"thresholds", "4"}, {"thresholds", "16"}}}),
          family_of<fit_improved_prandtl_ishlinskii>(
              {.name = ImprovedPrandtlIshlinskii::kFamily,
               .summary = "the same followed by a bent curve, thresholds growing with the rate",
               .only_if_named = true,
               .in_search = true,
               .typical_fit_s = 0.5}),
          family_of<fit_bouc_wen>(
              {.name = BoucWenModel::kFamily,
               .summary = "spring and a smooth hysteresis: b + alpha k x + (1 - alpha) k z",
               .only_if_named = true,
               .in_search = true,
               .typical_fit_s = 2.0}),
          family_of<fit_nonlinear_backlash>(
              {.name = NonlinearBacklash::kFamily,
               .summary = "a spring between two curves: clip(y + k dx, f_dc(x), f_ac(x))",
               .only_if_named = true,
               .in_search = true}),
          family_of<fit_improved_nonlinear_backlash>(
              {.name = ImprovedNonlinearBacklash::kFamily,
               .summary = "the same, the curves growing with the rate",
               .only_if_named = true}),
          family_of<fit_exponential_loading>(
              {.name = ExponentialLoading::kFamily,
               .summary = "nears one of two curves exponentially from the last reversal on",
               .only_if_named = true,
               .in_search = true})};
}

}  // namespace torsio
