#include "torsio/identify/exciting_program.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "arm/vector3.hpp"
#include "core/report_progress.hpp"
#include "identify/arm_equations.hpp"
#include "identify/momentum_windows.hpp"
#include "torsio/arm/arm_move.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kPlanRate_Hz = 125.0;
constexpr std::size_t kMaxMoves = 200;
constexpr std::size_t kMaxCandidates = 1000;
constexpr int kDraws = 200;  // per candidate, until a pose is within the limits
constexpr double kKnownShare = 0.02;
constexpr std::size_t kPosesPerCandidate = 10;
constexpr double kAxisDistance_m = 0.15;
constexpr double kShortestMove_rad = 0.3;  // way of the joint that moves the farthest
// Units of the payload's parameters, with which those of a hand tool are about 1.
constexpr double kUnitMoment_kg_m = 0.1;
constexpr double kUnitInertia_kg_m2 = 0.01;
constexpr double kLinkShare = 0.1;
constexpr double kLinkCom_m = 0.01;

double in_tenths_of_a_degree(double angle_rad) {
  return rad_from_deg(0.1 * std::round(10.0 * deg_from_rad(angle_rad)));
}

/// A move with what it adds to the information.
struct PlannedMove {
  std::vector<double> to_rad = {};
  Eigen::MatrixXd information = {};
  double duration_s = 0.0;
  std::vector<double> largest_torque_Nm = {};
  std::vector<double> largest_speed_rad_s = {};
};

class Planner {
 public:
  Planner(const ArmSetup& setup, const ExcitationSpec& spec)
      : setup_(setup), spec_(spec), dynamics_(setup.arm), random_(spec.seed) {
    const Vector3& gravity = setup.arm.gravity_m_s2;
    const double size = std::sqrt(dot(gravity, gravity));
    up_ = size > 0.0 ? -1.0 / size * gravity : Vector3{0.0, 0.0, 1.0};
    const auto joints = setup.arm.joints.size();
    if (spec.goal != ExcitationGoal::links) {
      BodyParameters units;
      units << 1.0, BodyParameters::Constant(kUnitMoment_kg_m).segment<3>(1),
          BodyParameters::Constant(kUnitInertia_kg_m2).segment<6>(4);
      scale_ = units.asDiagonal();
      first_column_ = kBodyParameters * eigen_index(joints);
      return;
    }
    const Eigen::Index size_of_links = kBodyParameters * eigen_index(joints);
    scale_ = Eigen::MatrixXd::Zero(size_of_links, size_of_links);
    for (std::size_t k = 0; k < joints; ++k) {
      const BodyPrior prior = body_prior(setup.arm.joints[k].body, kLinkShare, kLinkCom_m);
      const BodyParameters size_of = prior.covariance->diagonal().cwiseSqrt();
      const BodyJacobian correlation = size_of.cwiseInverse().asDiagonal() * *prior.covariance *
                                       size_of.cwiseInverse().asDiagonal();
      scale_.block<kBodyParameters, kBodyParameters>(kBodyParameters * eigen_index(k),
                                                     kBodyParameters * eigen_index(k)) =
          size_of.asDiagonal() * BodyJacobian(correlation.llt().matrixL());
    }
  }

  ExcitingProgram run(const Progress& progress) {
    const std::vector<double> start = start_pose();
    ExcitingProgram planned{.program = {.start_rad = start}};
    planned.largest_torque_Nm.assign(start.size(), 0.0);
    planned.largest_speed_rad_s.assign(start.size(), 0.0);
    information_ = Eigen::MatrixXd::Zero(scale_.cols(), scale_.cols());
    std::vector<double> at = start;
    for (std::size_t m = 0; m < spec_.moves; ++m) {
      report_progress(progress, static_cast<double>(m) / static_cast<double>(spec_.moves),
                      fmt::format("move {} of {}", m + 1, spec_.moves));
      const bool is_last = m + 1 == spec_.moves;
      std::optional<PlannedMove> best = is_last ? move_of(at, start) : best_move(at, start, m);
      if (!best) refuse(m);
      at = best->to_rad;
      information_ += best->information;
      planned.duration_s += best->duration_s;
      for (std::size_t j = 0; j < at.size(); ++j) {
        planned.largest_torque_Nm[j] =
            std::max(planned.largest_torque_Nm[j], best->largest_torque_Nm[j]);
        planned.largest_speed_rad_s[j] =
            std::max(planned.largest_speed_rad_s[j], best->largest_speed_rad_s[j]);
      }
      planned.program.steps.push_back({.task = ArmTask::move, .to_rad = std::move(best->to_rad)});
    }
    planned.condition_number = condition_number();
    planned.information = log_det(information_);
    return planned;
  }

 private:
  [[noreturn]] void refuse(std::size_t move) const {
    throw Error({.place = setup_.arm.name,
                 .problem = fmt::format("no pose for move {} is within the limits", move + 1),
                 .expected = fmt::format("poses with every joint {:g} m above the base and at most "
                                         "{:g} % of the rated torques",
                                         spec_.lowest_height_m, 100.0 * spec_.torque_share),
                 .found = fmt::format("none of {} draws",
                                      static_cast<std::size_t>(kDraws) * spec_.candidates),
                 .advice = "Lower the height, reduce the payload, or widen the joints' ranges."});
  }

  /// The first pose within the limits that is drawn.
  std::vector<double> start_pose() {
    for (int draw = 0; draw < kDraws; ++draw) {
      std::vector<double> pose = drawn();
      if (is_clear(pose)) return pose;
    }
    refuse(0);
  }
  std::vector<double> drawn() {
    std::vector<double> pose;
    pose.reserve(setup_.arm.joints.size());
    for (const ArmJoint& joint : setup_.arm.joints) {
      const double middle = 0.5 * (joint.lowest_rad + joint.highest_rad);
      const double half = 0.5 * spec_.range_share * (joint.highest_rad - joint.lowest_rad);
      pose.push_back(in_tenths_of_a_degree(middle + half * random_.uniform(-1.0, 1.0)));
    }
    return pose;
  }
  [[nodiscard]] bool is_clear(std::span<const double> pose) const {
    for (std::size_t k = 1; k <= setup_.arm.joints.size(); ++k) {
      const Vector3 at = k < setup_.arm.joints.size() ? dynamics_.link(k, pose).position_m
                                                      : dynamics_.flange(pose).position_m;
      if (dot(at, up_) < spec_.lowest_height_m) return false;
      if (k > 2 && at[0] * at[0] + at[1] * at[1] < kAxisDistance_m * kAxisDistance_m &&
          at[2] < dynamics_.link(1, pose).position_m[2] + kAxisDistance_m)
        return false;
    }
    return true;
  }

  /// To the pose that winds the spring of one joint the farthest.
  std::optional<PlannedMove> winding_move(const std::vector<double>& from,
                                          const std::vector<double>& home, std::size_t move) {
    const std::size_t joint = move % from.size();
    ArmDynamics::PerJoint before_Nm = {};
    ArmDynamics::PerJoint after_Nm = {};
    dynamics_.gravity_torque(from, before_Nm);
    std::vector<std::pair<double, std::vector<double>>> poses;
    for (std::size_t d = 0; d < kPosesPerCandidate * spec_.candidates; ++d) {
      std::vector<double> pose = drawn();
      if (!is_clear(pose)) continue;
      dynamics_.gravity_torque(pose, after_Nm);
      poses.emplace_back(-std::abs(after_Nm[joint] - before_Nm[joint]), std::move(pose));
    }
    std::ranges::sort(poses);
    for (const auto& [change_Nm, pose] : poses) {
      std::optional<PlannedMove> wound = move_of(from, pose);
      if (!wound || (move + 2 == spec_.moves && !move_of(pose, home))) continue;
      return wound;
    }
    return {};
  }

  std::optional<PlannedMove> best_move(const std::vector<double>& from,
                                       const std::vector<double>& home, std::size_t move) {
    if (spec_.goal == ExcitationGoal::springs) return winding_move(from, home, move);
    std::optional<PlannedMove> best;
    double best_gain = -1.0;
    const double now = log_det(information_);
    for (std::size_t c = 0; c < spec_.candidates; ++c) {
      std::optional<PlannedMove> candidate;
      for (int draw = 0; draw < kDraws && !candidate; ++draw) candidate = move_of(from, drawn());
      if (!candidate) continue;
      // The last move must lead home.
      if (move + 2 == spec_.moves && !move_of(candidate->to_rad, home)) continue;
      const double gain =
          (log_det(information_ + candidate->information) - now) / candidate->duration_s;
      if (gain <= best_gain) continue;
      best_gain = gain;
      best = std::move(candidate);
    }
    return best;
  }

  /// None if the move leaves the limits.
  [[nodiscard]] std::optional<PlannedMove> move_of(const std::vector<double>& from,
                                                   std::vector<double> to) const {
    if (!is_clear(to)) return {};
    const std::size_t joints = from.size();
    double farthest = 0.0;
    for (std::size_t j = 0; j < joints; ++j)
      farthest = std::max(farthest, std::abs(to[j] - from[j]));
    if (farthest < kShortestMove_rad) return {};
    ArmMove move(std::vector{from, to}, setup_.moves, kPlanRate_Hz);
    PlannedMove planned{.duration_s = move.duration_s(),
                        .largest_torque_Nm = std::vector<double>(joints, 0.0),
                        .largest_speed_rad_s = std::vector<double>(joints, 0.0)};
    ArmMotion motion{.name = setup_.arm.name, .sample_rate_Hz = kPlanRate_Hz};
    motion.angle_rad.resize(joints);
    const auto ticks = static_cast<std::size_t>(move.duration_s() * kPlanRate_Hz) + 4;
    for (std::size_t n = 0; n < ticks; ++n) {
      const ArmMove::Output at = move.step();
      if (!is_clear(std::span(at.position_rad).first(joints))) return {};
      ArmDynamics::PerJoint torque_Nm = {};
      dynamics_.inverse(at.position_rad, at.velocity_rad_s, at.acceleration_rad_s2, torque_Nm);
      for (std::size_t j = 0; j < joints; ++j) {
        if (std::abs(torque_Nm[j]) > spec_.torque_share * rating_Nm(j)) return {};
        planned.largest_torque_Nm[j] =
            std::max(planned.largest_torque_Nm[j], std::abs(torque_Nm[j]));
        planned.largest_speed_rad_s[j] =
            std::max(planned.largest_speed_rad_s[j], std::abs(at.velocity_rad_s[j]));
        motion.angle_rad[j].push_back(at.position_rad[j]);
      }
    }
    motion.torque_Nm.assign(joints, std::vector<double>(ticks, 0.0));
    planned.information = information_of(motion);
    planned.to_rad = std::move(to);
    return planned;
  }
  [[nodiscard]] double rating_Nm(std::size_t joint) const {
    return setup_.joints[joint].sheet.rating.torque_Nm.value;
  }

  [[nodiscard]] Eigen::MatrixXd information_of(const ArmMotion& motion) const {
    const MomentumWindows windows =
        momentum_windows(setup_.arm, {&motion, 1}, {.least_windows = 0});
    const Eigen::Index rows = windows.columns.rows();
    Eigen::MatrixXd scaled = windows.columns.middleCols(first_column_, scale_.rows()) * scale_;
    for (Eigen::Index r = 0; r < rows; ++r)
      scaled.row(r) /= kKnownShare * rating_Nm(static_cast<std::size_t>(r) % windows.joints);
    return scaled.transpose() * scaled;
  }
  static double log_det(const Eigen::MatrixXd& information) {
    Eigen::MatrixXd matrix = information;
    matrix.diagonal().array() += 1.0;
    return 2.0 * Eigen::MatrixXd(matrix.llt().matrixL()).diagonal().array().log().sum();
  }
  [[nodiscard]] double condition_number() const {
    if (spec_.goal != ExcitationGoal::payload) return kNotMeasured;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information_);
    return std::sqrt(eigen.eigenvalues().maxCoeff() / eigen.eigenvalues().minCoeff());
  }

  const ArmSetup& setup_;
  const ExcitationSpec& spec_;
  ArmDynamics dynamics_;
  Random random_;
  Vector3 up_ = {};
  Eigen::MatrixXd scale_;
  Eigen::Index first_column_ = 0;
  Eigen::MatrixXd information_;
};

void require_possible(const ExcitationSpec& spec) {
  const auto check = [](bool is_possible, const char* place, const std::string& expected,
                        double found) {
    if (!is_possible)
      throw UsageError({.place = place, .expected = expected, .found = fmt::format("{:g}", found)});
  };
  check(spec.moves >= 3 && spec.moves <= kMaxMoves, "moves", fmt::format("3 to {}", kMaxMoves),
        static_cast<double>(spec.moves));
  check(spec.candidates >= 1 && spec.candidates <= kMaxCandidates, "candidates",
        fmt::format("1 to {}", kMaxCandidates), static_cast<double>(spec.candidates));
  check(spec.range_share > 0.0 && spec.range_share <= 1.0, "range", "above 0, at most 1",
        spec.range_share);
  check(spec.torque_share > 0.0 && spec.torque_share <= 1.0, "torque", "above 0, at most 1",
        spec.torque_share);
  check(std::abs(spec.lowest_height_m) <= 10.0, "height", "-10 m to 10 m", spec.lowest_height_m);
}

}  // namespace

ExcitingProgram exciting_program(const ArmSetup& setup, const ExcitationSpec& spec,
                                 const Progress& progress) {
  require_possible(spec);
  return Planner(setup, spec).run(progress);
}

std::string program_yaml(const ArmProgram& program) {
  const auto list = [](const std::vector<double>& angles_rad) {
    std::vector<std::string> texts;
    texts.reserve(angles_rad.size());
    for (const double angle : angles_rad)
      texts.push_back(fmt::format("{:.1f}deg", deg_from_rad(angle)));
    return fmt::format("[{}]", fmt::join(texts, ", "));
  };
  std::string text = fmt::format("start: {}\nprogram:\n", list(program.start_rad));
  for (const ArmStep& step : program.steps) {
    if (step.task == ArmTask::move)
      text += fmt::format("  - move: {}\n", list(step.to_rad));
    else if (step.task == ArmTask::hold)
      text += fmt::format("  - hold: {:g}s\n", step.duration_s);
    else
      throw UsageError({.place = "program",
                        .expected = "moves and holds",
                        .found = std::string(name(step.task))});
  }
  return text;
}

}  // namespace torsio
