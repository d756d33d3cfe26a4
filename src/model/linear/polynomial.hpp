#pragma once

#include <cstddef>
#include <string_view>

#include "model/common/schedule.hpp"
#include "model/linear/direction.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// A polynomial spring, the same in both directions or with one curve for each direction of the
/// deflection:
///
///     y = P(z) + sum_j k_j x_j,   z = (x_0 - centre) / half_range,   P(z) = sum_i a_i z^i
///
/// x_0 is the first input (usually the spring deflection), x_j the others, z in -1..1 over the
/// training data, a_i in the target's unit. By direction, P is P+ while x_0 rises and P- while it
/// falls; the direction changes when x_0 has moved back from its extreme by more than the dead
/// band. From `reset()` until the first movement beyond it the direction is unknown and P is the
/// mean of both. All but centre, half_range and dead band may be scheduled over one input. Each
/// curve has the range of x_0 that it was fitted to: more than `kBorder` of it outside, x_0 is held
/// there and the value comes with `Fault::outside_training_range`. Source: specification 3.7
/// (Polynomial, degree 5). Cost: `degree` multiply-adds, and as `Linear`.
class Polynomial {
 public:
  static constexpr std::string_view kFamily = "polynomial";
  static constexpr std::size_t kHighestDegree = 20;
  static constexpr double kBorder = 0.05;  ///< share of a curve's range by which it is extrapolated

  struct Parameters {
    using Family = Polynomial;
    /// Columns: P+ (degree + 1, constant first), P- likewise if `by_direction`, then k_0 .. k_n-1
    /// (k_0 is 0: that term is in P).
    CoefficientSchedule coefficients = {};
    std::size_t degree = 1;
    bool by_direction = false;
    double dead_band = 0.0;   ///< x_0's unit, >= 0
    double centre = 0.0;      ///< x_0's unit
    double half_range = 1.0;  ///< x_0's unit, > 0
    /// Lowest and highest x_0 that P+ was fitted to, then those of P- if `by_direction`; one row
    /// per row of the coefficients. Empty: centre +- half_range for all of them.
    Matrix ranges = {};

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("coefficients", self.coefficients);
      visit("degree", self.degree);
      visit("by_direction", self.by_direction);
      visit("dead_band", self.dead_band);
      visit("centre", self.centre);
      visit("half_range", self.half_range);
      visit("ranges", self.ranges);
    }
    bool operator==(const Parameters&) const = default;

    /// Columns that belong to P+ and P-.
    [[nodiscard]] std::size_t curve_columns() const noexcept { return curves() * (degree + 1); }
    [[nodiscard]] std::size_t curves() const noexcept { return by_direction ? 2 : 1; }
  };

  /// @throws Error if the coefficients do not fit the degree or are not a valid schedule, k_0 is
  /// not 0, or centre, half_range, ranges or dead band are out of range.
  explicit Polynomial(const Parameters& parameters);

  [[nodiscard]] Parameters parameters() const;
  [[nodiscard]] std::size_t input_count() const noexcept {
    return coefficients_.size() - first_slope_;
  }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return coefficients_.fitted_count();
  }

  /// How past inputs influence the output; see `ModelMemory`.
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const;

  void reset() noexcept { direction_.reset(); }
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  /// The x_0 in the range of the present direction's curve (centre +- half_range before it has one)
  /// at which the output is `target`; the other inputs are as given and the search starts from the
  /// given x_0 (Newton's method kept inside a bracket, at most `kInversionSteps` steps). Where the
  /// two ends of that range do not enclose the target, the nearer end is returned with
  /// `Fault::outside_training_range`; where the schedule uses x_0 itself, the given x_0 with
  /// `Fault::model_not_finite`.
  [[nodiscard]] Estimate invert(double target, Features features) const noexcept TORSIO_REALTIME;
  static constexpr int kInversionSteps = 100;

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(direction_); }

 private:
  struct Curve {
    double value = 0.0;
    double slope = 0.0;  ///< per unit of z
    bool is_held = false;
  };
  struct Reach {
    double lowest = -1.0;  ///< z
    double highest = 1.0;
  };
  using Position = ScheduledCoefficients::Position;
  /// Reach of P+ (0) or P- (1).
  [[nodiscard]] Reach reach(const Position& at, std::size_t branch) const noexcept;
  [[nodiscard]] Curve branch(const Position& at, std::size_t branch, double z) const noexcept;
  [[nodiscard]] Curve curve(const Position& at, double z) const noexcept;

  std::size_t degree_;
  bool by_direction_;
  double dead_band_;
  double centre_;
  double half_range_;
  std::size_t first_slope_;
  ScheduledCoefficients coefficients_;
  ScheduledCoefficients ranges_;
  DirectionTracker direction_;
};

}  // namespace torsio
