#include "fit/grey_box/box_average.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "fit/common/strokes.hpp"
#include "numerics/parallel.hpp"

namespace torsio {
namespace {

constexpr double kNearlyAsGood = 1.02;
/// As if the errors of the longest strokes were those of so many independent ones.
constexpr double kIndependentStrokes = 64.0;

/// The knots, thresholds and time constants of both.
GreyBoxChoice joined(const GreyBoxChoice& a, const GreyBoxChoice& b) {
  GreyBoxChoice both = a;
  both.curve = std::max(a.curve, b.curve);
  both.slips = a.slips | b.slips;
  both.forces = std::max(a.forces, b.forces);
  return both;
}

bool has_no_other_kind_of_term(const GreyBoxChoice& choice, const GreyBoxChoice& than) {
  const auto adds = [](bool has, bool had) { return has && !had; };
  return choice.branches <= than.branches && !adds(choice.curve > 0, than.curve > 0) &&
         !adds(choice.slips != 0, than.slips != 0) && !adds(choice.is_signed, than.is_signed) &&
         !adds(choice.has_viscous, than.has_viscous) && !adds(choice.has_coulomb, than.has_coulomb);
}

/// The boxes to average, and the terms of all of them.
struct NearBoxes {
  std::vector<GreyBoxChoice> choices;
  GreyBoxChoice all;
};

NearBoxes boxes_near(const GreyBoxSearch& search, const GreyBoxSearch::Candidate& chosen) {
  NearBoxes near{.choices = {chosen.choice}, .all = chosen.choice};
  for (const GreyBoxSearch::Candidate& other : search.neighbours(chosen.choice)) {
    if (!(other.score <= kNearlyAsGood * chosen.score) ||
        !has_no_other_kind_of_term(other.choice, chosen.choice))
      continue;
    const GreyBoxChoice all = joined(near.all, other.choice);
    if (!GreyBoxCandidate(search.sums(), all).is_possible()) continue;
    near.choices.push_back(other.choice);
    near.all = all;
  }
  return near;
}

/// Their sum is 1.
std::vector<double> weights_of(const std::vector<GreyBoxChoice>& choices, const TrainingData& data,
                               double rate_share) {
  std::vector<double> weights(choices.size(), 1.0);
  const StrokeKinds strokes = stroke_kinds(data);
  if (strokes.count > 1) {
    const GreyBoxSums sums = gather_strokes(data, rate_share, strokes);
    for_each_chunk(choices.size(), 0, [&](std::size_t k) {
      weights[k] = GreyBoxCandidate(sums, choices[k]).held_out().of_folds.back();
    });
    double least = std::numeric_limits<double>::infinity();
    for (const double error : weights) least = std::fmin(least, error);
    for (double& weight : weights) {
      weight = std::pow(least / weight, kIndependentStrokes);
      if (!std::isfinite(weight)) weight = 0.0;
    }
  }
  double sum = 0.0;
  for (const double weight : weights) sum += weight;
  for (double& weight : weights) weight /= sum;
  return weights;
}

void add_to(std::vector<double>& sum, double weight, const std::vector<double>& coefficients) {
  sum.resize(coefficients.size(), 0.0);
  for (std::size_t j = 0; j < coefficients.size(); ++j) sum[j] += weight * coefficients[j];
}

/// Root mean square error on the samples of each fold within the range of the others.
double held_out_rmse(const GreyBoxSums& sums, const std::vector<std::vector<double>>& of_folds) {
  double error = 0.0;
  double rows = 0.0;
  for (std::size_t fold = 0; fold < sums.folds; ++fold) {
    if (of_folds[fold].empty()) continue;
    NormalEquations out = sums.cells[fold];
    if (!sums.beyond.empty()) add(out, sums.beyond[fold], -1.0);
    error += out.error(of_folds[fold]);
    rows += static_cast<double>(out.rows);
  }
  return std::sqrt(error / rows);
}

}  // namespace

std::optional<BoxAverage> box_average(const GreyBoxSearch& search,
                                      const GreyBoxSearch::Candidate& chosen,
                                      const TrainingData& data, double rate_share) {
  const GreyBoxSums& sums = search.sums();
  if (sums.levels > 1) return std::nullopt;
  const NearBoxes near = boxes_near(search, chosen);
  if (near.choices.size() < 2) return std::nullopt;
  const std::vector<double> weights = weights_of(near.choices, data, rate_share);
  std::vector<double> coefficients;
  std::vector<std::vector<double>> of_folds(sums.folds);
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const GreyBoxCandidate box(sums, near.choices[k]);
    add_to(coefficients, weights[k], box.finest_coefficients());
    const std::vector<std::vector<double>> own = box.finest_of_folds();
    for (std::size_t fold = 0; fold < sums.folds; ++fold)
      add_to(of_folds[fold], weights[k], own[fold]);
  }
  return BoxAverage{.parameters = GreyBoxCandidate(sums, near.all).with(coefficients),
                    .held_out_rmse = held_out_rmse(sums, of_folds),
                    .boxes = near.choices.size()};
}

}  // namespace torsio
