#include "fit/gaussian_process/gaussian_process_families.hpp"

#include "fit/common/fitted_model.hpp"
#include "fit/gaussian_process/fit_gaussian_process.hpp"
#include "fit/gaussian_process/fit_parametric_gp.hpp"

namespace torsio {

std::vector<FamilyInfo> gaussian_process_families() {
  return {
      family_of<fit_gaussian_process>(
          {.name = GaussianProcess::kFamily,
           .summary = "exact Gaussian process over some hundred samples"}),
      family_of<fit_parametric_gp>(
          {.name = ParametricGp::kFamily,
           .summary = "Gaussian process at a few inducing points, learned sample by sample"}),
      family_of<fit_variational_gp>({.name = "parametric_gp_variational",
                                     .summary = "the same by a variational bound, in closed form",
                                     .model_family = ParametricGp::kFamily})};
}

}  // namespace torsio
