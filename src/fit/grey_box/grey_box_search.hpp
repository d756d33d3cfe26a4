#pragma once

#include <string>

#include "fit/grey_box/grey_box_candidate.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// Chooses the terms of a grey box by what they predict of held-out data.
class GreyBoxSearch {
 public:
  /// Runs once through the data. @param schedule, rate_share as `gather` takes them
  GreyBoxSearch(const TrainingData& data, const std::string& schedule, double rate_share)
      : sums_(gather(data, schedule, rate_share)) {}

  struct Candidate {
    GreyBoxChoice choice;
    double held_out_error = 0.0;  ///< root mean square
  };
  /// @param passive never signed
  [[nodiscard]] Candidate choose(bool passive, const Progress& progress) const;

  /// Root mean square error on what was held out.
  [[nodiscard]] double held_out_error(const GreyBoxChoice& choice) const {
    return GreyBoxCandidate(sums_, choice).held_out_error();
  }
  /// Fitted to all data.
  [[nodiscard]] GreyBox::Parameters fitted(const GreyBoxChoice& choice) const {
    return GreyBoxCandidate(sums_, choice).fitted();
  }

  /// "17 knots, 4 slip elements with 5 knots, ..."
  [[nodiscard]] std::string description_of(const GreyBoxChoice& choice) const;
  [[nodiscard]] const char* what_was_held_out() const;

 private:
  GreyBoxSums sums_;
};

}  // namespace torsio
