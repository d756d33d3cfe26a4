#pragma once

#include <span>
#include <string>

#include "torsio/design/rubber_spring.hpp"

namespace torsio {

/// Outlines as DXF (ASCII, AC1009, millimetres): circles of the ring's face, and to the right of it
/// its section along the axis.
[[nodiscard]] std::string dxf_of_ring(const RubberRing& ring);
/// A rod or tube: its face and its section along the axis. @param inner_diameter_m 0: solid
[[nodiscard]] std::string dxf_of_rod(double outer_diameter_m, double inner_diameter_m,
                                     double length_m);

}  // namespace torsio
