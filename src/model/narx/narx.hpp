#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/checks.hpp"
#include "core/joined_name.hpp"
#include "torsio/core/error.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A nonlinear autoregressive model with exogenous inputs: any static family as the right side of a
/// difference equation.
///
///     y_k = clip(f(u_k, u_{k-1}, ..., u_{k-n_u}, y_{k-1}, ..., y_{k-n_y}))
///
/// y is the model's own output (free run) unless `correct` puts the measured one in its place (one
/// step ahead). Before the first sample the inputs are as in it, the outputs `start`. A discrete
/// model: it runs at the sample period that it was trained at. Where f leaves lowest..highest, or is
/// not finite, y stays at the end of that range, or as it was, with `Fault::diverged`. Source: paper
/// 002, specification 3.3. Cost: that of f. Nothing is allocated after construction.
template <Model M>
class Narx {
 public:
  using Inner = M;
  static constexpr std::string_view kPrefix = "narx_";
  static constexpr std::string_view kFamily = JoinedName<kPrefix, M::kFamily>::kName;
  static constexpr std::size_t kMaxLags = 1000;

  struct Parameters {
    using Family = Narx;
    typename M::Parameters model;  ///< f
    std::size_t inputs = 0;        ///< per tick
    std::size_t input_lags = 0;    ///< n_u
    std::size_t output_lags = 0;   ///< n_y
    double sample_period_s = 0.0;
    double lowest = 0.0;  ///< limit of the output
    double highest = 0.0;
    double start = 0.0;  ///< output before the first sample

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("model", self.model);
      visit("inputs", self.inputs);
      visit("input_lags", self.input_lags);
      visit("output_lags", self.output_lags);
      visit("sample_period_s", self.sample_period_s);
      visit("lowest", self.lowest);
      visit("highest", self.highest);
      visit("start", self.start);
    }
    bool operator==(const Parameters&) const = default;

    /// Inputs of f.
    [[nodiscard]] std::size_t regressors() const noexcept {
      return inputs * (input_lags + 1) + output_lags;
    }
  };

  /// @throws Error as f does, or if f has another number of inputs than the lags make, the lags, the
  /// period or the range make no sense, or `start` is outside the range.
  explicit Narx(Parameters parameters)
      : parameters_(std::move(parameters)),
        model_(parameters_.model),
        regressors_(checked_regressors()) {
    reset();
  }

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.inputs; }
  [[nodiscard]] std::size_t parameter_count() const noexcept { return model_.parameter_count(); }
  [[nodiscard]] double sample_period() const noexcept {
    return parameters_.sample_period_s;
  }  ///< [s]

  /// Not declared: the state has no form that gives a bound.
  [[nodiscard]] static ModelMemory memory(const InputRanges& /*ranges*/) {
    return {.is_declared = false};
  }

  void reset() noexcept { reset(parameters_.start); }
  /// As if the output had long been this.
  void reset(double output) noexcept {
    model_.reset();
    is_started_ = false;
    output_ = output;
    std::fill(regressors_.end() - outputs(), regressors_.end(), output);
  }

  Estimate step(Features features) noexcept TORSIO_REALTIME {
    store(features);
    Estimate estimate = model_.step(regressors_);
    const double wanted = estimate.value;
    estimate.value = std::isfinite(wanted)
                         ? std::min(std::max(wanted, parameters_.lowest), parameters_.highest)
                         : output_;
    if (estimate.value != wanted) estimate.fault = Fault::diverged;  // NaN too
    estimate.std_dev = kNotMeasured;                                 // f's own is that of one step
    output_ = estimate.value;
    return estimate;
  }

  /// Takes a measurement for the output of the last step. One that is not finite is passed over.
  void correct(double measured) noexcept TORSIO_REALTIME {
    if (std::isfinite(measured)) output_ = measured;
  }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    detail::visit_state_of(model_, bytes);
    bytes.visit(regressors_, output_, is_started_);
  }

 private:
  [[nodiscard]] std::ptrdiff_t outputs() const noexcept {
    return static_cast<std::ptrdiff_t>(parameters_.output_lags);
  }

  void store(Features features) noexcept {
    const auto first_output = regressors_.end() - outputs();
    const auto inputs = static_cast<std::ptrdiff_t>(parameters_.inputs);
    if (!is_started_) {
      for (auto at = regressors_.begin(); at != first_output; at += inputs)
        std::ranges::copy(features, at);
      is_started_ = true;
    } else {
      std::copy_backward(regressors_.begin(), first_output - inputs, first_output);
      std::ranges::copy(features, regressors_.begin());
    }
    std::copy_backward(first_output, regressors_.end() - 1, regressors_.end());
    *first_output = output_;
  }

  [[nodiscard]] std::size_t checked_regressors() const {
    const Parameters& p = parameters_;
    require(p.inputs >= 1 && p.inputs <= model_.input_count(), kFamily,
            "an input that the inner model has", std::to_string(p.inputs));
    require(p.input_lags <= kMaxLags && p.output_lags >= 1 && p.output_lags <= kMaxLags, kFamily,
            "0 to 1000 input lags and 1 to 1000 output lags",
            std::to_string(p.input_lags) + " and " + std::to_string(p.output_lags));
    require(model_.input_count() == p.regressors(), kFamily,
            "an inner model of as many inputs as lags make", std::to_string(model_.input_count()));
    require(std::isfinite(p.sample_period_s) && p.sample_period_s > 0.0, kFamily,
            "a positive sample_period_s", p.sample_period_s);
    require(std::isfinite(p.lowest) && std::isfinite(p.highest) && p.lowest < p.highest &&
                p.start >= p.lowest && p.start <= p.highest,
            kFamily, "lowest < highest, and start between them",
            as_text(p.lowest) + ", " + as_text(p.highest) + ", " + as_text(p.start));
    return p.regressors();
  }

  Parameters parameters_;
  M model_;
  std::vector<double> regressors_;  ///< inputs, the newest first, then outputs, the newest first
  double output_ = 0.0;
  bool is_started_ = false;
};

}  // namespace torsio
