#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/design/coupling/lobe.hpp"

namespace torsio::design {
namespace {

/// Area between both flanks and both radii by Simpson's rule, without a mesh.
double exact_area_mm2(const LobeShape& shape) {
  constexpr int kSteps = 2000;
  const double step_mm = (shape.outer_radius_mm - shape.root_radius_mm) / kSteps;
  double sum = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double radius_mm = shape.root_radius_mm + i * step_mm;
    const double weight = i == 0 || i == kSteps ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0);
    sum += weight * 2.0 * radius_mm * flank_angle_rad(shape, radius_mm);
  }
  return sum * step_mm / 3.0;
}

TEST(LobeMesh, HasTheLobesAreaAndNoInvertedElementForAllSevenGeometries) {
  for (const NamedLobe& lobe : paper_lobes()) {
    SCOPED_TRACE(std::string(lobe.name));
    const LobeMesh mesh = mesh_lobe(lobe.shape, {});
    EXPECT_GT(smallest_jacobian_mm2(mesh), 0.0);
    LobeShape untapered = lobe.shape;
    untapered.taper_mm = 0.0;
    const double exact_mm2 = exact_area_mm2(untapered);
    EXPECT_NEAR(mesh_area_mm2(mesh_lobe(untapered, {})), exact_mm2, 1e-5 * exact_mm2);
    if (lobe.shape.taper_mm > 0.0) {
      EXPECT_LT(mesh_area_mm2(mesh), 0.99 * exact_mm2);
    }
  }
}

TEST(LobeMesh, PutsTheNodesOfACurvedFlankOnItsArc) {
  const LobeShape shape = paper_lobe("gamma");
  const LobeMesh mesh = mesh_lobe(shape, {.radial = 8, .across = 6, .grading = 1.0});
  // The circle through the first, the middle and the last node has the flank's radius.
  const MeshNode a = mesh.nodes[static_cast<std::size_t>(mesh.upper_flank.front())];
  const MeshNode b = mesh.nodes[static_cast<std::size_t>(mesh.upper_flank[8])];
  const MeshNode c = mesh.nodes[static_cast<std::size_t>(mesh.upper_flank.back())];
  const double ab = std::hypot(b.x_mm - a.x_mm, b.y_mm - a.y_mm);
  const double bc = std::hypot(c.x_mm - b.x_mm, c.y_mm - b.y_mm);
  const double ca = std::hypot(a.x_mm - c.x_mm, a.y_mm - c.y_mm);
  const double twice_area =
      (b.x_mm - a.x_mm) * (c.y_mm - a.y_mm) - (b.y_mm - a.y_mm) * (c.x_mm - a.x_mm);
  EXPECT_NEAR(ab * bc * ca / (2.0 * std::abs(twice_area)), 10.0, 1e-9);
  EXPECT_GT(twice_area, 0.0);  // a convex jaw: the lobe is narrower than its chord
}

TEST(LobeMesh, IsSymmetricAndSharesEveryEndOfABondBetweenTwoTriangles) {
  const LobeMesh mesh = mesh_lobe(paper_lobe("beta"), {.radial = 4, .across = 4, .grading = 1.3});
  for (std::size_t i = 0; i < mesh.upper_flank.size(); ++i) {
    const MeshNode up = mesh.nodes[static_cast<std::size_t>(mesh.upper_flank[i])];
    const MeshNode low = mesh.nodes[static_cast<std::size_t>(mesh.lower_flank[i])];
    EXPECT_NEAR(up.x_mm, low.x_mm, 1e-12);
    EXPECT_NEAR(up.y_mm, -low.y_mm, 1e-12);
  }
  for (const int corner : {mesh.upper_flank.front(), mesh.upper_flank.back(),
                           mesh.lower_flank.front(), mesh.lower_flank.back()}) {
    int owners = 0;
    for (const auto& triangle : mesh.triangles)
      for (int i = 0; i < 3; ++i) owners += triangle[static_cast<std::size_t>(i)] == corner;
    EXPECT_EQ(owners, 2);
  }
}

TEST(LobeMesh, HasTheAreaOfTheRingAndNoNodeTwice) {
  for (const NamedLobe& lobe : paper_lobes()) {
    SCOPED_TRACE(std::string(lobe.name));
    LobeShape shape = lobe.shape;
    shape.taper_mm = 0.0;
    const LobeMesh alone = mesh_lobe(shape, {});
    shape.ring_radius_mm = 3.0;
    const LobeMesh mesh = mesh_lobe(shape, {});
    EXPECT_GT(smallest_jacobian_mm2(mesh), 0.0);
    const double ring_mm2 =
        std::numbers::pi / 6.0 * (shape.root_radius_mm * shape.root_radius_mm - 9.0);
    EXPECT_NEAR(mesh_area_mm2(mesh) - mesh_area_mm2(alone), ring_mm2, 1e-4 * ring_mm2);
    std::set<std::pair<double, double>> places;
    for (const MeshNode& node : mesh.nodes) places.emplace(node.x_mm, node.y_mm);
    EXPECT_EQ(places.size(), mesh.nodes.size());
    std::set<int> used;
    for (const auto& triangle : mesh.triangles) used.insert(triangle.begin(), triangle.end());
    EXPECT_EQ(used.size(), mesh.nodes.size());
    EXPECT_EQ(mesh.upper_flank.size(), mesh.lower_flank.size());
  }
}

TEST(LobeMesh, TapersTheOuterFaceByTheStatedDepth) {
  const LobeShape shape = paper_lobe("beta");
  const MeshDensity density = {.radial = 4, .across = 4, .grading = 1.0};
  const LobeMesh mesh = mesh_lobe(shape, density);
  const MeshNode middle = mesh.nodes[8 * 9 + 4];
  EXPECT_NEAR(middle.x_mm, 9.5, 1e-12);
  EXPECT_NEAR(middle.y_mm, 0.0, 1e-12);
  const MeshNode end = mesh.nodes[static_cast<std::size_t>(mesh.upper_flank.back())];
  EXPECT_NEAR(std::hypot(end.x_mm, end.y_mm), 10.0, 1e-9);
}

TEST(LobeMesh, RefusesShapesThatCannotBeBuilt) {
  const auto message = [](const LobeShape& shape, const MeshDensity& density = {}) {
    try {
      (void)mesh_lobe(shape, density);
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  using testing::HasSubstr;
  EXPECT_THAT(message({.half_width_mm = 2.6}), HasSubstr("jaws between the lobes"));
  EXPECT_THAT(message({.half_width_mm = -1.0}), HasSubstr("half width"));
  EXPECT_THAT(message({.flank_radius_mm = 2.0}), HasSubstr("flank radius"));
  EXPECT_THAT(message({.half_width_mm = 0.3, .flank_radius_mm = -4.0}), HasSubstr("axis"));
  EXPECT_THAT(message({.outer_radius_mm = 5.0}), HasSubstr("root radius"));
  EXPECT_THAT(message({.half_width_mm = NAN}), HasSubstr("finite"));
  EXPECT_THAT(message({.taper_mm = 3.0}), HasSubstr("taper"));
  EXPECT_THAT(message({.ring_radius_mm = 5.4}), HasSubstr("radius of the ring"));
  EXPECT_THAT(message({}, {.radial = 3}), HasSubstr("even numbers"));
  EXPECT_THAT(message({}, {.grading = 0.5}), HasSubstr("grading"));
  EXPECT_THROW((void)paper_lobe("theta"), UsageError);
}

}  // namespace
}  // namespace torsio::design
