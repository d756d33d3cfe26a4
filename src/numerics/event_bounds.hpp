#pragma once

#include <cstddef>

namespace torsio {

/// The 95 % upper bound, one-sided, of the mean of a Poisson count of which `events` were observed: the
/// m with P(N <= events | m) = 0.05; 3.00 for none. Divided by the observed time it bounds the rate.
[[nodiscard]] double poisson_upper_95(std::size_t events);

/// The 95 % upper bound, one-sided, of the probability of which `events` of `trials` were observed, exact
/// (Clopper & Pearson 1934): the p with P(K <= events | p) = 0.05; 1 where all were, or without trials.
[[nodiscard]] double binomial_upper_95(std::size_t events, std::size_t trials);

}  // namespace torsio
