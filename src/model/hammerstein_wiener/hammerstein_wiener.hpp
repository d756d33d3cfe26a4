#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "model/hammerstein_wiener/static_curve.hpp"
#include "model/hammerstein_wiener/transfer_function.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A linear system between two curves:
///
///     w = P(u),   x = G(z) w,   y = C(clip(x))
///
/// u is the first input (the others are not used), P and C are polynomials or piecewise linear, G
/// is of any order. x is limited to lowest..highest, its range in training as far as C is monotone
/// there: beyond, a polynomial diverges or is not monotone; more than `kBorder` of that range
/// beyond, a step reports `Fault::outside_training_range`. The memory is that of G; after `reset()`
/// it is that of a long rest at u = rest_input. A discrete model: it runs at the sample period that
/// it was trained at.
///
/// G runs as a cascade of second-order sections in transposed direct form II: two states per
/// section, which add up small differences of input and output instead of large sums that cancel,
/// as the states of direct form II do near slow poles.
///
/// Two scales and one offset are free (w, x -> their multiples, compensated in C): equal outputs,
/// other numbers. A fit fixes them (`fit_hammerstein_wiener`). Source: paper 003, specification
/// 3.5. Cost: 5 multiply-adds per section and those of the curves. Nothing is allocated after
/// construction.
class HammersteinWiener {
 public:
  static constexpr std::string_view kFamily = "hammerstein_wiener";
  static constexpr double kBorder = 0.1;  ///< share of the range: beyond it, a fault

  struct Parameters {
    using Family = HammersteinWiener;
    std::size_t inputs = 1;  ///< per tick
    double sample_period_s = 0.0;
    double rest_input = 0.0;  ///< u of a joint at rest
    StaticCurve input = {};   ///< P
    Sections sections = {};   ///< G
    StaticCurve output = {};  ///< C
    double lowest = 0.0;      ///< x where C is monotone
    double highest = 0.0;

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("inputs", self.inputs);
      visit("sample_period_s", self.sample_period_s);
      visit("rest_input", self.rest_input);
      visit("input", self.input);
      visit("sections", self.sections);
      visit("output", self.output);
      visit("lowest", self.lowest);
      visit("highest", self.highest);
    }
    bool operator==(const Parameters&) const = default;
  };

  /// @throws Error if there is no input, the period is not positive, a curve or a number is none,
  /// lowest is not below highest, C is not monotone between them, or G has no section, more than
  /// `kMaxSections`, or a pole that is not inside the unit circle.
  explicit HammersteinWiener(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return parameters_.inputs; }
  /// Numbers that make a difference: those of the curves and of G, less two scales and an offset.
  [[nodiscard]] std::size_t parameter_count() const noexcept;
  [[nodiscard]] double sample_period() const noexcept {
    return parameters_.sample_period_s;
  }  ///< [s]

  /// How past inputs influence the output; see `ModelMemory`.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept;
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  /// Two numbers a section.
  [[nodiscard]] std::span<const double> state() const noexcept { return state_; }
  void set_state(std::span<const double> state) noexcept TORSIO_REALTIME;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(state_, value_); }

 private:
  Parameters parameters_;
  std::vector<double> state_;
  double value_ = 0.0;  ///< at the last step
};

/// What paper 003 prints of its elastomer coupling, from the torsion in rad to the torque in Nm
/// (printed: degrees and Nm) at 200 Hz; curves (2), (3), errata in specification 1.
enum class Paper003 : std::uint8_t {
  discrete,  ///< (5), (6)
  tustin,    ///< (8), the same by Tustin, rounded; run by an exact first-order hold
  refined,   ///< (10), refined in continuous time; run likewise
};
[[nodiscard]] HammersteinWiener::Parameters hammerstein_wiener_of(Paper003 form,
                                                                  std::size_t inputs = 1);
/// X/W in continuous time: (5), (6) by Tustin, (8), (10).
[[nodiscard]] ContinuousTransfer continuous_of(Paper003 form);

}  // namespace torsio
