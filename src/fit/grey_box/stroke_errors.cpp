#include "fit/grey_box/stroke_errors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/common/held_out.hpp"
#include "fit/common/strokes.hpp"
#include "fit/grey_box/grey_box_sums.hpp"

namespace torsio {

StrokeErrors stroke_errors(const TrainingData& data, const GreyBox::Parameters& parameters,
                           const GreyBoxChoice& choice, double reference) {
  const StrokeKinds strokes = stroke_kinds(data);
  if (strokes.count < 2) return {};
  GreyBoxChoice own = choice;
  std::erase_if(own.banks, [](const BankChoice& bank) { return bank.is_empty(); });
  const GreyBoxSums sums = gather_strokes(data, parameters.terms, strokes);
  const GreyBoxCandidate::HeldOut held_out = GreyBoxCandidate(sums, own).held_out();
  StrokeErrors errors{.rmse = std::isfinite(held_out.rmse) ? held_out.rmse : 0.0};
  const double slow = held_out.of_folds.back();
  // Where the groups are close together, the quotient is that of two small numbers.
  constexpr double kLeastNovelty = 0.1;
  // Where the shorter strokes do not determine the model at all, they do not show what time adds.
  const bool is_determined = slow < 0.5 * target_std_dev(data);
  if (is_determined && slow > reference && strokes.novelty > kLeastNovelty)
    errors.growth = std::sqrt(slow * slow - reference * reference) / strokes.novelty;
  return errors;
}

}  // namespace torsio
