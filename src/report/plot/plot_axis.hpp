#pragma once

#include <string>
#include <vector>

#include "report/plot_range.hpp"

namespace torsio {

/// An axis of a picture: the range widened by a small margin, and where its values are drawn.
class PlotAxis {
 public:
  /// @param range may be empty; of a logarithmic axis only positive values
  PlotAxis(PlotRange range, bool is_logarithmic, bool has_margin, double from, double to);

  /// NaN for what is not on a logarithmic axis.
  [[nodiscard]] double at(double value) const;

  struct Tick {
    double value = 0.0;
    std::string text;
  };
  [[nodiscard]] std::vector<Tick> ticks() const;

 private:
  PlotRange range_;  ///< decimal logarithms on a logarithmic axis
  bool is_logarithmic_;
  double from_;
  double to_;
};

}  // namespace torsio
