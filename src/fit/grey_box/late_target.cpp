#include "fit/grey_box/late_target.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string_view>
#include <utility>

#include "core/report_progress.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kLongestLag_s = 0.05;
constexpr double kAsGood = 1.03;

/// Whether the delay of this quantity after the others is a fault of its sensor: a deflection comes after the torque
/// wherever there is viscosity, and a torque after the deflection never does.
bool never_lags(std::string_view target) {
  constexpr std::array<std::string_view, 2> kLoads{"Nm", "N"};
  const auto name = split_channel_name(target);
  return name && std::ranges::find(kLoads, name->unit->si_suffix) != kLoads.end();
}

/// Puts the target of `data` so many samples earlier into `moved`, whose features are the same.
void move_target(TrainingData& moved, const TrainingData& data, std::ptrdiff_t samples) {
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const Sequence& from = data.sequences[s];
    Sequence& to = moved.sequences[s];
    const auto size = static_cast<std::ptrdiff_t>(from.target.size());
    for (std::ptrdiff_t n = 0; n < size; ++n) {
      const auto at = static_cast<std::size_t>(n);
      const std::ptrdiff_t later = n + samples;
      const bool is_there = later >= 0 && later < size;
      const auto source = static_cast<std::size_t>(is_there ? later : n);
      to.target[at] = is_there ? from.target[source] : kNotMeasured;
      to.use[at] = is_there && from.use[source] != 0 && from.has_features(at) ? 1 : 0;
    }
  }
}

/// Terms of the first input, and what they are a choice of.
struct ChosenTerms {
  GreyBoxChoice choice;
  GreyBoxTerms::Structure structure;
};

ChosenTerms chosen_terms(const GreyBoxSearch& search, const GreyBoxChoice& choice) {
  return {.choice = choice, .structure = search.fitted(choice).terms};
}

/// Squared errors of terms on what is held out, at shifts of the target.
class ErrorsOfLags {
 public:
  /// `moved` has the features of `data`; its target is overwritten.
  ErrorsOfLags(const TrainingData& data, TrainingData& moved, const std::string& schedule,
               const ChosenTerms& terms, const Progress& progress)
      : data_(data), moved_(moved), schedule_(schedule), terms_(terms), progress_(progress) {}

  [[nodiscard]] double at(std::ptrdiff_t samples) {
    const auto known = squares_.find(samples);
    if (known != squares_.end()) return known->second;
    report_progress(progress_, 0.9, "comparing with a late target");
    move_target(moved_, data_, samples);
    const double error =
        GreyBoxSearch(moved_, schedule_, terms_.structure).held_out_error(terms_.choice);
    return squares_.emplace(samples, error * error).first->second;
  }

 private:
  const TrainingData& data_;
  TrainingData& moved_;
  const std::string& schedule_;
  const ChosenTerms& terms_;
  const Progress& progress_;
  std::map<std::ptrdiff_t, double> squares_;
};

/// The lag in whole samples with the least error: first longer and longer ones, then between them.
std::ptrdiff_t best_whole_lag(ErrorsOfLags& errors, std::ptrdiff_t longest) {
  std::ptrdiff_t best = 0;
  std::ptrdiff_t step = 1;
  for (; best + step <= longest && errors.at(best + step) < errors.at(best); step *= 2)
    best += step;
  for (; step >= 1; step /= 2)
    for (const std::ptrdiff_t other : {best - step, best + step})
      if (other >= 0 && other <= longest && errors.at(other) < errors.at(best)) best = other;
  return best;
}

/// The lowest point of a parabola through three values at -1, 0 and 1, as (place, value).
std::pair<double, double> lowest_point(double before, double here, double after) {
  const double curvature = before - 2.0 * here + after;
  if (!(curvature > 0.0)) return {0.0, here};
  const double place = std::clamp(0.5 * (before - after) / curvature, -1.0, 1.0);
  return {place, here + 0.5 * (after - before) * place + 0.5 * curvature * place * place};
}

/// For these terms: the lowest point of the parabola of the squared errors.
TargetLag lag_of_terms(ErrorsOfLags errors, double sample_rate_Hz) {
  const auto longest = std::max<std::ptrdiff_t>(1, std::lround(kLongestLag_s * sample_rate_Hz));
  const std::ptrdiff_t best = best_whole_lag(errors, longest);
  const auto [place, square] =
      lowest_point(errors.at(best - 1), errors.at(best), errors.at(best + 1));
  return {.samples = static_cast<double>(best) + place,
          .held_out_error = std::sqrt(std::max(square, 0.0))};
}

}  // namespace

TargetLag find_target_lag(const TrainingData& data, const std::string& schedule, double rate_share,
                          const GreyBoxChoice& main, const Progress& progress) {
  constexpr int kMaxRounds = 4;
  constexpr double kSettled = 0.25;  // samples
  TrainingData moved = data;
  ChosenTerms terms = chosen_terms(GreyBoxSearch(data, schedule, rate_share), main);
  TargetLag lag;
  for (int round = 0; round < kMaxRounds; ++round) {
    const double before = lag.samples;
    lag = lag_of_terms({data, moved, schedule, terms, progress}, data.sample_rate_Hz);
    if (std::abs(lag.samples - before) < kSettled) break;
    move_target(moved, data, std::lround(lag.samples));
    const GreyBoxSearch search(moved, schedule, rate_share);
    terms = chosen_terms(search, search.choose(false, progress).choice);
  }
  return lag;
}

bool has_bank_over_rate(const GreyBoxTerms::Structure& terms, const TrainingData& data) {
  return std::ranges::any_of(
      terms.banks, [&](const InputBank& bank) { return data.inputs[bank.input].is_rate; });
}

std::optional<LateTarget> explained_by_lag(const TrainingData& data, const std::string& schedule,
                                           double rate_share, const GreyBoxChoice& main,
                                           const GreyBoxSearch::Candidate& chosen,
                                           const Progress& progress) {
  if (!never_lags(data.target)) return std::nullopt;
  LateTarget late{.lag = find_target_lag(data, schedule, rate_share, main, progress),
                  .beside = main};
  const std::ptrdiff_t whole = std::lround(late.lag.samples);
  if (!(late.lag.samples > 0.0)) return std::nullopt;
  if (whole > 0) {
    TrainingData earlier = data;
    move_target(earlier, data, whole);
    const GreyBoxSearch search(earlier, schedule, rate_share);
    const GreyBoxSearch::Candidate terms = search.choose(false, progress);
    const GreyBoxTerms::Structure structure = search.fitted(terms.choice).terms;
    const GreyBoxSearch beside(earlier, schedule, structure);
    const GreyBoxSearch::Candidate banks = beside.choose_banks(terms.choice, progress);
    if (has_bank_over_rate(beside.fitted(banks.choice).terms, data)) return std::nullopt;
    // Banks are places among the finest ones, which must be the same.
    if (banks.choice.banks.size() != chosen.choice.banks.size()) return std::nullopt;
    late.lag.held_out_error = banks.held_out_error;
    late.beside.banks = banks.choice.banks;
  }
  if (late.lag.held_out_error > kAsGood * chosen.held_out_error) return std::nullopt;
  return late;
}

}  // namespace torsio
