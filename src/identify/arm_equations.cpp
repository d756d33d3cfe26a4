#include "identify/arm_equations.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kFrictionShare = 0.02;  // standard deviation of a friction, of the largest torque
constexpr double kLeastInertiaShare =
    1e-3;  // share of the largest moment: a product of 0 may differ, too
constexpr double kLargestScale = 3.0;
constexpr double kDeterminedFriction = 0.5;  // standard error over that of the prior

double friction_std(const ArmModel& arm, std::size_t joint) {
  return kFrictionShare * arm.joints[joint].effort_Nm;
}

double mean_of(const std::vector<double>& values, std::size_t joint) {
  return values.empty() ? 0.0 : values[joint];
}

/// The columns that are estimated, from those of all bodies.
class FreeColumns {
 public:
  FreeColumns(const ArmModel& arm, const MomentumWindows& windows,
              const std::vector<BodyPrior>& bodies, const IdentificationOptions& options)
      : arm_(arm), windows_(windows), bodies_(bodies), options_(options) {
    for (const BodyPrior& body : bodies) {
      first_.emplace_back(body.covariance ? std::optional(size_) : std::nullopt);
      if (body.covariance) size_ += kBodyParameters;
    }
    friction_ = size_;
    size_ += eigen_index(2 * windows.joints);
  }

  /// The standard deviation of the scale of a joint's torque.
  [[nodiscard]] double scale_std(std::size_t joint) const {
    double squares = 0.0;
    for (std::size_t w = 0; w < windows_.windows(); ++w) {
      const double torque_Nm = windows_.torque_Nm(eigen_index(w * windows_.joints + joint));
      squares += torque_Nm * torque_Nm;
    }
    const double rms_Nm = std::sqrt(squares / static_cast<double>(windows_.windows()));
    const double floor_Nm = options_.torque_floor_share * arm_.joints[joint].effort_Nm;
    return std::hypot(options_.torque_scale_share,
                      std::min(kLargestScale, rms_Nm > 0.0 ? floor_Nm / rms_Nm : kLargestScale));
  }
  [[nodiscard]] const std::vector<std::optional<Eigen::Index>>& first() const { return first_; }
  [[nodiscard]] Eigen::Index friction(std::size_t joint) const {
    return friction_ + eigen_index(2 * joint);
  }
  [[nodiscard]] Eigen::Index size() const { return size_; }

  [[nodiscard]] JointEquations equations() const {
    JointEquations of{.columns = Eigen::MatrixXd::Zero(windows_.columns.rows(), size_),
                      .target = windows_.torque_Nm,
                      .torque = windows_.torque_Nm,
                      .joints = windows_.joints,
                      .motion = windows_.motion};
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const auto columns = windows_.columns.middleCols(windows_.body_column(b), kBodyParameters);
      if (first_[b])
        of.columns.middleCols(*first_[b], kBodyParameters) = columns;
      else
        of.target -= columns * bodies_[b].mean;
    }
    of.columns.middleCols(friction_, eigen_index(2 * windows_.joints)) =
        windows_.columns.rightCols(eigen_index(2 * windows_.joints));
    if (options_.torque_scale_share > 0.0)
      for (std::size_t j = 0; j < windows_.joints; ++j) of.scale_std.push_back(scale_std(j));
    return of;
  }

  [[nodiscard]] FitPrior prior() const {
    FitPrior of{.mean = Eigen::VectorXd::Zero(size_),
                .precision = Eigen::MatrixXd::Zero(size_, size_)};
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (!first_[b]) continue;
      of.mean.segment<kBodyParameters>(*first_[b]) = bodies_[b].mean;
      // With columns of length 1: a mass in kg and an inertia of some g m2.
      const BodyJacobian& covariance = *bodies_[b].covariance;
      const BodyParameters scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
      const BodyJacobian correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
      of.precision.block<kBodyParameters, kBodyParameters>(*first_[b], *first_[b]) =
          scale.asDiagonal() * correlation.ldlt().solve(BodyJacobian::Identity()) *
          scale.asDiagonal();
    }
    for (std::size_t j = 0; j < windows_.joints; ++j) {
      const double precision = 1.0 / (friction_std(arm_, j) * friction_std(arm_, j));
      of.mean(friction(j)) = mean_of(options_.dry_Nm, j);
      of.mean(friction(j) + 1) = mean_of(options_.viscous_Nms_rad, j);
      of.precision(friction(j), friction(j)) = precision;
      of.precision(friction(j) + 1, friction(j) + 1) = precision;
    }
    return of;
  }

 private:
  const ArmModel& arm_;
  const MomentumWindows& windows_;
  const std::vector<BodyPrior>& bodies_;
  const IdentificationOptions& options_;
  std::vector<std::optional<Eigen::Index>> first_;
  Eigen::Index friction_ = 0;
  Eigen::Index size_ = 0;
};

IdentifiedQuantity parameter_of(const WeightedFit& fit, Eigen::Index at, double prior_std) {
  IdentifiedQuantity of{
      .value = fit.parameters(at),
      .standard_error = fit.standard_error(Eigen::VectorXd::Unit(fit.parameters.size(), at))};
  of.is_determined = of.standard_error <= kDeterminedFriction * prior_std;
  if (!of.is_determined)
    of.reason = fmt::format("the motion adds little to what was assumed, +- {:.2g}", prior_std);
  return of;
}

void check_share(double value, const char* name, double largest) {
  if (value >= 0.0 && value <= largest) return;
  throw UsageError({.place = name,
                    .expected = fmt::format("0 to {:g}", largest),
                    .found = fmt::format("{:g}", value)});
}

}  // namespace

BodyPrior body_prior(const BodyInertia& body, double share, double com_m) {
  BodyPrior prior{.mean = body_parameters(body)};
  if (share <= 0.0 && com_m <= 0.0) return prior;
  const double largest = *std::max_element(body.inertia_kg_m2.begin(), body.inertia_kg_m2.end());
  BodyParameters std_dev;
  std_dev << share * body.mass_kg, com_m, com_m, com_m, 0, 0, 0, 0, 0, 0;
  std_dev = std_dev.cwiseMax(1e-9);
  for (std::size_t i = 0; i < 6; ++i)
    std_dev(eigen_index(4 + i)) =
        std::max(share, kLeastInertiaShare) *
        std::max(i < 3 ? body.inertia_kg_m2[i] : largest, kLeastInertiaShare * largest);
  const BodyJacobian by = parameters_by_body(body);
  prior.covariance = by * std_dev.cwiseAbs2().asDiagonal() * by.transpose();
  return prior;
}

ArmFit fit_arm(const ArmModel& arm, const MomentumWindows& windows,
               const std::vector<BodyPrior>& bodies, const IdentificationOptions& options) {
  const FreeColumns columns(arm, windows, bodies, options);
  ArmFit of{.fit = weighted_fit(columns.equations(), columns.prior()), .body = columns.first()};
  for (std::size_t j = 0; j < windows.joints; ++j) {
    IdentifiedJoint joint{.name = arm.joints[j].name, .residual_Nm = of.fit.residual_rms[j]};
    joint.dry_Nm = parameter_of(of.fit, columns.friction(j), friction_std(arm, j));
    joint.viscous_Nms_rad = parameter_of(of.fit, columns.friction(j) + 1, friction_std(arm, j));
    of.joints.push_back(std::move(joint));
  }
  of.data = {.duration_s = windows.window_s * static_cast<double>(windows.windows()),
             .window_s = windows.window_s,
             .block_s = windows.window_s * static_cast<double>(of.fit.block_windows),
             .windows = windows.windows(),
             .blocks = of.fit.blocks};
  return of;
}

void require_possible(const IdentificationOptions& options, const ArmModel& arm) {
  check_share(options.torque_scale_share, "torque_scale_share", 0.5);
  check_share(options.torque_floor_share, "torque_floor_share", 0.1);
  check_share(options.link_share, "link_share", 1.0);
  check_share(options.link_com_m, "link_com_m", 1.0);
  const auto check_time = [](double value, const char* name, double least, double largest) {
    if (!(value >= least && value <= largest))
      throw UsageError({.place = name,
                        .expected = fmt::format("{:g} to {:g}", least, largest),
                        .found = fmt::format("{:g}", value)});
  };
  check_time(options.window_s, "window_s", 0.02, 10.0);
  check_time(options.speed_window_s, "speed_window_s", 0.001, 0.5);
  check_time(options.friction_speed_rad_s, "friction_speed_rad_s", 1e-4, 1.0);
  for (const std::vector<double>* friction : {&options.dry_Nm, &options.viscous_Nms_rad}) {
    if (friction->empty()) continue;
    if (friction->size() != arm.joints.size() ||
        !std::ranges::all_of(*friction, [](double value) { return value >= 0.0 && value < 1e6; }))
      throw UsageError(
          {.place = "friction of the bearings",
           .expected = fmt::format("none, or {} values of 0 or more", arm.joints.size()),
           .found = fmt::format("{} values", friction->size())});
  }
}

}  // namespace torsio
