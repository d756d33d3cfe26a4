#pragma once

#include <cstddef>
#include <vector>

#include "fit/common/usable_table.hpp"
#include "fit/gaussian_process/marginal_likelihood.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/common/fit_context.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

struct LikelihoodSearch {
  std::size_t restarts = 0;    ///< in addition to the kernel's own numbers
  std::size_t iterations = 0;  ///< limit of one search; 0: the kernel's own numbers
};

/// Numbers of the kernel and ln sigma^2 that maximise the marginal likelihood: from several starts on
/// `kSearchedSamples` of the samples, and from the best of these on all.
/// @param table what `process` was made of, standardised.
[[nodiscard]] std::vector<double> likeliest_numbers(MarginalLikelihood& process, const Table& table,
                                                    const LikelihoodSearch& wanted, Random& random,
                                                    const FitContext& context);

}  // namespace torsio
