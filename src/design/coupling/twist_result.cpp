#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <sstream>

#include "torsio/design/coupling/lobe_twist.hpp"

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

/// Torques per length of the upper and of the lower flank, at the turned position of the nodes.
std::array<double, 2> torques_N(const LobeMesh& mesh, const Blocks& blocks) {
  const std::set<int> upper(mesh.upper_flank.begin(), mesh.upper_flank.end());
  std::array<double, 2> sums = {};
  for (std::size_t i = 0; i < blocks.forces.size(); ++i) {
    const int number = static_cast<int>(blocks.forces[i][0]) - 1;
    if (number < 0 || static_cast<std::size_t>(number) >= mesh.nodes.size())
      return {kNotANumber, kNotANumber};
    const MeshNode& node = mesh.nodes[static_cast<std::size_t>(number)];
    const double x_mm = node.x_mm + blocks.displacements[i][1];
    const double y_mm = node.y_mm + blocks.displacements[i][2];
    sums[upper.contains(number) ? 0 : 1] += x_mm * blocks.forces[i][2] - y_mm * blocks.forces[i][1];
  }
  return sums;
}

double distance_to_bond_ends_mm(const LobeMesh& mesh, double x_mm, double y_mm) {
  double distance_mm = HUGE_VAL;
  for (const auto* flank : {&mesh.upper_flank, &mesh.lower_flank})
    for (const int end : {flank->front(), flank->back()}) {
      const MeshNode& node = mesh.nodes[static_cast<std::size_t>(end)];
      distance_mm = std::min(distance_mm, std::hypot(x_mm - node.x_mm, y_mm - node.y_mm));
    }
  return distance_mm;
}

/// Fills the strains from Green-Lagrange components in the plane; false for a volume ratio that no
/// nearly incompressible solution has. `places` is of the first step: reference coordinates.
bool fill_strains(const LobeMesh& mesh, const Blocks& blocks, const std::vector<Row>& places,
                  TwistStep& step) {
  step.element_strains.assign(mesh.triangles.size(), 0.0);
  for (std::size_t i = 0; i < blocks.strains.size(); ++i) {
    const Row& e = blocks.strains[i];
    const double mean = 0.5 * (e[2] + e[3]);
    const double radius = std::hypot(0.5 * (e[2] - e[3]), e[5]);
    const double large = 1.0 + 2.0 * (mean + radius);
    const double small = 1.0 + 2.0 * (mean - radius);
    const double volume = std::sqrt(std::max(large * small, 0.0));
    if (!(small > 0.0 && volume >= 0.9 && volume <= 1.1)) return false;
    const double strain = 0.5 * std::log(large);
    const double distance_mm = distance_to_bond_ends_mm(mesh, places[i][2], places[i][3]);
    if (!(e[0] >= 1.0 && e[0] <= static_cast<double>(mesh.triangles.size()))) return false;
    double& of_element = step.element_strains[static_cast<std::size_t>(e[0]) - 1];
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
  const std::size_t flank_nodes = mesh.upper_flank.size() + mesh.lower_flank.size();
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
