#include "check/torque_relation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace torsio {
namespace {

constexpr double kStrongCorrelation = 0.8;
constexpr double kShortestPart = 0.05;  ///< share of the recording
constexpr double kHalfWindow_s = 0.05;
constexpr double kInputBins = 48.0;
constexpr double kSlowest = 0.05;  ///< share of the upper decile of the speeds
constexpr double kSpeedStep = 4.0;
constexpr std::size_t kFewPassages = 40;
constexpr std::size_t kFewSharedCells = 6;
constexpr int kCandidates = 80;
constexpr std::size_t kFewReversals = 3;
constexpr double kOffsetExplains = 0.65;  ///< share of the scatter
constexpr double kSlopeExplains = 0.45;
constexpr double kOverScatter = 3.0;
constexpr double kOffsetShare = 0.15;  ///< share of the torque's range
constexpr double kSlopeFactor = 2.0;

/// Running sums of one part of a record.
struct Sums {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
  void add(double a, double b) { n += 1.0, x += a, y += b, xx += a * a, xy += a * b, yy += b * b; }
  [[nodiscard]] Sums without(const Sums& part) const {
    return {n - part.n, x - part.x, y - part.y, xx - part.xx, xy - part.xy, yy - part.yy};
  }
  [[nodiscard]] double covariance() const { return n > 0.0 ? xy - x * y / n : 0.0; }
  [[nodiscard]] double correlation() const {
    const double spread = (n * xx - x * x) * (n * yy - y * y);
    return spread > 0.0 ? (n * xy - x * y) / std::sqrt(spread) : 0.0;
  }
};

/// A passage through one cell of input and speed.
struct Passage {
  int cell = 0;
  double weight = 0.0;  ///< samples
  double input = 0.0;
  double torque = 0.0;
  double time = 0.0;  ///< in samples
};

/// The upper decile: a single snap has no effect.
double fast(const std::vector<double>& speeds) {
  std::vector<double> sorted;
  for (const double speed : speeds)
    if (is_finite(speed)) sorted.push_back(std::abs(speed));
  if (sorted.empty()) return 0.0;
  const auto decile = sorted.begin() + static_cast<std::ptrdiff_t>(9 * sorted.size() / 10);
  std::ranges::nth_element(sorted, decile);
  return *decile;
}

/// Cell of a sample, -1 at rest: creep and relaxation are not passages.
std::vector<int> cells_of(const Pair& pair, double sample_rate_Hz) {
  const auto window =
      static_cast<std::size_t>(std::max(1.0, std::round(kHalfWindow_s * sample_rate_Hz)));
  const std::vector<double> speed = movement(pair.input, window);
  const Extent extent = extent_of(pair.input);
  const double slowest = kSlowest * fast(speed);
  std::vector<int> cells(pair.input.size(), -1);
  if (!(slowest > 0.0) || !(extent.width() > 0.0)) return cells;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!is_finite(speed[i]) || !is_finite(pair.input[i]) || !is_finite(pair.target[i]) ||
        std::abs(speed[i]) < slowest)
      continue;
    const int place = static_cast<int>(
        std::min(kInputBins - 1.0, kInputBins * (pair.input[i] - extent.lowest) / extent.width()));
    const int gear =
        static_cast<int>(std::log(std::abs(speed[i]) / slowest) / std::log(kSpeedStep));
    cells[i] = (2 * gear + (speed[i] > 0.0 ? 1 : 0)) * static_cast<int>(kInputBins) + place;
  }
  return cells;
}

std::vector<Passage> passages_of(const Pair& pair, double sample_rate_Hz) {
  const std::vector<int> cells = cells_of(pair, sample_rate_Hz);
  std::vector<Passage> passages;
  std::map<int, std::size_t> last;  // noise at a border does not start a new passage
  const double apart = std::max(1.0, sample_rate_Hz * kHalfWindow_s);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i] < 0) continue;
    const auto now = static_cast<double>(i);
    const auto [at, is_new] = last.try_emplace(cells[i], passages.size());
    if (is_new || now - passages[at->second].time > apart) {
      at->second = passages.size();
      passages.push_back({.cell = cells[i]});
    }
    Passage& passage = passages[at->second];
    passage.weight += 1.0;
    passage.input += (pair.input[i] - passage.input) / passage.weight;
    passage.torque += (pair.target[i] - passage.torque) / passage.weight;
    passage.time = now;  // the end of the passage
  }
  return passages;
}

/// The part of the passages' torque that a change over time explains.
struct Explained {
  double explained = 0.0;  ///< share of the scatter at equal input and speed
  double offset = 0.0;     ///< in the middle of the input's range
  double slope = 0.0;
  double scatter = 0.0;  ///< the remainder, root mean square
};

/// Passages through cells, compared with the others of their cell.
class Comparison {
 public:
  Comparison(std::vector<Passage> passages, const Pair& pair)
      : passages_(std::move(passages)), slope_(line_through(pair).slope) {
    std::map<int, std::size_t> number;
    for (const Passage& each : passages_)
      cells_.push_back(number.try_emplace(each.cell, number.size()).first->second);
    cell_count_ = number.size();
    const Extent extent = extent_of(pair.input);
    middle_ = 0.5 * (extent.lowest + extent.highest);
    std::vector<double> torque;
    for (const Passage& each : passages_) torque.push_back(each.torque - slope_ * each.input);
    torque_ = centred(torque);
  }

  [[nodiscard]] const std::vector<Passage>& passages() const { return passages_; }
  [[nodiscard]] double slope() const { return slope_; }

  /// `course`: 0 early, 1 late, one for each passage.
  [[nodiscard]] Explained explained_by(const std::vector<double>& course) const {
    std::vector<double> tilted;
    for (std::size_t i = 0; i < course.size(); ++i)
      tilted.push_back(course[i] * (passages_[i].input - middle_));
    const std::vector<double> a = centred(course);
    const std::vector<double> b = centred(tilted);
    const double aa = product(a, a);
    const double ab = product(a, b);
    const double bb = product(b, b);
    const double ay = product(a, torque_);
    const double by = product(b, torque_);
    const double yy = product(torque_, torque_);
    const double determinant = aa * bb - ab * ab;
    if (!(determinant > 1e-9 * aa * bb) || !(yy > 0.0)) return {};
    Explained relation{.offset = (bb * ay - ab * by) / determinant,
                       .slope = (aa * by - ab * ay) / determinant};
    const double explained = relation.offset * ay + relation.slope * by;
    relation.explained = explained / yy;
    double weight = 0.0;
    for (const Passage& each : passages_) weight += each.weight;
    relation.scatter = std::sqrt(std::max(0.0, yy - explained) / weight);
    return relation;
  }

  /// Cells that were passed both before and after a time.
  [[nodiscard]] std::size_t shared_cells(double time) const {
    std::vector<std::uint8_t> seen(cell_count_, 0);
    for (std::size_t i = 0; i < passages_.size(); ++i)
      seen[cells_[i]] =
          static_cast<std::uint8_t>(seen[cells_[i]] | (passages_[i].time < time ? 1U : 2U));
    return static_cast<std::size_t>(std::ranges::count(seen, 3));
  }

 private:
  [[nodiscard]] std::vector<double> centred(std::vector<double> values) const {
    std::vector<double> sum(cell_count_, 0.0);
    std::vector<double> weight(cell_count_, 0.0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      sum[cells_[i]] += passages_[i].weight * values[i];
      weight[cells_[i]] += passages_[i].weight;
    }
    for (std::size_t i = 0; i < values.size(); ++i) values[i] -= sum[cells_[i]] / weight[cells_[i]];
    return values;
  }

  [[nodiscard]] double product(const std::vector<double>& x, const std::vector<double>& y) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) sum += passages_[i].weight * x[i] * y[i];
    return sum;
  }

  std::vector<Passage> passages_;
  std::vector<std::size_t> cells_;
  std::size_t cell_count_ = 0;
  double slope_ = 0.0;
  double middle_ = 0.0;
  std::vector<double> torque_;
};

// Before its first reversal a hysteretic spring is on its virgin curve: another torque, but no
// change.
bool turns_on_both_sides(const std::vector<double>& input, double sample) {
  constexpr std::size_t kThereAndBack = 2;
  const auto middle = input.begin() + static_cast<std::ptrdiff_t>(sample);
  return count_reversals({input.begin(), middle}) >= kThereAndBack &&
         count_reversals({middle, input.end()}) >= kThereAndBack;
}

}  // namespace

std::optional<SignFlip> find_sign_flip(const Pair& pair) {
  Sums whole;
  const auto is_known = [&](std::size_t i) {
    return is_finite(pair.input[i]) && is_finite(pair.target[i]);
  };
  for (std::size_t i = 0; i < pair.input.size(); ++i)
    if (is_known(i)) whole.add(pair.input[i], pair.target[i]);
  Sums before;
  Sums best;
  SignFlip flip;
  double strongest = 0.0;
  for (std::size_t i = 0; i < pair.input.size(); ++i) {
    if (!is_known(i)) continue;
    const double contrast = std::abs(before.covariance() - whole.without(before).covariance());
    if (before.n > kShortestPart * whole.n && before.n < (1.0 - kShortestPart) * whole.n &&
        contrast > strongest)
      strongest = contrast, flip.sample = i, best = before;
    before.add(pair.input[i], pair.target[i]);
  }
  flip.before = best.correlation();
  flip.after = whole.without(best).correlation();
  const bool turns = std::min(flip.before, flip.after) < -kStrongCorrelation &&
                     std::max(flip.before, flip.after) > kStrongCorrelation;
  return turns ? std::optional(flip) : std::nullopt;
}

std::optional<RelationChange> find_relation_change(const Pair& pair, double sample_rate_Hz) {
  if (correlation(pair.input, pair.target) < kClearCorrelation ||
      count_reversals(pair.input) < kFewReversals)
    return {};
  std::vector<Passage> passages = passages_of(pair, sample_rate_Hz);
  if (passages.size() < kFewPassages) return {};
  const Comparison comparison(std::move(passages), pair);
  const auto& all = comparison.passages();
  const auto samples = static_cast<double>(pair.input.size());
  Explained best;
  RelationChange change;
  std::vector<double> course(all.size());
  for (int k = 1; k < kCandidates; ++k) {
    const double time = samples * k / kCandidates;
    if (comparison.shared_cells(time) < kFewSharedCells || !turns_on_both_sides(pair.input, time))
      continue;
    std::ranges::transform(all, course.begin(),
                           [&](const Passage& each) { return each.time < time ? 0.0 : 1.0; });
    if (const Explained relation = comparison.explained_by(course);
        relation.explained > best.explained)
      best = relation, change.sample = static_cast<std::size_t>(time);
  }
  std::ranges::transform(all, course.begin(),
                         [&](const Passage& each) { return each.time / samples; });
  if (const Explained relation = comparison.explained_by(course);
      relation.explained >= best.explained)
    best = relation, change.is_gradual = true;
  change.offset = best.offset;
  const double early = comparison.slope() - 0.5 * best.slope;
  const double late = comparison.slope() + 0.5 * best.slope;
  change.slope_ratio = early > 0.0 && late > 0.0 ? late / early : 1.0;
  change.is_of_slope = best.explained >= kSlopeExplains &&
                       std::max(change.slope_ratio, 1.0 / change.slope_ratio) >= kSlopeFactor;
  const double least =
      std::max(kOffsetShare * extent_of(pair.target).width(), kOverScatter * best.scatter);
  const bool is_of_offset = best.explained >= kOffsetExplains && std::abs(change.offset) >= least;
  if (is_of_offset) change.is_of_slope = false;
  return is_of_offset || change.is_of_slope ? std::optional(change) : std::nullopt;
}

std::string_view unit_mistake(double ratio) {
  struct Mistake {
    double ratio;
    std::string_view name;
  };
  constexpr double kNear = 1.1;
  constexpr auto kMistakes = std::to_array<Mistake>({{57.29577951308232, "degrees and radians"},
                                                     {100.0, "Nm and Ncm"},
                                                     {1000.0, "a unit and its thousandth"},
                                                     {57295.77951308232, "degrees and mrad"},
                                                     {1e6, "a unit and its millionth"}});
  if (!(ratio > 0.0)) return {};
  const double factor = std::max(ratio, 1.0 / ratio);
  for (const Mistake& mistake : kMistakes)
    if (factor < kNear * mistake.ratio && mistake.ratio < kNear * factor) return mistake.name;
  return {};
}

}  // namespace torsio
