#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fit/grey_box/grey_box_candidate.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// Chooses the terms of a grey box by what they predict of held-out data.
class GreyBoxSearch {
 public:
  /// Runs once through the data. @param schedule, rate_share as `gather` takes them
  GreyBoxSearch(const TrainingData& data, const std::string& schedule, double rate_share)
      : sums_(gather(data, schedule, rate_share)) {}
  /// The same for banks beside terms that have been chosen, as `gather_banks` takes them.
  GreyBoxSearch(const TrainingData& data, const std::string& schedule,
                const GreyBoxTerms::Structure& chosen)
      : sums_(gather_banks(data, schedule, chosen)) {}
  /// The same for terms of the first input beside banks that have been chosen.
  GreyBoxSearch(const TrainingData& data, const std::string& schedule, double rate_share,
                const std::vector<InputBank>& banks)
      : sums_(gather_beside(data, schedule, rate_share, banks)) {}

  /// The thresholds that a step may lead to, as `GreyBoxChoice::slips`.
  using OtherSlips = std::vector<std::uint32_t>(std::uint32_t);

  struct Candidate {
    GreyBoxChoice choice;
    double held_out_error = 0.0;  ///< root mean square
    double score = 0.0;           ///< what is lowered: see `rated`
  };
  /// @param passive never signed
  [[nodiscard]] Candidate choose(bool passive, const Progress& progress) const;

  /// The same, from these terms on. @param line with banks, if they are chosen
  [[nodiscard]] Candidate choose(const GreyBoxChoice& line, const Progress& progress) const;

  /// Terms with thresholds that are chosen one by one, if they halve the held-out error. Smaller gains did
  /// not carry over to other motions; these did.
  /// @param spread what `choose` has chosen
  [[nodiscard]] Candidate choose_thresholds(const Candidate& spread,
                                            const Progress& progress) const;

  /// Adds to the chosen terms those banks over other inputs that lower the held-out error.
  /// @param main the terms, without banks
  [[nodiscard]] Candidate choose_banks(const GreyBoxChoice& main, const Progress& progress) const;

  /// Root mean square error on what was held out.
  [[nodiscard]] double held_out_error(const GreyBoxChoice& choice) const {
    return GreyBoxCandidate(sums_, choice).held_out().rmse;
  }
  /// Fitted to all data.
  [[nodiscard]] GreyBox::Parameters fitted(const GreyBoxChoice& choice) const {
    return GreyBoxCandidate(sums_, choice).fitted();
  }

  /// "17 knots, 4 slip elements with 5 knots, ..."
  [[nodiscard]] std::string description_of(const GreyBoxChoice& choice,
                                           const TrainingData& data) const;
  [[nodiscard]] const char* what_was_held_out() const;
  /// Recordings that are held out one after the other, also those of the inner levels of a schedule; 0: parts of
  /// recordings.
  [[nodiscard]] std::size_t held_out_records() const noexcept {
    return sums_.is_by_record || sums_.folds == 1 ? sums_.records : 0;
  }
  /// Whether blocks of a single recording are held out.
  [[nodiscard]] bool has_one_record() const noexcept {
    return sums_.records == 1 && sums_.levels == 1;
  }

  /// Rates terms of the first input alone by the root mean square error on what was held out, and
  /// those beside banks by the geometric mean of the folds' errors: recordings of another kind each have
  /// errors of another size, and the largest shall not choose the banks alone.
  [[nodiscard]] Candidate rated(const GreyBoxChoice& choice) const;

  /// What is one step of any sequence away, up or down, from terms without banks.
  [[nodiscard]] std::vector<Candidate> neighbours(const GreyBoxChoice& at) const;

  [[nodiscard]] const GreyBoxSums& sums() const noexcept { return sums_; }
  [[nodiscard]] bool has_rates() const;

 private:
  /// Those for which the samples suffice.
  [[nodiscard]] std::vector<Candidate> rated(std::vector<GreyBoxChoice> choices) const;
  /// From a line on, with these steps of the thresholds.
  [[nodiscard]] Candidate climbed(const GreyBoxChoice& line, OtherSlips* others,
                                  const Progress& progress) const;
  /// From `best` on, the best of `next(best.choice)` as long as it is worthwhile.
  template <class Next>
  [[nodiscard]] Candidate climbed(Candidate best, double worthwhile, const Next& next,
                                  const Progress& progress) const;

  GreyBoxSums sums_;
};

}  // namespace torsio
