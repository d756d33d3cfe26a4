#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/aligned_vector.hpp"
#include "model/mixture/gaussian_mixture.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio {

/// Where a mixture's standardised coordinates lie: x~ = (x - centre) / scale.
struct Standardisation {
  std::vector<double> centre;
  std::vector<double> scale;
};

/// Centre and spread of each column without its most extreme 0.5 % on either side: a spike of a
/// sensor does not stretch the coordinates, and a channel that rests most of the time keeps a
/// scale.
/// @param floors smallest scale of each column, physical units (a sensor's resolution).
[[nodiscard]] Standardisation robust_standardisation(const Matrix& samples,
                                                     std::span<const double> floors);

/// Settings of `OnlineMixture`; lengths are in standardised units.
struct OnlineMixtureSettings {
  std::size_t components = 300;    ///< at most this many
  double novelty_distance = 0.25;  ///< a sample farther than this from all means is a new component
  double initial_spread = 0.15;    ///< standard deviation of a component that has seen one sample
  double learning_rate_floor = 0.0;   ///< 0: means settle; above: they keep following
  double forgetting = 1.0;            ///< factor on a component's past with each of its samples
  std::size_t merge_candidates = 16;  ///< lightest components that are considered for merging
  double prune_count = 0.0;           ///< components lighter than this are dropped ...
  std::size_t prune_age = 0;          ///< ... once this many samples old; 0: never
};

/// Learns a Gaussian mixture sample by sample, in the order of recording.
///
/// The nearest component i takes the sample x~:
///
///     n = forgetting n + 1
///     d = x~ - mu
///     eta = max(1 / n, floor)
///     mu += eta d
///     A = forgetting A + (1 - eta) d d^T       (Welford's update for forgetting 1, floor 0)
///     Sigma = (nu0 s0^2 I + A) / (nu0 + n),   nu0 = D + 1, s0 the initial spread
///
/// A sample farther than the novelty distance from all means becomes a component of its own. When
/// none is free, the pair with the least Runnalls cost
///
///     ((w_i + w_j) ln|S_ij| - w_i ln|S_i| - w_j ln|S_j|) / 2
///
/// among the lightest and their nearest neighbours is merged first, keeping its moments. A
/// component's neighbour is looked for again when one of the two has changed, or a new component
/// came up for which it is the nearest.
///
/// Source: specification 3.1 (000 Algorithm 1, whose sign diverges as printed). Nothing is
/// allocated after construction but by `mixture`.
class OnlineMixture {
 public:
  /// @throws Error if a setting is out of range or the standardisation is not sound.
  OnlineMixture(Standardisation standardisation, const OnlineMixtureSettings& settings);

  /// @param sample D finite values, physical units.
  void learn(std::span<const double> sample);

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t merges() const noexcept { return merges_; }

  /// What has been learned so far. @throws Error before the first sample.
  [[nodiscard]] GaussianMixture mixture() const;

 private:
  struct Nearest {
    std::size_t component;
    double square_distance;
  };
  /// A component's nearest neighbour and what merging the two would cost, as long as neither has
  /// changed since.
  struct Pairing {
    std::size_t partner = 0;
    double cost = 0.0;
    std::uint64_t own_version = 0;
    std::uint64_t partner_version = 0;
  };

  [[nodiscard]] Nearest nearest(std::span<const double> at) const;
  [[nodiscard]] std::size_t neighbour(std::size_t component);
  [[nodiscard]] const Pairing& pairing(std::size_t component);
  void update(std::size_t component);
  void place(std::size_t component);
  void set_mean(std::size_t component, std::span<const double> mean);
  void copy_component(std::size_t from, std::size_t to);
  std::size_t merge_cheapest();
  void merge(std::size_t into, std::size_t from);
  [[nodiscard]] double merge_cost(std::size_t a, std::size_t b);
  void find_lightest();
  void prune();

  Standardisation standardisation_;
  OnlineMixtureSettings settings_;
  std::size_t dimension_;
  std::size_t size_ = 0;
  std::size_t merges_ = 0;
  std::uint64_t samples_ = 0;
  std::vector<double> counts_;
  std::vector<std::uint64_t> versions_;  ///< counts the changes of a component, from 1
  std::vector<Pairing> pairings_;
  std::vector<std::uint64_t> births_;  ///< number of the sample that made the component
  Matrix means_;
  Matrix scatters_;  ///< A, full matrices
  detail::AlignedVector<float>
      search_;                  ///< means in blocks of 16 for the search; free slots far away
  std::vector<double> sample_;  ///< standardised
  std::vector<double> merged_;  ///< scratch: a covariance
  std::vector<std::size_t> lightest_;
};

}  // namespace torsio
