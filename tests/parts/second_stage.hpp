#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "torsio/core/random.hpp"

namespace torsio {

/// A closed path of eight harmonics with random heights and phases, at most `amplitude_rad` large.
/// Its speed varies as much as its height.
inline std::vector<double> random_closed_path(double amplitude_rad, std::size_t samples,
                                              Random& random) {
  std::vector<double> path(samples, 0.0);
  for (int k = 1; k <= 8; ++k) {
    const double height = random.normal() / k;
    const double phase = 2.0 * std::numbers::pi * random.uniform();
    const double turn = 2.0 * std::numbers::pi * k / static_cast<double>(samples);
    for (std::size_t i = 0; i < samples; ++i)
      path[i] += height * std::sin(turn * static_cast<double>(i) + phase);
  }
  double highest = 0.0;
  for (const double x : path) highest = std::max(highest, std::abs(x));
  for (double& x : path) x *= amplitude_rad / highest;
  return path;
}

/// What a second stage did on a path that it entered relaxed.
struct WorkBook {
  double work_J = 0.0;           ///< supplied to the stage
  double stored_J = 0.0;         ///< stored part at the end
  double throughput_J = 0.0;     ///< sum of the magnitudes of the work
  double largest_gain_J = 0.0;   ///< largest decrease of the friction's loss
  double friction_loss_J = 0.0;  ///< friction work less what the friction stores, at the end
};

/// Walks `turns` times around a path with a sample every `dt_s`.
template <class Stage>
WorkBook walk(Stage& stage, const std::vector<double>& path, double dt_s, int turns) {
  stage.set_period(dt_s);
  stage.reset(path.back());
  const double elastic_J = stage.elastic_energy(path.back());
  const double friction_J = stage.friction_energy();
  WorkBook book;
  double last_rad = path.back();
  double last_Nm = stage.step(last_rad, 0.0);
  double last_friction_Nm = stage.friction_torque();
  double friction_work_J = 0.0;
  double largest_loss_J = 0.0;
  for (int turn = 0; turn < turns; ++turn) {
    for (const double deflection_rad : path) {
      const double increment_rad = deflection_rad - last_rad;
      const double torque_Nm = stage.step(deflection_rad, increment_rad / dt_s);
      const double work_J = 0.5 * (torque_Nm + last_Nm) * increment_rad;
      book.work_J += work_J;
      book.throughput_J += std::abs(work_J);
      friction_work_J += 0.5 * (stage.friction_torque() + last_friction_Nm) * increment_rad;
      book.friction_loss_J = friction_work_J - (stage.friction_energy() - friction_J);
      largest_loss_J = std::max(largest_loss_J, book.friction_loss_J);
      book.largest_gain_J = std::max(book.largest_gain_J, largest_loss_J - book.friction_loss_J);
      last_rad = deflection_rad;
      last_Nm = torque_Nm;
      last_friction_Nm = stage.friction_torque();
    }
  }
  book.stored_J = stage.elastic_energy(last_rad) - elastic_J + stage.friction_energy() - friction_J;
  return book;
}

}  // namespace torsio
