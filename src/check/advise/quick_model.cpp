#include "check/advise/quick_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/hysteresis/slip_bank.hpp"

namespace torsio {
namespace {

constexpr std::array kQuickHinges{-0.5, 0.0, 0.5};
constexpr std::size_t kQuickStops = 8;  // from the half range down to 1/128 of it
constexpr std::array<std::size_t, 2> kLoadedStops{2,
                                                  4};  // with a friction that grows with the load
constexpr std::array kRelaxations_s{0.02, 0.2, 2.0, 20.0};
// A column that hardly varies has no influence beyond this share of its own square sum.
constexpr double kRidge = 1e-6;

std::vector<double> thresholds() {
  std::vector<double> result;
  for (std::size_t j = 0; j < kQuickStops; ++j)
    result.push_back(std::ldexp(1.0, -static_cast<int>(j)));
  return result;
}

}  // namespace

/// The columns of one sequence, sample by sample.
class QuickModel::Rows {
 public:
  Rows(const QuickModel& model, const Sequence& sequence, std::size_t index, double sample_rate_Hz)
      : model_(model),
        sequence_(sequence),
        index_(index),
        row_(model.columns()),
        stops_(thresholds(), "check") {
    for (std::size_t l = 0; l < kRelaxations_s.size(); ++l)
      follow_[l] = -std::expm1(-1.0 / (kRelaxations_s[l] * sample_rate_Hz));
  }

  /// @returns the row of the next sample; without effect on the memory where a feature is missing.
  const std::vector<double>& next(std::size_t n) {
    if (!sequence_.has_features(n)) return row_;
    const double z = (sequence_.features(n, 0) - model_.middle_) / model_.half_range_;
    if (!has_last_) {
      slow_.fill(z);
      last_ = z;
      has_last_ = true;
    }
    stops_.move(z - last_);
    last_ = z;
    std::size_t column = 0;
    const auto put = [&](double value) { row_[column++] = value; };
    put(1.0);
    put(z);
    for (const double hinge : kQuickHinges) put(std::max(z - hinge, 0.0));
    for (const double force : stops_.forces()) put(force);
    for (const std::size_t j : kLoadedStops) put(stops_.forces()[j] * std::abs(z));
    for (std::size_t l = 0; l < slow_.size(); ++l) {
      slow_[l] += follow_[l] * (z - slow_[l]);
      put(z - slow_[l]);
    }
    for (std::size_t j = 1; j < sequence_.features.columns; ++j) {
      const double u = sequence_.features(n, j) / model_.input_rms_[j];
      put(u);
      put(std::tanh(3.0 * u));
    }
    for (std::size_t q = 0; q < model_.conditions_.size(); ++q) {
      const double c = (model_.conditions_[q].of_recording[index_] - model_.condition_middle_[q]) /
                       model_.condition_half_range_[q];
      put(c);
      put(c * z);
    }
    return row_;
  }

 private:
  const QuickModel& model_;
  const Sequence& sequence_;
  std::size_t index_;
  std::vector<double> row_;
  SlipBank stops_;
  std::array<double, kRelaxations_s.size()> slow_{};
  std::array<double, kRelaxations_s.size()> follow_{};
  double last_ = 0.0;
  bool has_last_ = false;
};

QuickModel::QuickModel(const TrainingData& data, const std::vector<ConditionValues>& conditions,
                       double lowest, double highest)
    : conditions_(conditions),
      middle_(0.5 * (lowest + highest)),
      half_range_(0.5 * (highest - lowest)),
      input_rms_(data.input_count(), 1.0) {
  const auto column = [&](bool is_free, bool is_linear) {
    is_free_.push_back(is_free ? 1 : 0);
    is_linear_.push_back(is_linear ? 1 : 0);
  };
  column(true, true);
  column(true, true);
  for (std::size_t i = 0; i < kQuickHinges.size(); ++i) column(true, false);
  for (std::size_t i = 0; i < kQuickStops + kLoadedStops.size(); ++i) column(false, false);
  for (std::size_t i = 0; i < kRelaxations_s.size(); ++i) column(false, false);
  for (std::size_t j = 1; j < data.input_count(); ++j) {
    double square = 0.0;
    double count = 0.0;
    for (const Sequence& sequence : data.sequences)
      for (std::size_t n = 0; n < sequence.target.size(); ++n)
        if (sequence.use[n] != 0) {
          square += sequence.features(n, j) * sequence.features(n, j);
          count += 1.0;
        }
    if (square > 0.0) input_rms_[j] = std::sqrt(square / count);
    column(true, !data.inputs[j].is_rate);
    column(true, false);
  }
  for (const ConditionValues& condition : conditions) {
    const auto [low, high] = std::ranges::minmax(condition.of_recording);
    condition_middle_.push_back(0.5 * (low + high));
    condition_half_range_.push_back(high > low ? 0.5 * (high - low) : 1.0);
    column(true, true);
    column(true, false);
  }
}

std::vector<BlockSums> QuickModel::blocks(const TrainingData& data, std::size_t sequence,
                                          const std::vector<std::size_t>& ends) const {
  std::vector<BlockSums> result(ends.size(), BlockSums(columns()));
  const Sequence& samples = data.sequences[sequence];
  Rows rows(*this, samples, sequence, data.sample_rate_Hz);
  std::size_t block = 0;
  for (std::size_t n = 0; n < samples.target.size(); ++n) {
    while (block < ends.size() && n >= ends[block]) ++block;
    const std::vector<double>& row = rows.next(n);
    if (samples.use[n] == 0 || block == ends.size()) continue;
    result[block].sums.add(row, samples.target[n]);
    result[block].target_sum += samples.target[n];
  }
  return result;
}

QuickModel::Coefficients QuickModel::solve(const NormalEquations& sums,
                                           const std::vector<std::uint8_t>& used) const {
  std::vector<std::size_t> columns;
  std::vector<std::uint8_t> is_free;
  for (std::size_t j = 0; j < used.size(); ++j)
    if (used[j] != 0) {
      columns.push_back(j);
      is_free.push_back(is_free_[j]);
    }
  NormalEquations part(columns.size());
  part.square = sums.square;
  part.rows = sums.rows;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    part.projection[i] = sums.projection[columns[i]];
    for (std::size_t j = 0; j < columns.size(); ++j)
      part.product(i, j) = sums.product(columns[i], columns[j]);
    part.product(i, i) *= 1.0 + kRidge;
  }
  const NonNegativeFit fitted = non_negative_least_squares(part, is_free);
  Coefficients coefficients(used.size(), 0.0);
  for (std::size_t i = 0; i < columns.size(); ++i)
    coefficients[columns[i]] = fitted.coefficients[i];
  return coefficients;
}

QuickModel::Coefficients QuickModel::fit(const NormalEquations& sums) const {
  return solve(sums, std::vector<std::uint8_t>(columns(), 1));
}

QuickModel::Coefficients QuickModel::fit_linear(const NormalEquations& sums) const {
  return solve(sums, is_linear_);
}

void add_sums(NormalEquations& sums, const NormalEquations& more) noexcept {
  for (std::size_t i = 0; i < sums.product.values.size(); ++i)
    sums.product.values[i] += more.product.values[i];
  for (std::size_t i = 0; i < sums.projection.size(); ++i) sums.projection[i] += more.projection[i];
  sums.square += more.square;
  sums.rows += more.rows;
}

}  // namespace torsio
