#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/grey_box/hats.hpp"
#include "model/hysteresis/slip_bank.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// Terms of a grey box over another input than the first, as plain data: friction that follows the
/// angle of another part of the drive (a wave generator), a curve, a product, an inertia.
///
/// u is that input, q the coordinate of its slip elements: u itself, or for a rate its integral over
/// time, of which the increments h u alone are used. x is the first input. Terms, in the order of
/// the columns:
///
/// | term | columns |
/// |---|---|
/// | slip: s_i / r_i of a stop over q, times hats of x over `force_knots` (held beyond) | thresholds x knots |
/// | curve: hats of u over the inner `curve_knots`; 0 at the outer ones and beyond | knots - 2 |
/// | product: u times hats of the input `product_input` over `product_knots` (held beyond) | knots |
/// | relaxation: v_j of time constant T_j over u; of a rate and a short T_j: an inertia | time constants |
///
///     s_i <- clip(s_i + dq, +-r_i),   v_j <- e^(-h/T_j) v_j + (T_j / h) (1 - e^(-h/T_j)) du
///
/// The stops are bounded, so the zero offset of a rate moves their force to one of its limits while
/// the drive rests, and no further.
struct InputBank {
  static constexpr std::size_t kMaxThresholds = 32;
  static constexpr std::size_t kMaxKnots = 1000;
  static constexpr std::size_t kMaxTimeConstants = 32;

  std::size_t input = 1;                      ///< which one, not the first
  bool is_integrated = false;                 ///< q is the integral of u over time
  std::vector<double> thresholds = {};        ///< r_i > 0, q's unit
  std::vector<double> force_knots = {0.0};    ///< x's unit, ascending; one: the same everywhere
  std::vector<double> curve_knots = {};       ///< u's unit, ascending; none, or at least 3
  std::vector<double> product_knots = {};     ///< ascending; none, or at least 2
  std::size_t product_input = 0;              ///< which input they are of; not `input`
  std::vector<double> time_constants_s = {};  ///< T_j > 0

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("input", self.input);
    visit("is_integrated", self.is_integrated);
    visit("thresholds", self.thresholds);
    visit("force_knots", self.force_knots);
    visit("curve_knots", self.curve_knots);
    visit("product_knots", self.product_knots);
    visit("product_input", self.product_input);
    visit("time_constants_s", self.time_constants_s);
  }
  bool operator==(const InputBank&) const = default;

  // Columns, from the first one of the bank on.
  [[nodiscard]] std::size_t first_curve() const noexcept {
    return thresholds.size() * force_knots.size();
  }
  [[nodiscard]] std::size_t first_product() const noexcept {
    return first_curve() + (curve_knots.empty() ? 0 : curve_knots.size() - 2);
  }
  [[nodiscard]] std::size_t first_relaxation() const noexcept {
    return first_product() + product_knots.size();
  }
  [[nodiscard]] std::size_t columns() const noexcept {
    return first_relaxation() + time_constants_s.size();
  }
  [[nodiscard]] std::size_t states() const noexcept {
    return thresholds.size() + time_constants_s.size();
  }

  /// Whether a term depends on the first input.
  [[nodiscard]] bool follows_x() const noexcept {
    return (!thresholds.empty() && force_knots.size() > 1) ||
           (!product_knots.empty() && product_input == 0);
  }

  /// @param inputs of the model @param place "grey_box: banks/0", for the message
  /// @throws Error naming the field that makes no sense.
  void check(std::size_t inputs, const std::string& place) const;
};

/// The states of an `InputBank`, and its terms.
class InputBankTerms {
 public:
  /// @param bank checked
  InputBankTerms(const InputBank& bank, double sample_period_s, std::string_view place);

  void reset() noexcept;
  /// One sample period later u is here; without effect on the states if that is not a finite number.
  void move(double u) noexcept TORSIO_REALTIME;

  /// s_i / r_i, then v_j.
  [[nodiscard]] std::span<const double> state() const noexcept { return state_; }
  /// What is not finite is passed over. @param state `bank.states()` numbers
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME;

  /// Last u, and whether there was one since the reset.
  [[nodiscard]] double last() const noexcept { return last_; }
  [[nodiscard]] bool is_started() const noexcept { return is_started_; }
  void set_last(double u) noexcept {
    last_ = u;
    is_started_ = true;
  }

  /// The state if u were here at once: nothing relaxes on the way.
  void jump(double u, std::span<double> state) const noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(slips_, state_, last_, is_started_);
  }

  /// Calls term(column, value) for each term that is not 0 for sure.
  /// @param bank the one of the constructor
  /// @param first column of the bank
  /// @param x the first input, a number or a `Sloped`; that of `features` is not looked at
  template <class Number, class Term>
  static void visit(const InputBank& bank, std::size_t first, Number x, Features features,
                    std::span<const double> state, Term&& term) noexcept {
    const double u = features[bank.input];
    const std::size_t slips = bank.thresholds.size();
    if (slips > 0) {
      const std::size_t knots = bank.force_knots.size();
      const auto cell = detail::held_hat_cell(bank.force_knots, x);
      std::size_t column = first + cell.left;
      for (std::size_t i = 0; i < slips; ++i, column += knots) {
        if (knots > 1)
          detail::visit_hats(term, column, cell.share, state[i]);
        else
          term(column, (1.0 - cell.share) * state[i]);
      }
    }
    if (const auto& knots = bank.curve_knots;
        !knots.empty() && u >= knots.front() && u <= knots.back()) {
      const auto cell = detail::hat_cell(knots, u);
      if (cell.left > 0) term(first + bank.first_curve() + cell.left - 1, 1.0 - cell.share);
      if (cell.left + 2 < knots.size()) term(first + bank.first_curve() + cell.left, cell.share);
    }
    if (!bank.product_knots.empty()) {
      const auto visit_product = [&](auto s) {
        const auto cell = detail::held_hat_cell(bank.product_knots, s);
        term(first + bank.first_product() + cell.left, (1.0 - cell.share) * u);
        term(first + bank.first_product() + cell.left + 1, cell.share * u);
      };
      if (bank.product_input == 0)
        visit_product(x);
      else
        visit_product(features[bank.product_input]);
    }
    for (std::size_t j = slips; j < state.size(); ++j)
      term(first + bank.first_relaxation() + j - slips, state[j]);
  }

 private:
  [[nodiscard]] double travel(double u) const noexcept;

  SlipBank slips_;             ///< s_i / r_i
  std::vector<double> decay_;  ///< e^(-h/T_j)
  std::vector<double> gain_;   ///< (T_j / h) (1 - e^(-h/T_j))
  std::vector<double> state_;
  double period_s_;  ///< 0: q is u
  double last_ = 0.0;
  bool is_started_ = false;
};

namespace detail {

/// Plain stops over their thresholds: states within +-1. @param place for messages
[[nodiscard]] SlipBank relative_stops(std::span<const double> thresholds, std::string_view place);

/// e^(-h/T) and (T/h) (1 - e^(-h/T)), added to the lists for each T.
void add_relaxations(std::span<const double> time_constants_s, double sample_period_s,
                     std::vector<double>& decay, std::vector<double>& gain);

}  // namespace detail

}  // namespace torsio
