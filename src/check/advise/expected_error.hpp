#pragma once

#include <map>
#include <string>
#include <vector>

#include "check/advise/region_errors.hpp"

namespace torsio {

/// The squared error that is expected in every region, with or without strokes.
///
///     E(c) = E(k) a^2 exp(sum_d g_d n_d)
///
/// k is the nearest region with strokes, n_d the steps from k to c in direction d, g_d the growth
/// per step (at most 2 ln 2 from the second on), and a the ratio of the amplitudes of c and k: a
/// model of equal quality has an error in proportion to the amplitude. E is at most the target's
/// own mean square.
class ExpectedError {
 public:
  /// The regions whose errors are known, with their mean squares.
  using Covered = std::map<RegionKey, double>;

  explicit ExpectedError(const RegionErrors& errors);

  [[nodiscard]] const Covered& covered() const noexcept { return covered_; }

  struct Value {
    double mean_square = 0.0;  ///< without a recording in this region
    double afterwards = 0.0;   ///< with one
    bool is_known = true;      ///< false: the distance includes a step whose growth is assumed
    RegionKey nearest = {};
  };
  [[nodiscard]] Value at(const RegionKey& key, const Covered& covered) const;

  /// What is known of the growth in each direction from one region to another, as clauses.
  [[nodiscard]] std::vector<std::string> growth_texts(const RegionKey& from,
                                                      const RegionKey& to) const;

 private:
  using Direction = RegionErrors::Direction;

  [[nodiscard]] double per_step(Direction direction) const;

  std::map<Direction, Growth> growths_;
  Covered covered_;
  Covered linear_;            ///< errors of the linear model
  double full_square_ = 0.0;  ///< square of the target at the half range, by the linear model
};

}  // namespace torsio
