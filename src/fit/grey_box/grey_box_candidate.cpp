#include "fit/grey_box/grey_box_candidate.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace torsio {
namespace {

using Index = Eigen::Index;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::array<std::size_t, GreyBoxChoice::kMaxBranches + 1> kBranches{0, 3, 6};
constexpr std::array kSmoothing{1e-6, 1e-4, 1e-2};
constexpr std::size_t kMaxColumns = 160;

/// The thresholds of a choice, as places among the finest ones.
std::vector<std::size_t> chosen_slips(const GreyBoxChoice& choice) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < GreyBoxSums::kThresholds; ++i)
    if ((choice.slips >> i & 1U) != 0) places.push_back(i);
  return places;
}

/// The time constants of a choice, as places among the finest ones: from the fastest on, evenly spread.
std::vector<std::size_t> chosen_branches(const GreyBoxChoice& choice) {
  const std::size_t count = kBranches.at(choice.branches);
  std::vector<std::size_t> places;
  places.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    places.push_back(i * (GreyBoxSums::kTimeConstants / count));
  return places;
}

GreyBoxTerms::Structure main_structure_of(const GreyBoxTerms::Structure& all,
                                          const GreyBoxChoice& choice) {
  GreyBoxTerms::Structure own;
  const double low = all.curve_knots.front();
  const double high = all.curve_knots.back();
  own.curve_knots = evenly(low, high, (std::size_t{1} << choice.curve) + 1);
  own.friction_knots = choice.forces == 0
                           ? std::vector<double>{0.5 * (low + high)}
                           : evenly(low, high, (std::size_t{1} << choice.forces) + 1);
  for (const std::size_t i : chosen_slips(choice)) own.thresholds.push_back(all.thresholds[i]);
  for (const std::size_t i : chosen_branches(choice))
    own.time_constants_s.push_back(all.time_constants_s[i]);
  own.rate_scales.assign(all.inputs(), 0.0);
  if (choice.has_coulomb) own.rate_scales = all.rate_scales;
  own.sample_period_s = all.sample_period_s;
  return own;
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

/// The same for the hats of a bank, those of a product in units of its input's mean square.
/// @param rows samples
void add_smoothing(Eigen::MatrixXd& product, const InputBank& bank, std::size_t first,
                   double smoothing, double rows) {
  const std::size_t forces = bank.force_knots.size();
  for (std::size_t i = 0; i < bank.thresholds.size(); ++i)
    add_smoothing(product, first + i * forces, forces, smoothing * rows);
  add_smoothing(product, first + bank.first_curve(), bank.first_product() - bank.first_curve(),
                smoothing * rows);
  const auto from = static_cast<Index>(first + bank.first_product());
  const auto count = static_cast<Index>(bank.product_knots.size());
  const double squares = product.diagonal().segment(from, count).sum();
  add_smoothing(product, first + bank.first_product(), bank.product_knots.size(),
                smoothing * squares);
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
    // An active-set search that cycles has no result: NaN is never chosen.
    if (!fit.has_converged)
      return Eigen::VectorXd::Constant(projection.size(), std::numeric_limits<double>::quiet_NaN());
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

}  // namespace

GreyBoxCandidate::GreyBoxCandidate(const GreyBoxSums& sums, const GreyBoxChoice& choice)
    : sums_(sums), choice_(choice) {
  if (sums.is_main_chosen) {
    structure_ = sums.all;
    structure_.banks.clear();
  } else {
    structure_ = main_structure_of(sums.all, choice);
  }
  for (std::size_t k = 0; k < choice.banks.size(); ++k) {
    if (choice.banks[k].is_empty()) continue;
    banks_.push_back({.place = k, .first = structure_.columns()});
    structure_.banks.push_back(sums.are_banks_chosen ? sums.all.banks[k]
                                                     : bank_of(sums.all.banks[k], choice.banks[k]));
  }
}

void GreyBoxCandidate::add_main_columns(std::vector<ColumnShare>& shares) const {
  const auto one = [&](std::size_t from, std::size_t to) { shares.push_back({from, to, 1.0}); };
  if (sums_.is_main_chosen) {
    for (std::size_t j = 0; j < structure_.first_slope(); ++j) one(j, j);
    return;
  }
  constexpr std::size_t kKnots = GreyBoxSums::kKnots;
  add_hats(shares, 0, kKnots, 0, structure_.curve_knots.size());
  const std::size_t forces = structure_.friction_knots.size();
  const auto slips = chosen_slips(choice_);
  for (std::size_t i = 0; i < slips.size(); ++i) {
    const std::size_t fine = sums_.all.first_slip() + slips[i] * kKnots;
    const std::size_t coarse = structure_.first_slip() + i * forces;
    if (forces > 1)
      add_hats(shares, fine, kKnots, coarse, forces);
    else
      for (std::size_t k = 0; k < kKnots; ++k) one(fine + k, coarse);
  }
  const auto branches = chosen_branches(choice_);
  for (std::size_t i = 0; i < branches.size(); ++i)
    one(sums_.all.first_relaxation() + branches[i], structure_.first_relaxation() + i);
}

std::vector<ColumnShare> GreyBoxCandidate::map() const {
  std::vector<ColumnShare> shares;
  add_main_columns(shares);
  const auto one = [&](std::size_t from, std::size_t to) { shares.push_back({from, to, 1.0}); };
  for (std::size_t j = 1; j < sums_.all.inputs(); ++j) {
    const bool schedules = sums_.frame.scheduled && sums_.frame.feature == j;
    if (!schedules && (sums_.is_rate[j] == 0 || choice_.has_viscous))
      one(sums_.all.first_slope() + j, structure_.first_slope() + j);
    if (choice_.has_coulomb && sums_.is_rate[j] != 0)
      one(sums_.all.first_coulomb() + j, structure_.first_coulomb() + j);
  }
  std::size_t finest = sums_.all.first_bank();
  for (std::size_t k = 0, own = 0; k < sums_.all.banks.size(); ++k) {
    if (own < banks_.size() && banks_[own].place == k) {
      const std::size_t first = banks_[own].first;
      const InputBank& bank = structure_.banks[own++];
      const double sign = choice_.banks[k].is_negative ? -1.0 : 1.0;
      if (!sums_.are_banks_chosen)
        add_bank_columns(shares, sums_.all.banks[k], finest, bank, first, choice_.banks[k]);
      for (std::size_t j = 0; sums_.are_banks_chosen && j < bank.columns(); ++j)
        shares.push_back({finest + j, first + j, j < bank.first_curve() ? sign : 1.0});
    }
    finest += sums_.all.banks[k].columns();
  }
  return shares;
}

bool GreyBoxCandidate::is_possible() const noexcept {
  const std::size_t columns = structure_.columns();
  return columns <= kMaxColumns && kSamplesPerTerm * columns * sums_.levels <= sums_.samples;
}

std::vector<NormalEquations> GreyBoxCandidate::projected(
    const std::vector<NormalEquations>& all) const {
  std::vector<ColumnShare> shares = this->map();
  // A candidate uses few of the finest terms, so those are taken out first.
  std::vector<Index> used;
  used.reserve(shares.size());
  for (const ColumnShare& share : shares) used.push_back(static_cast<Index>(share.from));
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (ColumnShare& share : shares)
    share.from = static_cast<std::size_t>(
        std::ranges::lower_bound(used, static_cast<Index>(share.from)) - used.begin());
  Eigen::SparseMatrix<double> map(static_cast<Index>(used.size()),
                                  static_cast<Index>(structure_.columns()));
  map.setFromTriplets(shares.begin(), shares.end());
  const auto finest = static_cast<Index>(sums_.all.columns());
  std::vector<NormalEquations> cells;
  cells.reserve(all.size());
  for (const NormalEquations& cell : all) {
    NormalEquations& small = cells.emplace_back(structure_.columns());
    const Eigen::Map<const RowMajor> product(cell.product.values.data(), finest, finest);
    const Eigen::Map<const Eigen::VectorXd> projection(cell.projection.data(), finest);
    const RowMajor taken = product(used, used);
    const Eigen::MatrixXd half = taken * map;
    Eigen::Map<RowMajor>(small.product.values.data(), map.cols(), map.cols()) =
        map.transpose() * half;
    Eigen::Map<Eigen::VectorXd>(small.projection.data(), map.cols()) =
        map.transpose() * Eigen::VectorXd(projection(used));
    small.square = cell.square;
    small.rows = cell.rows;
  }
  return cells;
}

std::vector<double> GreyBoxCandidate::solved(const NormalEquations& equations) const {
  const auto count = static_cast<Index>(structure_.columns());
  Eigen::MatrixXd product =
      Eigen::Map<const RowMajor>(equations.product.values.data(), count, count);
  const Eigen::VectorXd projection =
      Eigen::Map<const Eigen::VectorXd>(equations.projection.data(), count);
  const double weight = kSmoothing[choice_.smoothing] * static_cast<double>(equations.rows);
  add_smoothing(product, 0, structure_.curve_knots.size(), weight);
  for (std::size_t i = 0; i < structure_.thresholds.size(); ++i)
    add_smoothing(product, structure_.first_slip() + i * structure_.friction_knots.size(),
                  structure_.friction_knots.size(), weight);
  for (std::size_t k = 0; k < banks_.size(); ++k)
    add_smoothing(product, structure_.banks[k], banks_[k].first, kSmoothing[choice_.smoothing],
                  static_cast<double>(equations.rows));
  // Coefficients that no sample determines remain 0.
  constexpr double kRidge = 1e-9;
  const double mean = product.trace() / static_cast<double>(count);
  std::vector<std::uint8_t> is_free(structure_.columns(), 1);
  for (Index j = 0; j < count; ++j) product(j, j) += kRidge * std::max(product(j, j), 1e-3 * mean);
  for (std::size_t j = structure_.first_slip(); j < structure_.first_slope(); ++j)
    if (!choice_.is_signed || j >= structure_.first_relaxation()) is_free[j] = 0;
  for (std::size_t k = 0; k < banks_.size(); ++k)
    std::fill_n(is_free.begin() + static_cast<std::ptrdiff_t>(banks_[k].first),
                structure_.banks[k].first_curve(), 0);
  for (std::size_t l = 0; choice_.is_passive && l < structure_.inputs(); ++l)
    if (sums_.is_rate[l] != 0)
      is_free[structure_.first_slope() + l] = is_free[structure_.first_coulomb() + l] = 0;
  const Eigen::VectorXd solution = solve_mixed(product, projection, equations.square, is_free);
  return {solution.begin(), solution.end()};
}

std::vector<double> GreyBoxCandidate::solved_without(const NormalEquations& fold,
                                                     const NormalEquations& all) const {
  if (fold.rows == 0 || fold.rows == all.rows) return {};
  NormalEquations rest = all;
  add(rest, fold, -1.0);
  return solved(rest);
}

NormalEquations GreyBoxCandidate::of_level(const std::vector<NormalEquations>& cells,
                                           std::size_t level) const {
  NormalEquations sum(cells[0].columns());
  for (std::size_t fold = 0; fold < sums_.folds; ++fold)
    add(sum, cells[level * sums_.folds + fold]);
  return sum;
}

NormalEquations GreyBoxCandidate::whole_level(const std::vector<NormalEquations>& cells,
                                              const std::vector<NormalEquations>& gap,
                                              std::size_t level) const {
  NormalEquations sum = of_level(cells, level);
  if (!gap.empty()) add(sum, gap[level]);
  return sum;
}

double GreyBoxCandidate::left_out_levels(const std::vector<NormalEquations>& cells) const {
  Matrix all(sums_.levels, cells[0].columns());
  for (std::size_t level = 0; level < sums_.levels; ++level)
    std::ranges::copy(solved(cells[level]), all.row(level).begin());
  double error = 0.0;
  std::size_t rows = 0;
  for (std::size_t out = 1; out + 1 < sums_.levels; ++out) {
    CoefficientSchedule others{.scheduled = true, .feature = 0, .knots = {}, .values = {}};
    others.values = Matrix(sums_.levels - 1, all.columns);
    for (std::size_t level = 0; level < sums_.levels; ++level) {
      if (level == out) continue;
      std::ranges::copy(all.row(level), others.values.row(others.knots.size()).begin());
      others.knots.push_back(sums_.frame.knots[level]);
    }
    const ScheduledCoefficients between(others, 1, GreyBox::kFamily);
    std::vector<double> coefficients(all.columns);
    const std::array<double, 1> at{sums_.frame.knots[out]};
    between.evaluate(at, coefficients);
    error += cells[out].error(coefficients);
    rows += cells[out].rows;
  }
  return std::sqrt(error / static_cast<double>(rows));
}

GreyBoxCandidate::HeldOut GreyBoxCandidate::left_out_folds(
    const std::vector<NormalEquations>& cells) const {
  const std::vector<NormalEquations> beyond = projected(sums_.beyond);
  struct Sum {
    double error = 0.0;
    std::size_t rows = 0;
  };
  std::vector<Sum> folds(sums_.folds);
  for (std::size_t level = 0; level < sums_.levels; ++level) {
    const NormalEquations sum = of_level(cells, level);
    for (std::size_t fold = 0; fold < sums_.folds; ++fold) {
      const NormalEquations& out = cells[level * sums_.folds + fold];
      const std::vector<double> coefficients = solved_without(out, sum);
      if (coefficients.empty()) continue;
      folds[fold].error += out.error(coefficients);
      folds[fold].rows += out.rows;
      if (beyond.empty()) continue;
      folds[fold].error -= beyond[fold].error(coefficients);
      folds[fold].rows -= beyond[fold].rows;
    }
  }
  Sum all;
  double logarithms = 0.0;
  double scored = 0.0;
  std::vector<double> of_folds;
  for (const Sum& fold : folds) {
    of_folds.push_back(std::sqrt(fold.error / static_cast<double>(fold.rows)));
    all = {all.error + fold.error, all.rows + fold.rows};
    if (fold.rows == 0) continue;
    logarithms += 0.5 * std::log(fold.error / static_cast<double>(fold.rows));
    scored += 1.0;
  }
  return {.rmse = std::sqrt(all.error / static_cast<double>(all.rows)),
          .geometric = std::exp(logarithms / scored),
          .of_folds = std::move(of_folds)};
}

GreyBoxCandidate::HeldOut GreyBoxCandidate::held_out() const {
  const std::vector<NormalEquations> cells = projected(sums_.cells);
  if (sums_.folds > 1) return left_out_folds(cells);
  const double rmse = left_out_levels(cells);
  return {.rmse = rmse, .geometric = rmse};
}

GreyBox::Parameters GreyBoxCandidate::fitted() const {
  const std::vector<NormalEquations> cells = projected(sums_.cells);
  const std::vector<NormalEquations> gap = projected(sums_.gap);
  GreyBox::Parameters parameters{.terms = structure_, .coefficients = sums_.frame, .residual = {}};
  Matrix& values = parameters.coefficients.values;
  values = Matrix(sums_.levels, structure_.columns());
  for (std::size_t level = 0; level < sums_.levels; ++level) {
    std::vector<double> solution = solved(whole_level(cells, gap, level));
    for (std::size_t k = 0; k < banks_.size(); ++k)
      if (choice_.banks[banks_[k].place].is_negative)
        for (std::size_t j = 0; j < structure_.banks[k].first_curve(); ++j)
          solution[banks_[k].first + j] = -solution[banks_[k].first + j];
    std::ranges::copy(solution, values.row(level).begin());
  }
  return parameters;
}

std::vector<double> GreyBoxCandidate::finest(const std::vector<double>& own) const {
  std::vector<double> coefficients(sums_.all.columns(), 0.0);
  for (const ColumnShare& share : map()) coefficients[share.from] += share.factor * own[share.to];
  return coefficients;
}

std::vector<double> GreyBoxCandidate::finest_coefficients() const {
  return finest(solved(whole_level(projected(sums_.cells), projected(sums_.gap), 0)));
}

std::vector<std::vector<double>> GreyBoxCandidate::finest_of_folds() const {
  const std::vector<NormalEquations> cells = projected(sums_.cells);
  const NormalEquations sum = of_level(cells, 0);
  std::vector<std::vector<double>> of_folds(sums_.folds);
  for (std::size_t fold = 0; fold < sums_.folds; ++fold) {
    const std::vector<double> coefficients = solved_without(cells[fold], sum);
    if (!coefficients.empty()) of_folds[fold] = finest(coefficients);
  }
  return of_folds;
}

GreyBox::Parameters GreyBoxCandidate::with(const std::vector<double>& coefficients) const {
  GreyBox::Parameters parameters{.terms = structure_, .coefficients = sums_.frame, .residual = {}};
  parameters.coefficients.values = Matrix(1, structure_.columns());
  // At a knot of its own, a coarse hat has the value of the fine one.
  for (const ColumnShare& share : map())
    if (share.factor == 1.0) parameters.coefficients.values(0, share.to) = coefficients[share.from];
  return parameters;
}

}  // namespace torsio
