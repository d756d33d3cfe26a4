#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <numbers>

#include "torsio/core/error.hpp"
#include "torsio/design/coupling/lobe.hpp"

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

using Text = std::back_insert_iterator<std::string>;

/// Numbers of a node of the plane mesh in all levels that have it: those between layers have corners only.
std::vector<int> levels_of(const LobeMesh& mesh, const std::vector<bool>& is_corner, int node) {
  const int count = static_cast<int>(mesh.nodes.size());
  std::vector<int> numbers;
  for (int level = 0; level <= 2 * mesh.layers; ++level)
    if (level % 2 == 0 || is_corner[static_cast<std::size_t>(node)])
      numbers.push_back(level * count + node + 1);
  return numbers;
}

std::vector<bool> corners_of(const LobeMesh& mesh) {
  std::vector<bool> is_corner(mesh.nodes.size(), false);
  for (const auto& triangle : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) is_corner[static_cast<std::size_t>(triangle[k])] = true;
  return is_corner;
}

void add_nodes(const LobeMesh& mesh, const std::vector<bool>& is_corner, Text out) {
  const std::size_t count = mesh.nodes.size();
  for (int level = 0; level <= 2 * mesh.layers; ++level) {
    const double z_mm = mesh.layers > 0 ? mesh.half_length_mm * level / (2.0 * mesh.layers) : 0.0;
    for (std::size_t i = 0; i < count; ++i)
      if (level % 2 == 0 || is_corner[i])
        fmt::format_to(out, "{},{:.10g},{:.10g},{:.10g}\n",
                       static_cast<std::size_t>(level) * count + i + 1, mesh.nodes[i].x_mm,
                       mesh.nodes[i].y_mm, z_mm);
  }
}

void add_triangles(const LobeMesh& mesh, Text out) {
  fmt::format_to(out, "*ELEMENT, TYPE=CPE6, ELSET=EALL\n");
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    fmt::format_to(out, "{}", i + 1);
    for (const int node : mesh.triangles[i]) fmt::format_to(out, ",{}", node + 1);
    fmt::format_to(out, "\n");
  }
}

/// Corners below and above, middles of the edges below and above, middles of the edges along the axis.
void add_wedges(const LobeMesh& mesh, Text out) {
  fmt::format_to(out, "*ELEMENT, TYPE=C3D15, ELSET=EALL\n");
  const int count = static_cast<int>(mesh.nodes.size());
  std::size_t number = 0;
  for (int layer = 0; layer < mesh.layers; ++layer)
    for (const auto& triangle : mesh.triangles) {
      fmt::format_to(out, "{}", ++number);
      const auto add = [&](std::size_t first, int level) {
        for (std::size_t k = first; k < first + 3; ++k)
          fmt::format_to(out, ",{}", level * count + triangle[k] + 1);
      };
      add(0, 2 * layer);
      add(0, 2 * layer + 2);
      add(3, 2 * layer);
      add(3, 2 * layer + 2);
      add(0, 2 * layer + 1);
      fmt::format_to(out, "\n");
    }
}

}  // namespace

std::string twist_deck(const LobeMesh& mesh, const Rubber& rubber,
                       const std::vector<double>& twists_deg) {
  check(rubber, twists_deg);
  std::string deck = "*NODE, NSET=NALL\n";
  const auto out = std::back_inserter(deck);
  const std::vector<bool> is_corner = corners_of(mesh);
  add_nodes(mesh, is_corner, out);
  if (mesh.layers > 0)
    add_wedges(mesh, out);
  else
    add_triangles(mesh, out);
  deck += "*NSET, NSET=MOV\n";
  for (const auto* flank : {&mesh.upper_flank, &mesh.lower_flank})
    for (const int node : *flank)
      for (const int number : levels_of(mesh, is_corner, node))
        fmt::format_to(out, "{},\n", number);
  if (mesh.layers > 0) {
    deck += "*NSET, NSET=MID, GENERATE\n";
    fmt::format_to(out, "1,{},1\n", mesh.nodes.size());
    deck += "*BOUNDARY\nMID,3,3\nMOV,3,3\n";
  }
  fmt::format_to(out,
                 "*MATERIAL, NAME=RUB\n*HYPERELASTIC, NEO HOOKE\n{:.10g},{:.10g}\n"
                 "*SOLID SECTION, ELSET=EALL, MATERIAL=RUB\n",
                 0.5 * rubber.shear_modulus_MPa, 2.0 / rubber.bulk_modulus_MPa);
  for (const double twist_deg : twists_deg) {
    deck += "*STEP, NLGEOM, INC=400\n*STATIC\n0.25,1.,1e-4,1.\n*BOUNDARY\n";
    for (const auto* flank : {&mesh.upper_flank, &mesh.lower_flank}) {
      const double side = flank == &mesh.upper_flank ? -1.0 : 1.0;
      const double angle_rad = side * 0.5 * twist_deg * std::numbers::pi / 180.0;
      for (const int index : *flank) {
        const MeshNode& node = mesh.nodes[static_cast<std::size_t>(index)];
        const double x_mm = std::cos(angle_rad) * node.x_mm - std::sin(angle_rad) * node.y_mm;
        const double y_mm = std::sin(angle_rad) * node.x_mm + std::cos(angle_rad) * node.y_mm;
        for (const int number : levels_of(mesh, is_corner, index))
          fmt::format_to(out, "{0},1,1,{1:.12g}\n{0},2,2,{2:.12g}\n", number, x_mm - node.x_mm,
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
