#pragma once

#include <concepts>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "torsio/model/bouc_wen_model.hpp"
#include "torsio/model/dgmm.hpp"
#include "torsio/model/dynamic_bouc_wen.hpp"
#include "torsio/model/ensemble.hpp"
#include "torsio/model/exponential_loading.hpp"
#include "torsio/model/friction_drive.hpp"
#include "torsio/model/gaussian_process.hpp"
#include "torsio/model/grey_box.hpp"
#include "torsio/model/gru.hpp"
#include "torsio/model/hammerstein_wiener.hpp"
#include "torsio/model/improved_prandtl_ishlinskii.hpp"
#include "torsio/model/linear.hpp"
#include "torsio/model/linear_coulomb.hpp"
#include "torsio/model/lstm.hpp"
#include "torsio/model/mlp.hpp"
#include "torsio/model/model.hpp"
#include "torsio/model/multivariate_polynomial.hpp"
#include "torsio/model/narx.hpp"
#include "torsio/model/nonlinear_backlash.hpp"
#include "torsio/model/operator_sum.hpp"
#include "torsio/model/parametric_gp.hpp"
#include "torsio/model/polynomial.hpp"
#include "torsio/model/viscoelastic.hpp"

namespace torsio {

template <class... Family>
struct FamilyList {
  using Models = std::variant<Family...>;
  using Parameters = std::variant<typename Family::Parameters...>;
  template <class M>
  static constexpr bool kHolds = (std::same_as<M, Family> || ...);
};

/// Every family that model files and the command line know: one line each.
using KnownFamilies = FamilyList<Linear,                        //
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
                                 FrictionDrive,                 //
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
                                 Narx<GaussianProcess>,         //
                                 Narx<ParametricGp>>;

/// A model that can run backwards: from the target to its first input, whose value in `features`
/// is at most where a search starts. `invert` says a finite value in every case; it may need scratch
/// space, so it is not const.
template <class M>
concept Invertible = requires(M& model, double target, Features features) {
  { model.invert(target, features) } noexcept -> std::same_as<Estimate>;
};

/// A model whose family is known only at run time. Dispatch is a switch: no virtual call, nothing
/// allocated.
class AnyModel {
 public:
  using Parameters = KnownFamilies::Parameters;

  /// @throws Error if the family refuses its parameters.
  explicit AnyModel(const Parameters& parameters);
  template <class Family>
    requires KnownFamilies::kHolds<Family>
  AnyModel(Family model) : model_(std::move(model)) {}

  /// As model files spell it: "linear".
  [[nodiscard]] std::string_view family() const noexcept;
  [[nodiscard]] Parameters parameters() const;
  [[nodiscard]] std::size_t input_count() const noexcept;
  [[nodiscard]] std::size_t parameter_count() const noexcept;

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  [[nodiscard]] bool feeds_back() const noexcept;  ///< its own output, as `FeedsBack` families do
  /// Puts a measurement in the place of the last output; nothing to a model that does not feed back.
  void correct(double measured) noexcept TORSIO_REALTIME;
  /// Memory of `HasState` families; empty for others.
  [[nodiscard]] std::span<const double> state() const noexcept;
  /// As the family's own; nothing to a family without. @param state `state().size()` numbers.
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME;
  /// What the last layer of a network saw in the last step; empty for other families.
  [[nodiscard]] std::span<const float> last_layer_input() const noexcept;

  [[nodiscard]] bool can_invert() const noexcept;
  /// The first input at which the model says `target`, the others being as given; see the family's
  /// own `invert`. Where `can_invert()` is false the given first input (0 if that is no
  /// number) comes back with `Fault::model_not_finite`.
  [[nodiscard]] Estimate invert(double target, Features features) noexcept TORSIO_REALTIME;

  /// The model as its own family, or null.
  template <class Family>
    requires KnownFamilies::kHolds<Family>
  [[nodiscard]] const Family* get_if() const noexcept {
    return std::get_if<Family>(&model_);
  }

 private:
  KnownFamilies::Models model_;
};

/// The family that a set of parameters belongs to.
[[nodiscard]] std::string_view family_of(const AnyModel::Parameters& parameters) noexcept;

/// Empty parameters of a family, to be filled by whoever reads them.
/// @throws UsageError that lists the families if there is none of that name.
[[nodiscard]] AnyModel::Parameters parameters_of_family(std::string_view family);

/// "linear, linear_coulomb, ...": the families of `KnownFamilies`, for messages.
[[nodiscard]] std::string known_model_families();

}  // namespace torsio
