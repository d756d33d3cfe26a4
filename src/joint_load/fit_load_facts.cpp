#include "joint_load/fit_load_facts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "joint_load/local_quartic.hpp"
#include "numerics/least_squares.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::array<double, 8> kStopShares = {0.004, 0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6};
constexpr std::size_t kKnots = 8;
constexpr std::size_t kStopsBegin = 2 + kKnots;
constexpr std::size_t kSpringTerms = kStopsBegin + 2 * kStopShares.size();
constexpr std::size_t kRowsOfARecording = 4000;
constexpr std::size_t kBlocks = 10;
constexpr double kSameLoad = 0.02;  ///< share by which loads must differ to be two
constexpr std::size_t kWider = 3;   ///< how much wider the smoothing is than the polynomial of q''

using SpringTerms = std::array<double, kSpringTerms>;

/// One sample: what the spring does there, and the motion of the load, all of it smoothed.
struct FactRow {
  SpringTerms spring{};
  double sine = 0.0;  ///< its angle has the zero that is stated
  double cosine = 0.0;
  double acceleration_rad_s2 = 0.0;
  std::size_t recording = 0;
  std::size_t block = 0;
};

struct RangeOfDeflection {
  double middle = 0.0;
  double half = 0.0;
};

RangeOfDeflection range_of(const std::vector<LoadedMotion>& motions) {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -lowest;
  for (const LoadedMotion& motion : motions)
    for (const double x : motion.deflection)
      if (std::isfinite(x)) {
        lowest = std::min(lowest, x);
        highest = std::max(highest, x);
      }
  return {.middle = 0.5 * (lowest + highest), .half = 0.5 * (highest - lowest)};
}

/// Terms of the spring at every sample, each a column; x is -1 to 1.
std::vector<std::vector<double>> spring_columns(const LoadedMotion& of,
                                                const RangeOfDeflection& range) {
  const std::size_t samples = of.deflection.size();
  std::vector<std::vector<double>> columns(kSpringTerms,
                                           std::vector<double>(samples, kNotMeasured));
  std::array<double, kStopShares.size()> stops{};
  double last = kNotMeasured;
  for (std::size_t n = 0; n < samples; ++n) {
    const double x = (of.deflection[n] - range.middle) / range.half;
    if (!std::isfinite(x)) continue;
    const double change = std::isfinite(last) ? x - last : 0.0;
    last = x;
    columns[0][n] = 1.0;
    columns[1][n] = change;
    for (std::size_t k = 0; k < kKnots; ++k)  // the first is x + 1
      columns[2 + k][n] = std::max(0.0, x + 1.0 - 2.0 * static_cast<double>(k) / kKnots);
    for (std::size_t k = 0; k < stops.size(); ++k) {
      stops[k] = std::clamp(stops[k] + change, -kStopShares[k], kStopShares[k]);
      columns[kStopsBegin + 2 * k][n] = stops[k];
      columns[kStopsBegin + 2 * k + 1][n] = stops[k] * std::abs(x);
    }
  }
  return columns;
}

void append_rows(const LoadedMotion& of, std::size_t recording, const RangeOfDeflection& range,
                 std::vector<FactRow>& rows) {
  const std::size_t samples = of.deflection.size();
  const std::vector<std::vector<double>> spring = spring_columns(of, range);
  std::vector<double> sine(samples);
  std::vector<double> cosine(samples);
  for (std::size_t n = 0; n < samples; ++n) {
    sine[n] = std::sin(of.motion.angle_rad[n] + of.load.zero_rad);
    cosine[n] = std::cos(of.motion.angle_rad[n] + of.load.zero_rad);
  }
  const LocalQuartic smooth(kWider * of.half_width, 1.0);
  const std::size_t margin = smooth.half_width();
  const std::size_t stride = samples / kRowsOfARecording + 1;
  for (std::size_t n = margin; n + margin < samples; n += stride) {
    FactRow row{.sine = smooth.value(sine, n),
                .cosine = smooth.value(cosine, n),
                .acceleration_rad_s2 = smooth.value(of.motion.acceleration_rad_s2, n),
                .recording = recording,
                .block = recording * kBlocks + n * kBlocks / samples};
    for (std::size_t k = 0; k < kSpringTerms; ++k) row.spring[k] = smooth.value(spring[k], n);
    if (std::isfinite(row.acceleration_rad_s2) &&
        std::ranges::all_of(row.spring, [](double term) { return std::isfinite(term); }))
      rows.push_back(row);
  }
}

/// The equations at one zero, and which of the rows count.
class FactEquations {
 public:
  FactEquations(const std::vector<LoadedMotion>& motions, const LoadSheet& sheet)
      : motions_(motions), sheet_(sheet) {
    const RangeOfDeflection range = range_of(motions);
    for (std::size_t m = 0; m < motions.size(); ++m) append_rows(motions[m], m, range, rows_);
  }

  /// Change of inertia and zero from `zero_rad`, over the rows that `uses` accepts.
  /// @throws Error if they are not determined.
  template <class Uses>
  [[nodiscard]] std::array<double, 2> solve(double zero_rad, const Uses& uses) const {
    Matrix design(0, columns());
    std::vector<double> torque_Nm;
    for (const FactRow& row : rows_) {
      if (!uses(row)) continue;
      const JointLoad& load = motions_[row.recording].load;
      const double sine = row.sine * std::cos(zero_rad) + row.cosine * std::sin(zero_rad);
      const double cosine = row.cosine * std::cos(zero_rad) - row.sine * std::sin(zero_rad);
      design.values.insert(design.values.end(), row.spring.begin(), row.spring.end());
      if (sheet_.fits_joint_inertia) design.values.push_back(-row.acceleration_rad_s2);
      if (sheet_.fits_zero) design.values.push_back(-load.gravity_Nm * cosine);
      torque_Nm.push_back(load.gravity_Nm * sine + load.inertia_kg_m2 * row.acceleration_rad_s2);
    }
    design.rows = torque_Nm.size();
    const LeastSquares solved = least_squares(design, torque_Nm);
    for (const std::size_t column : solved.dropped)
      if (column >= kSpringTerms) refuse_undetermined("no motion shows it apart from the spring");
    std::array<double, 2> facts{};
    std::size_t at = kSpringTerms;
    if (sheet_.fits_joint_inertia) facts[0] = solved.coefficients[at++];
    if (sheet_.fits_zero) facts[1] = solved.coefficients[at];
    return facts;
  }
  [[noreturn]] void refuse_undetermined(const std::string& problem) const {
    throw Error({.place = sheet_.file,
                 .problem = "the recordings do not determine what it fits: " + problem,
                 .advice = "State joint_inertia and zero as numbers with their errors, or record "
                           "other loads and faster motions."});
  }

 private:
  [[nodiscard]] std::size_t columns() const {
    return kSpringTerms + (sheet_.fits_joint_inertia ? 1 : 0) + (sheet_.fits_zero ? 1 : 0);
  }

  const std::vector<LoadedMotion>& motions_;
  const LoadSheet& sheet_;
  std::vector<FactRow> rows_;
};

/// Standard errors by leaving out one group of rows after the other.
template <class GroupOf>
std::array<double, 2> jackknife(const FactEquations& equations, double zero_rad, std::size_t groups,
                                const GroupOf& group_of) {
  std::vector<std::array<double, 2>> without;
  std::array<double, 2> mean{};
  for (std::size_t g = 0; g < groups; ++g) {
    without.push_back(
        equations.solve(zero_rad, [&](const FactRow& row) { return group_of(row) != g; }));
    for (std::size_t i = 0; i < 2; ++i) mean[i] += without.back()[i] / static_cast<double>(groups);
  }
  std::array<double, 2> errors{};
  for (std::size_t i = 0; i < 2; ++i) {
    double squares = 0.0;
    for (const auto& facts : without) squares += (facts[i] - mean[i]) * (facts[i] - mean[i]);
    errors[i] = std::sqrt(squares * static_cast<double>(groups - 1) / static_cast<double>(groups));
  }
  return errors;
}

void require_two_loads(const std::vector<LoadedMotion>& motions, const FactEquations& equations) {
  const auto differs = [&](double JointLoad::*member) {
    const auto [least, most] = std::ranges::minmax(
        motions, {}, [member](const LoadedMotion& motion) { return motion.load.*member; });
    return most.load.*member - least.load.*member > kSameLoad * most.load.*member;
  };
  if (differs(&JointLoad::gravity_Nm) || differs(&JointLoad::inertia_kg_m2)) return;
  equations.refuse_undetermined(
      "all recordings have the same load, so that the spring may have caused any difference");
}

}  // namespace

FittedFacts fit_load_facts(const std::vector<LoadedMotion>& motions, const LoadSheet& sheet) {
  constexpr int kSteps = 10;
  constexpr double kEnough_rad = 1e-7;
  const FactEquations equations(motions, sheet);
  require_two_loads(motions, equations);
  const auto all = [](const FactRow&) { return true; };
  double zero_rad = 0.0;
  std::array<double, 2> facts = equations.solve(zero_rad, all);
  for (int step = 0; step < kSteps && std::abs(facts[1]) > kEnough_rad; ++step) {
    zero_rad += facts[1];
    facts = equations.solve(zero_rad, all);
  }
  std::array<double, 2> errors = jackknife(equations, zero_rad, motions.size() * kBlocks,
                                           [](const FactRow& row) { return row.block; });
  if (motions.size() > 2) {
    const auto of_recordings = jackknife(equations, zero_rad, motions.size(),
                                         [](const FactRow& row) { return row.recording; });
    for (std::size_t i = 0; i < 2; ++i) errors[i] = std::max(errors[i], of_recordings[i]);
  }
  const FittedFacts fitted{.joint_inertia_kg_m2 = {facts[0], errors[0]},
                           .zero_rad = {zero_rad, errors[1]}};
  double inertia_kg_m2 = 0.0;
  for (const LoadedMotion& motion : motions)
    inertia_kg_m2 = std::max(inertia_kg_m2, motion.load.inertia_kg_m2);
  if (sheet.fits_zero && !(errors[1] < rad_from_deg(5.0)))
    equations.refuse_undetermined(
        fmt::format("the zero has a standard error of {:.2g} deg", deg_from_rad(errors[1])));
  if (sheet.fits_joint_inertia && !(errors[0] < std::max(inertia_kg_m2, std::abs(facts[0]))))
    equations.refuse_undetermined(
        fmt::format("the joint_inertia is {:.3g} +- {:.2g} kg m2", facts[0], errors[0]));
  return fitted;
}

}  // namespace torsio
