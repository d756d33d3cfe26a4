#pragma once

#include <span>
#include <string>

namespace torsio {

/// One curve of a plot; x and y have the same length. Points that are not finite are skipped.
struct Curve {
  std::string label;
  std::span<const double> x;
  std::span<const double> y;
};

struct PlotLabels {
  std::string x;
  std::string y;
};

}  // namespace torsio
