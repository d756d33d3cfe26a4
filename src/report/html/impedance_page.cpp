#include <fmt/format.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <span>
#include <string>

#include "report/html/time_figure_builder.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/tracking.hpp"

namespace torsio {
namespace {

using Value = std::complex<double> ImpedancePoint::*;

/// Wanted and linear model of the first run, and what each has rendered.
template <class X, class Y>
std::vector<XySeries> curves(std::span<const ImpedanceRun> runs, const X& x, const Y& y) {
  std::vector<XySeries> series;
  const auto add = [&](const ImpedanceRun& run, const std::string& label, CurveRole role,
                       Value value) {
    XySeries one{.label = label, .role = role, .x = {}, .y = {}};
    for (const ImpedancePoint& point : run.points) {
      one.x.push_back(x(point, point.*value));
      one.y.push_back(y(point.*value));
    }
    series.push_back(std::move(one));
  };
  add(runs.front(), "wanted", CurveRole::measured, &ImpedancePoint::wanted_Nm_rad);
  add(runs.front(), "linear model", CurveRole::model, &ImpedancePoint::linear_Nm_rad);
  for (const ImpedanceRun& run : runs)
    add(run, runs.size() > 1 && !run.model.empty() ? "rendered with " + run.model : "rendered",
        CurveRole::model, &ImpedancePoint::rendered_Nm_rad);
  return series;
}

}  // namespace

ReportDocument impedance_report(std::span<const ImpedanceRun> runs) {
  const ImpedanceRun& run = runs.front();
  const auto frequency = [](const ImpedancePoint& point, std::complex<double>) {
    return point.frequency_Hz;
  };
  ReportDocument document{
      .title = "Impedance of " + run.actuator,
      .summary = {fmt::format(
                      "The joint renders {:.4g} Nm/rad at rest and is passive up to {:.3g} Hz.",
                      run.stiffness_Nm_rad, run.passive_to_Hz),
                  fmt::format("The current was limited in {:.1f} % of the cycles.",
                              100.0 * run.limited_share)},
      .sections = {},
      .origin = {{"seed", fmt::format("{}", run.seed)}}};
  ReportSection section{.heading = "Impedance over the frequency",
                        .preformatted = impedance_text(runs)};
  section.figures.emplace_back(XyFigure{
      .title = "Bode diagram: magnitude",
      .x = {"frequency [Hz]", true},
      .y = {"|torque / angle| [Nm/rad]", true},
      .series = curves(runs, frequency, [](std::complex<double> z) { return std::abs(z); })});
  section.figures.emplace_back(
      XyFigure{.title = "Bode diagram: phase",
               .x = {"frequency [Hz]", true},
               .y = {"phase [deg]"},
               .series = curves(runs, frequency, [](std::complex<double> z) {
                 return std::arg(z) * 180.0 / std::numbers::pi;
               })});
  section.figures.emplace_back(
      XyFigure{.title = "Nyquist diagram",
               .x = {"real part [Nm/rad]"},
               .y = {"imaginary part [Nm/rad]"},
               .series = curves(
                   runs, [](const ImpedancePoint&, std::complex<double> z) { return z.real(); },
                   [](std::complex<double> z) { return z.imag(); }),
               .is_equal = true});
  document.sections.push_back(std::move(section));
  document.sections.push_back(
      {.heading = "Motion of the hand",
       .figures = {channels_figure(run.record, "Signals of the joint", {}, {})}});
  return document;
}

}  // namespace torsio
