#include "fit/hammerstein_wiener/wiener_error.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/aligned_vector.hpp"
#include "core/all_finite.hpp"
#include "fit/hammerstein_wiener/section_kernel.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

/// Samples at once: their columns stay in the nearest caches.
constexpr std::size_t kBlock = section_kernel::kColumnValues;
using Eigen::Index;
using Block = detail::AlignedVector<double>;  ///< column by column

std::size_t rounded_up(std::size_t count) {
  return (count + section_kernel::kLanes - 1) / section_kernel::kLanes * section_kernel::kLanes;
}

std::size_t largest_of(std::span<const double> values, std::size_t not_this) {
  std::size_t best = not_this == 0 ? 1 : 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (i != not_this && std::abs(values[i]) > std::abs(values[best])) best = i;
  return best;
}

std::span<double> column(std::span<double> block, std::size_t at, std::size_t samples) {
  return block.subspan(at * kBlock, samples);
}

constexpr std::array<double, 1> kImpulse{1.0};

}  // namespace

void fill_basis(const StaticCurve& curve, double x, std::span<double> basis) {
  if (!curve.knots.empty()) {
    std::ranges::fill(basis, 0.0);
    for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
      const std::size_t at = curve.segment(x) + i;
      basis[at] = curve.basis(at, x);
    }
    return;
  }
  const double z = (x - curve.centre) / curve.half_range;
  double power = 1.0;
  for (double& each : basis) {
    each = power;
    power *= z;
  }
}

double WienerData::slowest_pole() const {
  constexpr double kLongestMemory = 10.0;  // records
  std::size_t longest = 1;
  for (const WienerRecord& record : records) longest = std::max(longest, record.input.size());
  return std::exp(-1.0 / (kLongestMemory * static_cast<double>(longest)));
}

std::size_t WienerData::scored_samples() const {
  std::size_t count = 0;
  for (const WienerRecord& record : records)
    count += static_cast<std::size_t>(std::ranges::count_if(record.scored, std::identity{}));
  return count;
}

WienerData wiener_data(const TrainingData& data) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  WienerData made{.records = {},
                  .sample_period_s = 1.0 / data.sample_rate_Hz,
                  .range = {kInfinity, -kInfinity}};
  double count = 0.0;
  double mean = 0.0;
  double squares = 0.0;
  for (const Sequence& sequence : data.sequences) {
    WienerRecord record;
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (!sequence.has_features(n)) continue;
      record.input.push_back(sequence.features(n, 0));
      record.target.push_back(sequence.target[n]);
      record.scored.push_back(sequence.use[n]);
      if (sequence.use[n] == 0) continue;
      made.range.lowest = std::min(made.range.lowest, record.input.back());
      made.range.highest = std::max(made.range.highest, record.input.back());
      const double distance = sequence.target[n] - mean;
      mean += distance / ++count;
      squares += distance * (sequence.target[n] - mean);
    }
    made.records.push_back(std::move(record));
  }
  made.rest_input =
      std::clamp(0.0, made.range.lowest, std::max(made.range.lowest, made.range.highest));
  made.deviation = std::sqrt(squares / std::max(count, 1.0));
  return made;
}

std::size_t shifting_value(const StaticCurve& input, double rest_input) {
  if (input.knots.empty()) return 0;
  const auto next = std::ranges::min_element(
      input.knots, {}, [&](double knot) { return std::abs(knot - rest_input); });
  return static_cast<std::size_t>(next - input.knots.begin());
}

WienerData front_of(const WienerData& data, std::size_t samples) {
  std::size_t all = 0;
  for (const WienerRecord& record : data.records) all += record.input.size();
  WienerData front = data;
  for (WienerRecord& record : front.records) {
    const std::size_t kept =
        all <= samples ? record.input.size() : record.input.size() * samples / all;
    record.input.resize(kept);
    record.target.resize(kept);
    record.scored.resize(kept);
  }
  return front;
}

void SectionCascade::run_section(std::size_t section, bool is_all_pole, std::span<double> signal) {
  const auto g = sections_.row(section);
  const double b0 = is_all_pole ? 1.0 : g[0];
  const double b1 = is_all_pole ? 0.0 : g[1];
  const double b2 = is_all_pole ? 0.0 : g[2];
  const double a1 = g[3];
  const double a2 = g[4];
  double s1 = state_[2 * section];
  double s2 = state_[2 * section + 1];
  for (double& x : signal) {
    const double y = b0 * x + s1;
    s1 = b1 * x + s2 - a1 * y;
    s2 = b2 * x - a2 * y;
    x = y;
  }
  state_[2 * section] = s1;
  state_[2 * section + 1] = s2;
}

void SectionCascade::run(std::span<double> signal, std::size_t first) {
  for (std::size_t i = first; i < sections_.rows; ++i) run_section(i, false, signal);
}

WienerError::WienerError(const WienerData& data, WienerNumbers numbers, WienerFree free)
    : data_(data), frame_(std::move(numbers)) {
  const bool is_model = free == WienerFree::model;
  const std::size_t shift = shifting_value(frame_.input, data_.rest_input);
  const std::size_t held = largest_of(frame_.input.values, shift);
  for (std::size_t k = 0; is_model && k < frame_.input.values.size(); ++k) {
    if (k == shift || k == held) continue;
    input_free_.push_back(k);
    names_.push_back(fmt::format("p{}", k));
  }
  const Sections& g = frame_.sections;
  for (std::size_t i = 0; i < g.rows; ++i) {
    const std::size_t held_b = largest_of(g.row(i).first(3), 3);
    for (std::size_t c = 0; c < kSectionColumns; ++c) {
      if (is_model && (c == held_b || g(i, c) == 0.0)) continue;
      section_free_.emplace_back(i, c);
      names_.push_back(fmt::format("{}{}{}", c < 3 ? 'b' : 'f', c < 3 ? c : c - 2,
                                   g.rows == 1 ? "" : fmt::format(" of section {}", i + 1)));
    }
  }
  output_free_ = is_model ? frame_.output.values.size() : 0;
  for (std::size_t k = 0; k < output_free_; ++k) names_.push_back(fmt::format("c{}", k));
  model_size_ = names_.size();
  for (std::size_t r = 0; r < frame_.start.rows; ++r)
    for (std::size_t s = 0; s < frame_.start.columns; ++s)
      names_.push_back(fmt::format("start {} of record {}", s + 1, r + 1));
  for (const WienerRecord& record : data_.records) {
    Matrix& basis = basis_.emplace_back(frame_.input.values.size(), record.input.size());
    std::vector<double> at_rest(basis.rows);
    std::vector<double> phi(basis.rows);
    fill_basis(frame_.input, data_.rest_input, at_rest);
    for (std::size_t n = 0; n < basis.columns; ++n) {
      fill_basis(frame_.input, record.input[n], phi);
      for (std::size_t k = 0; k < basis.rows; ++k) basis(k, n) = phi[k] - at_rest[k];
    }
  }
}

std::vector<double> WienerError::pack(const WienerNumbers& numbers) const {
  std::vector<double> packed;
  for (const std::size_t k : input_free_) packed.push_back(numbers.input.values[k]);
  for (const auto& [i, c] : section_free_) packed.push_back(numbers.sections(i, c));
  packed.insert(packed.end(), numbers.output.values.begin(),
                numbers.output.values.begin() + static_cast<std::ptrdiff_t>(output_free_));
  packed.insert(packed.end(), numbers.start.values.begin(), numbers.start.values.end());
  return packed;
}

WienerNumbers WienerError::unpack(std::span<const double> packed) const {
  WienerNumbers numbers = frame_;
  auto next = packed.begin();
  for (const std::size_t k : input_free_) numbers.input.values[k] = *next++;
  for (const auto& [i, c] : section_free_) numbers.sections(i, c) = *next++;
  for (std::size_t k = 0; k < output_free_; ++k) numbers.output.values[k] = *next++;
  for (double& value : numbers.start.values) value = *next++;
  return numbers;
}

std::size_t WienerError::at(std::size_t section, std::size_t column) const {
  const auto found = std::ranges::find(section_free_, std::pair(section, column));
  return found == section_free_.end()
             ? kNowhere
             : input_free_.size() + static_cast<std::size_t>(found - section_free_.begin());
}

std::pair<std::size_t, std::size_t> WienerError::poles_at(std::size_t section) const {
  return {at(section, 3), at(section, 4)};
}

/// The sensitivities of one record, which all pass the same sections: those to the values of P, and for each
/// section those to its numerator, to its denominator and to the state at the start.
class WienerError::Sensitivities {
 public:
  Sensitivities(const Sections& g, std::size_t inputs, bool has_start)
      : sections_(g),
        inputs_(inputs),
        per_section_(has_start ? 3 : 2),
        stride_(rounded_up(inputs + per_section_ * g.rows)),
        values_(kBlock * stride_),
        coefficients_(3 * g.rows * stride_, 0.0),
        states_(2 * g.rows * stride_, 0.0),
        past_(stride_) {
    for (std::size_t i = 0; i < g.rows; ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        double* const b = coefficients_.data() + (3 * i + c) * stride_;
        std::fill_n(b, numerator(i), g(i, c));  // what entered the cascade before this section
        if (c == 0) std::fill_n(b + numerator(i), per_section_, 1.0);  // what enters here: 1 / F
      }
  }

  [[nodiscard]] std::size_t numerator(std::size_t section) const {
    return inputs_ + per_section_ * section;
  }
  [[nodiscard]] std::size_t denominator(std::size_t section) const {
    return numerator(section) + 1;
  }
  [[nodiscard]] std::size_t start(std::size_t section) const { return numerator(section) + 2; }

  /// Begins a block: all signals are zero.
  void begin(std::size_t count) {
    count_ = count;
    std::fill_n(values_.data(), count * stride_, 0.0);
  }
  void set(std::size_t signal, std::span<const double> from, double factor = 1.0) {
    double* to = values_.data() + signal;
    for (const double value : from) {
      *to = factor * value;
      to += stride_;
    }
  }
  void run_section(std::size_t i) {
    double* const b = coefficients_.data() + 3 * i * stride_;
    double* const s = states_.data() + 2 * i * stride_;
    section_kernel::run({.b0 = b,
                         .b1 = b + stride_,
                         .b2 = b + 2 * stride_,
                         .a1 = sections_(i, 3),
                         .a2 = sections_(i, 4),
                         .s1 = s,
                         .s2 = s + stride_},
                        values_.data(), count_, stride_);
  }
  /// out(n) = signal(n - k), from block to block.
  void copy(std::size_t signal, std::size_t k, std::span<double> out) const {
    for (std::size_t n = 0; n < std::min(k, count_); ++n) out[n] = past_[signal][2 - k + n];
    const double* from = values_.data() + signal;
    for (std::size_t n = k; n < count_; ++n, from += stride_) out[n] = *from;
  }
  /// Ends a block: keeps the last two values of each signal.
  void end() {
    for (std::size_t n = count_ - std::min<std::size_t>(2, count_); n < count_; ++n)
      for (std::size_t k = 0; k < stride_; ++k) past_[k] = {past_[k][1], values_[n * stride_ + k]};
  }

 private:
  const Sections& sections_;
  std::size_t inputs_;
  std::size_t per_section_;
  std::size_t stride_;
  std::size_t count_ = 0;
  detail::AlignedVector<double> values_;        ///< [sample][signal] of a block
  detail::AlignedVector<double> coefficients_;  ///< [section][b0, b1, b2][signal]
  detail::AlignedVector<double> states_;        ///< [section][s1, s2][signal]
  std::vector<std::array<double, 2>> past_;     ///< the last two values of each signal
};

/// Calls take(columns, samples) for each block of each record: one row per sample, zero where not
/// scored, the last column the error, the one before x.
template <class Take>
bool WienerError::pass(const WienerNumbers& numbers, bool with_slopes, const Take& take) const {
  const Sections& g = numbers.sections;
  const std::size_t error_at = with_slopes ? size() + 1 : 1;
  const std::size_t x_at = error_at - 1;
  const std::size_t inputs = with_slopes ? input_free_.size() : 0;
  const bool has_start = numbers.start.rows > 0;
  Block block(rounded_up(error_at + 1) * kBlock, 0.0);
  const std::span<double> columns(block);
  for (std::size_t r = 0; r < data_.records.size(); ++r) {
    const WienerRecord& record = data_.records[r];
    SectionCascade cascade(g);
    if (has_start) cascade.set_state(numbers.start.row(r));
    Sensitivities sensitivities(g, inputs, has_start);
    for (std::size_t begin = 0; begin < record.input.size(); begin += kBlock) {
      const std::size_t count = std::min(kBlock, record.input.size() - begin);
      const auto x = column(columns, x_at, count);
      std::ranges::fill(x, 0.0);
      for (std::size_t k = 0; k < basis_[r].rows; ++k) {
        const auto phi = basis_[r].row(k).subspan(begin, count);
        const double value = numbers.input.values[k];
        for (std::size_t n = 0; n < count; ++n) x[n] += value * phi[n];
      }
      if (with_slopes) {
        sensitivities.begin(count);
        for (std::size_t k = 0; k < inputs; ++k)
          sensitivities.set(k, basis_[r].row(input_free_[k]).subspan(begin, count));
      }
      for (std::size_t i = 0; i < g.rows; ++i) {
        if (with_slopes) sensitivities.set(sensitivities.numerator(i), x);
        cascade.run_section(i, false, x);
        if (!with_slopes) continue;
        sensitivities.set(sensitivities.denominator(i), x, -1.0);
        if (has_start && begin == 0) sensitivities.set(sensitivities.start(i), kImpulse);
        sensitivities.run_section(i);
      }
      if (with_slopes) {
        fill_slopes(numbers, r, count, sensitivities, columns);
        sensitivities.end();
      }
      const auto error = column(columns, error_at, count);
      for (std::size_t n = 0; n < count; ++n) {
        if (record.scored[begin + n] == 0) continue;
        error[n] = numbers.output(x[n]) - record.target[begin + n];
        constexpr double kLargest = 1e100;
        if (!(std::abs(error[n]) < kLargest)) return false;
      }
      for (std::size_t n = 0; n < kBlock; ++n)
        if (n >= count || record.scored[begin + n] == 0)
          for (std::size_t k = 0; k <= error_at; ++k) block[k * kBlock + n] = 0.0;
      take(block, begin, count, record);
    }
  }
  return true;
}

/// The columns of the numbers in a block of record `r`, whose x is in its column.
void WienerError::fill_slopes(const WienerNumbers& numbers, std::size_t r, std::size_t count,
                              const Sensitivities& of, std::span<double> block) const {
  const auto part = [&](std::size_t at) { return column(block, at, count); };
  const auto x = part(size());
  for (std::size_t k = 0; k < input_free_.size(); ++k) of.copy(k, 0, part(k));
  for (std::size_t i = 0; i < numbers.sections.rows; ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      if (const std::size_t to = at(i, c); to != kNowhere) of.copy(of.numerator(i), c, part(to));
    for (std::size_t c = 3; c < 5; ++c)
      if (const std::size_t to = at(i, c); to != kNowhere)
        of.copy(of.denominator(i), c - 2, part(to));
  }
  for (std::size_t c = model_size_; c < size(); ++c) std::ranges::fill(part(c), 0.0);
  for (std::size_t i = 0; numbers.start.rows > 0 && i < numbers.sections.rows; ++i) {
    const std::size_t to = model_size_ + r * numbers.start.columns + 2 * i;
    of.copy(of.start(i), 0, part(to));
    of.copy(of.start(i), 1, part(to + 1));
  }
  const std::size_t output_at = input_free_.size() + section_free_.size();
  std::vector<double> phi_of_x(output_free_);
  Eigen::ArrayXd slope(static_cast<Index>(count));
  for (std::size_t n = 0; n < count; ++n) {
    if (output_free_ > 0) fill_basis(numbers.output, x[n], phi_of_x);
    for (std::size_t k = 0; k < output_free_; ++k) part(output_at + k)[n] = phi_of_x[k];
    slope[static_cast<Index>(n)] = numbers.output.slope(x[n]);
  }
  for (std::size_t k = 0; k < size(); ++k)
    if (k < output_at || k >= model_size_)
      Eigen::Map<Eigen::ArrayXd>(part(k).data(), static_cast<Index>(count)) *= slope;
}

double WienerError::sum_of_squares(const WienerNumbers& numbers) const {
  double sum = 0.0;
  const bool is_determined =
      pass(numbers, false, [&](const Block& block, auto, std::size_t count, auto&) {
        const auto error = std::span(block).subspan(kBlock, count);
        sum += std::inner_product(error.begin(), error.end(), error.begin(), 0.0);
      });
  return is_determined ? sum : kNotMeasured;
}

bool WienerError::products(const WienerNumbers& numbers, Matrix& gram) const {
  const std::size_t columns = rounded_up(size() + 2);
  Matrix sum(columns, columns);
  const bool is_determined = pass(numbers, true, [&](const Block& block, auto, auto, auto&) {
    section_kernel::add_products(block.data(), columns, sum.values.data());
  });
  gram = Matrix(size() + 1, size() + 1);
  const auto source = [&](std::size_t k) { return k < size() ? k : k + 1; };
  for (std::size_t i = 0; i < gram.rows; ++i)
    for (std::size_t j = 0; j <= i; ++j) gram(i, j) = gram(j, i) = sum(source(i), source(j));
  return is_determined && all_finite(gram.values);
}

Matrix WienerError::rows(const WienerNumbers& numbers) const {
  Matrix all(data_.scored_samples(), size() + 1);
  std::size_t row = 0;
  (void)pass(numbers, true,
             [&](const Block& block, std::size_t begin, std::size_t count, const WienerRecord& of) {
               for (std::size_t n = 0; n < count; ++n) {
                 if (of.scored[begin + n] == 0) continue;
                 for (std::size_t k = 0; k <= size(); ++k)
                   all(row, k) = block[(k < size() ? k : k + 1) * kBlock + n];
                 ++row;
               }
             });
  return all;
}

std::vector<double> WienerError::inner(const WienerNumbers& numbers) const {
  std::vector<double> all;
  (void)pass(numbers, false,
             [&](const Block& block, std::size_t begin, std::size_t count, const WienerRecord& of) {
               for (std::size_t n = 0; n < count; ++n)
                 if (of.scored[begin + n] != 0) all.push_back(block[n]);
             });
  return all;
}

}  // namespace torsio
