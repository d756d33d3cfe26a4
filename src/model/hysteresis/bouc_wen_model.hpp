#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "model/hysteresis/increment.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A spring beside a smooth hysteresis of the first input:
///
///     y = b + alpha k x_0 + (1 - alpha) k z + sum_j>0 k_j x_j
///     dz = [1 - |z|^n (beta sgn(dx_0 z) + gamma)] dx_0
///
/// z in +-z_max = (beta + gamma)^(-1/n). Independent of rate: z is advanced along dx_0, however far
/// that is, exactly where beta = gamma and z falls back to 0, else by midpoint steps of at most z_max / 8
/// (of z_max / 100: 1e-4 z_max off at most) and, within a hundredth of z_max, in closed form. With
/// (1 - alpha) k >= 0 and |gamma| <= beta no closed path gives work. After `reset()` z is 0.
/// State: z / z_max. Source: Ismail, Ikhouane and Rodellar 2009; specification 3.7. Cost: two
/// powers, and two more for every z_max / 8 of a longer step.
class BoucWenModel {
 public:
  static constexpr std::string_view kFamily = "bouc_wen";
  static constexpr FamilyTraits kTraits{.continues = true};

  struct Parameters {
    using Family = BoucWenModel;
    double stiffness = 1.0;           ///< k, target's unit over x_0's
    double elastic_share = 1.0;       ///< alpha; (1 - alpha) k >= 0
    double beta = 0.5;                ///< > 0, x_0's unit to the power -n
    double gamma = 0.5;               ///< -beta < gamma <= beta
    double exponent = 1.0;            ///< n, 1 to 20
    double bias = 0.0;                ///< b, target's unit
    std::vector<double> slopes = {};  ///< 0, k_1 .. k_m-1: one per input
    double centre = 0.0;              ///< middle of the training range of x_0
    double half_range = 1.0;          ///< half of that range, > 0

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("stiffness", self.stiffness);
      visit("elastic_share", self.elastic_share);
      visit("beta", self.beta);
      visit("gamma", self.gamma);
      visit("exponent", self.exponent);
      visit("bias", self.bias);
      visit("slopes", self.slopes);
      visit("centre", self.centre);
      visit("half_range", self.half_range);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if one of the conditions above does not hold.
  explicit BoucWenModel(const Parameters& parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.slopes.size(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept;

  /// How past inputs influence the output; see `ModelMemory`.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::span<const double> state() const noexcept { return {&share_, 1}; }
  void set_state(std::span<const double> state) noexcept;

  /// As `Backlash::invert`, but up to one and a half times the range beyond its ends.
  [[nodiscard]] Estimate invert(double target, Features features) const noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(increment_, share_); }

 private:
  [[nodiscard]] double share_after(double increment) const noexcept;

  Parameters parameters_;
  double largest_;    ///< z_max
  double unloading_;  ///< (beta - gamma) / (beta + gamma)
  Increment increment_;
  double share_ = 0.0;  ///< z / z_max
};

}  // namespace torsio
