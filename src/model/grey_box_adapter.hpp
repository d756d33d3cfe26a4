#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "model/common/linear_update.hpp"
#include "model/grey_box/grey_box.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/common/model_adapter.hpp"

namespace torsio {

/// Adapts the coefficients of a grey box to a reference, sample by sample; its knots, thresholds, time
/// constants and its residual stay constant.
///
///     y = frozen + S sum_c d_c x_c,   x_c = g_c phi_c / S,   c <- c + g_c d_c
///
/// phi_c are the terms (`GreyBoxTerms`), S the spread of the target: that of a torque which is
/// uniform over the elastic curve. g_c is the largest |coefficient| of the group of the term: the
/// curve, all slips, all branches, or the term itself (slopes and friction of other inputs); of a bank the
/// slips, the curve, the product, or the term itself. Terms
/// whose group is 0 are left out. d follows the error by `LinearUpdate`, and is then
/// brought back into its bounds:
///
///     |d_c| <= rho                      (`largest_change`)
///     c + g_c d_c >= 0                  slips, branches, slopes and friction whose coefficients are >= 0
///     the curve stays ascending         if that of the frozen model ascends (least squares: pooled
///                                       neighbours)
///
/// so a passive model stays passive. Coefficients that are scheduled are moved by the same d_c at
/// every knot of the schedule. Without updates the value is the frozen one, to the bit.
/// Cost for n terms: RLS one pass over n^2 / 2 doubles. Nothing is allocated after construction.
class GreyBoxAdapter final : public ModelAdapter {
 public:
  /// @throws Error if a setting is out of range, or all coefficients are 0.
  GreyBoxAdapter(const AdaptationSettings& settings, const GreyBox::Parameters& base,
                 double sample_period_s);

  [[nodiscard]] std::unique_ptr<ModelAdapter> copy() const override {
    return std::make_unique<GreyBoxAdapter>(*this);
  }

  Estimate step(const AnyModel& model, Features features,
                const Estimate& frozen) noexcept override TORSIO_REALTIME;

  /// max |d_c|
  [[nodiscard]] double relative_change() const noexcept override;
  [[nodiscard]] AnyParameters adapted(AnyParameters base) const override;

  /// Terms that are adapted.
  [[nodiscard]] std::size_t terms() const noexcept { return active_.size(); }

 private:
  /// A term that is adapted.
  struct Term {
    std::size_t column = 0;
    double scale = 0.0;   ///< g_c
    double lowest = 0.0;  ///< bound of d_c
    bool is_non_negative = false;
  };
  /// Neighbours of the curve that have been pooled.
  struct Pool {
    double sum = 0.0;
    std::size_t count = 0;
    [[nodiscard]] double mean() const noexcept { return sum / static_cast<double>(count); }
  };
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  /// @returns how many there are.
  std::size_t add_terms(const GreyBox::Parameters& base, double largest_change);
  [[nodiscard]] UpdateOutcome update(double error) noexcept override;
  void restore() noexcept override { weights_.reset(); }
  [[nodiscard]] bool make_ascending(std::span<double> deviation) noexcept;

  std::vector<Term> active_;
  std::vector<std::size_t> place_;  ///< index of each column among the active ones, or kNone
  /// Per knot of the curve: sum of the least rises so far over the schedule, in units of g; empty if the
  /// curve need not ascend.
  std::vector<double> rise_;
  std::vector<Pool> pools_;
  detail::LinearUpdate weights_;
};

}  // namespace torsio
