#include "train/grey_box_search.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "torsio/core/error.hpp"
#include "train/folds.hpp"

namespace torsio {
namespace {

using Index = Eigen::Index;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::size_t kFinest = 5;  // 2^5 + 1 knots
constexpr std::size_t kKnots = (std::size_t{1} << kFinest) + 1;
constexpr std::size_t kThresholds = 8;
constexpr std::size_t kTimeConstants = 6;
constexpr std::array<std::size_t, 5> kSlips{0, 1, 2, 4, 8};
constexpr std::array<std::size_t, 3> kBranches{0, 3, 6};
constexpr std::array kSmoothing{1e-6, 1e-4, 1e-2};
constexpr std::size_t kMostColumns = 160;
constexpr std::size_t kMostSummed = 100000;  // rows; of more every n-th is taken
constexpr double kWorthwhile = 0.99;

/// Indices that n of `count` geometric values keep: from the finest on, evenly spread.
std::vector<std::size_t> kept(std::size_t n, std::size_t count) {
  std::vector<std::size_t> indices;
  if (n == 1) return {1};  // the second finest: above the resolution, below any loop
  const std::size_t stride = n == 0 ? 1 : count / n;
  for (std::size_t i = 0; i < n; ++i) indices.push_back(i * stride);
  return indices;
}

std::vector<double> evenly(double low, double high, std::size_t knots) {
  std::vector<double> all(knots);
  for (std::size_t i = 0; i < knots; ++i)
    all[i] = low + (high - low) * static_cast<double>(i) / static_cast<double>(knots - 1);
  all.back() = high;
  return all;
}

/// Of coarse hats in fine ones: hats at every 2^coarser-th knot.
void add_hats(std::vector<Eigen::Triplet<double>>& triplets, std::size_t fine_first,
              std::size_t coarse_first, std::size_t level, std::size_t places) {
  const std::size_t step = (kKnots - 1) >> level;
  const auto index = [](std::size_t i) { return static_cast<int>(i); };
  for (std::size_t fine = 0; fine < kKnots; ++fine) {
    const std::size_t left = std::min(fine / step, places - 2);
    const double share = static_cast<double>(fine - left * step) / static_cast<double>(step);
    if (share < 1.0)
      triplets.emplace_back(index(fine_first + fine), index(coarse_first + left), 1.0 - share);
    if (share > 0.0)
      triplets.emplace_back(index(fine_first + fine), index(coarse_first + left + 1), share);
  }
}

void add(NormalEquations& sum, const NormalEquations& part, double sign = 1.0) {
  for (std::size_t i = 0; i < sum.product.values.size(); ++i)
    sum.product.values[i] += sign * part.product.values[i];
  for (std::size_t i = 0; i < sum.projection.size(); ++i)
    sum.projection[i] += sign * part.projection[i];
  sum.square += sign * part.square;
  sum.rows = sign > 0.0 ? sum.rows + part.rows : sum.rows - part.rows;
}

/// λ |second differences|² over `count` neighbouring columns.
void add_smoothing(Eigen::MatrixXd& product, std::size_t first, std::size_t count, double weight) {
  constexpr std::array<double, 3> kDifference{1.0, -2.0, 1.0};
  for (std::size_t i = 0; i + 2 < count; ++i)
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        product(static_cast<Index>(first + i + a), static_cast<Index>(first + i + b)) +=
            weight * kDifference[a] * kDifference[b];
}

/// argmin over all columns, those that are not free >= 0: the free ones are eliminated first, so
/// that the active sets are searched among few.
Eigen::VectorXd solve_mixed(const Eigen::MatrixXd& product, const Eigen::VectorXd& projection,
                            double square, const std::vector<std::uint8_t>& is_free) {
  std::vector<Index> free;
  std::vector<Index> bound;
  for (std::size_t j = 0; j < is_free.size(); ++j)
    (is_free[j] != 0 ? free : bound).push_back(static_cast<Index>(j));
  const Eigen::LLT<Eigen::MatrixXd> inner(product(free, free));
  Eigen::VectorXd solution = Eigen::VectorXd::Zero(projection.size());
  const Eigen::VectorXd projection_free = projection(free);
  Eigen::VectorXd rest = projection_free;
  if (!bound.empty()) {
    const Eigen::MatrixXd coupling = product(free, bound);
    const Eigen::MatrixXd explained = inner.solve(coupling);
    const Eigen::MatrixXd schur =
        Eigen::MatrixXd(product(bound, bound)) - coupling.transpose() * explained;
    const Eigen::VectorXd target =
        Eigen::VectorXd(projection(bound)) - explained.transpose() * projection_free;
    NormalEquations small(bound.size());
    Eigen::Map<RowMajor>(small.product.values.data(), schur.rows(), schur.cols()) = schur;
    std::ranges::copy(target, small.projection.begin());
    small.square = square;
    const NonNegativeFit fit =
        non_negative_least_squares(small, std::vector<std::uint8_t>(bound.size(), 0));
    const Eigen::VectorXd values = Eigen::Map<const Eigen::VectorXd>(
        fit.coefficients.data(), static_cast<Index>(fit.coefficients.size()));
    for (std::size_t i = 0; i < bound.size(); ++i)
      solution[bound[i]] = values[static_cast<Index>(i)];
    rest -= coupling * values;
  }
  const Eigen::VectorXd values = inner.solve(rest);
  for (std::size_t i = 0; i < free.size(); ++i) solution[free[i]] = values[static_cast<Index>(i)];
  return solution;
}

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

}  // namespace

GreyBoxSearch::GreyBoxSearch(const TrainingData& data, const std::string& schedule) {
  const Table table = usable_table(data);
  const Groups groups = groups_by(schedule, data, table.features);
  frame_ = groups.frame;
  levels_ = groups.samples.size();
  samples_ = table.features.rows;
  Range range;
  std::vector<double> squares(data.input_count(), 0.0);
  for (std::size_t n = 0; n < samples_; ++n) {
    range.low = std::min(range.low, table.features(n, 0));
    range.high = std::max(range.high, table.features(n, 0));
    for (std::size_t j = 0; j < squares.size(); ++j)
      squares[j] += table.features(n, j) * table.features(n, j);
  }
  if (!(range.high > range.low))
    throw Error({.problem = "a grey box needs a first input that varies",
                 .found = data.inputs[0].expression + " is constant in the training data"});
  constexpr std::size_t kLeast = 200;
  if (samples_ < kLeast)
    throw Error({.problem = "too few training samples for a grey box",
                 .expected = fmt::format("at least {}", kLeast),
                 .found = fmt::format("{}", samples_)});
  all_.sample_period_s = 1.0 / data.sample_rate_Hz;
  all_.curve_knots = all_.friction_knots = evenly(range.low, range.high, kKnots);
  const double half = 0.5 * (range.high - range.low);
  for (std::size_t i = kThresholds; i-- > 0;)
    all_.thresholds.push_back(half * std::exp2(-static_cast<double>(i + 1)));
  std::size_t longest = 0;
  for (const Sequence& sequence : data.sequences)
    longest = std::max(longest, sequence.target.size());
  const double fastest_s = 4.0 * all_.sample_period_s;
  const double slowest_s =
      std::max(0.25 * static_cast<double>(longest) * all_.sample_period_s, 2.0 * fastest_s);
  for (std::size_t i = 0; i < kTimeConstants; ++i)
    all_.time_constants_s.push_back(
        fastest_s * std::pow(slowest_s / fastest_s,
                             static_cast<double>(i) / static_cast<double>(kTimeConstants - 1)));
  constexpr double kRateShare = 0.2;  // of the rate's root mean square: dry friction has turned
  for (std::size_t j = 0; j < data.input_count(); ++j) {
    is_rate_.push_back(data.inputs[j].is_rate ? 1 : 0);
    const double rms = std::sqrt(squares[j] / static_cast<double>(samples_));
    all_.rate_scales.push_back(data.inputs[j].is_rate ? kRateShare * rms : 0.0);
  }

  constexpr std::size_t kRecordsToLeaveOut = 3;
  std::size_t records = 0;
  for (const Sequence& sequence : data.sequences)
    if (std::ranges::find(sequence.use, 1) != sequence.use.end()) ++records;
  is_by_record_ = levels_ < kRecordsToLeaveOut && records >= kRecordsToLeaveOut && levels_ == 1;
  folds_ = levels_ >= kRecordsToLeaveOut ? 1
           : is_by_record_               ? std::min(records, 2 * kFolds)
                                         : kFolds;
  cells_.assign(levels_ * folds_, NormalEquations(all_.columns()));

  const std::size_t stride = (samples_ + kMostSummed - 1) / kMostSummed;
  std::vector<std::pair<std::size_t, double>> row;
  std::size_t record = 0;
  std::size_t used = 0;
  for (const Sequence& sequence : data.sequences) {
    GreyBoxTerms terms(all_);
    std::size_t own = 0;
    const auto usable = static_cast<std::size_t>(std::ranges::count(sequence.use, 1));
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (!sequence.has_features(n)) continue;
      const Features features = sequence.features.row(n);
      terms.move(features[0]);
      if (sequence.use[n] == 0) continue;
      const std::size_t fold = is_by_record_ ? record % folds_
                               : folds_ == 1 ? 0
                                             : interleaved_fold(own, usable);
      ++own;
      if (used++ % stride != 0) continue;
      std::size_t level = 0;
      if (frame_.scheduled)
        level = static_cast<std::size_t>(std::ranges::find(frame_.knots, features[frame_.feature]) -
                                         frame_.knots.begin());
      NormalEquations& sums = cells_[level * folds_ + fold];
      row.clear();
      terms.visit(features, [&](std::size_t column, double value) {
        if (value != 0.0) row.emplace_back(column, value);
      });
      const double target = sequence.target[n];
      for (const auto& [i, a] : row) {
        for (const auto& [j, b] : row) sums.product(i, j) += a * b;
        sums.projection[i] += a * target;
      }
      sums.square += target * target;
      ++sums.rows;
    }
    if (usable > 0) ++record;
  }
}

GreyBoxTerms::Structure GreyBoxSearch::structure_of(const GreyBoxChoice& choice) const {
  GreyBoxTerms::Structure own;
  const double low = all_.curve_knots.front();
  const double high = all_.curve_knots.back();
  own.curve_knots = evenly(low, high, (std::size_t{1} << choice.curve) + 1);
  own.friction_knots = choice.forces == 0
                           ? std::vector<double>{0.5 * (low + high)}
                           : evenly(low, high, (std::size_t{1} << choice.forces) + 1);
  for (const std::size_t i : kept(kSlips[choice.slips], kThresholds))
    own.thresholds.push_back(all_.thresholds[i]);
  for (const std::size_t i : kept(kBranches[choice.branches], kTimeConstants))
    own.time_constants_s.push_back(all_.time_constants_s[i]);
  own.rate_scales.assign(all_.inputs(), 0.0);
  if (choice.has_coulomb) own.rate_scales = all_.rate_scales;
  own.sample_period_s = all_.sample_period_s;
  return own;
}

std::vector<NormalEquations> GreyBoxSearch::projected(const GreyBoxChoice& choice) const {
  const GreyBoxTerms::Structure own = structure_of(choice);
  std::vector<Eigen::Triplet<double>> triplets;
  const auto one = [&](std::size_t from, std::size_t to) {
    triplets.emplace_back(static_cast<int>(from), static_cast<int>(to), 1.0);
  };
  add_hats(triplets, 0, 0, choice.curve, own.curve_knots.size());
  const std::size_t forces = own.friction_knots.size();
  const auto slips = kept(kSlips[choice.slips], kThresholds);
  for (std::size_t i = 0; i < slips.size(); ++i) {
    const std::size_t fine = all_.first_slip() + slips[i] * kKnots;
    const std::size_t coarse = own.first_slip() + i * forces;
    if (forces > 1)
      add_hats(triplets, fine, coarse, choice.forces, forces);
    else
      for (std::size_t k = 0; k < kKnots; ++k) one(fine + k, coarse);
  }
  const auto branches = kept(kBranches[choice.branches], kTimeConstants);
  for (std::size_t i = 0; i < branches.size(); ++i)
    one(all_.first_relaxation() + branches[i], own.first_relaxation() + i);
  for (std::size_t j = 1; j < all_.inputs(); ++j) {
    const bool schedules = frame_.scheduled && frame_.feature == j;
    if (!schedules && (is_rate_[j] == 0 || choice.has_viscous))
      one(all_.first_slope() + j, own.first_slope() + j);
    if (choice.has_coulomb && is_rate_[j] != 0)
      one(all_.first_coulomb() + j, own.first_coulomb() + j);
  }
  Eigen::SparseMatrix<double> map(static_cast<Index>(all_.columns()),
                                  static_cast<Index>(own.columns()));
  map.setFromTriplets(triplets.begin(), triplets.end());
  std::vector<NormalEquations> cells;
  cells.reserve(cells_.size());
  for (const NormalEquations& cell : cells_) {
    NormalEquations& small = cells.emplace_back(own.columns());
    const Eigen::Map<const RowMajor> product(cell.product.values.data(),
                                             static_cast<Index>(all_.columns()),
                                             static_cast<Index>(all_.columns()));
    const Eigen::MatrixXd half = product * map;
    Eigen::Map<RowMajor>(small.product.values.data(), map.cols(), map.cols()) =
        map.transpose() * half;
    Eigen::Map<Eigen::VectorXd>(small.projection.data(), map.cols()) =
        map.transpose() * Eigen::Map<const Eigen::VectorXd>(cell.projection.data(), map.rows());
    small.square = cell.square;
    small.rows = cell.rows;
  }
  return cells;
}

std::vector<double> GreyBoxSearch::solved(const GreyBoxChoice& choice,
                                          const NormalEquations& equations) const {
  const GreyBoxTerms::Structure own = structure_of(choice);
  const auto count = static_cast<Index>(own.columns());
  Eigen::MatrixXd product =
      Eigen::Map<const RowMajor>(equations.product.values.data(), count, count);
  const Eigen::VectorXd projection =
      Eigen::Map<const Eigen::VectorXd>(equations.projection.data(), count);
  const double weight = kSmoothing[choice.smoothing] * static_cast<double>(equations.rows);
  add_smoothing(product, 0, own.curve_knots.size(), weight);
  for (std::size_t i = 0; i < own.thresholds.size(); ++i)
    add_smoothing(product, own.first_slip() + i * own.friction_knots.size(),
                  own.friction_knots.size(), weight);
  // What no sample tells stays 0.
  constexpr double kRidge = 1e-9;
  const double mean = product.trace() / static_cast<double>(count);
  std::vector<std::uint8_t> is_free(own.columns(), 1);
  for (Index j = 0; j < count; ++j) product(j, j) += kRidge * std::max(product(j, j), 1e-3 * mean);
  for (std::size_t j = own.first_slip(); j < own.first_slope(); ++j)
    if (!choice.is_signed || j >= own.first_relaxation()) is_free[j] = 0;
  const Eigen::VectorXd solution = solve_mixed(product, projection, equations.square, is_free);
  return {solution.begin(), solution.end()};
}

double GreyBoxSearch::left_out_levels(const GreyBoxChoice& choice,
                                      const std::vector<NormalEquations>& cells) const {
  Matrix all(levels_, cells[0].columns());
  for (std::size_t level = 0; level < levels_; ++level)
    std::ranges::copy(solved(choice, cells[level]), all.row(level).begin());
  double error = 0.0;
  std::size_t rows = 0;
  for (std::size_t out = 1; out + 1 < levels_; ++out) {
    CoefficientSchedule others{.scheduled = true, .feature = 0, .knots = {}, .values = {}};
    others.values = Matrix(levels_ - 1, all.columns);
    for (std::size_t level = 0; level < levels_; ++level) {
      if (level == out) continue;
      std::ranges::copy(all.row(level), others.values.row(others.knots.size()).begin());
      others.knots.push_back(frame_.knots[level]);
    }
    const ScheduledCoefficients between(others, 1, GreyBox::kFamily);
    std::vector<double> coefficients(all.columns);
    const std::array<double, 1> at{frame_.knots[out]};
    between.evaluate(at, coefficients);
    error += cells[out].error(coefficients);
    rows += cells[out].rows;
  }
  return std::sqrt(error / static_cast<double>(rows));
}

double GreyBoxSearch::left_out_folds(const GreyBoxChoice& choice,
                                     const std::vector<NormalEquations>& cells) const {
  double error = 0.0;
  std::size_t rows = 0;
  for (std::size_t level = 0; level < levels_; ++level) {
    NormalEquations sum(cells[0].columns());
    for (std::size_t fold = 0; fold < folds_; ++fold) add(sum, cells[level * folds_ + fold]);
    for (std::size_t fold = 0; fold < folds_; ++fold) {
      const NormalEquations& out = cells[level * folds_ + fold];
      if (out.rows == 0 || out.rows == sum.rows) continue;
      NormalEquations rest = sum;
      add(rest, out, -1.0);
      error += out.error(solved(choice, rest));
      rows += out.rows;
    }
  }
  return std::sqrt(error / static_cast<double>(rows));
}

double GreyBoxSearch::held_out_error(const GreyBoxChoice& choice) const {
  const std::vector<NormalEquations> cells = projected(choice);
  return folds_ == 1 ? left_out_levels(choice, cells) : left_out_folds(choice, cells);
}

bool GreyBoxSearch::is_possible(const GreyBoxChoice& choice) const {
  const std::size_t columns = structure_of(choice).columns();
  return columns <= kMostColumns && kSamplesPerTerm * columns * levels_ <= samples_;
}

GreyBoxSearch::Candidate GreyBoxSearch::choose(bool passive, const Progress& progress) const {
  const bool has_rates = std::ranges::find(is_rate_, 1) != is_rate_.end();
  Candidate best{.choice = {}, .held_out_error = held_out_error({})};
  const auto ups = [&](const GreyBoxChoice& at) {
    std::vector<GreyBoxChoice> next;
    const auto with = [&](auto change) {
      GreyBoxChoice candidate = at;
      change(candidate);
      if (is_possible(candidate)) next.push_back(candidate);
    };
    // Two at a time as well: three knots show nothing of a curve that stiffens both ways alike.
    for (std::size_t by = 1; by <= 2; ++by) {
      if (at.curve + by <= kFinest) with([by](auto& c) { c.curve += by; });
      if (at.slips + by < kSlips.size()) with([by](auto& c) { c.slips += by; });
    }
    if (at.slips > 0 && at.forces < kFinest) with([](auto& c) { ++c.forces; });
    if (at.slips > 1) with([](auto& c) { --c.slips; });
    if (at.branches + 1 < kBranches.size()) with([](auto& c) { ++c.branches; });
    if (at.smoothing > 0) with([](auto& c) { --c.smoothing; });
    if (!passive && !at.is_signed && at.slips > 0) with([](auto& c) { c.is_signed = true; });
    // Friction of the wrong sign somewhere: no force >= 0 is a step towards it.
    if (!passive && at.slips == 0)
      with([](auto& c) {
        c.is_signed = true;
        c.slips = 1;
        c.forces = 2;
      });
    if (!passive && at.slips > 0 && at.forces + 1 < kFinest)
      with([](auto& c) {
        c.is_signed = true;
        c.forces += 2;
        c.curve = std::max(c.curve, c.forces);
      });
    if (has_rates && !at.has_viscous) with([](auto& c) { c.has_viscous = true; });
    if (has_rates && !at.has_coulomb) with([](auto& c) { c.has_coulomb = true; });
    return next;
  };
  constexpr double kUsualSteps = 12.0;
  for (double step = 0.0;; ++step) {
    report_progress(progress, std::min(step / kUsualSteps, 0.99),
                    fmt::format("choosing terms, error {:.4g}", best.held_out_error));
    std::optional<Candidate> better;
    for (const GreyBoxChoice& choice : ups(best.choice)) {
      const double error = held_out_error(choice);
      if (error < kWorthwhile * best.held_out_error && (!better || error < better->held_out_error))
        better = Candidate{choice, error};
    }
    if (!better) return best;
    best = *better;
  }
}

GreyBox::Parameters GreyBoxSearch::fitted(const GreyBoxChoice& choice) const {
  const std::vector<NormalEquations> cells = projected(choice);
  GreyBox::Parameters parameters{
      .terms = structure_of(choice), .coefficients = frame_, .residual = {}};
  Matrix& values = parameters.coefficients.values;
  values = Matrix(levels_, parameters.terms.columns());
  for (std::size_t level = 0; level < levels_; ++level) {
    NormalEquations sum(cells[0].columns());
    for (std::size_t fold = 0; fold < folds_; ++fold) add(sum, cells[level * folds_ + fold]);
    std::ranges::copy(solved(choice, sum), values.row(level).begin());
  }
  return parameters;
}

const char* GreyBoxSearch::what_was_held_out() const {
  if (folds_ == 1) return "inner knots of the schedule, one at a time";
  return is_by_record_ ? "records in turn" : "fifths of interleaved blocks";
}

std::string GreyBoxSearch::description_of(const GreyBoxChoice& choice) const {
  const GreyBoxTerms::Structure own = structure_of(choice);
  std::string text = fmt::format("a curve of {} knots", own.curve_knots.size());
  if (!own.thresholds.empty())
    text += fmt::format(", {} slip elements{}", own.thresholds.size(),
                        own.friction_knots.size() == 1
                            ? std::string(" of constant force")
                            : fmt::format(" with forces at {} knots", own.friction_knots.size()));
  if (!own.time_constants_s.empty())
    text += fmt::format(", {} relaxing branches", own.time_constants_s.size());
  if (choice.is_signed) text += ", slip forces of any sign (not passive)";
  if (choice.has_viscous) text += ", viscous friction";
  if (choice.has_coulomb) text += ", dry friction of the rates";
  return text;
}

}  // namespace torsio
