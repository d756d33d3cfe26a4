#include "fit/hammerstein_wiener/wiener_start.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>

namespace torsio {
namespace {

using Eigen::Index;
using Signals = std::vector<std::vector<double>>;  ///< one per record

/// Products of columns and target over the scored samples, and their least-squares solution.
class ColumnProducts {
 public:
  explicit ColumnProducts(std::size_t columns)
      : products_(Eigen::MatrixXd::Zero(static_cast<Index>(columns) + 1,
                                        static_cast<Index>(columns) + 1)),
        rows_(static_cast<Index>(columns) + 1, kRows) {}

  void add(std::span<const double> row) {
    std::ranges::copy(row, rows_.col(filled_++).data());
    if (filled_ == kRows) take_in();
  }

  struct Solution {
    std::vector<double> coefficients;
    double sum_of_squares = 0.0;
  };
  /// The last column is the target.
  [[nodiscard]] Solution solved() {
    take_in();
    const Index n = products_.rows() - 1;
    const Eigen::MatrixXd full = products_.selfadjointView<Eigen::Lower>();
    Eigen::VectorXd scale = full.diagonal().head(n).cwiseSqrt();
    for (double& s : scale) s = s > 0.0 ? 1.0 / s : 0.0;
    const Eigen::MatrixXd scaled =
        scale.asDiagonal() * full.topLeftCorner(n, n) * scale.asDiagonal();
    const Eigen::VectorXd right = scale.asDiagonal() * full.col(n).head(n);
    // The least-norm solution: columns that the data cannot distinguish share the coefficient.
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(n, n);
    solver.setThreshold(1e-13);
    solver.compute(scaled);
    const Eigen::VectorXd found = scale.asDiagonal() * solver.solve(right);
    return {{found.begin(), found.end()},
            full(n, n) - 2.0 * found.dot(full.col(n).head(n)) +
                found.dot(full.topLeftCorner(n, n) * found)};
  }

 private:
  static constexpr Index kRows = 256;  // at once: a product of matrices
  void take_in() {
    products_.selfadjointView<Eigen::Lower>().rankUpdate(rows_.leftCols(filled_));
    filled_ = 0;
  }

  Eigen::MatrixXd products_;
  Eigen::MatrixXd rows_;  ///< transposed
  Index filled_ = 0;
};

/// Calls take(record, sample) for each scored sample that has `lags` before it in its record.
template <class Take>
void for_each_scored(const WienerData& data, std::size_t lags, const Take& take) {
  for (std::size_t r = 0; r < data.records.size(); ++r)
    for (std::size_t n = lags; n < data.records[r].input.size(); ++n)
      if (data.records[r].scored[n] != 0) take(r, n);
}

Signals filtered(Signals signals, const Sections& sections, bool is_all_pole) {
  for (std::vector<double>& signal : signals) {
    SectionCascade cascade(sections);
    for (std::size_t i = 0; i < sections.rows; ++i) cascade.run_section(i, is_all_pole, signal);
  }
  return signals;
}

Signals centred_inputs(const WienerData& data) {
  Signals signals;
  const double half = 0.5 * (data.range.highest - data.range.lowest);
  for (const WienerRecord& record : data.records) {
    std::vector<double>& signal = signals.emplace_back(record.input);
    for (double& value : signal) value = (value - data.rest_input) / half;
  }
  return signals;
}

/// Held where not measured.
Signals targets(const WienerData& data) {
  Signals signals;
  for (const WienerRecord& record : data.records) {
    std::vector<double>& signal = signals.emplace_back(record.target);
    const auto first = std::ranges::find_if(signal, [](double y) { return std::isfinite(y); });
    double last = first == signal.end() ? 0.0 : *first;
    for (double& value : signal) {
      if (std::isfinite(value)) last = value;
      value = last;
    }
  }
  return signals;
}

struct LinearStart {
  Sections sections;
  double sum_of_squares = std::numeric_limits<double>::infinity();
};

/// The numerator that goes best with given poles, in powers of 1 - z^-1: those of z^-1 are nearly one
/// column for a signal that is slow against the sample period.
LinearStart with_numerator(const WienerData& data, const Signals& inputs, const Sections& all_pole,
                           std::size_t zeros) {
  const Signals v = filtered(inputs, all_pole, true);
  ColumnProducts products(zeros + 2);
  std::vector<double> row(zeros + 3);
  for_each_scored(data, zeros, [&](std::size_t r, std::size_t n) {
    for (std::size_t k = 0; k <= zeros; ++k) row[k] = v[r][n - k];
    for (std::size_t k = 1; k <= zeros; ++k)
      for (std::size_t i = zeros; i >= k; --i) row[i] = row[i - 1] - row[i];
    row[zeros + 1] = 1.0;
    row[zeros + 2] = data.records[r].target[n];
    products.add(row);
  });
  const auto [found, sum] = products.solved();
  std::vector<double> numerator(zeros + 1, 0.0);
  std::vector<double> difference{1.0};  // (1 - z^-1)^k
  for (std::size_t k = 0; k <= zeros; ++k) {
    for (std::size_t i = 0; i <= k; ++i) numerator[i] += found[k] * difference[i];
    difference.push_back(0.0);
    for (std::size_t i = k + 1; i > 0; --i) difference[i] -= difference[i - 1];
  }
  if (std::ranges::all_of(numerator, [](double b) { return b == 0.0; })) return {};
  Sections sections = sections_of({numerator, {1.0}});
  Sections both(std::max(sections.rows, all_pole.rows), kSectionColumns);
  for (std::size_t i = 0; i < both.rows; ++i) {
    both(i, 0) = 1.0;
    if (i < sections.rows)
      for (std::size_t c = 0; c < 3; ++c) both(i, c) = sections(i, c);
    if (i < all_pole.rows)
      for (std::size_t c = 3; c < 5; ++c) both(i, c) = all_pole(i, c);
  }
  return {std::move(both), sum};
}

/// Steiglitz-McBride: least squares one step ahead on input and output filtered by the last 1 / F.
LinearStart by_steiglitz_mcbride(const WienerData& data, const Signals& inputs, std::size_t zeros,
                                 std::size_t poles) {
  constexpr int kRounds = 8;
  const Signals outputs = targets(data);
  Sections all_pole = sections_of({{1.0}, {1.0}});
  const std::size_t lags = std::max(zeros, poles);
  LinearStart best;
  for (int round = 0; round < kRounds; ++round) {
    const Signals u = filtered(inputs, all_pole, true);
    const Signals y = filtered(outputs, all_pole, true);
    ColumnProducts products(poles + zeros + 2);
    std::vector<double> row(poles + zeros + 3);
    for_each_scored(data, lags, [&](std::size_t r, std::size_t n) {
      for (std::size_t k = 1; k <= poles; ++k) row[k - 1] = -y[r][n - k];
      for (std::size_t k = 0; k <= zeros; ++k) row[poles + k] = u[r][n - k];
      row[poles + zeros + 1] = 1.0;
      row[poles + zeros + 2] = y[r][n];
      products.add(row);
    });
    const auto found = products.solved().coefficients;
    std::vector<double> denominator{1.0};
    denominator.insert(denominator.end(), found.begin(),
                       found.begin() + static_cast<std::ptrdiff_t>(poles));
    if (!std::ranges::all_of(denominator, [](double a) { return std::isfinite(a); })) break;
    all_pole = sections_of({{1.0}, denominator});
    reflect_unstable_poles(all_pole);
    for (std::size_t i = 0; i < all_pole.rows; ++i) all_pole(i, 0) = 1.0;
    LinearStart now = with_numerator(data, inputs, all_pole, zeros);
    if (now.sum_of_squares < best.sum_of_squares) best = std::move(now);
  }
  return best;
}

/// The best of some sets of real poles, time constants spread from two samples to half a record.
LinearStart by_time_constants(const WienerData& data, const Signals& inputs, std::size_t zeros,
                              std::size_t poles) {
  std::size_t longest = 0;
  for (const WienerRecord& record : data.records) longest = std::max(longest, record.input.size());
  const std::size_t choices = std::max(poles, poles <= 2 ? std::size_t{7} : std::size_t{6});
  std::vector<double> grid(choices);
  for (std::size_t i = 0; i < choices; ++i) {
    const double share =
        choices < 2 ? 0.0 : static_cast<double>(i) / static_cast<double>(choices - 1);
    grid[i] = std::exp(-1.0 / (2.0 * std::pow(0.25 * static_cast<double>(longest), share)));
  }
  std::vector<std::uint8_t> taken(choices, 0);  // the slowest first
  std::fill(taken.end() - static_cast<std::ptrdiff_t>(poles), taken.end(), 1);
  LinearStart best;
  do {
    std::vector<double> of_set;
    for (std::size_t i = choices; i-- > 0;)
      if (taken[i] != 0) of_set.push_back(grid[i]);
    Sections all_pole((poles + 1) / 2, kSectionColumns);
    for (std::size_t i = 0; i < all_pole.rows; ++i) {
      const double one = of_set[2 * i];
      const double two = 2 * i + 1 < poles ? of_set[2 * i + 1] : 0.0;
      all_pole(i, 0) = 1.0;
      all_pole(i, 3) = -(one + two);
      all_pole(i, 4) = one * two;
    }
    LinearStart now = with_numerator(data, inputs, all_pole, zeros);
    if (now.sum_of_squares < best.sum_of_squares) best = std::move(now);
  } while (std::ranges::next_permutation(taken).found);
  return best;
}

/// Knots with as many samples between each two of them; fewer where samples coincide.
std::vector<double> knots_of(std::vector<double> samples, std::size_t count) {
  std::ranges::sort(samples);
  std::vector<double> knots;
  for (std::size_t k = 0; k < count; ++k) {
    const double knot = samples[k * (samples.size() - 1) / (count - 1)];
    if (knots.empty() || knot > knots.back()) knots.push_back(knot);
  }
  return knots;
}

/// A curve over these samples, initially linear from -1 to 1.
StaticCurve line_over(std::vector<double> samples, std::size_t values, bool is_piecewise_linear) {
  const auto [lowest, highest] = std::ranges::minmax(samples);
  const double half = highest > lowest ? 0.5 * (highest - lowest) : 1.0;
  StaticCurve curve{.knots = {},
                    .values = std::vector<double>(values, 0.0),
                    .centre = 0.5 * (lowest + highest),
                    .half_range = half};
  if (!is_piecewise_linear) {
    if (values > 1) curve.values[1] = 1.0;
    return curve;
  }
  curve.knots = knots_of(std::move(samples), values);
  if (curve.knots.size() < 2) curve.knots = {lowest, lowest + 2.0 * half};
  curve.values.clear();
  for (const double knot : curve.knots) curve.values.push_back((knot - curve.centre) / half);
  return curve;
}

/// The value of P that only shifts w is 0.
void hold_shift(StaticCurve& input, double rest_input) {
  const double shift = input.values[shifting_value(input, rest_input)];
  if (input.knots.empty())
    input.values.front() = 0.0;
  else
    for (double& value : input.values) value -= shift;
}

/// The largest coefficient of each numerator is 1.
void hold_numerators(Sections& sections) {
  for (std::size_t i = 0; i < sections.rows; ++i) {
    const auto b = sections.row(i).first(3);
    const double largest =
        *std::ranges::max_element(b, {}, [](double each) { return std::abs(each); });
    for (double& each : b) each /= largest;
  }
}

std::vector<double> scored_inputs(const WienerData& data) {
  std::vector<double> all;
  for_each_scored(data, 0,
                  [&](std::size_t r, std::size_t n) { all.push_back(data.records[r].input[n]); });
  return all;
}

/// P by least squares, as if C were straight. Its largest value but the shifting one becomes 1.
void fit_input(const WienerData& data, WienerNumbers& numbers) {
  StaticCurve& p = numbers.input;
  const std::size_t count = p.values.size();
  std::vector<Signals> columns;
  for (std::size_t k = 0; k < count; ++k) {
    Signals signals;
    for (const WienerRecord& record : data.records) {
      std::vector<double>& signal = signals.emplace_back(record.input);
      for (double& value : signal) value = p.basis(k, value) - p.basis(k, data.rest_input);
    }
    columns.push_back(filtered(std::move(signals), numbers.sections, false));
  }
  ColumnProducts products(count + 1);
  std::vector<double> row(count + 2);
  for_each_scored(data, 0, [&](std::size_t r, std::size_t n) {
    for (std::size_t k = 0; k < count; ++k) row[k] = columns[k][r][n];
    row[count] = 1.0;
    row[count + 1] = data.records[r].target[n];
    products.add(row);
  });
  std::vector<double> values = products.solved().coefficients;
  values.pop_back();
  const double largest =
      *std::ranges::max_element(values, {}, [](double each) { return std::abs(each); });
  if (!std::isfinite(largest) || largest == 0.0) return;
  for (double& value : values) value /= largest;
  p.values = std::move(values);
  hold_shift(p, data.rest_input);
}

void fit_output(const WienerData& data, const WienerShape& shape, WienerNumbers& numbers) {
  const std::vector<double> x = WienerError(data, numbers).inner(numbers);
  numbers.output = line_over(x, shape.output_values, shape.is_piecewise_linear);
  const std::size_t count = numbers.output.values.size();
  ColumnProducts products(count);
  std::vector<double> row(count + 1);
  std::size_t at = 0;
  for_each_scored(data, 0, [&](std::size_t r, std::size_t n) {
    fill_basis(numbers.output, x[at], std::span(row).first(count));
    row[count] = data.records[r].target[n];
    products.add(row);
    ++at;
  });
  numbers.output.values = products.solved().coefficients;
}

}  // namespace

std::optional<Sections> slow_start(const WienerData& data, std::size_t zeros, std::size_t poles) {
  const LinearStart found = by_time_constants(data, centred_inputs(data), zeros, poles);
  if (!std::isfinite(found.sum_of_squares)) return std::nullopt;
  Sections sections = found.sections;
  const double half = 0.5 * (data.range.highest - data.range.lowest);
  for (std::size_t c = 0; c < 3; ++c) sections(0, c) /= half;
  return sections;
}

std::vector<WienerNumbers> wiener_starts(const WienerData& data, const WienerShape& shape,
                                         bool has_start) {
  constexpr std::size_t kEnough = 5'000;  // samples for a start
  const WienerData part = front_of(data, kEnough);
  const Signals inputs = centred_inputs(part);
  std::vector<LinearStart> linear{by_steiglitz_mcbride(part, inputs, shape.zeros, shape.poles)};
  if (shape.poles > 0) linear.push_back(by_time_constants(part, inputs, shape.zeros, shape.poles));
  std::vector<std::pair<double, WienerNumbers>> ranked;
  for (const LinearStart& each : linear) {
    if (!std::isfinite(each.sum_of_squares)) continue;
    WienerNumbers straight{
        .input = line_over(scored_inputs(data), shape.input_values, shape.is_piecewise_linear),
        .sections = each.sections,
        .output = {},
        .start = {}};
    hold_numerators(straight.sections);
    hold_shift(straight.input, data.rest_input);
    WienerNumbers bent = straight;
    fit_input(data, bent);
    for (WienerNumbers* numbers : {&straight, &bent}) {
      fit_output(data, shape, *numbers);
      if (has_start) numbers->start = Matrix(data.records.size(), 2 * numbers->sections.rows);
      const double sum = WienerError(data, *numbers).sum_of_squares(*numbers);
      if (std::isfinite(sum)) ranked.emplace_back(sum, std::move(*numbers));
    }
  }
  std::ranges::stable_sort(ranked, {}, &std::pair<double, WienerNumbers>::first);
  std::vector<WienerNumbers> starts;
  for (auto& [sum, numbers] : ranked)
    if (starts.size() < 2) starts.push_back(std::move(numbers));
  return starts;
}

}  // namespace torsio
