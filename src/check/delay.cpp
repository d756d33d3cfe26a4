#include "check/delay.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>

#include "check/hysteresis_fit.hpp"
#include "numerics/nnls.hpp"
#include "numerics/reversals.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr double kLongest_s = 0.6;
constexpr double kCoarseStep_s = 4e-3;
constexpr double kFineStep_s = 2e-4;
constexpr std::size_t kEnoughSamples = 8000;
constexpr double kExplainsLittle = 0.2;  ///< share of the variance: there is no delay to find
constexpr double kShare = 0.75;          ///< share of what is unexplained without shift
constexpr double kEarlyShare = 0.3;
constexpr double kLeastGain = 3e-4;  ///< share of the variance: a friction explains less, too
constexpr double kLongLag_s = 0.2;
constexpr double kEarlyRest = 0.01;
constexpr double kHeldOutShare = 0.6;
constexpr std::size_t kLeastParts = 3;
constexpr double kShortest_s = 8e-3;
constexpr double kLeastChange_s = 0.012;
constexpr double kCourseShare = 0.3;  ///< share of what a constant lag leaves
constexpr int kCourseSteps = 8;
constexpr auto kDelayHinges = std::to_array<double>({-0.5, 0.0, 0.5});  // the input is scaled
constexpr std::size_t kDelayStops = 20;
constexpr double kSmallestStop = 0.004;  ///< share of half the range
constexpr auto kLoadedStops = std::to_array<std::size_t>({4, 8, 12});
constexpr auto kRelaxations_s = std::to_array<double>({0.02, 0.2, 2.0, 20.0});
constexpr Eigen::Index kFree = 4 + static_cast<Eigen::Index>(kDelayHinges.size());
constexpr Eigen::Index kColumns =
    kFree + static_cast<Eigen::Index>(kDelayStops + kLoadedStops.size() + kRelaxations_s.size());
constexpr std::size_t kParts = 4;
constexpr std::size_t kStrokesOfADrift = 10;
constexpr double kSpeedHalfWindow_s = 0.02;
constexpr double kScaleShare = 0.1;
constexpr double kScaleRest = 2e-3;  ///< a torque that changed its gain leaves more
constexpr double kSideShare = 0.4;
constexpr double kSmallScale = 0.01;
constexpr double kInverted = -0.5;  ///< an angle that does not move, or has the wrong sign
constexpr double kSome = 1.5;
constexpr double kSmallRest = 0.2;

/// The samples between the first and the last finite one.
std::pair<std::size_t, std::size_t> finite_part(const std::vector<double>& values) {
  std::size_t begin = 0;
  std::size_t end = values.size();
  while (begin < end && !is_finite(values[begin])) ++begin;
  while (end > begin && !is_finite(values[end - 1])) --end;
  return {begin, end};
}

/// Share that a shift leaves of what is unexplained without it, at most. The error without shift
/// grows with the delay, so that a long one must explain more: in a slow motion the valley over the
/// lags is flat, and its lowest point is accidental.
double greatest_share(double lag_s) {
  return kShare / (1.0 + 2.0 * std::min(std::abs(lag_s), kLongLag_s) / kLongLag_s);
}

double shortest_lag_s(double sample_rate_Hz) { return std::max(kShortest_s, 1.5 / sample_rate_Hz); }

/// Whether the shift explains what friction would not, also in parts that were not used for the fit.
bool is_held_out(const Delay& delay) {
  return delay.without_shift - delay.unexplained >= kLeastGain &&
         delay.held_out_share <= kHeldOutShare && delay.better_parts >= kLeastParts;
}

/// The columns of a dissipative spring over the input: the first kFree are a drift and a static curve, the
/// others stop operators (also with a friction that grows with the load) and relaxations. With
/// coefficients >= 0 the torque of each of the others leads the deflection, as friction, viscosity
/// and relaxation do, so that none of them can imitate a late torque.
Eigen::MatrixXd spring_columns(const std::vector<double>& input,
                               const std::vector<std::size_t>& samples, double sample_rate_Hz) {
  const Extent extent = extent_of(input);
  const double middle = 0.5 * (extent.lowest + extent.highest);
  const double scale = extent.width() > 0.0 ? 2.0 / extent.width() : 0.0;
  std::array<double, kDelayStops> limits{};
  for (std::size_t k = 0; k < kDelayStops; ++k)
    limits[k] =
        std::pow(kSmallestStop, static_cast<double>(k) / static_cast<double>(kDelayStops - 1));
  std::array<double, kRelaxations_s.size()> follow{};
  for (std::size_t k = 0; k < follow.size(); ++k)
    follow[k] = -std::expm1(-1.0 / (kRelaxations_s[k] * sample_rate_Hz));
  const bool drifts = count_reversals(input) >= kStrokesOfADrift;
  Eigen::MatrixXd columns(static_cast<Eigen::Index>(samples.size()), kColumns);
  std::array<double, kDelayStops> stops{};
  std::array<double, kRelaxations_s.size()> slow{};
  double last = kNotMeasured;
  std::size_t i = 0;
  for (Eigen::Index row = 0; row < columns.rows(); ++row) {
    for (; i <= samples[static_cast<std::size_t>(row)]; ++i) {
      if (!is_finite(input[i])) continue;
      const double z = scale * (input[i] - middle);
      if (!is_finite(last)) slow.fill(z), last = z;
      for (std::size_t k = 0; k < kDelayStops; ++k)
        stops[k] = std::clamp(stops[k] + z - last, -limits[k], limits[k]);
      for (std::size_t k = 0; k < slow.size(); ++k) slow[k] += follow[k] * (z - slow[k]);
      last = z;
    }
    Eigen::Index column = 0;
    const auto put = [&](double value) { columns(row, column++) = value; };
    put(1.0), put(last), put(last * last * last);
    // In a motion of few strokes a drift and a late torque are alike.
    put(drifts ? static_cast<double>(row) / static_cast<double>(columns.rows()) - 0.5 : 0.0);
    for (const double hinge : kDelayHinges) put(std::max(last - hinge, 0.0));
    for (const double stop : stops) put(stop);
    for (const std::size_t k : kLoadedStops) put(stops[k] * std::abs(last));
    for (const double each : slow) put(last - each);
  }
  return columns;
}

/// The fits of the target at one shift, in parts of the recording.
class ShiftedFit {
 public:
  ShiftedFit(const Eigen::MatrixXd& columns, const std::array<Eigen::MatrixXd, kParts>& products,
             Eigen::VectorXd target)
      : whole_(static_cast<std::size_t>(kColumns)) {
    target.array() -= target.mean();
    const double length = target.norm();
    if (length > 0.0) target /= length;
    Eigen::Index begin = 0;
    for (std::size_t p = 0; p < kParts; ++p) {
      const Eigen::Index end =
          target.size() * static_cast<Eigen::Index>(p + 1) / static_cast<Eigen::Index>(kParts);
      const auto rows = target.segment(begin, end - begin);
      NormalEquations part(static_cast<std::size_t>(kColumns));
      part.product.values.assign(products[p].data(), products[p].data() + products[p].size());
      const Eigen::VectorXd projection = columns.middleRows(begin, end - begin).transpose() * rows;
      part.projection.assign(projection.begin(), projection.end());
      part.square = rows.squaredNorm();
      add(whole_, part, 1.0);
      parts_.push_back(std::move(part));
      begin = end;
    }
  }

  /// Share of the variance that the fit leaves.
  [[nodiscard]] double unexplained() const { return whole_.error(coefficients(whole_)); }

  /// Square sum of the error in one part, of the fit to the others.
  [[nodiscard]] double held_out(std::size_t p) const {
    NormalEquations others = whole_;
    add(others, parts_[p], -1.0);
    return parts_[p].error(coefficients(others));
  }

 private:
  static void add(NormalEquations& sum, const NormalEquations& part, double sign) {
    const auto onto = [sign](std::vector<double>& to, const std::vector<double>& from) {
      std::ranges::transform(to, from, to.begin(),
                             [sign](double a, double b) { return a + sign * b; });
    };
    onto(sum.product.values, part.product.values);
    onto(sum.projection, part.projection);
    sum.square += sign * part.square;
  }

  static std::vector<double> coefficients(const NormalEquations& equations) {
    std::array<std::uint8_t, static_cast<std::size_t>(kColumns)> is_free{};
    std::fill_n(is_free.begin(), kFree, std::uint8_t{1});
    return non_negative_least_squares(equations, is_free).coefficients;
  }

  NormalEquations whole_;
  std::vector<NormalEquations> parts_;
};

/// Unexplained shares over shifts of the target.
class Search {
 public:
  Search(const Pair& pair, double sample_rate_Hz) : pair_(pair), sample_rate_Hz_(sample_rate_Hz) {
    const auto [begin, end] = finite_part(pair.target);
    longest_ = std::min(static_cast<std::ptrdiff_t>(std::round(kLongest_s * sample_rate_Hz)),
                        static_cast<std::ptrdiff_t>((end - begin) / 8));
    samples_ = samples_for_fit(pair.input, begin + static_cast<std::size_t>(longest_),
                               end - static_cast<std::size_t>(longest_), kEnoughSamples);
  }
  [[nodiscard]] bool is_possible() const {
    return longest_ > 0 && samples_.size() >= kFewestSamples;
  }

  [[nodiscard]] Delay run() {
    columns_ = spring_columns(pair_.input, samples_, sample_rate_Hz_);
    line_ = columns_.col(1).array() - columns_.col(1).mean();
    for (std::size_t p = 0; p < kParts; ++p) {
      const Eigen::Index begin = part_begin(p);
      const auto rows = columns_.middleRows(begin, part_begin(p + 1) - begin);
      products_[p] = rows.transpose() * rows;
    }
    const auto step = std::max<std::ptrdiff_t>(
        1, static_cast<std::ptrdiff_t>(std::round(kCoarseStep_s * sample_rate_Hz_)));
    std::vector<std::pair<std::ptrdiff_t, double>> shares;
    for (std::ptrdiff_t lag = -(longest_ / step) * step; lag <= longest_; lag += step)
      shares.emplace_back(lag, fit(lag).unexplained());
    auto best = *std::ranges::min_element(shares, {}, &std::pair<std::ptrdiff_t, double>::second);
    const std::ptrdiff_t coarse = best.first;
    const auto fine = std::max<std::ptrdiff_t>(
        1, static_cast<std::ptrdiff_t>(std::round(kFineStep_s * sample_rate_Hz_)));
    for (std::ptrdiff_t lag = std::max(-longest_, coarse - step + 1);
         lag < std::min(longest_, coarse + step); lag += fine)
      if (const double share = fit(lag).unexplained(); share < best.second) best = {lag, share};
    const ShiftedFit unshifted = fit(0);
    const ShiftedFit shifted = fit(best.first);
    Delay delay{.lag_s = static_cast<double>(best.first) / sample_rate_Hz_,
                .unexplained = best.second,
                .without_shift = unshifted.unexplained(),
                .held_out_share = 1.0,
                .better_parts = 0,
                .shortest_s = std::numeric_limits<double>::infinity(),
                .is_at_end = std::abs(best.first) + step > longest_};
    double before = 0.0;
    double after = 0.0;
    for (std::size_t p = 0; p < kParts; ++p) {
      const double without = unshifted.held_out(p);
      const double with = shifted.held_out(p);
      before += without, after += with;
      if (with < without) ++delay.better_parts;
    }
    if (before > 0.0) delay.held_out_share = after / before;
    for (const auto& [lag, share] : shares)
      if (const double late_s = static_cast<double>(best.first - lag) / sample_rate_Hz_;
          late_s > 0.0 && greatest_share(late_s) * share >= best.second)
        delay.shortest_s = late_s;
    delay.course = run_course(delay);
    return delay;
  }

 private:
  /// Empty unless the lag clearly grows.
  [[nodiscard]] std::optional<LagCourse> run_course(const Delay& constant) const {
    const LagCourse course = fit_course(constant.lag_s);
    const bool is_clear = std::abs(course.change_s) >= kLeastChange_s &&
                          std::abs(course.change_s) <= kLongest_s &&
                          course.unexplained <= kCourseShare * constant.unexplained;
    return is_clear ? std::optional(course) : std::nullopt;
  }

  /// A lag a + b t by Gauss and Newton: the target and t times the target change by their derivatives. Begins at a
  /// constant lag.
  [[nodiscard]] LagCourse fit_course(double lag_s) const {
    const Eigen::Index rows = columns_.rows();
    Eigen::MatrixXd columns(rows, kColumns + 2);
    columns.rightCols(kColumns) = columns_;
    std::vector<std::uint8_t> is_free(static_cast<std::size_t>(kColumns + 2), 0);
    std::fill_n(is_free.begin(), 2 + kFree, std::uint8_t{1});
    const Eigen::VectorXd at_s = times_s();
    LagCourse course{.at_middle_s = lag_s};
    Eigen::MatrixXd product(kColumns + 2, kColumns + 2);
    product.bottomRightCorner(kColumns, kColumns) =
        std::accumulate(products_.begin() + 1, products_.end(), products_.front());
    for (int step = 0; step < kCourseSteps; ++step) {
      if (!std::isfinite(course.at_middle_s) || !std::isfinite(course.per_second)) return {};
      Eigen::VectorXd target(rows);
      for (Eigen::Index n = 0; n < rows; ++n) {
        const double late_s = course.at_middle_s + course.per_second * at_s(n);
        const auto [value, rate] = target_at(n, late_s);
        target(n) = value, columns(n, 0) = rate, columns(n, 1) = rate * at_s(n);
      }
      target.array() -= target.mean();
      if (line_.dot(target) < 0.0) target = -target, columns.leftCols<2>() *= -1.0;
      NormalEquations equations(static_cast<std::size_t>(kColumns + 2));
      product.topRows<2>() = columns.leftCols<2>().transpose() * columns;
      product.leftCols<2>() = product.topRows<2>().transpose().eval();
      const Eigen::VectorXd projection = columns.transpose() * target;
      equations.product.values.assign(product.data(), product.data() + product.size());
      equations.projection.assign(projection.begin(), projection.end());
      equations.square = target.squaredNorm();
      const std::vector<double> found = non_negative_least_squares(equations, is_free).coefficients;
      course.unexplained = equations.error(found) / equations.square;
      course.at_middle_s -= found[0];
      course.per_second -= found[1];
    }
    course.change_s = course.per_second * (at_s(rows - 1) - at_s(0));
    return course;
  }

  /// Times of the samples, from the middle one.
  [[nodiscard]] Eigen::VectorXd times_s() const {
    Eigen::VectorXd at_s(columns_.rows());
    const auto middle = static_cast<double>(samples_[samples_.size() / 2]);
    for (Eigen::Index n = 0; n < at_s.size(); ++n)
      at_s(n) =
          (static_cast<double>(samples_[static_cast<std::size_t>(n)]) - middle) / sample_rate_Hz_;
    return at_s;
  }
  /// The target and its derivative so long after a sample, interpolated linearly.
  [[nodiscard]] std::pair<double, double> target_at(Eigen::Index n, double late_s) const {
    const auto longest = static_cast<double>(longest_ - 1);
    const double shift = std::clamp(late_s * sample_rate_Hz_, -longest, longest);
    const double at = static_cast<double>(samples_[static_cast<std::size_t>(n)]) + shift;
    const auto before = static_cast<std::size_t>(std::floor(at));
    const double step = pair_.target[before + 1] - pair_.target[before];
    return {pair_.target[before] + (at - std::floor(at)) * step, step * sample_rate_Hz_};
  }
  [[nodiscard]] Eigen::Index part_begin(std::size_t p) const {
    return columns_.rows() * static_cast<Eigen::Index>(p) / static_cast<Eigen::Index>(kParts);
  }
  [[nodiscard]] ShiftedFit fit(std::ptrdiff_t lag) const {
    const Eigen::VectorXd target = at_samples(pair_.target, samples_, lag);
    // An inverted torque would seem to have a negative friction.
    const bool is_inverted = line_.dot(target) < 0.0;
    return {columns_, products_, is_inverted ? Eigen::VectorXd(-target) : target};
  }

  const Pair& pair_;
  double sample_rate_Hz_;
  std::ptrdiff_t longest_ = 0;
  std::vector<std::size_t> samples_;
  Eigen::MatrixXd columns_;
  Eigen::VectorXd line_;  ///< the input, without its mean
  std::array<Eigen::MatrixXd, kParts> products_;
};

}  // namespace

std::optional<Delay> estimate_delay(const Pair& pair, double sample_rate_Hz) {
  Search search(pair, sample_rate_Hz);
  if (!search.is_possible()) return {};
  return search.run();
}

bool is_late(const Delay& delay, double sample_rate_Hz) {
  return delay.lag_s >= shortest_lag_s(sample_rate_Hz) && delay.unexplained <= kExplainsLittle &&
         delay.unexplained <= greatest_share(delay.lag_s) * delay.without_shift &&
         is_held_out(delay);
}

bool is_early(const Delay& delay, double sample_rate_Hz) {
  return delay.lag_s <= -shortest_lag_s(sample_rate_Hz) && delay.unexplained <= kEarlyRest &&
         delay.unexplained <= kEarlyShare * delay.without_shift && is_held_out(delay);
}

std::optional<TwoSides> relate_sides(const std::vector<double>& first,
                                     const std::vector<double>& second,
                                     const std::vector<double>& torque, double sample_rate_Hz) {
  const auto half_window =
      static_cast<std::size_t>(std::max(1.0, std::round(kSpeedHalfWindow_s * sample_rate_Hz)));
  const std::vector<double> moved = movement(second, half_window);
  std::vector<double> known(first.size());
  for (std::size_t i = 0; i < known.size(); ++i) known[i] = first[i] + moved[i] + torque[i];
  const std::vector<std::size_t> samples = samples_for_fit(known, 0, known.size());
  if (samples.size() < kFewestSamples) return {};
  const FixedColumns columns(hysteresis_columns(torque, samples));
  const double window_s = 2.0 * static_cast<double>(half_window) / sample_rate_Hz;
  const Eigen::VectorXd angle = at_samples(second, samples);
  const Eigen::VectorXd difference = at_samples(first, samples) - angle;
  const Eigen::VectorXd scale = columns.residual(angle);
  const Eigen::VectorXd speed = columns.residual(at_samples(moved, samples) / window_s);
  const Eigen::VectorXd rest = columns.residual(difference);
  const auto left_by = [&](const Eigen::MatrixXd& extra) {
    const Eigen::VectorXd solution = extra.colPivHouseholderQr().solve(rest);
    return std::pair{share_of_variance(rest - extra * solution, difference), solution};
  };
  Eigen::MatrixXd both(rest.size(), 2);
  both << scale, speed;
  const auto [unexplained, solution] = left_by(both);
  const auto width = [](const Eigen::VectorXd& values) {
    return values.maxCoeff() - values.minCoeff();
  };
  const double deflection = width(difference - solution(0) * angle);
  const double travel = std::min(width(angle), width(difference + angle));
  return TwoSides{.excess = solution(0),
                  .lateness_s = -solution(1),
                  .unexplained = unexplained,
                  .without_excess = left_by(speed).first,
                  .without_lateness = left_by(scale).first,
                  .travel = deflection > 0.0 ? travel / deflection : 0.0};
}

bool has_wrong_scale(const TwoSides& sides) {
  return sides.travel >= kFarTravel && sides.unexplained <= kScaleRest &&
         std::abs(sides.excess) >= kSmallScale && sides.excess > kInverted &&
         sides.unexplained <= kScaleShare * sides.without_excess;
}

bool has_late_side(const TwoSides& sides, double sample_rate_Hz) {
  return sides.travel >= kSome && sides.unexplained <= kSmallRest &&
         std::abs(sides.lateness_s) >= shortest_lag_s(sample_rate_Hz) &&
         sides.unexplained <= kSideShare * sides.without_lateness;
}

}  // namespace torsio
