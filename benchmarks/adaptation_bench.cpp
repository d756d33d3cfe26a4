#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "dgmm_bench.hpp"
#include "fitted_grey_box.hpp"
#include "model/dgmm_adapter.hpp"
#include "model/grey_box_adapter.hpp"
#include "rows.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kLearned = 20000;
constexpr std::size_t kPasses = 15;
constexpr double kStiffer = 1.1;

AdaptationSettings unguarded() {
  return {.largest_error = 1e9, .frozen_after_s = 0.0, .comparison_s = 1e6};
}

/// What one sample costs: the shortest mean of several passes over the same samples, each from the
/// frozen model. The reading of the clock is part of it.
template <class Reset, class Sample>
double best_mean_s(const Reset& reset, const Sample& learned_in) {
  double best_s = 1e9;
  for (std::size_t pass = 0; pass < kPasses; ++pass) {
    reset();
    Clock::duration sum{};
    for (std::size_t n = 0; n < kLearned; ++n) sum += learned_in(n);
    best_s = std::min(best_s, std::chrono::duration<double>(sum).count() / kLearned);
  }
  return best_s;
}

struct LearnTimes {
  double mean_s = 0.0;
  double worst_s = 0.0;  ///< the mean, times the largest count of operations over the mean count
};

/// `learn` of a mixture whose spring has become stiffer by a tenth; the query before it is not included.
LearnTimes time_mixture(std::size_t components) {
  Dgmm::Parameters base;
  base.mixture = components == 300 ? small_mixture() : full_mixture();
  base.clamp.slope.assign(base.mixture.dimension() - 1, 0.0);
  base.clamp.thin_log_density = -8.0;
  Dgmm frozen(base);
  DgmmAdapter adapter(unguarded(), base, 1e-3);
  const Matrix samples = spring_samples(kLearned, 3);
  std::size_t missed = 0;
  std::size_t operations = 0;
  std::size_t most = 0;
  const double mean_s = best_mean_s(
      [&] {
        adapter.reset();
        operations = 0;
      },
      [&](std::size_t n) {
        const Features features = samples.row(n).subspan(1);
        (void)adapter.step(frozen, features, frozen.step(features));
        const auto begin = Clock::now();
        const UpdateOutcome outcome = adapter.learn({.value = kStiffer * samples(n, 0)});
        const auto end = Clock::now();
        if (outcome != UpdateOutcome::updated && outcome != UpdateOutcome::limited) ++missed;
        operations += adapter.operations();
        most = std::max(most, adapter.operations());
        return end - begin;
      });
  if (missed > 0) throw std::logic_error("a sample was passed over: nothing was measured");
  const double mean = static_cast<double>(operations) / kLearned;
  return {mean_s, mean_s * static_cast<double>(std::max(most, adapter.max_operations())) / mean};
}

const LearnTimes& mixture_times(std::size_t components) {
  static const LearnTimes small = time_mixture(300);
  if (components == 300) return small;
  static const LearnTimes large = time_mixture(5000);
  return large;
}

}  // namespace

Row dgmm_learn_300() { return {.value = mixture_times(300).mean_s * 1e6, .unit = "us"}; }
Row dgmm_learn_300_worst() { return {.value = mixture_times(300).worst_s * 1e6, .unit = "us"}; }
Row dgmm_learn_5000() { return {.value = mixture_times(5000).mean_s * 1e6, .unit = "us"}; }
Row dgmm_learn_5000_worst() { return {.value = mixture_times(5000).worst_s * 1e6, .unit = "us"}; }

Row grey_box_learn() {
  AnyModel model = fitted_grey_box();
  const GreyBox::Parameters base = model.get_if<GreyBox>()->parameters();
  GreyBoxAdapter adapter(unguarded(), base, 1e-3);
  std::size_t missed = 0;
  const double seconds = best_mean_s(
      [&] {
        adapter.reset();
        model.reset();
      },
      [&](std::size_t n) {
        const double t_s = 1e-3 * static_cast<double>(n);
        const std::array features{0.02 * std::sin(0.7 * t_s) + 0.01 * std::sin(3.1 * t_s),
                                  0.014 * std::cos(0.7 * t_s) + 0.031 * std::cos(3.1 * t_s),
                                  0.3 * std::cos(0.6 * t_s)};
        const Estimate frozen = model.step(features);
        const auto begin = Clock::now();
        (void)adapter.step(model, features, frozen);
        const UpdateOutcome outcome = adapter.learn({.value = kStiffer * frozen.value});
        const auto end = Clock::now();
        if (outcome != UpdateOutcome::updated && outcome != UpdateOutcome::limited) ++missed;
        return end - begin;
      });
  if (missed > 0) throw std::logic_error("a sample was passed over: nothing was measured");
  return {.value = seconds * 1e6, .unit = "us"};
}

}  // namespace torsio::bench
