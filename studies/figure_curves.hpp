#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim/sensors/sensor_set.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/report/document/report_document.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {

/// Which samples of a signal a figure shows.
struct Thinning {
  double rate_Hz = kBenchRate_Hz;
  std::size_t step = 100;  ///< every that many samples
};

/// Every `step`-th value, from the first on.
[[nodiscard]] std::vector<double> every(const std::vector<double>& values, std::size_t step);

/// A figure over time, without curves.
[[nodiscard]] XyFigure trace_figure(std::string title, const char* unit);
void add_trace(XyFigure& figure, std::string label, const std::vector<double>& values,
               CurveRole role = CurveRole::model, const Thinning& thinning = {});

/// A figure of torque over deflection, without curves.
[[nodiscard]] XyFigure loop_figure(std::string title);
/// A curve of two signals of one length.
void add_loop(XyFigure& figure, std::string label, const std::vector<double>& deflection_deg,
              const std::vector<double>& torque_Nm, CurveRole role = CurveRole::measured);

/// The error of a torque loop's run [Nm].
[[nodiscard]] std::vector<double> tracking_error(const Recording& run);

/// The deflection of a spring [deg]: every `step`-th sample of gear output less joint.
[[nodiscard]] std::vector<double> deflection_curve(const Recording& recording,
                                                   std::size_t step = Thinning{}.step);

/// RMS of a signal while a linear chirp has the frequencies of each band. @returns middle of the band [Hz] and RMS; NaN
/// for a band without a sample
[[nodiscard]] std::vector<std::pair<double, double>> rms_by_frequency(
    const std::vector<double>& values, double rate_Hz, const Chirp::Parameters& chirp,
    std::span<const double> edges_Hz);

/// The measures of a loop of torque over deflection, by means over 40 bins of the deflection in each direction of the
/// torque.
struct LoopMeasures {
  double width_Nm = 0.0;  ///< mean distance of both directions in the middle half of the bins
  double nonlinear_Nm =
      0.0;  ///< RMS distance of their mean from its regression line, over the bins with both
};

[[nodiscard]] LoopMeasures loop_measures(const std::vector<double>& deflection_deg,
                                         const std::vector<double>& torque_Nm);

}  // namespace torsio
