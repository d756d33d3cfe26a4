#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <numbers>

#include "torsio/core/error.hpp"
#include "torsio/design/coupling/lobe_twist.hpp"

namespace torsio::design {
namespace {

void check(const Rubber& rubber, const std::vector<double>& twists_deg) {
  for (const double modulus_MPa : {rubber.shear_modulus_MPa, rubber.bulk_modulus_MPa})
    if (!(std::isfinite(modulus_MPa) && modulus_MPa > 0.0))
      throw UsageError({.place = "material of the lobe",
                        .expected = "a shear and a bulk modulus above 0",
                        .found = fmt::format("{} MPa", modulus_MPa),
                        .advice = "rubber has a bulk modulus of about 2000 MPa"});
  if (twists_deg.empty())
    throw UsageError({.place = "twists of the lobe", .expected = "one or more", .found = "none"});
  for (const double twist_deg : twists_deg)
    if (!(std::abs(twist_deg) <= 30.0))
      throw UsageError({.place = "twists of the lobe",
                        .expected = "-30 to 30 degrees",
                        .found = fmt::format("{} degrees", twist_deg)});
}

}  // namespace

std::string twist_deck(const LobeMesh& mesh, const Rubber& rubber,
                       const std::vector<double>& twists_deg) {
  check(rubber, twists_deg);
  std::string deck = "*NODE, NSET=NALL\n";
  const auto out = std::back_inserter(deck);
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    fmt::format_to(out, "{},{:.10g},{:.10g},0\n", i + 1, mesh.nodes[i].x_mm, mesh.nodes[i].y_mm);
  deck += "*ELEMENT, TYPE=CPE6, ELSET=EALL\n";
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    fmt::format_to(out, "{}", i + 1);
    for (const int node : mesh.triangles[i]) fmt::format_to(out, ",{}", node + 1);
    deck += '\n';
  }
  deck += "*NSET, NSET=MOV\n";
  for (const auto* flank : {&mesh.upper_flank, &mesh.lower_flank})
    for (const int node : *flank) fmt::format_to(out, "{},\n", node + 1);
  fmt::format_to(out,
                 "*MATERIAL, NAME=RUB\n*HYPERELASTIC, NEO HOOKE\n{:.10g},{:.10g}\n"
                 "*SOLID SECTION, ELSET=EALL, MATERIAL=RUB\n",
                 0.5 * rubber.shear_modulus_MPa, 2.0 / rubber.bulk_modulus_MPa);
  for (const double twist_deg : twists_deg) {
    deck += "*STEP, NLGEOM, INC=400\n*STATIC\n0.25,1.,1e-4,1.\n*BOUNDARY\n";
    for (const auto* flank : {&mesh.upper_flank, &mesh.lower_flank}) {
      const double side = flank == &mesh.upper_flank ? -1.0 : 1.0;
      const double angle_rad = side * 0.5 * twist_deg * std::numbers::pi / 180.0;
      for (const int number : *flank) {
        const MeshNode& node = mesh.nodes[static_cast<std::size_t>(number)];
        const double x_mm = std::cos(angle_rad) * node.x_mm - std::sin(angle_rad) * node.y_mm;
        const double y_mm = std::sin(angle_rad) * node.x_mm + std::cos(angle_rad) * node.y_mm;
        fmt::format_to(out, "{0},1,1,{1:.12g}\n{0},2,2,{2:.12g}\n", number + 1, x_mm - node.x_mm,
                       y_mm - node.y_mm);
      }
    }
    deck +=
        "*NODE PRINT, NSET=MOV, FREQUENCY=400\nRF\n*NODE PRINT, NSET=MOV, FREQUENCY=400\nU\n"
        "*EL PRINT, ELSET=EALL, FREQUENCY=400\nE\n*EL PRINT, ELSET=EALL, FREQUENCY=400\nCOORD\n"
        "*END STEP\n";
  }
  return deck;
}

}  // namespace torsio::design
