#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "fit/hammerstein_wiener/wiener_problem.hpp"
#include "fit/hammerstein_wiener/wiener_search.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kSmallest = 1e-12;  // denominator's coefficient, in 1 / sample period

/// a b c d e of a section, time in sample periods. Its denominator is (s + p)^2 + d (s + p) + e, p that of
/// the slowest pole that is allowed, d and e as logarithms.
using Coefficients = std::array<double, kSectionColumns>;

ContinuousTransfer transfer_of(std::span<const double> theta, double slowest) {
  const double d = std::exp(theta[3]);
  const double e = std::exp(theta[4]);
  return {{theta[0], theta[1], theta[2]}, {1.0, d + 2.0 * slowest, e + slowest * (d + slowest)}};
}

Coefficients discrete_of(std::span<const double> theta, double slowest) {
  const DiscreteTransfer held = first_order_hold(transfer_of(theta, slowest), 1.0);
  return {held.numerator[0], held.numerator[1], held.numerator[2], held.denominator[1],
          held.denominator[2]};
}

/// Each section (five numbers) from a, b, c, ln d, ln e; states as they are.
WienerChart continuous_chart(std::size_t sections, double slowest) {
  return
      [sections, slowest](std::span<const double> theta, std::span<double> packed, Matrix& slopes) {
        constexpr double kStep = 1e-6;
        std::ranges::copy(theta, packed.begin());
        for (std::size_t k = 0; k < slopes.rows; ++k) slopes(k, k) = 1.0;
        for (std::size_t i = 0; i < sections; ++i) {
          const std::size_t first = kSectionColumns * i;
          const auto own = theta.subspan(first, kSectionColumns);
          std::ranges::copy(discrete_of(own, slowest),
                            packed.begin() + static_cast<std::ptrdiff_t>(first));
          for (std::size_t j = 0; slopes.rows > 0 && j < kSectionColumns; ++j) {
            Coefficients moved{};
            std::ranges::copy(own, moved.begin());
            const double step = kStep * std::max(std::abs(own[j]), j < 3 ? kStep : 1.0);
            moved[j] = own[j] + step;
            const Coefficients above = discrete_of(moved, slowest);
            moved[j] = own[j] - step;
            const Coefficients below = discrete_of(moved, slowest);
            for (std::size_t c = 0; c < kSectionColumns; ++c)
              slopes(first + c, first + j) = (above[c] - below[c]) / (2.0 * step);
          }
        }
      };
}

/// Tustin's form of each section; of a section of first order with a fast pole beside it.
std::vector<double> theta_of(const Sections& sections, double slowest) {
  std::vector<double> theta;
  for (std::size_t i = 0; i < sections.rows; ++i) {
    const auto g = sections.row(i);
    const ContinuousTransfer one =
        tustin(DiscreteTransfer{{g[0], g[1], g[2]}, {1.0, g[3], g[4]}}, 1.0);
    theta.insert(theta.end(), one.numerator.begin(), one.numerator.end());
    const double d = one.denominator[1] - 2.0 * slowest;
    const double e = one.denominator[2] - slowest * (d + slowest);
    for (const double each : {d, e}) theta.push_back(std::log(std::max(each, kSmallest)));
  }
  return theta;
}

/// Logarithms would decrease without limit towards the slowest pole.
std::vector<double> lowest_theta(std::size_t sections, std::size_t size, double slowest) {
  constexpr double kNear = 0.1;
  std::vector<double> lowest(size, -std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < sections; ++i) {
    lowest[kSectionColumns * i + 3] = std::log(kNear * slowest);
    lowest[kSectionColumns * i + 4] = std::log(kNear * slowest * slowest);
  }
  return lowest;
}

/// What goes into G and what should come out of it, as the discrete model has it.
WienerData inner_data(const WienerData& data, const WienerNumbers& numbers) {
  WienerData inner = data;
  inner.range = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  inner.rest_input = 0.0;
  const double at_rest = numbers.input(data.rest_input);
  for (std::size_t r = 0; r < inner.records.size(); ++r) {
    WienerRecord& record = inner.records[r];
    for (double& value : record.input) {
      value = numbers.input(value) - at_rest;
      inner.range.lowest = std::min(inner.range.lowest, value);
      inner.range.highest = std::max(inner.range.highest, value);
    }
    record.target = record.input;
    SectionCascade cascade(numbers.sections);
    if (numbers.start.rows > 0) cascade.set_state(numbers.start.row(r));
    cascade.run(record.target);
  }
  return inner;
}

}  // namespace

WienerNumbers held_between_samples(const WienerData& data, WienerNumbers numbers) {
  for (std::size_t i = 0; i < numbers.sections.rows; ++i) {
    const auto g = numbers.sections.row(i);
    const DiscreteTransfer held = first_order_hold(
        tustin(DiscreteTransfer{{g[0], g[1], g[2]}, {1.0, g[3], g[4]}}, data.sample_period_s),
        data.sample_period_s);
    std::ranges::copy(held.numerator, g.begin());
    std::copy(held.denominator.begin() + 1, held.denominator.end(), g.begin() + 3);
  }
  numbers.start = {};
  return numbers;
}

ContinuousFit refined_in_continuous_time(const WienerData& data, const WienerNumbers& numbers,
                                         std::size_t iterations, const Progress& progress) {
  const std::size_t sections = numbers.sections.rows;
  const double slowest = -std::log(data.slowest_pole());  // 1 / sample period
  const WienerError error(data, numbers, WienerFree::sections);
  std::vector<Sections> begins{numbers.sections};
  if (const auto slow = slow_start(inner_data(data, numbers), 2 * sections, 2 * sections);
      slow && slow->rows == sections)
    begins.push_back(*slow);
  std::vector<std::vector<double>> starts;
  for (const Sections& begin : begins) {
    starts.push_back(theta_of(begin, slowest));
    starts.back().resize(error.size(), 0.0);  // and from rest
  }
  const WienerChart chart = continuous_chart(sections, slowest);
  const SearchResult found =
      minimise_squares_from(wiener_problem(error, error.size(), chart), starts,
                            {.max_iterations = iterations,
                             .lower = lowest_theta(sections, error.size(), slowest),
                             .tolerance = 1e-7,  // a slow pole's valley has no end that matters
                             .progress = progress});
  std::vector<double> packed(error.size());
  Matrix no_slopes;
  chart(found.theta, packed, no_slopes);
  ContinuousFit result{.fit = {.numbers = error.unpack(packed),
                               .sum_of_squares = found.sum_of_squares,
                               .has_converged = found.has_converged,
                               .iterations = found.iterations},
                       .sections = {}};
  // From sample periods to seconds: s -> s T.
  const double period_s = data.sample_period_s;
  for (std::size_t i = 0; i < sections; ++i) {
    ContinuousTransfer one =
        transfer_of(std::span(found.theta).subspan(kSectionColumns * i, kSectionColumns), slowest);
    for (std::vector<double>* of : {&one.numerator, &one.denominator}) {
      (*of)[1] /= period_s;
      (*of)[2] /= period_s * period_s;
    }
    result.sections.push_back(std::move(one));
  }
  return result;
}

}  // namespace torsio
