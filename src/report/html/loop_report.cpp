#include "report/html/loop_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "report/html/report_parts.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kLowest_Hz = 0.1;
constexpr std::size_t kBodeFrequencies = 400;
constexpr double kNyquistRange = 3.0;  ///< larger values of the loop are not in the Nyquist diagram

struct Response {
  std::vector<double> frequency_Hz;
  std::vector<std::complex<double>> value;
  std::vector<double> phase_deg;  ///< without jumps
};

/// Frequencies that rise geometrically up to nearly half of the sample rate, and those of the margins.
std::vector<double> frequencies(const LinearSystem& loop, const Margins& of) {
  const double highest_Hz = 0.499 * loop.sample_rate_Hz();
  std::vector<double> all;
  for (std::size_t k = 0; k < kBodeFrequencies; ++k)
    all.push_back(kLowest_Hz * std::pow(highest_Hz / kLowest_Hz,
                                        static_cast<double>(k) / (kBodeFrequencies - 1)));
  for (const double at_rad_s : {of.crossover_rad_s, of.gain_rad_s})
    if (at_rad_s > kTurn * kLowest_Hz && at_rad_s < kTurn * highest_Hz)
      all.push_back(at_rad_s / kTurn);
  std::ranges::sort(all);
  return all;
}

Response response_of(const LinearSystem& loop, const Margins& of) {
  Response response{.frequency_Hz = frequencies(loop, of), .value = {}, .phase_deg = {}};
  double before_deg = -90.0;
  for (const double at_Hz : response.frequency_Hz) {
    response.value.push_back(loop.response(kTurn * at_Hz));
    const double phase_deg = deg_from_rad(std::arg(response.value.back()));
    before_deg = phase_deg + 360.0 * std::round((before_deg - phase_deg) / 360.0);
    response.phase_deg.push_back(before_deg);
  }
  return response;
}

/// The index of a frequency that `frequencies` contains; the size where it does not.
std::size_t index_of(const Response& response, double at_rad_s) {
  const auto found = std::ranges::find_if(response.frequency_Hz, [&](double at_Hz) {
    return std::abs(at_Hz - at_rad_s / kTurn) <= 1e-9 * at_Hz;
  });
  return static_cast<std::size_t>(found - response.frequency_Hz.begin());
}

XySeries margin_points() {
  return {.label = "margins",
          .style = CurveStyle::points,
          .role = CurveRole::measured,
          .x = {},
          .y = {}};
}

void add_point(XySeries& points, double x, double y, std::string name) {
  points.x.push_back(x);
  points.y.push_back(y);
  points.names.push_back(std::move(name));
}

XySeries limit(std::string label, std::vector<double> x, std::vector<double> y) {
  return {
      .label = std::move(label), .role = CurveRole::limit, .x = std::move(x), .y = std::move(y)};
}

struct Diagrams {
  XyFigure magnitude{.title = "Bode diagram of the loop: magnitude",
                     .x = {"frequency [Hz]", true},
                     .y = {"|loop|", true},
                     .series = {}};
  XyFigure phase{.title = "Bode diagram of the loop: phase",
                 .x = {"frequency [Hz]", true},
                 .y = {"phase [deg]"},
                 .series = {}};
  XyFigure nyquist{.title = "Nyquist diagram of the loop",
                   .x = {"real part"},
                   .y = {"imaginary part"},
                   .series = {},
                   .is_equal = true};
};

void add_curves(Diagrams& to, const DrawnLoop& of, const Response& response) {
  XySeries magnitude{.label = of.label, .x = response.frequency_Hz, .y = {}};
  XySeries nyquist{.label = of.label, .x = {}, .y = {}};
  for (const std::complex<double>& value : response.value) {
    const bool is_near = std::abs(value) <= kNyquistRange;
    magnitude.y.push_back(std::abs(value));
    nyquist.x.push_back(is_near ? value.real() : kNotMeasured);
    nyquist.y.push_back(is_near ? value.imag() : kNotMeasured);
  }
  to.magnitude.series.push_back(std::move(magnitude));
  to.phase.series.push_back(
      {.label = of.label, .x = response.frequency_Hz, .y = response.phase_deg});
  to.nyquist.series.push_back(std::move(nyquist));
}

struct MarginPoints {
  XySeries magnitude = margin_points();
  XySeries phase = margin_points();
  XySeries nyquist = margin_points();
};

void add_margins(MarginPoints& to, const DrawnLoop& of, const Response& response,
                 const Margins& margin) {
  const auto add = [&](double at_rad_s, const std::string& name) {
    const std::size_t i = index_of(response, at_rad_s);
    if (i == response.value.size()) return;
    add_point(to.magnitude, response.frequency_Hz[i], std::abs(response.value[i]), name);
    add_point(to.phase, response.frequency_Hz[i], response.phase_deg[i], name);
    add_point(to.nyquist, response.value[i].real(), response.value[i].imag(), name);
  };
  if (std::isfinite(margin.phase_rad))
    add(margin.crossover_rad_s,
        fmt::format("{:.0f} deg, {}", deg_from_rad(margin.phase_rad), of.label));
  if (std::isfinite(margin.gain))
    add(margin.gain_rad_s, fmt::format("gain {:.2f}, {}", margin.gain, of.label));
}

XySeries unit_circle() {
  constexpr std::size_t kPoints = 120;
  XySeries circle = limit("unit circle", {}, {});
  for (std::size_t k = 0; k <= kPoints; ++k) {
    const double angle_rad = kTurn * static_cast<double>(k) / kPoints;
    circle.x.push_back(std::cos(angle_rad));
    circle.y.push_back(std::sin(angle_rad));
  }
  return circle;
}

std::string finite_text(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : std::string("none");
}

}  // namespace

std::vector<ReportFigure> loop_figures(std::span<const DrawnLoop> loops) {
  Diagrams diagrams;
  MarginPoints points;
  double highest_Hz = kLowest_Hz;
  for (const DrawnLoop& of : loops) {
    highest_Hz = std::max(highest_Hz, 0.499 * of.loop.sample_rate_Hz());
    const Margins margin = margins(of.loop);
    const Response response = response_of(of.loop, margin);
    add_curves(diagrams, of, response);
    add_margins(points, of, response, margin);
  }
  diagrams.magnitude.series.push_back(std::move(points.magnitude));
  diagrams.phase.series.push_back(std::move(points.phase));
  diagrams.nyquist.series.push_back(std::move(points.nyquist));
  diagrams.magnitude.series.push_back(limit("1", {kLowest_Hz, highest_Hz}, {1.0, 1.0}));
  diagrams.phase.series.push_back(limit("-180 deg", {kLowest_Hz, highest_Hz}, {-180.0, -180.0}));
  diagrams.nyquist.series.push_back(unit_circle());
  diagrams.nyquist.series.push_back({.label = "critical point",
                                     .style = CurveStyle::points,
                                     .role = CurveRole::measured,
                                     .x = {-1.0},
                                     .y = {0.0},
                                     .names = {"-1"}});
  return {std::move(diagrams.magnitude), std::move(diagrams.phase), std::move(diagrams.nyquist)};
}

ReportSection loop_section(std::span<const DrawnLoop> loops) {
  TextTable table;
  table.header({"loop", "phase margin [deg]", "at [Hz]", "gain margin", "at [Hz]", "least gain"});
  for (const DrawnLoop& of : loops) {
    const Margins margin = margins(of.loop);
    table.row({of.label, finite_text(deg_from_rad(margin.phase_rad), 1),
               finite_text(margin.crossover_rad_s / kTurn, 2), finite_text(margin.gain, 2),
               finite_text(margin.gain_rad_s / kTurn, 2), finite_text(margin.least_gain, 3)});
  }
  ReportSection section{
      .heading = "The loop, cut open at the current",
      .text =
          "Of the linear model: spring, drive, current loop, delay of one sample; without dry "
          "friction. It is stable for any factor of the gains between the least gain and the "
          "gain margin."};
  section.tables.push_back(report_table(table));
  section.figures = loop_figures(loops);
  return section;
}

}  // namespace torsio
