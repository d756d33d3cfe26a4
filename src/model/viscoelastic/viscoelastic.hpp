#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "model/viscoelastic/spring_dashpot_network.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A network of springs and dashpots between both sides of the deflection u, the first input:
///
///     y = b + k u + d u' + sum_i z_i,    z_i' = g_i u' - p_i z_i
///
/// k, d, g_i, p_i from `relaxation_spectrum`, b an offset. The other inputs are not used. Solved exactly for a
/// deflection that is linear between two steps, h apart (first-order hold); u' = (u_n - u_n-1) / h:
///
///     z_i <- exp(-p_i h) z_i + g_i (1 - exp(-p_i h)) / (p_i h) (u_n - u_n-1)
///
/// A continuous-time model: model files run it at any sample rate. After `reset()` it is relaxed at
/// the first deflection that it receives. The state is z, the torques [Nm] of the branches. Source:
/// specification 3.6, paper 003. Cost: 3 multiply-adds per branch.
class Viscoelastic {
 public:
  static constexpr std::string_view kFamily = "viscoelastic";
  static constexpr FamilyTraits kTraits{.continues = true};

  struct Parameters {
    using Family = Viscoelastic;
    SpringDashpotNetwork network;  ///< values in target unit per input unit: Nm/rad and Nm s/rad
    double offset = 0.0;           ///< b, target's unit
    double sample_period_s = 0.0;  ///< h
    std::size_t inputs = 1;        ///< per tick; the first is u

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("network", self.network);
      visit("offset", self.offset);
      visit("sample_period_s", self.sample_period_s);
      visit("inputs", self.inputs);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error as `relaxation_spectrum`, or if the period is not positive, the offset not finite, or
  /// there is no input.
  explicit Viscoelastic(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.inputs; }
  /// One a spring or dashpot, and the offset.
  [[nodiscard]] std::size_t parameter_count() const noexcept { return parameter_count_; }
  [[nodiscard]] double sample_period() const noexcept {
    return parameters_.sample_period_s;
  }  ///< [s]
  /// The same network, discretised for another sample period.
  [[nodiscard]] static Parameters at_sample_period(Parameters parameters, double sample_period_s) {
    parameters.sample_period_s = sample_period_s;
    return parameters;
  }
  [[nodiscard]] const RelaxationSpectrum& spectrum() const noexcept { return spectrum_; }

  /// How past inputs influence the output; see `ModelMemory`.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept;
  /// Where numbers are too large for a double the model returns to rest and outputs its offset,
  /// with a fault.
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  /// z; of a model that has not been stepped since its reset, z at the first deflection.
  [[nodiscard]] std::span<const double> state() const noexcept { return torque_; }
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME;

  /// The first input of the last step for which its output would have been `target`. Where there is
  /// none (a fluid, before it has moved) the given one is returned with `Fault::model_not_finite`.
  [[nodiscard]] Estimate invert(double target, Features features) const noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(torque_, last_, is_started_, value_without_, value_per_input_);
  }

 private:
  Parameters parameters_;
  RelaxationSpectrum spectrum_;
  std::size_t parameter_count_;
  std::vector<double> decay_;   ///< exp(-p_i h)
  std::vector<double> gain_;    ///< gain of z_i in the increment
  double slope_ = 0.0;          ///< slope of y in the increment, without the branches
  double moving_slope_ = 0.0;   ///< slope of y in u within a step
  std::vector<double> torque_;  ///< z_i
  double last_ = 0.0;           ///< u of the last step
  bool is_started_ = false;
  double value_without_ = 0.0;    ///< y of the last step less what u added,
  double value_per_input_ = 0.0;  ///< and what it added, per u
};

}  // namespace torsio
