#include "torsio/fit/families.hpp"

#include <algorithm>
#include <vector>

#include "data/names.hpp"
#include "fit/common/fitted_model.hpp"
#include "fit/gaussian_process/gaussian_process_families.hpp"
#include "fit/grey_box/fit_grey_box.hpp"
#include "fit/hammerstein_wiener/hammerstein_wiener_families.hpp"
#include "fit/hysteresis/hysteresis_families.hpp"
#include "fit/linear/fit_linear.hpp"
#include "fit/linear/fit_polynomial.hpp"
#include "fit/linear/named_coefficients.hpp"
#include "fit/mixture/fit_dgmm.hpp"
#include "fit/narx/narx_families.hpp"
#include "fit/network/network_families.hpp"
#include "fit/second_order/second_order_families.hpp"
#include "fit/viscoelastic/fit_viscoelastic.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

ParameterDescription describe_network(const AnyParameters& parameters,
                                      const EstimatorSettings& /*settings*/) {
  constexpr int kDigits = 6;
  const auto& network = parameters.get<Viscoelastic::Parameters>().network;
  return {.lines = {"network " + text_of(network, kDigits)}, .covered = "network.nodes."};
}

std::vector<FamilyInfo> static_families() {
  return {
      family_of<fit_linear>({.name = Linear::kFamily,
                             .summary = "spring with a bias: b + sum k x",
                             .takes_levels = true,
                             .describe = describe_coefficients}),
      family_of<fit_linear_coulomb>(
          {.name = LinearCoulomb::kFamily,
           .summary = "spring with a bias and friction: b + sum k x + c tanh(r/v)",
           .describe = describe_coefficients}),
      family_of<fit_polynomial>(
          {.name = Polynomial::kFamily,
           .summary = "curve of the first input, one for each direction: P(x) + sum k x",
           .variations = {{"degree", "3"}, {"degree", "7"}},
           .describe = describe_coefficients}),
      family_of<fit_grey_box>(
          {.name = GreyBox::kFamily,
           .summary =
               "torsio's own: elastic curve, slip, relaxation and friction, as the data ask for",
           .variations = {{"passive", "true"}, {"residual", "none"}}}),
      family_of<fit_viscoelastic>(
          {.name = Viscoelastic::kFamily,
           .summary = "network of springs and dashpots that the first input deflects",
           .only_if_named = true,
           .in_search = true,
           .variations = {{"network", "standard_linear_solid"},
                          {"network", "generalised_maxwell(3)"}},
           .typical_fit_s = 1.0,
           .describe = describe_network}),
  };
}

std::vector<FamilyInfo> mixture_families() {
  return {family_of<fit_dgmm>(
              {.name = Dgmm::kFamily,
               .summary = "Gaussian mixture of target and inputs, learned sample by sample",
               .variations = {{"components", "100"}, {"components", "1000"}},
               .typical_fit_s = 0.4}),
          family_of<fit_dgmm_paper>(
              {.name = "dgmm_paper",
               .summary = "Algorithm 1 of paper 000, the sign of its update corrected: for "
                          "comparison only",
               .model_family = Dgmm::kFamily})};
}

}  // namespace

std::span<const FamilyInfo> families() noexcept {
  static const std::vector<FamilyInfo> all = [] {
    std::vector<FamilyInfo> list;
    for (const auto& room :
         {static_families(), hysteresis_families(), mixture_families(), gaussian_process_families(),
          network_families(), second_order_families(), hammerstein_wiener_families(),
          narx_families()})
      list.insert(list.end(), room.begin(), room.end());
    return list;
  }();
  return all;
}

bool has_option(const FamilyInfo& family, std::string_view option) noexcept {
  return std::ranges::find(family.options, option, &OptionInfo::name) != family.options.end();
}

const FamilyInfo& find_family(std::string_view name) {
  const auto all = families();
  const auto family = std::ranges::find(all, name, &FamilyInfo::name);
  if (family != all.end()) return *family;
  std::vector<std::string> names;
  names.reserve(all.size());
  for (const FamilyInfo& each : all) names.emplace_back(each.name);
  throw UsageError(
      {.problem = "no model family is called \"" + std::string(name) + '"',
       .expected = "one of " + joined(names),
       .advice = name.find(':') == std::string_view::npos
                     ? did_you_mean(name, names)
                     : "Give one model and its options as --model FAMILY --set NAME=VALUE."});
}

}  // namespace torsio
