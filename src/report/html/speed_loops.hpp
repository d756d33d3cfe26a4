#pragma once

#include <span>
#include <string>
#include <vector>

#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// Central differences over 0.1 s, which leave out the noise and the steps of an encoder.
[[nodiscard]] std::vector<double> rate_of(std::span<const double> x, double rate_Hz);

/// "spring_deflection_rad [rad]"; without a unit the name alone.
[[nodiscard]] std::string with_unit(const std::string& channel);
/// "d/dt spring_deflection_rad [rad/s]".
[[nodiscard]] std::string rate_label(const std::string& channel);

/// The mean of a quantity over another one while that rises and while it falls, for up to three bands of its speed that
/// have equally many samples: how far a loop depends on the speed. Fewer bands where the speeds hardly differ.
/// @param x_name, y_name of channels, or expressions
[[nodiscard]] XyFigure speed_loops(const std::string& x_name, std::span<const double> x,
                                   const std::string& y_name, std::span<const double> y,
                                   double rate_Hz);

}  // namespace torsio
