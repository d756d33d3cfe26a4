#include "fit/grey_box/grey_box_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace torsio {
namespace {

constexpr double kWorthwhile = 0.99;

/// One step up any sequence from `at`.
std::vector<GreyBoxChoice> steps_up(const GreyBoxChoice& at, bool has_rates) {
  std::vector<GreyBoxChoice> next;
  const auto with = [&](auto change) {
    GreyBoxChoice candidate = at;
    change(candidate);
    next.push_back(candidate);
  };
  // Two at a time as well: three knots show nothing of a curve that stiffens both ways alike.
  for (std::size_t by = 1; by <= 2; ++by) {
    if (at.curve + by <= GreyBoxSums::kFinest) with([by](auto& c) { c.curve += by; });
    if (at.slips + by <= GreyBoxChoice::kMaxSlips) with([by](auto& c) { c.slips += by; });
  }
  if (at.slips > 0 && at.forces < GreyBoxSums::kFinest) with([](auto& c) { ++c.forces; });
  if (at.slips > 1) with([](auto& c) { --c.slips; });
  if (at.branches < GreyBoxChoice::kMaxBranches) with([](auto& c) { ++c.branches; });
  if (at.smoothing > 0) with([](auto& c) { --c.smoothing; });
  if (!at.is_passive && !at.is_signed && at.slips > 0) with([](auto& c) { c.is_signed = true; });
  // Friction of the wrong sign somewhere: no force >= 0 is a step towards it.
  if (!at.is_passive && at.slips == 0)
    with([](auto& c) {
      c.is_signed = true;
      c.slips = 1;
      c.forces = 2;
    });
  if (!at.is_passive && at.slips > 0 && at.forces + 1 < GreyBoxSums::kFinest)
    with([](auto& c) {
      c.is_signed = true;
      c.forces += 2;
      c.curve = std::max(c.curve, c.forces);
    });
  if (has_rates && !at.has_viscous) with([](auto& c) { c.has_viscous = true; });
  if (has_rates && !at.has_coulomb) with([](auto& c) { c.has_coulomb = true; });
  return next;
}

}  // namespace

GreyBoxSearch::Candidate GreyBoxSearch::choose(bool passive, const Progress& progress) const {
  const bool has_rates = std::ranges::find(sums_.is_rate, 1) != sums_.is_rate.end();
  const GreyBoxChoice line{.is_passive = passive};
  Candidate best{.choice = line, .held_out_error = held_out_error(line)};
  constexpr double kUsualSteps = 12.0;
  for (double step = 0.0;; ++step) {
    report_progress(progress, std::min(step / kUsualSteps, 0.99),
                    fmt::format("choosing terms, error {:.4g}", best.held_out_error));
    std::optional<Candidate> better;
    for (const GreyBoxChoice& choice : steps_up(best.choice, has_rates)) {
      const GreyBoxCandidate candidate(sums_, choice);
      if (!candidate.is_possible()) continue;
      const double error = candidate.held_out_error();
      if (error < kWorthwhile * best.held_out_error && (!better || error < better->held_out_error))
        better = Candidate{choice, error};
    }
    if (!better) return best;
    best = *better;
  }
}

const char* GreyBoxSearch::what_was_held_out() const {
  if (sums_.folds == 1) return "inner knots of the schedule, one at a time";
  return sums_.is_by_record ? "records in turn" : "fifths of interleaved blocks";
}

std::string GreyBoxSearch::description_of(const GreyBoxChoice& choice) const {
  const GreyBoxTerms::Structure own = GreyBoxCandidate(sums_, choice).structure();
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
