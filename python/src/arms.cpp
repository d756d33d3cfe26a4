#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "arm_rows.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio::python {
namespace {

Vector3 vector_of(const py::handle& object, const std::string& name) {
  const JointRows rows(object, 3, name);
  if (rows.size() != 1)
    throw UsageError({.place = name, .expected = "three numbers", .found = kind_of(object)});
  Vector3 vector{};
  std::ranges::copy(rows.row(0), vector.begin());
  return vector;
}

/// The rigid-body dynamics of an arm as Python holds them.
class Arm {
 public:
  explicit Arm(ArmModel model) : model_(std::move(model)), dynamics_(model_) {}

  [[nodiscard]] std::size_t size() const noexcept { return dynamics_.size(); }
  [[nodiscard]] const std::string& name() const noexcept { return model_.name; }
  [[nodiscard]] std::vector<std::string> joints() const {
    std::vector<std::string> names;
    names.reserve(size());
    for (const ArmJoint& joint : model_.joints) names.push_back(joint.name);
    return names;
  }
  /// @param limit of a joint
  template <class Limit>
  [[nodiscard]] py::array_t<double> limits(Limit limit) const {
    py::array_t<double> of(static_cast<py::ssize_t>(size()));
    for (std::size_t j = 0; j < size(); ++j) of.mutable_at(j) = limit(model_.joints[j]);
    return of;
  }

  void set_payload(double mass_kg, const py::object& com_m, const py::object& inertia_kg_m2) {
    BodyInertia payload{.mass_kg = mass_kg};
    if (!com_m.is_none()) payload.com_m = vector_of(com_m, "com_m");
    if (!inertia_kg_m2.is_none()) {
      const JointRows moments(inertia_kg_m2, 6, "inertia_kg_m2");
      if (moments.size() != 1)
        throw UsageError({.place = "inertia_kg_m2",
                          .expected = "six numbers: xx, yy, zz, xy, xz, yz",
                          .found = kind_of(inertia_kg_m2)});
      std::ranges::copy(moments.row(0), payload.inertia_kg_m2.begin());
    }
    if (!is_possible_payload(payload) || !dynamics_.set_payload(payload))
      throw UsageError({.place = "Arm.set_payload",
                        .expected = "a mass of 0 or more, finite numbers, moments of inertia that "
                                    "are not negative",
                        .found = "others"});
    model_.payload = payload;
  }
  void set_gravity(const py::object& gravity_m_s2) {
    const Vector3 gravity = vector_of(gravity_m_s2, "gravity_m_s2");
    if (!dynamics_.set_gravity(gravity))
      throw UsageError(
          {.place = "gravity_m_s2", .expected = "finite numbers", .found = "not a number"});
    model_.gravity_m_s2 = gravity;
  }

  [[nodiscard]] py::object gravity(const py::object& angle_rad) const {
    return of_poses(angle_rad, {joints_axis()},
                    [this](auto q, auto out) { dynamics_.gravity_torque(q, out); });
  }
  [[nodiscard]] py::object mass_matrix(const py::object& angle_rad) const {
    return of_poses(angle_rad, {joints_axis(), joints_axis()},
                    [this](auto q, auto out) { dynamics_.mass_matrix(q, out); });
  }
  [[nodiscard]] py::object jacobian(const py::object& angle_rad) const {
    return of_poses(angle_rad, {6, joints_axis()},
                    [this](auto q, auto out) { static_cast<void>(dynamics_.jacobian(q, out)); });
  }
  /// @param link none: the flange
  [[nodiscard]] py::object frame(const py::object& angle_rad,
                                 std::optional<std::size_t> link) const {
    if (link && *link >= size())
      throw UsageError({.place = "Arm.frame",
                        .expected = "a link from 0 to " + std::to_string(size() - 1),
                        .found = std::to_string(*link)});
    return of_poses(angle_rad, {4, 4}, [this, link](auto q, auto out) {
      const ArmFrame at = link ? dynamics_.link(*link, q) : dynamics_.flange(q);
      for (std::size_t row = 0; row < 3; ++row) {
        std::copy_n(at.rotation.begin() + 3 * row, 3, out.begin() + 4 * row);
        out[4 * row + 3] = at.position_m[row];
        out[12 + row] = 0.0;
      }
      out[15] = 1.0;
    });
  }
  [[nodiscard]] py::object inverse(const py::object& angle_rad, const py::object& speed_rad_s,
                                   const py::object& acceleration_rad_s2) const {
    return of_motion(
        angle_rad, {speed_rad_s, "speed_rad_s"}, {acceleration_rad_s2, "acceleration_rad_s2"},
        [this](auto q, auto qd, auto qdd, auto out) { dynamics_.inverse(q, qd, qdd, out); });
  }
  [[nodiscard]] py::object forward(const py::object& angle_rad, const py::object& speed_rad_s,
                                   const py::object& torque_Nm) const {
    return of_motion(
        angle_rad, {speed_rad_s, "speed_rad_s"}, {torque_Nm, "torque_Nm"},
        [this](auto q, auto qd, auto tau, auto out) { dynamics_.forward(q, qd, tau, out); });
  }

 private:
  using Named = std::pair<const py::object&, const char*>;

  [[nodiscard]] py::ssize_t joints_axis() const noexcept {
    return static_cast<py::ssize_t>(size());
  }
  template <class Of>
  [[nodiscard]] py::object of_poses(const py::object& angle_rad, const Shape& tail, Of of) const {
    const JointRows q(angle_rad, size(), "angle_rad");
    const RowsOut out(q.leading(), tail);
    {
      const py::gil_scoped_release unlocked;
      for (std::size_t row = 0; row < q.size(); ++row) of(q.row(row), out.row(row));
    }
    return out.array;
  }
  template <class Of>
  [[nodiscard]] py::object of_motion(const py::object& angle_rad, Named first, Named second,
                                     Of of) const {
    const JointRows q(angle_rad, size(), "angle_rad");
    const JointRows a(first.first, size(), first.second);
    const JointRows b(second.first, size(), second.second);
    a.require_like(q, first.second);
    b.require_like(q, second.second);
    const RowsOut out(q.leading(), {joints_axis()});
    {
      const py::gil_scoped_release unlocked;
      for (std::size_t row = 0; row < q.size(); ++row)
        of(q.row(row), a.row(row), b.row(row), out.row(row));
    }
    return out.array;
  }

  ArmModel model_;
  ArmDynamics dynamics_;
};

}  // namespace
}  // namespace torsio::python

template <>
struct pybind11::detail::type_caster<torsio::python::Arm> : InitialisedCaster<torsio::python::Arm> {
};

namespace torsio::python {
namespace {

std::unique_ptr<Arm> arm_of(const py::object& arm) {
  const std::string file = path_text(arm);
  if (file == kReadyArm) return std::make_unique<Arm>(arm6_setup().arm);
  return std::make_unique<Arm>(
      interruptible([&](const Progress& progress) { return read_arm(file, progress); }).arm);
}

std::unique_ptr<Arm> arm_from_urdf(const py::object& file) {
  return std::make_unique<Arm>(read_urdf_file(path_text(file)));
}

}  // namespace

void bind_arms(py::module_& module) {
  py::class_<Arm>(
      module, "Arm",
      "The rigid-body dynamics of a serial arm: M(q) a + c(q, v) + g(q) = tau + J(q)^T f.\n\n"
      "Arm('arm6') is the arm of paper 000, Arm('my_arm.yaml') an arm of a file "
      "(docs/robot/arm.md) "
      "with its payload, Arm.from_urdf('my_arm.urdf') links and joints alone.\n\n"
      "Angles, speeds and torques have shape (..., joints): one pose, or as many as there are, "
      "which "
      "are computed without the interpreter's lock. What is not finite gives NaN.")
      .def(py::init(&arm_of), py::arg("arm") = kReadyArm)
      .def_static("from_urdf", &arm_from_urdf, py::arg("file"))
      .def("__len__", &Arm::size)
      .def_property_readonly("name", &Arm::name)
      .def_property_readonly("joints", &Arm::joints, "The names of the joints, from the base on.")
      .def_property_readonly(
          "lowest_rad",
          [](const Arm& arm) { return arm.limits([](const auto& of) { return of.lowest_rad; }); })
      .def_property_readonly(
          "highest_rad",
          [](const Arm& arm) { return arm.limits([](const auto& of) { return of.highest_rad; }); })
      .def_property_readonly(
          "speed_rad_s",
          [](const Arm& arm) { return arm.limits([](const auto& of) { return of.speed_rad_s; }); })
      .def_property_readonly(
          "effort_Nm",
          [](const Arm& arm) { return arm.limits([](const auto& of) { return of.effort_Nm; }); })
      .def("set_payload", &Arm::set_payload, py::arg("mass_kg"), py::arg("com_m") = py::none(),
           py::arg("inertia_kg_m2") = py::none(),
           "What the arm carries, in the frame of the flange; inertia xx, yy, zz, xy, xz, yz about "
           "the centre of mass.")
      .def("set_gravity", &Arm::set_gravity, py::arg("gravity_m_s2"),
           "In the frame of the base: (0, 0, -9.81) if it is level.")
      .def("gravity", &Arm::gravity, py::arg("angle_rad"), "g(q) [Nm], (..., joints).")
      .def("mass_matrix", &Arm::mass_matrix, py::arg("angle_rad"),
           "M(q) [kg m2], (..., joints, joints).")
      .def("jacobian", &Arm::jacobian, py::arg("angle_rad"),
           "J(q) of the flange in the frame of the base, (..., 6, joints): velocity, then angular "
           "velocity.")
      .def("frame", &Arm::frame, py::arg("angle_rad"), py::arg("link") = py::none(),
           "The flange, or a link by its number, in the frame of the base: (..., 4, 4).")
      .def("inverse", &Arm::inverse, py::arg("angle_rad"), py::arg("speed_rad_s"),
           py::arg("acceleration_rad_s2"), "The torques of a motion [Nm], (..., joints).")
      .def("forward", &Arm::forward, py::arg("angle_rad"), py::arg("speed_rad_s"),
           py::arg("torque_Nm"), "The accelerations under torques [rad/s2], (..., joints).");
  bind_arm_simulation(module);
}

}  // namespace torsio::python
