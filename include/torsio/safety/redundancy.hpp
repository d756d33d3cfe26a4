#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// One estimate of the joint torque, and what it depends on.
struct TorqueSource {
  std::string name;  ///< "current", "gear", "spring"
  /// Encoders, sensors, supply, clock, calibration: names of parts whose fault changes this
  /// estimate. Sources that list the same name can fail together.
  std::vector<std::string> depends_on;
};

struct RedundancySettings {
  std::vector<TorqueSource> sources;
  /// Correlation of the sources' errors in units of their error bars, row by row; empty: none.
  std::vector<double> correlation;
  /// Per source, at least 1; empty: 1 each. The error bar counts so many times: a source whose error
  /// persists for a whole recording gets less weight than one with the same error bar whose errors
  /// average out.
  std::vector<double> error_bar_factors = {};
};

/// A set of sources or of parts: bit i is the i-th one.
using SourceSet = std::uint32_t;
using PartSet = std::uint32_t;

/// The torque in which several sources are combined.
struct FusedTorque {
  double value_Nm = 0.0;  ///< finite in every case; the last one where no source is valid
  double std_dev_Nm = kNotMeasured;
  SourceSet used = 0;  ///< the valid sources
  /// Parts on which every valid source depends: no comparison covers them.
  PartSet not_redundant = 0;
  Fault fault = Fault::none;  ///< input_not_finite where no source is valid
  /// A channel had a spike in this tick, and the sources were given an extrapolated sample in its
  /// place (`MonitoredTorque`; the error bar does not contain this).
  bool has_replaced_input = false;
};

/// Combines estimates of one torque by their error bars:
///
///     tau = w' t,  var = w' S w + d,  S_ij = c_i s_i R_ij c_j s_j
///     d = max_i max(0, (t_i - tau)^2 - (S_ii - 2 (S w)_i + w' S w))
///
/// t the valid estimates, s their error bars at this tick, c the factors of the settings, R the correlation of their errors. w are
/// the weights >= 0 with sum 1 for which w' S w is smallest, and d the disagreement that the error bars do not
/// explain: one of the sources is wrong by more than it reports, and it may be the one with the largest
/// weight. Since the weights are not negative, the result lies between the estimates; since a smaller set of
/// sources has a larger minimum, the error bar does not become narrower when a source is lost that agrees.
///
/// A source is left out only if it reports itself invalid: a fault, a value that is not finite, an
/// error bar that is not finite or not positive. Valid sources that disagree are all used: which of
/// them is wrong is not decided here (`Monitor` stops the joint), since two sources with a common
/// part can agree on a wrong torque. Source: paper 000, section 6.4, compares three estimates; the
/// combination is ours (minimum variance, as in Maybeck 1979).
class Redundancy {
 public:
  static constexpr std::size_t kMaxSources = 8;
  static constexpr std::size_t kMaxParts = 32;

  /// @throws Error for no sources or more than `kMaxSources`, names that are empty or used twice,
  /// parts without a name or more than `kMaxParts` of them, a correlation that is not a
  /// correlation matrix (size, ones on the diagonal, symmetric, positive definite), or factors that
  /// are not one of 1 to 1e6 for each source.
  explicit Redundancy(const RedundancySettings& settings);

  /// @param sources one estimate for each source; of another size, none is used
  FusedTorque step(std::span<const Estimate> sources) noexcept TORSIO_REALTIME;
  void reset() noexcept { last_Nm_ = 0.0; }

  [[nodiscard]] const RedundancySettings& settings() const noexcept { return settings_; }
  /// Every part that a source depends on, in the order of first appearance: bits of a `PartSet`.
  [[nodiscard]] const std::vector<std::string>& parts() const noexcept { return parts_; }
  [[nodiscard]] PartSet parts_of(std::size_t source) const noexcept { return parts_of_[source]; }
  [[nodiscard]] std::vector<std::string> names(PartSet parts) const;

  /// The parts of which a single fault can explain which valid sources disagree: those on which at
  /// least one source of each disagreeing pair depends. For reports; no decision is based on it.
  /// @param pairs the disagreeing pairs of sources
  [[nodiscard]] PartSet suspects(std::span<const std::array<std::uint8_t, 2>> pairs) const noexcept
      TORSIO_REALTIME;

 private:
  using Row = std::array<double, kMaxSources>;

  /// The smallest variance in units of the smallest error bar, and with which weights it is
  /// reached.
  /// @param precision smallest error bar divided by that of each source; 0 if it is not valid
  /// @param u output: weights divided by `precision`
  double minimise(SourceSet valid, const Row& precision, Row& u) const noexcept;
  /// sqrt(d)
  [[nodiscard]] double disagreement_Nm(std::span<const Estimate> sources, const FusedTorque& fused,
                                       const Row& std_dev_Nm, double smallest_Nm,
                                       const Row& u) const noexcept;
  /// The same over the chosen sources; those whose weight would become negative leave the set.
  double minimise_over(SourceSet& chosen, const Row& precision, Row& u) const noexcept;
  /// The source of `others` with which the variance would decrease most, as a set; empty: none.
  [[nodiscard]] SourceSet entering(SourceSet others, const Row& precision, const Row& u,
                                   double variance) const noexcept;

  RedundancySettings settings_;
  std::vector<std::string> parts_;
  std::array<PartSet, kMaxSources> parts_of_{};
  std::array<Row, kMaxSources> correlation_{};
  Row factors_{};
  std::vector<double> inverses_;  ///< one for each set of sources
  double last_Nm_ = 0.0;
};

}  // namespace torsio
