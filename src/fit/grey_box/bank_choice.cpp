#include "fit/grey_box/bank_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fit/grey_box/sample_range.hpp"

namespace torsio {
namespace {

constexpr std::size_t kThresholds = 8;
/// The largest threshold is this share of half the range. Elements with larger ones hardly slip: they
/// follow the coordinate itself, and with it what loads the drive at this angle.
constexpr double kLargestThreshold = 0.25;
constexpr std::array<std::size_t, BankChoice::kMaxSlips + 1> kBankSlips{0, 2, 4, 8};
constexpr std::array kPeriods{1.0, 4.0, 16.0};  // time constants, in samples

std::size_t knots_at(std::size_t level) { return (std::size_t{1} << level) + 1; }

/// The range of an input over all usable samples.
SampleRange range_of(const TrainingData& data, std::size_t input) {
  SampleRange range;
  for (const Sequence& sequence : data.sequences)
    for (std::size_t n = 0; n < sequence.use.size(); ++n)
      if (sequence.use[n] != 0) range.take(sequence.features(n, input));
  return range;
}

/// The least width that the slips' coordinate covers in a recording. Recordings in which it covers
/// less than 1e-4 of the most are at rest.
double least_width(const TrainingData& data, std::size_t input) {
  const double period_s = data.inputs[input].is_rate ? 1.0 / data.sample_rate_Hz : 0.0;
  std::vector<double> widths;
  for (const Sequence& sequence : data.sequences) {
    SampleRange range;
    double integral = 0.0;
    for (std::size_t n = 0; n < sequence.use.size(); ++n) {
      if (!sequence.has_features(n)) continue;
      const double u = sequence.features(n, input);
      integral += period_s * u;
      if (sequence.use[n] != 0) range.take(period_s > 0.0 ? integral : u);
    }
    widths.push_back(range.width());
  }
  constexpr double kAtRest = 1e-4;
  const double widest = *std::ranges::max_element(widths);
  double least = widest;
  for (const double width : widths)
    if (width > kAtRest * widest) least = std::min(least, width);
  return least;
}

/// Whether the slips' coordinate of an input is the first input but for a constant in every recording:
/// 99 % of its variance. Slips over the first input are there already.
bool follows_first(const TrainingData& data, std::size_t input) {
  const double period_s = data.inputs[input].is_rate ? 1.0 / data.sample_rate_Hz : 0.0;
  for (const Sequence& sequence : data.sequences) {
    double count = 0.0;
    std::array<double, 2> sums{};
    std::array<double, 3> products{};  // qq, qx, xx
    double integral = 0.0;
    for (std::size_t n = 0; n < sequence.use.size(); ++n) {
      if (!sequence.has_features(n)) continue;
      const double u = sequence.features(n, input);
      integral += period_s * u;
      if (sequence.use[n] == 0) continue;
      const double q = period_s > 0.0 ? integral : u;
      const double x = sequence.features(n, 0);
      count += 1.0;
      sums = {sums[0] + q, sums[1] + x};
      products = {products[0] + q * q, products[1] + q * x, products[2] + x * x};
    }
    if (count == 0.0) continue;
    const double qq = products[0] - sums[0] * sums[0] / count;
    const double qx = products[1] - sums[0] * sums[1] / count;
    const double xx = products[2] - sums[1] * sums[1] / count;
    constexpr double kTheSame = 0.99;
    if (!(qx * qx > kTheSame * qq * xx)) return false;
  }
  return true;
}

/// Which of the finest thresholds is number i of `count`: evenly spread, with the largest.
std::size_t finest_of(std::size_t i, std::size_t count) {
  return (i + 1) * (kThresholds / count) - 1;
}

}  // namespace

std::vector<double> evenly(double low, double high, std::size_t count) {
  std::vector<double> all(count);
  for (std::size_t i = 0; i < count; ++i)
    all[i] = low + (high - low) * static_cast<double>(i) / static_cast<double>(count - 1);
  all.back() = high;
  return all;
}

std::vector<InputBank> finest_banks(const TrainingData& data, std::size_t excluded) {
  const SampleRange of_first = range_of(data, 0);
  std::vector<InputBank> banks;
  for (std::size_t input = 1; input < data.input_count(); ++input) {
    const SampleRange range = range_of(data, input);
    const double half = 0.5 * least_width(data, input);
    if (input == excluded || !(range.width() > 0.0) || !(half > 0.0)) continue;
    InputBank bank{.input = input, .is_integrated = data.inputs[input].is_rate};
    for (std::size_t i = kThresholds; i-- > 0;)
      bank.thresholds.push_back(kLargestThreshold * half * std::exp2(-static_cast<double>(i)));
    if (follows_first(data, input)) bank.thresholds.clear();
    bank.force_knots = evenly(of_first.low, of_first.high, knots_at(BankChoice::kMaxForces));
    bank.curve_knots = evenly(range.low, range.high, knots_at(BankChoice::kMaxCurve));
    bank.product_knots = evenly(of_first.low, of_first.high, knots_at(BankChoice::kMaxProduct - 1));
    for (const double periods : kPeriods)
      bank.time_constants_s.push_back(periods / data.sample_rate_Hz);
    banks.push_back(std::move(bank));
  }
  return banks;
}

InputBank bank_of(const InputBank& finest, const BankChoice& choice) {
  const auto over = [](const std::vector<double>& fine, std::size_t count) {
    return evenly(fine.front(), fine.back(), count);
  };
  InputBank own{.input = finest.input, .is_integrated = finest.is_integrated};
  const std::size_t slips = finest.thresholds.empty() ? 0 : kBankSlips[choice.slips];
  for (std::size_t i = 0; i < slips; ++i)
    own.thresholds.push_back(finest.thresholds[finest_of(i, slips)]);
  own.force_knots =
      slips == 0 || choice.forces == 0
          ? std::vector<double>{0.5 * (finest.force_knots.front() + finest.force_knots.back())}
          : over(finest.force_knots, knots_at(choice.forces));
  if (choice.curve > 0) own.curve_knots = over(finest.curve_knots, knots_at(choice.curve));
  if (choice.product > 0)
    own.product_knots = over(finest.product_knots, knots_at(choice.product - 1));
  own.product_input = finest.product_input;
  own.time_constants_s.assign(
      finest.time_constants_s.begin(),
      finest.time_constants_s.begin() + static_cast<std::ptrdiff_t>(choice.relaxations));
  return own;
}

void add_hats(std::vector<ColumnShare>& shares, std::size_t from_column, std::size_t from_knots,
              std::size_t to_column, std::size_t to_knots, double factor, bool inner) {
  const std::size_t step = (from_knots - 1) / (to_knots - 1);
  const std::size_t left_out = inner ? 1 : 0;
  const auto put = [&](std::size_t from, std::size_t to, double share) {
    const bool is_outer = from == 0 || from + 1 == from_knots || to == 0 || to + 1 == to_knots;
    if (share > 0.0 && !(inner && is_outer))
      shares.push_back({from_column + from - left_out, to_column + to - left_out, factor * share});
  };
  for (std::size_t at = 0; at < from_knots; ++at) {
    const std::size_t left = std::min(at / step, to_knots - 2);
    const double share = static_cast<double>(at - left * step) / static_cast<double>(step);
    put(at, left, 1.0 - share);
    put(at, left + 1, share);
  }
}

void add_bank_columns(std::vector<ColumnShare>& shares, const InputBank& finest,
                      std::size_t finest_first, const InputBank& chosen, std::size_t chosen_first,
                      const BankChoice& choice) {
  const double sign = choice.is_negative ? -1.0 : 1.0;
  const std::size_t fine = finest.force_knots.size();
  const std::size_t coarse = chosen.force_knots.size();
  const std::size_t slips = chosen.thresholds.size();
  const auto one = [&](std::size_t from, std::size_t to, double factor) {
    shares.push_back({finest_first + from, chosen_first + to, factor});
  };
  for (std::size_t i = 0; i < slips; ++i) {
    const std::size_t from = finest_of(i, slips) * fine;
    if (coarse > 1)
      add_hats(shares, finest_first + from, fine, chosen_first + i * coarse, coarse, sign);
    else
      for (std::size_t k = 0; k < fine; ++k) one(from + k, i, sign);
  }
  if (!chosen.curve_knots.empty())
    add_hats(shares, finest_first + finest.first_curve(), finest.curve_knots.size(),
             chosen_first + chosen.first_curve(), chosen.curve_knots.size(), 1.0, true);
  if (!chosen.product_knots.empty())
    add_hats(shares, finest_first + finest.first_product(), finest.product_knots.size(),
             chosen_first + chosen.first_product(), chosen.product_knots.size());
  for (std::size_t j = 0; j < chosen.time_constants_s.size(); ++j)
    one(finest.first_relaxation() + j, chosen.first_relaxation() + j, 1.0);
}

std::string description_of(const InputBank& bank, const BankChoice& choice,
                           const TrainingData& data) {
  std::vector<std::string> parts;
  if (!bank.thresholds.empty())
    parts.push_back(fmt::format(
        "{} slip elements of forces {} 0{}{}", bank.thresholds.size(),
        choice.is_negative ? "<=" : ">=", bank.is_integrated ? " that follow its integral" : "",
        bank.force_knots.size() == 1 ? std::string()
                                     : fmt::format(", which depend on the first input at {} knots",
                                                   bank.force_knots.size())));
  if (!bank.curve_knots.empty())
    parts.push_back(fmt::format("a curve of {} knots", bank.curve_knots.size()));
  if (!bank.product_knots.empty())
    parts.push_back(fmt::format("a slope that depends on the first input at {} knots",
                                bank.product_knots.size()));
  if (!bank.time_constants_s.empty())
    parts.push_back(fmt::format("{} relaxations", bank.time_constants_s.size()));
  return fmt::format("over {}: {}", data.inputs[bank.input].expression, fmt::join(parts, "; "));
}

}  // namespace torsio
