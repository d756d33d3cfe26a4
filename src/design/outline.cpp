#include "design/outline.hpp"

#include <fmt/format.h>

namespace torsio {
namespace {

std::string circle(double radius_mm) {
  return fmt::format("0\nCIRCLE\n8\nOUTLINE\n10\n0.0\n20\n0.0\n40\n{:.6f}\n", radius_mm);
}

std::string line(double x1, double y1, double x2, double y2) {
  return fmt::format("0\nLINE\n8\nOUTLINE\n10\n{:.6f}\n20\n{:.6f}\n11\n{:.6f}\n21\n{:.6f}\n", x1,
                     y1, x2, y2);
}

std::string rectangle(double x, double y, double width, double height) {
  return line(x, y, x + width, y) + line(x + width, y, x + width, y + height) +
         line(x + width, y + height, x, y + height) + line(x, y + height, x, y);
}

std::string outline(double outer_mm, double inner_mm, double length_mm) {
  std::string text =
      "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$MEASUREMENT\n70\n1\n0\nENDSEC\n"
      "0\nSECTION\n2\nENTITIES\n";
  text += circle(outer_mm);
  if (inner_mm > 0.0) text += circle(inner_mm);
  const double left = 1.5 * outer_mm;
  if (inner_mm > 0.0) {
    text += rectangle(left, inner_mm, length_mm, outer_mm - inner_mm);
    text += rectangle(left, -outer_mm, length_mm, outer_mm - inner_mm);
  } else {
    text += rectangle(left, -outer_mm, length_mm, 2.0 * outer_mm);
  }
  return text + "0\nENDSEC\n0\nEOF\n";
}

}  // namespace

std::string dxf_of_ring(const RubberRing& ring) {
  return outline(ring.outer_m * 1e3, ring.inner_m * 1e3, ring.length_m * 1e3);
}

std::string dxf_of_rod(double outer_diameter_m, double inner_diameter_m, double length_m) {
  return outline(outer_diameter_m * 500.0, inner_diameter_m * 500.0, length_m * 1e3);
}

}  // namespace torsio
