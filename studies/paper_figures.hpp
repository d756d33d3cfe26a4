#pragma once

#include <array>
#include <string_view>

#include "studies/study.hpp"

namespace torsio {

/// Every figure in `paper_figures.csv`; the build fails on a line with an unknown item or unit.
inline constexpr auto kPaperFigures = std::to_array<PaperFigure>({
#include "paper_figures.inc"
});

/// The figure of that name; null if the file does not have it.
inline const PaperFigure* find_paper_figure(std::string_view paper, std::string_view item,
                                            std::string_view condition,
                                            std::string_view quantity) noexcept {
  for (const PaperFigure& each : kPaperFigures)
    if (each.paper == paper && each.item == item && each.condition == condition &&
        each.quantity == quantity)
      return &each;
  return nullptr;
}

/// The figure of that name. One that the file does not have ends the build.
consteval PaperFigure paper_figure(std::string_view paper, std::string_view item,
                                   std::string_view condition, std::string_view quantity) {
  for (const PaperFigure& each : kPaperFigures)
    if (each.paper == paper && each.item == item && each.condition == condition &&
        each.quantity == quantity)
      return each;
  throw "paper_figures.csv has no such figure";
}

}  // namespace torsio
