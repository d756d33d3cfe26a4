#include "data/mapping/number_coding.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace torsio {
namespace {

constexpr double kCodeRounding = 1e-5;  ///< numbers that were scaled and written with few digits
constexpr double kCodeJumpShare = 0.3;  ///< share of the range: a jump
constexpr double kSameJump =
    0.2;  ///< by which jumps of one amount may differ, by the motion meanwhile
constexpr double kOverOthers = 2.0;  ///< decoded steps over the largest one between the jumps
constexpr double kRoughness = 0.05;  ///< share that decoding leaves of the sum of the squared steps
constexpr std::size_t kFewestJumps = 2;

double median_jump(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

struct StepSums {
  double largest = 0.0;
  double squares = 0.0;
};

StepSums step_sums_of(std::span<const double> values) {
  StepSums steps;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double step = std::abs(values[i] - values[i - 1]);
    steps.largest = std::max(steps.largest, step);
    steps.squares += step * step;
  }
  return steps;
}

/// The step of numbers that were written with few digits: each larger one determines it better.
double refined_step(std::span<const double> values, double step) {
  constexpr double kNear = 0.25;
  std::vector<double> sizes;
  for (const double value : values) sizes.push_back(std::abs(value));
  std::ranges::sort(sizes);
  for (const double size : sizes) {
    const double codes = std::round(size / step);
    if (codes >= 1.0 && std::abs(size / step - codes) < kNear) step = size / codes;
  }
  return step;
}

/// So many samples that a signal moves through a twentieth of its range in half of the places.
std::size_t samples_of_a_motion(std::span<const double> values) {
  constexpr double kMoved = 0.05;
  const auto [lowest, highest] = std::ranges::minmax(values);
  std::size_t samples = 1;
  for (; 4 * samples < values.size(); samples *= 2) {
    std::vector<double> moved;
    for (std::size_t i = samples; i < values.size(); ++i)
      moved.push_back(std::abs(values[i] - values[i - samples]));
    if (median_jump(std::move(moved)) >= kMoved * (highest - lowest)) break;
  }
  return samples;
}

/// Sum of the squared second differences over so many samples: a signal that was folded at zero has kinks there.
double kinks_of(std::span<const double> values, std::size_t samples) {
  double squares = 0.0;
  for (std::size_t i = samples; i + samples < values.size(); ++i) {
    const double second = values[i + samples] - 2.0 * values[i] + values[i - samples];
    squares += second * second;
  }
  return squares;
}

/// The power of two of `step` that is nearest to `jump`; 0 if it has no usual number of bits.
double nearest_power(double jump, double step) {
  constexpr double kFewestBits = 7.0;
  constexpr double kMaxBits = 33.0;
  if (!(step > 0.0)) return 0.0;
  const double bits = std::round(std::log2(jump / step));
  return bits >= kFewestBits && bits <= kMaxBits ? std::exp2(bits) * step : 0.0;
}

/// An angle that begins again after a turn, also once only. Either it stays within the turn, or each jump is a whole turn
/// apart from a motion that is small compared with it.
std::optional<CodedNumbers> find_turns(std::span<const double> values, double step, double turn) {
  constexpr double kSmall = 0.02;  // share of a turn
  CodedNumbers found{.span = turn, .codes = step > 0.0 ? std::round(turn / step) : 0.0};
  double usual = 0.0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double jump = std::abs(values[i] - values[i - 1]);
    if (jump <= 0.5 * turn) {
      usual = std::max(usual, jump);
    } else if (++found.jumps == 1) {
      found.first = i;
    }
  }
  if (found.jumps == 0 || found.jumps > values.size() / 2 || !(usual > 0.0)) return std::nullopt;
  const double largest_step = kOverOthers * (usual + step);
  const auto [lowest, highest] = std::ranges::minmax(values);
  const bool is_within_turn = std::abs(highest - lowest - turn) <= largest_step;
  if (!is_within_turn && largest_step > kSmall * turn) return std::nullopt;
  std::vector<double> decoded(values.begin(), values.end());
  unwrap(decoded, turn);
  if (step_sums_of(decoded).largest > largest_step ||
      kinks_of(decoded, 1) >= kRoughness * kinks_of(values, 1))
    return std::nullopt;
  return found;
}

}  // namespace

void decode_sign_bit(std::vector<double>& values, double sign_bit) noexcept {
  for (double& value : values)
    if (value >= sign_bit * (1.0 - kCodeRounding)) value = sign_bit - value;
}

void decode_modulus(std::vector<double>& values, double modulus) noexcept {
  for (double& value : values)
    if (value >= 0.5 * modulus * (1.0 - kCodeRounding)) value -= modulus;
}

void unwrap(std::vector<double>& values, double span) noexcept {
  bool has_last = false;
  double last = 0.0;
  double turns = 0.0;
  for (double& value : values) {
    if (!std::isfinite(value)) continue;
    if (has_last) turns -= std::round((value - last) / span);
    has_last = true;
    last = value;
    value += turns * span;
  }
}

std::optional<CodedNumbers> find_coded_numbers(std::span<const double> values, double step,
                                               std::span<const double> turns) {
  if (values.size() < 2) return std::nullopt;
  if (step > 0.0) step = refined_step(values, step);
  const auto [lowest, highest] = std::ranges::minmax(values);
  const double range = highest - lowest;
  for (const double turn : turns)
    if (const auto found = find_turns(values, step, turn)) return found;
  std::vector<double> jumps;
  double usual = 0.0;  // the largest one besides the jumps
  CodedNumbers found;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double jump = std::abs(values[i] - values[i - 1]);
    if (!(jump > kCodeJumpShare * range)) {
      usual = std::max(usual, jump);
      continue;
    }
    if (jumps.empty()) found.first = i;
    jumps.push_back(jump);
  }
  found.jumps = jumps.size();
  // A single jump is a wrap if it passes through a whole range of codes.
  if (const double codes = nearest_power(range + step, step);
      jumps.size() == 1 && codes > 0.0 &&
      std::abs(range + step - codes) <= kOverOthers * (usual + step) &&
      std::abs(jumps.front() - codes) <= kOverOthers * (usual + step))
    if (const auto turned = find_turns(values, step, codes)) return turned;
  if (jumps.size() < kFewestJumps || jumps.size() > values.size() / 2) return std::nullopt;
  const double jump = median_jump(jumps);
  const auto is_other = [&](double of) { return std::abs(of / jump - 1.0) > kSameJump; };
  if (std::ranges::any_of(jumps, is_other)) return std::nullopt;

  const double power = nearest_power(jump, step);
  std::vector<double> magnitudes(values.begin(), values.end());
  if (highest <= 0.0)
    for (double& value : magnitudes) value = -value;
  const double least = std::min(std::abs(lowest), std::abs(highest));
  const double largest_step = kOverOthers * (usual + step);
  const bool begins_at_zero = lowest * highest >= 0.0 && least <= largest_step;
  const StepSums before = step_sums_of(values);
  double least_kinks = HUGE_VAL;
  std::size_t samples = 1;  // for all ways the same
  bool is_coded = false;
  const auto consider = [&](CodedNumbers::Kind kind, double span, const auto& decode) {
    std::vector<double> decoded = magnitudes;
    decode(decoded, span);
    const StepSums after = step_sums_of(decoded);
    if (after.largest > largest_step || after.squares >= kRoughness * before.squares) return;
    if (!is_coded) samples = samples_of_a_motion(decoded);
    const double kinks = kinks_of(decoded, samples);
    if (kinks >= least_kinks) return;
    least_kinks = 0.999 * kinks;  // the first one where ways are equal
    is_coded = true;
    found.kind = kind;
    found.span = span;
    found.codes = step > 0.0 ? std::round(span / step) : 0.0;
  };
  using Kind = CodedNumbers::Kind;
  if (power > 0.0 && begins_at_zero) {
    consider(Kind::modulus, power, decode_modulus);
    consider(Kind::sign_bit, power, decode_sign_bit);
  }
  if (power > 0.0) consider(Kind::wrapped, power, unwrap);
  constexpr double kTurn_rad = 6.283185307179586;
  for (const double turn : {kTurn_rad, kTurn_rad / 2.0, 1.0, 360.0, 1000.0, 1e4, 1e6})
    if (std::abs(turn / jump - 1.0) < kSameJump) consider(Kind::wrapped, turn, unwrap);
  if (is_coded) return found;
  // Not a known amount: the range itself, unless the signal only changes between two levels.
  consider(Kind::wrapped, range + step, unwrap);
  std::vector<double> unwrapped = magnitudes;
  unwrap(unwrapped, range + step);
  const auto [first, last] = std::ranges::minmax(unwrapped);
  return is_coded && last - first > range ? std::optional(found) : std::nullopt;
}

}  // namespace torsio
