#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/hyperbolic_tangent.hpp"
#include "model/common/schedule.hpp"
#include "model/grey_box/grey_box_correction.hpp"
#include "model/grey_box/hats.hpp"
#include "model/grey_box/input_bank.hpp"
#include "model/hysteresis/slip_bank.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// The terms of a grey box, without their coefficients, and their states.
///
/// x is the first input. A hat function is 1 at its knot, 0 at its neighbours' and straight between
/// them. Terms, in the order of the columns of the coefficients:
///
/// | term | columns |
/// |---|---|
/// | elastic curve: hats of x over `curve_knots`, straight beyond its ends | knots |
/// | slip: stop s_i of threshold r_i, over r_i, times hats of x over `friction_knots` (held beyond) | thresholds x knots |
/// | relaxation: v_j, a spring in series with a dashpot of time constant T_j | time constants |
/// | slope: every other input | inputs |
/// | Coulomb: tanh of every input over its scale | inputs |
/// | each bank over another input: see `InputBank` | its columns |
///
///     s_i <- clip(s_i + dx, +-r_i),   v_j <- e^(-h/T_j) v_j + (T_j / h) (1 - e^(-h/T_j)) dx
///
/// The v_j are exact where x is linear between samples.
class GreyBoxTerms {
 public:
  static constexpr std::size_t kMaxThresholds = 32;
  static constexpr std::size_t kMaxKnots = 1000;
  static constexpr std::size_t kMaxTimeConstants = 32;
  static constexpr std::size_t kMaxBanks = 64;

  struct Structure {
    std::vector<double> curve_knots;       ///< x's unit, ascending, at least 2
    std::vector<double> thresholds;        ///< r_i, x's unit, > 0
    std::vector<double> friction_knots;    ///< x's unit, ascending; one: the same everywhere
    std::vector<double> time_constants_s;  ///< T_j > 0
    std::vector<double> rate_scales;       ///< per input, in its unit; 0: no Coulomb term
    double sample_period_s = 0.0;
    std::vector<InputBank> banks = {};  ///< over other inputs than the first

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("curve_knots", self.curve_knots);
      visit("thresholds", self.thresholds);
      visit("friction_knots", self.friction_knots);
      visit("time_constants_s", self.time_constants_s);
      visit("rate_scales", self.rate_scales);
      visit("sample_period_s", self.sample_period_s);
      visit("banks", self.banks);
    }
    bool operator==(const Structure&) const = default;

    [[nodiscard]] std::size_t inputs() const noexcept { return rate_scales.size(); }
    [[nodiscard]] std::size_t first_slip() const noexcept { return curve_knots.size(); }
    [[nodiscard]] std::size_t first_relaxation() const noexcept {
      return first_slip() + thresholds.size() * friction_knots.size();
    }
    [[nodiscard]] std::size_t first_slope() const noexcept {
      return first_relaxation() + time_constants_s.size();
    }
    [[nodiscard]] std::size_t first_coulomb() const noexcept { return first_slope() + inputs(); }
    /// Column of the first bank: the number of the columns of x and of the slopes and Coulomb terms.
    [[nodiscard]] std::size_t first_bank() const noexcept { return first_coulomb() + inputs(); }
    [[nodiscard]] std::size_t columns() const noexcept {
      std::size_t sum = first_bank();
      for (const InputBank& bank : banks) sum += bank.columns();
      return sum;
    }
  };

  GreyBoxTerms() = default;
  /// @throws Error naming the field that makes no sense.
  explicit GreyBoxTerms(Structure structure);

  [[nodiscard]] const Structure& structure() const noexcept { return structure_; }
  /// 1 / u_l of each input; 0: no Coulomb term.
  [[nodiscard]] std::span<const double> rate_factors() const noexcept { return rate_factors_; }

  /// As if x had long been where it is at the next `move`.
  void reset() noexcept;
  /// One sample period later the inputs are here.
  void move(Features features) noexcept TORSIO_REALTIME;
  /// Last x; 0 before the first.
  [[nodiscard]] double position() const noexcept { return last_; }

  /// Whether x and the input of every bank have had a value since the reset.
  [[nodiscard]] bool is_started() const noexcept {
    return is_started_ && std::ranges::all_of(banks_, &InputBankTerms::is_started);
  }
  /// The last x and the last input of each bank. @param inputs 1 + number of banks
  void get_last(std::span<double> inputs) const noexcept TORSIO_REALTIME;
  /// As if these had been the last inputs.
  void set_last(std::span<const double> inputs) noexcept TORSIO_REALTIME;

  /// s_i / r_i, then v_j, then the same of each bank.
  [[nodiscard]] std::span<const double> state() const noexcept { return state_; }
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(slips_, state_, banks_, last_, is_started_);
  }

  /// Calls term(column, value) for each term that is not 0, as of now.
  /// @param features the first is not looked at
  template <class Term>
  void visit(Features features, Term&& term) const noexcept {
    visit_motion(
        last_, [this](std::size_t i) { return state_[i]; }, term);
    visit_banks(last_, features, bank_state(), term);
    for (std::size_t j = 1; j < features.size(); ++j) {
      term(structure_.first_slope() + j, features[j]);
      if (const double factor = rate_factors_[j]; factor > 0.0)
        term(structure_.first_coulomb() + j, detail::hyperbolic_tangent(features[j] * factor));
    }
  }

  /// The terms of x alone, if x had jumped here at once: nothing relaxes on the way. Each term comes with its
  /// slope over x.
  template <class Term>
  void visit_jump(double x, Term&& term) const noexcept {
    using detail::Sloped;
    // The first sample has no increment.
    const Sloped dx = is_started_ ? Sloped{.value = x - last_, .slope = 1.0} : Sloped{};
    const std::span<const double> stiffness = slips_.stiffness();
    const auto moved = [&](std::size_t i) {
      if (i >= stiffness.size()) return dx + state_[i];
      return detail::limited(dx * stiffness[i] + state_[i], -1.0, 1.0);
    };
    visit_motion(Sloped{.value = x, .slope = 1.0}, moved, term);
  }

  /// States of all banks.
  [[nodiscard]] std::size_t bank_states() const noexcept { return bank_state().size(); }
  /// The states of the banks if their inputs had jumped here at once. @param state `bank_states()`
  void jump_banks(Features features, std::span<double> state) const noexcept TORSIO_REALTIME;
  /// The terms of the banks alone with these states and this x, a number or a `Sloped`; `features[0]` is not
  /// looked at.
  template <class Number, class Term>
  void visit_banks(Number x, Features features, std::span<const double> state,
                   Term&& term) const noexcept {
    std::size_t column = structure_.first_bank();
    for (const InputBank& bank : structure_.banks) {
      InputBankTerms::visit(bank, column, x, features, state.first(bank.states()), term);
      state = state.subspan(bank.states());
      column += bank.columns();
    }
  }

 private:
  [[nodiscard]] std::span<const double> bank_state() const noexcept {
    return std::span(state_).subspan(slips_.size() + decay_.size());
  }

  /// @param state of s_i / r_i, then of v_j, as a function of the index
  template <class Number, class State, class Term>
  void visit_motion(Number x, const State& state, Term&& term) const noexcept {
    const auto curve = detail::hat_cell(structure_.curve_knots, x, curve_cell_);
    term(curve.left, 1.0 - curve.share);
    term(curve.left + 1, curve.share);
    const std::size_t slips = slips_.size();
    const std::size_t knots = structure_.friction_knots.size();
    std::size_t column = structure_.first_slip();
    if (knots == 1) {
      for (std::size_t i = 0; i < slips; ++i) term(column + i, state(i));
    } else {
      const auto slip = detail::held_hat_cell(structure_.friction_knots, x, friction_cell_);
      column += slip.left;
      for (std::size_t i = 0; i < slips; ++i, column += knots)
        detail::visit_hats(term, column, slip.share, state(i));
    }
    for (std::size_t j = 0; j < decay_.size(); ++j)
      term(structure_.first_relaxation() + j, state(slips + j));
  }

  Structure structure_;
  SlipBank slips_;                    ///< s_i / r_i
  std::vector<double> decay_;         ///< e^(-h/T_j)
  std::vector<double> gain_;          ///< (T_j / h) (1 - e^(-h/T_j))
  std::vector<double> rate_factors_;  ///< a product takes a tenth of the time of a division
  std::vector<InputBankTerms> banks_;
  std::vector<double> state_;
  double last_ = 0.0;
  bool is_started_ = false;
  // Between which knots x was at the last `move`; see `cell_of`.
  std::size_t curve_cell_ = 0;
  std::size_t friction_cell_ = 0;
};

/// torsio's own spring model: what physics allows, and of that what the data ask for.
///
///     y = curve(x) + sum_i w_i(x) s_i / r_i + sum_j k_j v_j + sum_l (k_l x_l + f_l tanh(x_l / u_l))
///         + banks + residual
///
/// A stiffening and, if need be, asymmetric elastic curve; a bank of slip operators whose forces may
/// depend on the deflection (friction under load); viscoelastic branches; viscous and dry friction of
/// other inputs (rates); for another input with a bank of its own, slip operators, a curve, a product
/// and an inertia (`InputBank`); see `GreyBoxTerms`. All coefficients may be scheduled over one input. With
/// w_i constant and >= 0, k_j >= 0, an ascending curve and no bank it is passive. The residual, if there is
/// one, is a small model of its own (`GreyBoxResidual`), bounded, and faded out away from its training data. A fit
/// chooses which terms there are by cross-validation (fit/grey_box/fit_grey_box.hpp). A family of its own:
/// no paper has it; the parts are those of specification 3.6 and 3.7. Cost: some 4 (2 + 2
/// thresholds + branches + inputs) multiply-adds, those of the banks, and that of the
/// residual.
class GreyBox {
 public:
  static constexpr std::string_view kFamily = "grey_box";
  static constexpr FamilyTraits kTraits{.continues = true};

  struct Parameters {
    using Family = GreyBox;
    GreyBoxTerms::Structure terms;
    CoefficientSchedule coefficients;  ///< columns as `GreyBoxTerms` lists them
    std::optional<GreyBoxResidual> residual = {};

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("terms", self.terms);
      visit("coefficients", self.coefficients);
      visit("residual", self.residual);
    }
  };

  /// @throws Error if the structure makes no sense, the coefficients do not fit it, or the residual
  /// has other inputs than the box.
  explicit GreyBox(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.terms.inputs(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept;
  [[nodiscard]] double sample_period() const noexcept {
    return parameters_.terms.sample_period_s;
  }  ///< [s]
  /// The same model at another sample period; without a relaxation it has none, and is as it was.
  [[nodiscard]] static Parameters at_sample_period(Parameters parameters, double sample_period_s) {
    if (parameters.terms.sample_period_s > 0.0) parameters.terms.sample_period_s = sample_period_s;
    return parameters;
  }

  /// How past inputs influence the output; see `ModelMemory`.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept { terms_.reset(); }
  Estimate step(Features features) noexcept TORSIO_REALTIME;
  /// The memory after a `step`, without its output. @returns whether the memory is finite
  bool advance(Features features) noexcept TORSIO_REALTIME;

  /// As of the last `step`.
  [[nodiscard]] const GreyBoxTerms& terms() const noexcept { return terms_; }

  /// s_i / r_i, then v_j in the first input's unit, then the same of each bank.
  [[nodiscard]] std::span<const double> state() const noexcept { return terms_.state(); }
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME {
    terms_.set_state(state);
  }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(terms_); }

  /// The first input at which the output would be `target` after an immediate change from the
  /// present input, the others as given and the residual as at the present input (Newton's steps, then
  /// secants kept inside a bracket, at most `kInversionSteps`). Where neither the curve nor its continuation beyond
  /// the nearer end, `kInversionReach` times as long, encloses the target, that end is returned with
  /// `Fault::outside_training_range`; where the schedule uses the first input, `Fault::model_not_finite`.
  [[nodiscard]] Estimate invert(double target, Features features) noexcept TORSIO_REALTIME;
  static constexpr int kInversionSteps = 100;
  static constexpr double kInversionReach = 1.5;  ///< further than an estimator uses the value

 private:
  template <class Use>
  [[nodiscard]] auto with_coefficients(Features features, const Use& use) const noexcept;
  template <class Coefficient>
  [[nodiscard]] Estimate solved(const Coefficient& coefficient, double target,
                                Features features) noexcept;
  template <class Error>
  [[nodiscard]] double near_root(const Error& error_at, double rise, double wanted) const noexcept;
  template <class Coefficient>
  [[nodiscard]] double others(const Coefficient& coefficient, Features features) const noexcept;
  [[nodiscard]] double residual(Features features) noexcept;

  Parameters parameters_;
  GreyBoxTerms terms_;
  ScheduledCoefficients coefficients_;
  std::optional<GreyBoxCorrection> correction_;
  std::vector<double> correction_inputs_;
  std::vector<double> jumped_;  ///< states of the banks, while inverting
  bool banks_follow_x_ = false;
};

}  // namespace torsio
