#include "check/advise/expected_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace torsio {
namespace {

using Direction = RegionErrors::Direction;

constexpr std::array kDirections{Direction::larger, Direction::smaller, Direction::faster,
                                 Direction::slower, Direction::off_centre};
constexpr std::size_t kFewStrokes = 4;
constexpr double kMaxGrowth = 12.0;
// What one step shows is not extrapolated without bound: a further one at most doubles the error.
constexpr double kFurtherStep = 1.386;
// Assumed where nothing determines the growth, ln of the ratio of squared errors per step. Beyond
// the range of the recordings a guard replaces the model, so that the error doubles: 2 ln 2.
constexpr double kUnknownBeyond = 1.386;
constexpr int kFewSteps = 2;  // farther away an error is assumed, too
constexpr double kUnknownStep = 0.7;
constexpr double kUnknownCentre = 0.35;
constexpr double kWithinARegion = 0.5;  // steps from a recorded motion to another one in its region
constexpr double kNearest = 0.01;       // per step, where the growth is 0

/// The steps from one region to another in every direction; 0 if it is the other way.
std::array<std::pair<Direction, int>, kDirections.size()> steps(const RegionKey& from,
                                                                const RegionKey& to) {
  const auto forward = [](int difference) { return std::max(0, difference); };
  return {std::pair{Direction::larger, forward(from.amplitude - to.amplitude)},
          std::pair{Direction::smaller, forward(to.amplitude - from.amplitude)},
          std::pair{Direction::faster, forward(to.frequency - from.frequency)},
          std::pair{Direction::slower, forward(from.frequency - to.frequency)},
          std::pair{Direction::off_centre, std::abs(to.centre - from.centre)}};
}

const char* name(Direction direction) {
  switch (direction) {
    case Direction::larger: return "larger";
    case Direction::smaller: return "smaller";
    case Direction::faster: return "faster";
    case Direction::slower: return "slower";
    case Direction::off_centre: return "off-centre";
  }
  return "other";
}

}  // namespace

ExpectedError::ExpectedError(const RegionErrors& errors)
    : full_square_(std::pow(errors.linear_slope(), 2)) {
  for (const Direction direction : kDirections) growths_[direction] = errors.growth(direction);
  // The strokes of a recording resemble each other more than those of its use.
  double growth = 0.0;
  for (const Direction direction : {Direction::smaller, Direction::faster, Direction::slower})
    growth = std::max(growth, growths_[direction].per_step);
  const bool has_enough = std::ranges::any_of(
      errors.held_out(), [](const auto& region) { return region.second.strokes >= kFewStrokes; });
  for (const auto& [key, region] : errors.held_out()) {
    if (has_enough && region.strokes < kFewStrokes) continue;
    covered_[key] = region.mean_square() * std::exp(kWithinARegion * growth);
    linear_[key] = errors.held_out_linear().at(key).mean_square();
  }
}

double ExpectedError::per_step(Direction direction) const {
  const Growth& growth = growths_.at(direction);
  if (growth.is_known) return growth.per_step;
  if (direction == Direction::larger || direction == Direction::faster) return kUnknownBeyond;
  return direction == Direction::off_centre ? kUnknownCentre : kUnknownStep;
}

ExpectedError::Value ExpectedError::at(const RegionKey& key, const Covered& covered) const {
  if (const auto found = covered.find(key); found != covered.end())
    return {.mean_square = found->second,
            .afterwards = found->second,
            .is_known = true,
            .nearest = key};
  Value best;
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [known, error] : covered) {
    Value value{.mean_square = 0.0, .afterwards = error, .is_known = true, .nearest = known};
    double growth = 0.0;
    double distance = 0.0;
    bool leaves_range = false;
    for (const auto& [direction, count] : steps(known, key)) {
      if (count == 0) continue;
      const double step = per_step(direction);
      growth += step + std::min(step, kFurtherStep) * (count - 1);
      distance += (step + kNearest) * count;
      value.is_known = value.is_known && growths_.at(direction).is_known && count <= kFewSteps;
      leaves_range =
          leaves_range || direction == Direction::larger || direction == Direction::faster;
    }
    value.afterwards *= std::exp2(2.0 * (known.amplitude - key.amplitude));
    if (distance >= least) continue;
    least = distance;
    value.mean_square = value.afterwards * std::exp(std::min(growth, kMaxGrowth));
    // Beyond the range a guard replaces the model by the linear one.
    if (const auto linear = linear_.find(known); leaves_range && linear != linear_.end())
      value.mean_square = std::max(value.mean_square, linear->second * value.afterwards / error);
    // No error is larger than the torque of the stroke itself, whose mean square is a third of its
    // peak's.
    value.mean_square = std::clamp(
        value.mean_square, value.afterwards,
        std::max(value.afterwards, full_square_ * std::exp2(-2.0 * key.amplitude) / 3.0));
    best = value;
  }
  return best;
}

std::vector<std::string> ExpectedError::growth_texts(const RegionKey& from,
                                                     const RegionKey& to) const {
  std::vector<std::string> texts;
  for (const auto& [direction, count] : steps(from, to)) {
    if (count == 0) continue;
    const Growth& growth = growths_.at(direction);
    if (growth.is_known)
      texts.push_back(fmt::format(
          "{} strokes, left out of the training, had {:.2g} times the "
          "RMSE{} ({} strokes){}",
          name(direction), std::sqrt(growth.largest.ratio),
          growth.largest.is_clear ? "" : ", not a clear difference", growth.largest.strokes,
          count > kFewSteps ? ", but this region is farther away" : ""));
    else
      texts.push_back(
          fmt::format("how the error grows towards {} strokes cannot be determined; "
                      "{:.2g} times the RMSE per region is assumed",
                      name(direction), std::exp(0.5 * per_step(direction))));
  }
  return texts;
}

}  // namespace torsio
