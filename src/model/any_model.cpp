#include "torsio/model/any_model.hpp"

#include <array>
#include <optional>
#include <type_traits>

#include "model/affine_inverse.hpp"
#include "torsio/core/dispatch.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

static_assert(Model<AnyModel> && Model<Linear> && Model<LinearCoulomb> && Model<Polynomial> &&
              Model<Dgmm> && Model<GaussianProcess> && Model<ParametricGp> && Model<Mlp> &&
              Model<Lstm> && Model<Gru> && Model<MlpEnsemble> && Model<LstmEnsemble> &&
              Model<GruEnsemble> && FeedsBack<Narx<Linear>> &&
              FeedsBack<Narx<MultivariatePolynomial>> && FeedsBack<Narx<Dgmm>> &&
              FeedsBack<Narx<Mlp>> && FeedsBack<Narx<GaussianProcess>> &&
              FeedsBack<Narx<ParametricGp>>);
static_assert(HasState<MaxwellSlipModel> && HasState<PrandtlIshlinskii> &&
              HasState<ImprovedPrandtlIshlinskii> && HasState<BoucWenModel> &&
              HasState<NonlinearBacklash> && HasState<ImprovedNonlinearBacklash> &&
              HasState<ExponentialLoading> && HasState<HammersteinWiener> &&
              HasState<Viscoelastic> && HasState<GreyBox> && HasState<DynamicBoucWen> &&
              HasState<FrictionDrive>);
static_assert(Invertible<AnyModel>);

template <class... Family>
constexpr auto family_names(std::type_identity<std::variant<Family...>> /*models*/) {
  return std::array<std::string_view, sizeof...(Family)>{Family::kFamily...};
}

template <class... Family>
std::optional<AnyModel::Parameters> empty_parameters(
    std::string_view family, std::type_identity<std::variant<Family...>> /*models*/) {
  std::optional<AnyModel::Parameters> found;
  ((family == Family::kFamily ? void(found = typename Family::Parameters{}) : void()), ...);
  return found;
}

constexpr std::type_identity<KnownFamilies::Models> kModels;
constexpr auto kNames = family_names(kModels);

template <class... Family>
KnownFamilies::Models construct(const AnyModel::Parameters& parameters,
                                std::type_identity<std::variant<Family...>> /*models*/) {
  std::optional<KnownFamilies::Models> model;
  const auto take = [&]<class F>(std::type_identity<F>) {
    if (const auto* own = std::get_if<typename F::Parameters>(&parameters)) model.emplace(F(*own));
  };
  (take(std::type_identity<Family>{}), ...);
  return *std::move(model);
}

}  // namespace

AnyModel::AnyModel(const Parameters& parameters) : model_(construct(parameters, kModels)) {}

std::string_view AnyModel::family() const noexcept { return kNames[model_.index()]; }

AnyModel::Parameters AnyModel::parameters() const {
  return std::visit([](const auto& model) -> Parameters { return model.parameters(); }, model_);
}

std::size_t AnyModel::input_count() const noexcept {
  return dispatch(model_, [](const auto& model) { return model.input_count(); });
}

std::size_t AnyModel::parameter_count() const noexcept {
  return dispatch(model_, [](const auto& model) { return model.parameter_count(); });
}

void AnyModel::reset() noexcept {
  dispatch(model_, [](auto& model) { model.reset(); });
}

Estimate AnyModel::step(Features features) noexcept {
  return dispatch(model_, [&](auto& model) { return model.step(features); });
}

bool AnyModel::feeds_back() const noexcept {
  return dispatch(model_, []<class M>(const M&) { return FeedsBack<M>; });
}

void AnyModel::correct(double measured) noexcept {
  dispatch(model_, [&]<class M>(M& model) {
    if constexpr (FeedsBack<M>) model.correct(measured);
  });
}

std::span<const double> AnyModel::state() const noexcept {
  return dispatch(model_, []<class M>(const M& model) -> std::span<const double> {
    if constexpr (HasState<M>) {
      return model.state();
    } else {
      return {};
    }
  });
}

void AnyModel::set_state(std::span<const double> state) noexcept {
  dispatch(model_, [&]<class M>(M& model) {
    if constexpr (HasState<M>) model.set_state(state);
  });
}

std::span<const float> AnyModel::last_layer_input() const noexcept {
  return dispatch(model_, [](const auto& model) -> std::span<const float> {
    if constexpr (requires { model.last_layer_input(); }) {
      return model.last_layer_input();
    } else {
      return {};
    }
  });
}

bool AnyModel::can_invert() const noexcept {
  return dispatch(model_, []<class M>(const M&) { return Invertible<M>; });
}

Estimate AnyModel::invert(double target, Features features) noexcept {
  return dispatch(model_, [&]<class M>(M& model) -> Estimate {
    if constexpr (Invertible<M>) {
      return model.invert(target, features);
    } else {
      return no_inverse(features);
    }
  });
}

std::string_view family_of(const AnyModel::Parameters& parameters) noexcept {
  return kNames[parameters.index()];
}

AnyModel::Parameters parameters_of_family(std::string_view family) {
  if (auto found = empty_parameters(family, kModels)) return *std::move(found);
  throw UsageError({.problem = "no model family is called \"" + std::string(family) + '"',
                    .expected = "one of " + known_model_families()});
}

std::string known_model_families() {
  std::string list;
  for (const std::string_view family : kNames) {
    if (!list.empty()) list += ", ";
    list += family;
  }
  return list;
}

}  // namespace torsio
