#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "model/gaussian_process/gaussian_process.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "model/grey_box/grey_box.hpp"
#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "model/hysteresis/bouc_wen_model.hpp"
#include "model/hysteresis/exponential_loading.hpp"
#include "model/hysteresis/improved_prandtl_ishlinskii.hpp"
#include "model/hysteresis/nonlinear_backlash.hpp"
#include "model/hysteresis/operator_sum.hpp"
#include "model/linear/linear.hpp"
#include "model/linear/linear_coulomb.hpp"
#include "model/linear/polynomial.hpp"
#include "model/mixture/dgmm.hpp"
#include "model/narx/multivariate_polynomial.hpp"
#include "model/narx/narx.hpp"
#include "model/network/ensemble.hpp"
#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "model/second_order/dynamic_bouc_wen.hpp"
#include "model/second_order/rigid_drive.hpp"
#include "model/viscoelastic/viscoelastic.hpp"
#include "torsio/core/error.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

template <NamedFamily... Family>
struct FamilyList {
  static constexpr std::size_t kSize = sizeof...(Family);
  static constexpr std::array<std::string_view, kSize> kNames{Family::kFamily...};
  template <template <class...> class Template>
  using In = Template<Family...>;
  template <class More>
  using With = FamilyList<Family..., More>;

  /// Calls `use(std::type_identity<F>())` for each family in turn.
  template <class Use>
  static void for_each(const Use& use) {
    (use(std::type_identity<Family>()), ...);
  }
};

/// Every family that model files can hold: one line each.
using AllFamilies = FamilyList<Linear,                        //
                               LinearCoulomb,                 //
                               Polynomial,                    //
                               MaxwellSlipModel,              //
                               PrandtlIshlinskii,             //
                               ImprovedPrandtlIshlinskii,     //
                               BoucWenModel,                  //
                               NonlinearBacklash,             //
                               ImprovedNonlinearBacklash,     //
                               ExponentialLoading,            //
                               GreyBox,                       //
                               Viscoelastic,                  //
                               HammersteinWiener,             //
                               DynamicBoucWen,                //
                               RigidDrive,                    //
                               Dgmm,                          //
                               GaussianProcess,               //
                               ParametricGp,                  //
                               Mlp,                           //
                               Lstm,                          //
                               Gru,                           //
                               MlpEnsemble,                   //
                               LstmEnsemble,                  //
                               GruEnsemble,                   //
                               Narx<Linear>,                  //
                               Narx<MultivariatePolynomial>,  //
                               Narx<Dgmm>,                    //
                               Narx<Mlp>,                     //
                               Narx<Lstm>,                    //
                               Narx<GaussianProcess>,         //
                               Narx<ParametricGp>>;

namespace detail {

/// Whether a comma-separated list has the name.
consteval bool lists(std::string_view list, std::string_view name) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    if (list.substr(0, end) == name) return true;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

/// The families of a list whose name is in TORSIO_FAMILIES.
template <class Kept, class... Rest>
struct Named {
  using Type = Kept;
};
#ifdef TORSIO_FAMILIES
template <class Kept, class First, class... Rest>
struct Named<Kept, First, Rest...> {
  using Next = std::conditional_t<lists(TORSIO_FAMILIES, First::kFamily),
                                  typename Kept::template With<First>, Kept>;
  using Type = typename Named<Next, Rest...>::Type;
};
template <class... Family>
using NamedFamilies = typename Named<FamilyList<>, Family...>::Type;

consteval bool all_are_known() {
  std::string_view list = TORSIO_FAMILIES;
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(','), list.size());
    if (std::ranges::find(AllFamilies::kNames, list.substr(0, end)) == AllFamilies::kNames.end())
      return false;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return true;
}
static_assert(all_are_known(), "TORSIO_FAMILIES names a family that is not in AllFamilies");
#endif

}  // namespace detail

/// What this build reads and writes: all, or those of -DTORSIO_FAMILIES=linear,grey_box.
#ifdef TORSIO_FAMILIES
using KnownFamilies = AllFamilies::In<detail::NamedFamilies>;
#else
using KnownFamilies = AllFamilies;
#endif

/// Calls `use` with the parameters as their own type. @throws Error if this build does not know
/// them.
template <class Parameters, class Use>
void with_own_type(Parameters& parameters, const Use& use) {
  bool is_known = false;
  KnownFamilies::for_each([&]<class F>(std::type_identity<F> /*family*/) {
    if (is_known) return;
    if (auto* const own = parameters.template get_if<typename F::Parameters>()) {
      is_known = true;
      use(*own);
    }
  });
  if (!is_known)
    throw Error({.place = "family",
                 .expected = "one that this build of torsio has",
                 .found = std::string(parameters.family()),
                 .advice = "A build with -DTORSIO_FAMILIES has only those that it names."});
}

}  // namespace torsio
