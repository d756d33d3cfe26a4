#include "torsio/identify/identify_links.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "identify/arm_equations.hpp"
#include "identify/momentum_windows.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kDeterminedShare = 0.5;  // standard error over the assumed deviation

WindowSettings window_settings(const IdentificationOptions& options) {
  return {.window_s = options.window_s,
          .speed_window_s = options.speed_window_s,
          .friction_speed_rad_s = options.friction_speed_rad_s};
}

/// A value of a link with its standard error, compared with what was assumed of it.
IdentifiedQuantity link_quantity(double value, double error, double assumed) {
  IdentifiedQuantity of{.value = value, .standard_error = error};
  of.is_determined = error <= kDeterminedShare * assumed;
  if (!of.is_determined)
    of.reason = fmt::format("the motion adds little to the model's value, +- {:.2g}", assumed);
  return of;
}

IdentifiedLink link_of(const ArmFit& of, std::size_t link, const BodyPrior& prior,
                       const BodyInertia& body, const BodyInertia& modelled) {
  const Eigen::Index first = of.body[link].value();
  const BodyJacobian to_body = parameters_by_body(body).inverse();
  const BodyJacobian from_model = parameters_by_body(modelled).inverse();
  const BodyJacobian assumed = from_model * *prior.covariance * from_model.transpose();
  const auto quantity = [&](std::size_t i, double value) {
    const Eigen::Index row = eigen_index(i);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(of.fit.parameters.size());
    gradient.segment<kBodyParameters>(first) = to_body.row(row);
    return link_quantity(value, of.fit.standard_error(gradient), std::sqrt(assumed(row, row)));
  };
  IdentifiedLink identified;
  identified.mass_kg = quantity(0, body.mass_kg);
  for (std::size_t i = 0; i < 3; ++i) identified.com_m[i] = quantity(1 + i, body.com_m[i]);
  for (std::size_t i = 0; i < 6; ++i)
    identified.inertia_kg_m2[i] = quantity(4 + i, body.inertia_kg_m2[i]);
  return identified;
}

bool is_possible_link(ArmModel arm, std::size_t link, const BodyInertia& body) {
  arm.joints[link].body = body;
  try {
    require_possible(arm);
  } catch (const Error&) {
    return false;
  }
  return true;
}

}  // namespace

IdentifiedLinks identify_links(const ArmModel& arm, std::span<const ArmMotion> motions,
                               const IdentificationOptions& options) {
  require_possible(options, arm);
  if (!(options.link_share > 0.0 && options.link_com_m > 0.0))
    throw UsageError(
        {.place = "link_share and link_com_m",
         .expected = "deviations above 0: how far the links may be from the model",
         .found = fmt::format("{:g} and {:g} m", options.link_share, options.link_com_m)});
  const MomentumWindows windows = momentum_windows(arm, motions, window_settings(options));
  std::vector<BodyPrior> exact;
  std::vector<BodyPrior> bodies;
  exact.reserve(arm.joints.size() + 1);
  bodies.reserve(arm.joints.size() + 1);
  for (const ArmJoint& joint : arm.joints) {
    bodies.push_back(body_prior(joint.body, options.link_share, options.link_com_m));
    exact.push_back({.mean = body_parameters(joint.body)});
  }
  bodies.push_back({.mean = body_parameters(arm.payload)});
  exact.push_back(bodies.back());
  ArmFit fit = fit_arm(arm, windows, bodies, options);
  IdentifiedLinks found{.joints = std::move(fit.joints),
                        .modelled_joints = fit_arm(arm, windows, exact, options).joints,
                        .arm = arm,
                        .data = fit.data};
  for (std::size_t k = 0; k < arm.joints.size(); ++k) {
    const BodyInertia body = body_of(fit.fit.parameters.segment<kBodyParameters>(*fit.body[k]));
    IdentifiedLink link = link_of(fit, k, bodies[k], body, arm.joints[k].body);
    link.name = arm.joints[k].link;
    link.is_impossible = !is_possible_link(arm, k, body);
    if (!link.is_impossible) found.arm.joints[k].body = body;
    found.links.push_back(std::move(link));
  }
  return found;
}

std::vector<double> torque_residuals(const ArmModel& arm, std::span<const IdentifiedJoint> joints,
                                     std::span<const ArmMotion> motions,
                                     const IdentificationOptions& options) {
  const MomentumWindows windows = momentum_windows(arm, motions, window_settings(options));
  Eigen::VectorXd parameters(windows.columns.cols());
  for (std::size_t k = 0; k <= arm.joints.size(); ++k)
    parameters.segment<kBodyParameters>(windows.body_column(k)) =
        body_parameters(k < arm.joints.size() ? arm.joints[k].body : arm.payload);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    parameters(windows.friction_column() + eigen_index(2 * j)) = joints[j].dry_Nm.value;
    parameters(windows.friction_column() + eigen_index(2 * j + 1)) =
        joints[j].viscous_Nms_rad.value;
  }
  const Eigen::VectorXd needed = windows.columns * parameters;
  std::vector<double> squares(joints.size(), 0.0);
  for (std::size_t w = 0; w < windows.windows(); ++w)
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const Eigen::Index row = eigen_index(w * joints.size() + j);
      const double residual = needed(row) - windows.torque_Nm(row);
      squares[j] += residual * residual;
    }
  for (double& square : squares)
    square = std::sqrt(square / static_cast<double>(windows.windows()));
  return squares;
}

}  // namespace torsio
