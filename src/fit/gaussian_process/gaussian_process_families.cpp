#include "fit/gaussian_process/gaussian_process_families.hpp"

#include "fit/common/fitted_model.hpp"
#include "fit/gaussian_process/fit_gaussian_process.hpp"
#include "fit/gaussian_process/fit_parametric_gp.hpp"
#include "fit/gaussian_process/fit_parametric_gp_paper.hpp"
#include "fit/gaussian_process/kernel_search.hpp"

namespace torsio {
namespace {

template <class Process>
ParameterDescription describe_kernel(const AnyParameters& parameters,
                                     const EstimatorSettings& /*settings*/) {
  const auto& kernel = parameters.get<typename Process::Parameters>().kernel;
  return {.lines = {"kernel " + description_of(kernel)}, .covered = "kernel."};
}

}  // namespace

std::vector<FamilyInfo> gaussian_process_families() {
  return {
      family_of<fit_gaussian_process>(
          {.name = GaussianProcess::kFamily,
           .summary = "exact Gaussian process over some hundred samples",
           .typical_fit_s = 2.0,
           .describe = describe_kernel<GaussianProcess>}),
      family_of<fit_parametric_gp>(
          {.name = ParametricGp::kFamily,
           .summary = "Gaussian process at a few inducing points, learned sample by sample",
           .describe = describe_kernel<ParametricGp>}),
      family_of<fit_parametric_gp_paper>(
          {.name = "parametric_gp_paper",
           .summary = "the same by Algorithm 1 of paper 002 as printed, for comparison",
           .model_family = ParametricGp::kFamily,
           .only_if_named = true}),
      family_of<fit_variational_gp>({.name = "parametric_gp_variational",
                                     .summary = "the same by a variational bound, in closed form",
                                     .model_family = ParametricGp::kFamily,
                                     .typical_fit_s = 1.0})};
}

}  // namespace torsio
