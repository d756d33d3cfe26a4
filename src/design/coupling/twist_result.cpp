#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "torsio/design/coupling/lobe.hpp"

namespace torsio::design {
namespace {

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

using Row = std::vector<double>;
struct Blocks {
  std::vector<Row> forces, displacements, strains, coordinates;
};

std::vector<Row>* block_of(Blocks& blocks, const std::string& line) {
  if (line.starts_with(" forces")) return &blocks.forces;
  if (line.starts_with(" displacements")) return &blocks.displacements;
  if (line.starts_with(" strains")) return &blocks.strains;
  if (line.starts_with(" global coordinates") || line.starts_with(" coordinates"))
    return &blocks.coordinates;
  return nullptr;
}

/// Blocks by the step at whose end they were printed. Every step lasts 1.
std::map<int, Blocks> read_blocks(const std::string& text) {
  std::map<int, Blocks> steps;
  std::vector<Row>* rows = nullptr;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t time = line.rfind(" time ");
    if (time != std::string::npos) {
      const double end = std::strtod(line.c_str() + time + 6, nullptr);
      const double step = std::round(end);
      rows = std::abs(end - step) < 1e-6 && step >= 1.0 && step < 1e6
                 ? block_of(steps[static_cast<int>(step)], line)
                 : nullptr;
    } else if (rows != nullptr) {
      std::istringstream words(line);
      Row row;
      for (std::string word; words >> word;) {
        char* end = nullptr;
        const double value = std::strtod(word.c_str(), &end);
        row.push_back(*end == '\0' ? value : kNotANumber);
      }
      if (!row.empty()) rows->push_back(std::move(row));
    }
  }
  return steps;
}

bool complete(const std::vector<Row>& rows, std::size_t count, std::size_t columns) {
  return rows.size() == count && std::all_of(rows.begin(), rows.end(), [&](const Row& row) {
           return row.size() == columns && std::all_of(row.begin(), row.end(), [](double value) {
                    return std::isfinite(value);
                  });
         });
}

/// The plane node of a number in the deck; none if there is no such one.
const MeshNode* node_of(const LobeMesh& mesh, double number) {
  const auto levels = 2 * static_cast<std::size_t>(mesh.layers) + 1;
  if (!(number >= 1.0 && number <= static_cast<double>(levels * mesh.nodes.size()))) return nullptr;
  return &mesh.nodes[(static_cast<std::size_t>(number) - 1) % mesh.nodes.size()];
}

/// Torques over length of the upper and of the lower flank, at the turned position of the nodes.
std::array<double, 2> torques_N(const LobeMesh& mesh, const Blocks& blocks) {
  const std::set<int> upper(mesh.upper_flank.begin(), mesh.upper_flank.end());
  const double length_mm = mesh.layers > 0 ? mesh.half_length_mm : 1.0;
  std::array<double, 2> sums = {};
  for (std::size_t i = 0; i < blocks.forces.size(); ++i) {
    const MeshNode* const node = node_of(mesh, blocks.forces[i][0]);
    if (node == nullptr) return {kNotANumber, kNotANumber};
    const double x_mm = node->x_mm + blocks.displacements[i][1];
    const double y_mm = node->y_mm + blocks.displacements[i][2];
    const bool is_upper = upper.contains(static_cast<int>(node - mesh.nodes.data()));
    sums[is_upper ? 0 : 1] += (x_mm * blocks.forces[i][2] - y_mm * blocks.forces[i][1]) / length_mm;
  }
  return sums;
}

/// Rows of forces and displacements: the nodes of both flanks in all levels that have them.
std::size_t flank_rows(const LobeMesh& mesh) {
  std::set<int> corners;
  for (const auto& triangle : mesh.triangles)
    corners.insert(triangle.begin(), triangle.begin() + 3);
  const auto layers = static_cast<std::size_t>(mesh.layers);
  std::size_t rows = 0;
  for (const auto* flank : {&mesh.upper_flank, &mesh.lower_flank})
    for (const int node : *flank) rows += layers + 1 + (corners.contains(node) ? layers : 0);
  return rows;
}

/// In a solid, the bond ends at the free end, too.
double distance_to_bond_ends_mm(const LobeMesh& mesh, const Row& place) {
  const auto from = [&](const std::vector<int>& nodes) {
    double least_mm = HUGE_VAL;
    for (const int index : nodes) {
      const MeshNode& node = mesh.nodes[static_cast<std::size_t>(index)];
      least_mm = std::min(least_mm, std::hypot(place[2] - node.x_mm, place[3] - node.y_mm));
    }
    return least_mm;
  };
  double distance_mm = from(mesh.bond_ends);
  if (mesh.layers > 0)
    distance_mm =
        std::min(distance_mm, std::hypot(std::min(from(mesh.upper_flank), from(mesh.lower_flank)),
                                         mesh.half_length_mm - place[4]));
  return distance_mm;
}

/// Fills the strains from Green-Lagrange components, whose eigenvalues e give the stretches √(1 + 2 e);
/// false for a volume ratio that no nearly incompressible solution has. `places` is of the first step:
/// reference coordinates.
bool fill_strains(const LobeMesh& mesh, const Blocks& blocks, const std::vector<Row>& places,
                  TwistStep& step) {
  step.element_strains.assign(mesh.triangles.size(), 0.0);
  const std::size_t elements =
      mesh.triangles.size() * static_cast<std::size_t>(std::max(mesh.layers, 1));
  for (std::size_t i = 0; i < blocks.strains.size(); ++i) {
    const Row& e = blocks.strains[i];  // element, point, xx, yy, zz, xy, xz, yz
    Eigen::Matrix3d green;
    green << e[2], e[5], e[6], e[5], e[3], e[7], e[6], e[7], e[4];
    const Eigen::Vector3d values = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>()
                                       .computeDirect(green, Eigen::EigenvaluesOnly)
                                       .eigenvalues();
    const Eigen::Array3d squares = 1.0 + 2.0 * values.array();
    const double volume = std::sqrt(std::max(squares.prod(), 0.0));
    if (!(squares.minCoeff() > 0.0 && volume >= 0.9 && volume <= 1.1)) return false;
    const double strain = 0.5 * std::log(squares.maxCoeff());
    const double distance_mm = distance_to_bond_ends_mm(mesh, places[i]);
    if (!(e[0] >= 1.0 && e[0] <= static_cast<double>(elements))) return false;
    double& of_element =
        step.element_strains[(static_cast<std::size_t>(e[0]) - 1) % mesh.triangles.size()];
    of_element = std::max(of_element, strain);
    step.strain = std::max(step.strain, strain);
    if (distance_mm >= 0.3) step.strain_outside_300um = std::max(step.strain_outside_300um, strain);
    if (distance_mm >= 0.8) step.strain_outside_800um = std::max(step.strain_outside_800um, strain);
  }
  return true;
}

}  // namespace

TwistCurve read_twists(const LobeMesh& mesh, const std::vector<double>& twists_deg,
                       const std::string& dat_text) {
  std::map<int, Blocks> blocks = read_blocks(dat_text);
  TwistCurve curve;
  const std::size_t flank_nodes = flank_rows(mesh);
  for (std::size_t k = 0; k < twists_deg.size(); ++k) {
    const auto stop = [&](const char* why) {
      curve.stopped_by = fmt::format("twist of {} degrees not reached: {}", twists_deg[k], why);
      return curve;
    };
    const Blocks& step = blocks[static_cast<int>(k) + 1];
    if (step.forces.empty()) return stop("the solver wrote no result for it");
    if (!complete(step.forces, flank_nodes, 4) || !complete(step.displacements, flank_nodes, 4) ||
        step.strains.size() % mesh.triangles.size() != 0 ||
        !complete(step.strains, std::max<std::size_t>(step.strains.size(), 1), 8) ||
        !complete(step.coordinates, step.strains.size(), 5))
      return stop("the solver's result is incomplete or not finite");
    const auto [upper_N, lower_N] = torques_N(mesh, step);
    if (!(std::abs(upper_N + lower_N) <= 1e-4 * std::abs(upper_N) + 1e-9))
      return stop("the torques of both flanks do not balance");
    TwistStep result = {.twist_deg = twists_deg[k], .torque_N = upper_N};
    if (!fill_strains(mesh, step, blocks[1].coordinates, result))
      return stop("volumes change by more than 10 %");
    curve.steps.push_back(result);
  }
  return curve;
}

}  // namespace torsio::design
