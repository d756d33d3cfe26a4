#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

class AnyModel;
namespace detail {
class HeldModel;
class HeldParameters;
template <class M>
class HeldModelOf;
template <class P>
class HeldParametersOf;

/// Identifies a type by its address.
template <class T>
inline constexpr char kTypeTag = 0;
}  // namespace detail

/// The parameters of a model whose family is known only at run time. A value: a copy is deep.
class AnyParameters {
 public:
  template <class P>
    requires NamedFamily<typename P::Family>
  AnyParameters(P parameters)
      : held_(std::make_unique<detail::HeldParametersOf<P>>(std::move(parameters))) {}
  AnyParameters(const AnyParameters& other);
  AnyParameters& operator=(const AnyParameters& other);
  AnyParameters(AnyParameters&& other) noexcept;
  AnyParameters& operator=(AnyParameters&& other) noexcept;
  ~AnyParameters();

  /// As model files spell it: "linear".
  [[nodiscard]] std::string_view family() const noexcept;
  /// The same parameters at another sample rate, if the family is `Rediscretised` and the parameters
  /// have a sample period; else as they are.
  [[nodiscard]] AnyParameters at_sample_period(double sample_period_s) const;

  /// The parameters as their own type, or null.
  template <class P>
  [[nodiscard]] const P* get_if() const noexcept;
  template <class P>
  [[nodiscard]] P* get_if() noexcept;
  /// The same. @throws Error if they are those of another family.
  template <class P>
  [[nodiscard]] const P& get() const;
  template <class P>
  [[nodiscard]] P& get();

 private:
  friend class AnyModel;
  explicit AnyParameters(std::unique_ptr<detail::HeldParameters> held) noexcept;
  std::unique_ptr<detail::HeldParameters> held_;
};

/// A model whose family is known only at run time. A value: a copy is deep, a step is one virtual
/// call and allocates nothing. Any `NamedFamily` can be held, one of the user's own too; model files
/// hold those of `known_families.hpp`.
class AnyModel {
 public:
  using Parameters = AnyParameters;

  /// @throws Error if the family refuses its parameters.
  explicit AnyModel(const Parameters& parameters);
  template <NamedFamily Family>
  AnyModel(Family model) : held_(std::make_unique<detail::HeldModelOf<Family>>(std::move(model))) {}
  AnyModel(const AnyModel& other);
  AnyModel& operator=(const AnyModel& other);
  AnyModel(AnyModel&& other) noexcept;
  AnyModel& operator=(AnyModel&& other) noexcept;
  ~AnyModel();

  /// As model files spell it: "linear".
  [[nodiscard]] std::string_view family() const noexcept;
  [[nodiscard]] FamilyTraits traits() const noexcept;
  [[nodiscard]] Parameters parameters() const;
  [[nodiscard]] std::size_t input_count() const noexcept;
  [[nodiscard]] std::size_t parameter_count() const noexcept;
  /// At which a discrete model runs [s]; NaN of a static one.
  [[nodiscard]] double sample_period() const noexcept;
  /// Whether `AnyParameters::at_sample_period` takes its parameters to another sample rate.
  [[nodiscard]] bool is_rediscretised() const noexcept;

  /// As the family declares it; empty for a family that depends on the present inputs only.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;
  /// As `step`, for a caller that does not use the output, which some families then do not compute.
  /// @returns whether the output, or without one the memory, is finite
  [[nodiscard]] bool advance(Features features) noexcept TORSIO_REALTIME;

  [[nodiscard]] bool feeds_back() const noexcept;  ///< its own output, as `FeedsBack` families do
  /// Puts a measurement in the place of the last output; nothing to a model that does not feed back.
  void correct(double measured) noexcept TORSIO_REALTIME;
  /// Memory of `HasState` families; empty for others.
  [[nodiscard]] std::span<const double> state() const noexcept;
  /// As the family's own; nothing to a family without. @param state `state().size()` numbers.
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME;
  /// As the family lists it (`HasStateBytes`).
  void visit_state(detail::StateBytes& bytes) noexcept;
  /// Differs for the states of different models: family and parameters.
  [[nodiscard]] std::uint64_t state_identity() const noexcept;
  /// The input of a network's last layer in the last step; empty for other families.
  [[nodiscard]] std::span<const float> last_layer_input() const noexcept;

  [[nodiscard]] bool can_invert() const noexcept;
  /// The first input at which the model estimates `target`, the others being as given; see the
  /// family's own `invert`. Where `can_invert()` is false the given first input (0 if that is no
  /// number) comes back with `Fault::model_not_finite`.
  [[nodiscard]] Estimate invert(double target, Features features) noexcept TORSIO_REALTIME;

  /// The model as its own family, or null.
  template <class Family>
  [[nodiscard]] const Family* get_if() const noexcept;

 private:
  std::unique_ptr<detail::HeldModel> held_;
};

namespace detail {

class HeldModel {
 public:
  virtual ~HeldModel() = default;
  [[nodiscard]] virtual std::unique_ptr<HeldModel> copy() const = 0;
  [[nodiscard]] virtual const void* tag() const noexcept = 0;
  [[nodiscard]] virtual const void* model() const noexcept = 0;

  [[nodiscard]] virtual std::string_view family() const noexcept = 0;
  [[nodiscard]] virtual FamilyTraits traits() const noexcept = 0;
  [[nodiscard]] virtual AnyParameters parameters() const = 0;
  [[nodiscard]] virtual std::size_t input_count() const noexcept = 0;
  [[nodiscard]] virtual std::size_t parameter_count() const noexcept = 0;
  [[nodiscard]] virtual double sample_period() const noexcept = 0;
  [[nodiscard]] virtual bool is_rediscretised() const noexcept = 0;
  [[nodiscard]] virtual ModelMemory memory(const InputRanges& ranges) const = 0;
  virtual void reset() noexcept = 0;
  virtual Estimate step(Features features) noexcept = 0;
  virtual bool advance(Features features) noexcept = 0;
  [[nodiscard]] virtual bool feeds_back() const noexcept = 0;
  virtual void correct(double measured) noexcept = 0;
  [[nodiscard]] virtual std::span<const double> state() const noexcept = 0;
  virtual void set_state(std::span<const double> state) noexcept = 0;
  virtual void visit_state(StateBytes& bytes) noexcept = 0;
  [[nodiscard]] virtual std::uint64_t state_identity() const noexcept = 0;
  [[nodiscard]] virtual std::span<const float> last_layer_input() const noexcept = 0;
  [[nodiscard]] virtual bool can_invert() const noexcept = 0;
  virtual Estimate invert(double target, Features features) noexcept = 0;

 protected:
  HeldModel() = default;
  HeldModel(const HeldModel&) = default;
  HeldModel& operator=(const HeldModel&) = default;
};

class HeldParameters {
 public:
  virtual ~HeldParameters() = default;
  [[nodiscard]] virtual std::unique_ptr<HeldParameters> copy() const = 0;
  [[nodiscard]] virtual const void* tag() const noexcept = 0;
  [[nodiscard]] virtual void* parameters() noexcept = 0;
  [[nodiscard]] virtual std::string_view family() const noexcept = 0;
  [[nodiscard]] virtual std::unique_ptr<HeldModel> model() const = 0;
  [[nodiscard]] virtual std::unique_ptr<HeldParameters> at_sample_period(double period_s) const = 0;

 protected:
  HeldParameters() = default;
  HeldParameters(const HeldParameters&) = default;
  HeldParameters& operator=(const HeldParameters&) = default;
};

template <class M>
class HeldModelOf final : public HeldModel {
 public:
  explicit HeldModelOf(M model) : model_(std::move(model)) {}

  [[nodiscard]] std::unique_ptr<HeldModel> copy() const override {
    return std::make_unique<HeldModelOf>(*this);
  }
  [[nodiscard]] const void* tag() const noexcept override { return &kTypeTag<M>; }
  [[nodiscard]] const void* model() const noexcept override { return &model_; }

  [[nodiscard]] std::string_view family() const noexcept override { return M::kFamily; }
  [[nodiscard]] FamilyTraits traits() const noexcept override { return detail::traits_of<M>(); }
  [[nodiscard]] AnyParameters parameters() const override {
    return typename M::Parameters(model_.parameters());
  }
  [[nodiscard]] std::size_t input_count() const noexcept override { return model_.input_count(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept override {
    return model_.parameter_count();
  }
  [[nodiscard]] double sample_period() const noexcept override {
    if constexpr (HasSamplePeriod<M>) {
      return model_.sample_period();
    } else {
      return kNotMeasured;
    }
  }
  [[nodiscard]] bool is_rediscretised() const noexcept override { return Rediscretised<M>; }

  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const override {
    return memory_of(model_, ranges);
  }
  void reset() noexcept override { model_.reset(); }
  Estimate step(Features features) noexcept override { return model_.step(features); }
  bool advance(Features features) noexcept override {
    if constexpr (Advances<M>)
      return model_.advance(features);
    else
      return std::isfinite(model_.step(features).value);
  }

  [[nodiscard]] bool feeds_back() const noexcept override { return FeedsBack<M>; }
  void correct([[maybe_unused]] double measured) noexcept override {
    if constexpr (FeedsBack<M>) model_.correct(measured);
  }
  [[nodiscard]] std::span<const double> state() const noexcept override {
    if constexpr (HasState<M>) {
      return model_.state();
    } else {
      return {};
    }
  }
  void set_state([[maybe_unused]] std::span<const double> state) noexcept override {
    if constexpr (HasState<M>) model_.set_state(state);
  }
  void visit_state(StateBytes& bytes) noexcept override { visit_state_of(model_, bytes); }
  [[nodiscard]] std::uint64_t state_identity() const noexcept override {
    return state_identity_of(model_);
  }
  [[nodiscard]] std::span<const float> last_layer_input() const noexcept override {
    if constexpr (HasLastLayer<M>) {
      return model_.last_layer_input();
    } else {
      return {};
    }
  }
  [[nodiscard]] bool can_invert() const noexcept override { return Invertible<M>; }
  Estimate invert([[maybe_unused]] double target, Features features) noexcept override {
    if constexpr (Invertible<M>) {
      return model_.invert(target, features);
    } else {
      return detail::no_inverse(features);
    }
  }

 private:
  M model_;
};

template <class P>
class HeldParametersOf final : public HeldParameters {
 public:
  using Family = typename P::Family;
  explicit HeldParametersOf(P parameters) : parameters_(std::move(parameters)) {}

  [[nodiscard]] std::unique_ptr<HeldParameters> copy() const override {
    return std::make_unique<HeldParametersOf>(*this);
  }
  [[nodiscard]] const void* tag() const noexcept override { return &kTypeTag<P>; }
  [[nodiscard]] void* parameters() noexcept override { return &parameters_; }
  [[nodiscard]] std::string_view family() const noexcept override { return Family::kFamily; }
  [[nodiscard]] std::unique_ptr<HeldModel> model() const override {
    return std::make_unique<HeldModelOf<Family>>(Family(parameters_));
  }
  [[nodiscard]] std::unique_ptr<HeldParameters> at_sample_period(
      [[maybe_unused]] double period_s) const override {
    if constexpr (Rediscretised<Family>) {
      return std::make_unique<HeldParametersOf>(Family::at_sample_period(parameters_, period_s));
    } else {
      return copy();
    }
  }

 private:
  P parameters_;
};

}  // namespace detail

template <class P>
P* AnyParameters::get_if() noexcept {
  return held_->tag() == &detail::kTypeTag<P> ? static_cast<P*>(held_->parameters()) : nullptr;
}
template <class P>
const P* AnyParameters::get_if() const noexcept {
  return held_->tag() == &detail::kTypeTag<P> ? static_cast<const P*>(held_->parameters())
                                              : nullptr;
}
template <class P>
P& AnyParameters::get() {
  if (P* const own = get_if<P>()) return *own;
  throw Error({.place = "parameters",
               .expected = "those of the family " + std::string(P::Family::kFamily),
               .found = std::string(family())});
}
template <class P>
const P& AnyParameters::get() const {
  return const_cast<AnyParameters*>(this)
      ->get<P>();  // NOLINT(cppcoreguidelines-pro-type-const-cast)
}

template <class Family>
const Family* AnyModel::get_if() const noexcept {
  return held_->tag() == &detail::kTypeTag<Family> ? static_cast<const Family*>(held_->model())
                                                   : nullptr;
}

}  // namespace torsio
