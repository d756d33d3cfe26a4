#include "fit/gaussian_process/likelihood_search.hpp"

#include <limits>
#include <utility>

#include "fit/common/usable_table.hpp"
#include "fit/gaussian_process/fit_gaussian_process.hpp"
#include "fit/gaussian_process/kernel_data.hpp"
#include "fit/gaussian_process/kernel_search.hpp"

namespace torsio {
namespace {

/// A share of the whole search, for its listener.
struct Share {
  double begin;
  double end;
  double first_step = 1.0;  ///< step size at the start of its minimisation
};

LbfgsResult search(MarginalLikelihood& process, std::vector<double> start, std::size_t iterations,
                   const FitContext& context, const Share& share) {
  KernelSearch kernel_search(process.kernel(), iterations);
  kernel_search.settings.first_step = share.first_step;
  return minimise(reported([&](auto x, auto gradient) { return process.evaluate(x, gradient); },
                           context, share.begin, share.end, iterations, "fitting gaussian_process"),
                  std::move(start), kernel_search.settings);
}

/// The best of several starts.
std::vector<double> best_of(MarginalLikelihood& process, const LikelihoodSearch& wanted,
                            Random& random, const FitContext& context) {
  const std::vector<double> first = first_start(process.kernel());
  std::vector<double> best = first;
  double least = std::numeric_limits<double>::infinity();
  const double share = 0.5 / static_cast<double>(wanted.restarts + 1);
  for (std::size_t k = 0; k <= wanted.restarts; ++k) {
    const double begin = share * static_cast<double>(k);
    LbfgsResult result = search(process, k == 0 ? first : moved_start(first, random),
                                wanted.iterations, context, {begin, begin + share});
    if (result.value >= least) continue;
    least = result.value;
    best = std::move(result.at);
  }
  return best;
}

}  // namespace

std::vector<double> likeliest_numbers(MarginalLikelihood& process, const Table& table,
                                      const LikelihoodSearch& wanted, Random& random,
                                      const FitContext& context) {
  if (wanted.iterations == 0) return first_start(process.kernel());
  if (table.target.size() <= kSearchedSamples) return best_of(process, wanted, random, context);
  Table part = thinned(table, kSearchedSamples, random);
  MarginalLikelihood of_part(process.kernel(), std::move(part.features), std::move(part.target));
  std::vector<double> start = best_of(of_part, wanted, random, context);
  return search(process, std::move(start), wanted.iterations, context, {0.5, 1.0, 0.05}).at;
}

}  // namespace torsio
