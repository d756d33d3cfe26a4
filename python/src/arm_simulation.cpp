#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "arm_rows.hpp"
#include "estimators.hpp"
#include "sim/arm/arm_session.hpp"
#include "torsio/arm/contacts_file.hpp"
#include "torsio/sim/arm/arm_run.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio::python {
namespace {

constexpr const char* kStep = "ArmSimulation.step";

/// Simulated arms under their controllers, one per row, in ticks of a millisecond.
class ArmSimulation {
 public:
  ArmSimulation(ArmSetup setup, ArmController::Settings settings, std::size_t rows,
                std::uint64_t seed, bool has_rigid_gears, std::vector<double> start_rad)
      : setup_(std::move(setup)),
        settings_(std::move(settings)),
        form_(has_rigid_gears ? FirstStageForm::rigid : FirstStageForm::elastic),
        start_rad_(std::move(start_rad)),
        seed_(seed),
        rows_(rows) {}

  /// Opens the brakes of all rows. @throws Error, Cancelled
  void start(const Progress& progress) {
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      if (progress && !progress(static_cast<double>(row) / static_cast<double>(size()), "start"))
        throw Cancelled();
      begin(row);
    }
  }

  [[nodiscard]] std::size_t size() const noexcept { return rows_.size(); }
  [[nodiscard]] std::size_t joints() const noexcept { return setup_.joints.size(); }

  py::dict step(const py::object& position_rad, const py::object& speed_rad_s,
                const py::object& acceleration_rad_s2, const py::object& torque_Nm,
                const py::object& force_N, bool guided) {
    const InUse in_use(is_in_use_);
    const auto position = given(position_rad, joints(), "position_rad");
    const auto speed = given(speed_rad_s, joints(), "speed_rad_s");
    const auto acceleration = given(acceleration_rad_s2, joints(), "acceleration_rad_s2");
    const auto torque = given(torque_Nm, joints(), "torque_Nm");
    const auto force = given(force_N, 3, "force_N");
    if (int{position.has_value()} + int{torque.has_value()} + int{guided} != 1)
      throw UsageError({.place = kStep,
                        .expected = "one of position_rad, torque_Nm and guided=True",
                        .found = "none, or several"});
    Outputs out(size(), joints());
    {
      const py::gil_scoped_release unlocked;
      for (std::size_t row = 0; row < size(); ++row) {
        ArmReference reference;
        if (torque) {
          reference.mode = ArmMode::joints;
          for (std::size_t j = 0; j < joints(); ++j)
            reference.joints[j] = {.mode = JointMode::torque, .torque_Nm = torque->row(row)[j]};
        } else if (guided) {
          reference.mode = ArmMode::guiding;
        } else {
          copy(position, row, reference.position_rad);
          copy(speed, row, reference.velocity_rad_s);
          copy(acceleration, row, reference.acceleration_rad_s2);
        }
        ArmLoad load;
        copy(force, row, load.force_N);
        ArmSession& arm = *rows_[row];
        const ArmController::Output& output = arm.control(reference);
        out.set(row, output, arm.bench());
        arm.act(load);
      }
    }
    return std::move(out).result();
  }

  void reset(const py::object& mask) {
    const InUse in_use(is_in_use_);
    const py::array_t<bool> chosen = rows_of(mask, "ArmSimulation.reset");
    interruptible([&](const Progress& progress) {
      for (std::size_t row = 0; row < size(); ++row) {
        if (!progress(0.0, "reset")) throw Cancelled();
        if (chosen.data()[row]) begin(row);
      }
      return 0;
    });
  }
  void end_reaction(const py::object& mask) {
    const InUse in_use(is_in_use_);
    const py::array_t<bool> chosen = rows_of(mask, "ArmSimulation.end_reaction");
    for (std::size_t row = 0; row < size(); ++row)
      if (chosen.data()[row]) rows_[row]->controller().end_reaction();
  }

 private:
  /// What a step gives, as arrays.
  class Outputs {
   public:
    Outputs(std::size_t rows, std::size_t joints)
        : shape_{static_cast<py::ssize_t>(rows)},
          per_joint_{static_cast<py::ssize_t>(joints)},
          contact_(shape_[0]),
          stopped_(shape_[0]) {}

    void set(std::size_t row, const ArmController::Output& output, const ArmBench& bench) {
      for (std::size_t j = 0; j < static_cast<std::size_t>(per_joint_[0]); ++j) {
        const ArmController::JointOutput& of = output.joints[j];
        angle_.row(row)[j] = bench.samples()[j].joint_angle_rad;
        speed_.row(row)[j] = of.speed_rad_s;
        torque_.row(row)[j] = of.torque.value;
        torque_std_.row(row)[j] = of.torque.std_dev;
        external_.row(row)[j] = of.external_Nm;
        external_std_.row(row)[j] = of.external_std_Nm;
        true_torque_.row(row)[j] = bench.plant().torques(j).joint_Nm;
        true_external_.row(row)[j] = bench.plant().external_torque(j);
      }
      contact_.mutable_data()[row] = output.contact.is_found;
      stopped_.mutable_data()[row] = output.cause != ArmStopCause::none;
    }
    [[nodiscard]] py::dict result() && {
      using namespace py::literals;
      return py::dict("joint_angle_rad"_a = angle_.array, "joint_speed_rad_s"_a = speed_.array,
                      "torque_Nm"_a = torque_.array, "torque_std_dev_Nm"_a = torque_std_.array,
                      "external_torque_Nm"_a = external_.array,
                      "external_torque_std_dev_Nm"_a = external_std_.array,
                      "truth_torque_Nm"_a = true_torque_.array,
                      "truth_external_torque_Nm"_a = true_external_.array,
                      "is_contact"_a = contact_, "is_stopped"_a = stopped_);
    }

   private:
    Shape shape_;
    Shape per_joint_;
    RowsOut angle_{shape_, per_joint_};
    RowsOut speed_{shape_, per_joint_};
    RowsOut torque_{shape_, per_joint_};
    RowsOut torque_std_{shape_, per_joint_};
    RowsOut external_{shape_, per_joint_};
    RowsOut external_std_{shape_, per_joint_};
    RowsOut true_torque_{shape_, per_joint_};
    RowsOut true_external_{shape_, per_joint_};
    py::array_t<bool> contact_;
    py::array_t<bool> stopped_;
  };

  void begin(std::size_t row) {
    rows_[row] = std::make_unique<ArmSession>(
        setup_, settings_, form_, std::span<const FaultSchedule>{}, seed_ + row, start_rad_);
    rows_[row]->open_brakes();
  }
  [[nodiscard]] std::optional<JointRows> given(const py::object& object, std::size_t width,
                                               const std::string& name) const {
    if (object.is_none()) return {};
    JointRows rows(object, width, name);
    if (rows.leading() == Shape{static_cast<py::ssize_t>(size())}) return rows;
    throw UsageError({.place = std::string(kStep) + ": " + name,
                      .expected = "shape (" + std::to_string(size()) + ", " +
                                  std::to_string(width) + "), one row per arm",
                      .found = kind_of(object)});
  }
  [[nodiscard]] py::array_t<bool> rows_of(const py::object& mask, const std::string& place) const {
    if (mask.is_none()) {
      py::array_t<bool> all(static_cast<py::ssize_t>(size()));
      std::fill_n(all.mutable_data(), size(), true);
      return all;
    }
    const auto flags = py::array::ensure(mask);
    if (!flags || flags.ndim() != 1 || flags.dtype().kind() != 'b' ||
        flags.shape(0) != static_cast<py::ssize_t>(size())) {
      PyErr_Clear();
      throw UsageError(
          {.place = place,
           .expected = "a mask of shape (" + std::to_string(size()) + ",) and type bool",
           .found = kind_of(mask)});
    }
    return py::array_t<bool, py::array::c_style>(flags);
  }
  template <class To>
  static void copy(const std::optional<JointRows>& from, std::size_t row, To& to) {
    if (from) std::ranges::copy(from->row(row), to.begin());
  }

  ArmSetup setup_;
  ArmController::Settings settings_;
  FirstStageForm form_;
  std::vector<double> start_rad_;
  std::uint64_t seed_;
  std::vector<std::unique_ptr<ArmSession>> rows_;
  std::atomic<bool> is_in_use_ = false;
};

}  // namespace
}  // namespace torsio::python

template <>
struct pybind11::detail::type_caster<torsio::python::ArmSimulation>
    : InitialisedCaster<torsio::python::ArmSimulation> {};

namespace torsio::python {
namespace {

ContactReaction reaction_of(const std::string& word) {
  std::vector<std::string> words;
  for (const ContactReaction reaction :
       {ContactReaction::none, ContactReaction::stop, ContactReaction::hold,
        ContactReaction::retract, ContactReaction::floating}) {
    if (word == name(reaction)) return reaction;
    words.emplace_back(name(reaction));
  }
  throw UsageError({.place = "reaction",
                    .expected = "none, stop, hold, retract or float",
                    .found = "'" + word + "'"});
}

std::unique_ptr<ArmSimulation> simulation_of(const py::object& arm, std::size_t rows,
                                             std::uint64_t seed, bool rigid_gears,
                                             const py::object& start_rad,
                                             const py::object& contacts,
                                             const std::string& reaction) {
  constexpr std::size_t kMaxRows = 100'000;
  if (rows < 1 || rows > kMaxRows)
    throw UsageError({.place = "rows",
                      .expected = "1 to " + std::to_string(kMaxRows),
                      .found = std::to_string(rows)});
  const std::string file = path_text(arm);
  const bool is_ready_arm = file == kReadyArm;
  ArmSetup setup = is_ready_arm ? arm6_setup() : interruptible([&](const Progress& progress) {
    return read_arm(file, progress);
  });
  require_carriable(setup, file);
  std::vector<double> start(setup.joints.size(), 0.0);
  if (!start_rad.is_none()) {
    const JointRows pose(start_rad, start.size(), "start_rad");
    if (pose.size() != 1)
      throw UsageError({.place = "start_rad", .expected = "one pose", .found = kind_of(start_rad)});
    std::ranges::copy(pose.row(0), start.begin());
  } else if (is_ready_arm) {
    start = arm6_program().start_rad;
  }
  ArmController::Settings settings = arm_controller_settings(setup);
  settings.reaction = reaction_of(reaction);
  if (!contacts.is_none()) {
    const std::string path = path_text(contacts);
    const ContactsFile learned = read_contacts(path);
    require_contacts_of(learned, setup.arm, settings.observer.bandwidth_rad_s, path);
    settings.contacts = learned.settings();
  } else if (settings.reaction != ContactReaction::none) {
    throw UsageError({.place = "reaction",
                      .expected = "contacts, a file of `torsio arm learn-contacts`",
                      .found = "None"});
  }
  auto simulation = std::make_unique<ArmSimulation>(std::move(setup), std::move(settings), rows,
                                                    seed, rigid_gears, std::move(start));
  interruptible([&](const Progress& progress) {
    simulation->start(progress);
    return 0;
  });
  return simulation;
}

}  // namespace

void bind_arm_simulation(py::module_& module) {
  py::class_<ArmSimulation>(
      module, "ArmSimulation",
      "Simulated arms of series-elastic joints under their controllers, one per row, which are "
      "stepped together: for learning.\n\n"
      "ArmSimulation('arm6', rows=64, seed=1); arm: 'arm6' or a YAML file (docs/robot/arm.md). Row "
      "n "
      "has the noise of seed + n. The brakes are open when it is made. contacts: a file of `torsio "
      "arm "
      "learn-contacts`, with which contacts are found; reaction: none, stop, hold, retract, float.")
      .def(py::init(&simulation_of), py::arg("arm") = kReadyArm, py::kw_only(), py::arg("rows") = 1,
           py::arg("seed") = 1, py::arg("rigid_gears") = true, py::arg("start_rad") = py::none(),
           py::arg("contacts") = py::none(), py::arg("reaction") = "none")
      .def("__len__", &ArmSimulation::size)
      .def("step", &ArmSimulation::step, py::kw_only(), py::arg("position_rad") = py::none(),
           py::arg("speed_rad_s") = py::none(), py::arg("acceleration_rad_s2") = py::none(),
           py::arg("torque_Nm") = py::none(), py::arg("force_N") = py::none(),
           py::arg("guided") = false,
           "One millisecond of every arm: angles of the links (with speeds and accelerations), "
           "torques of the springs, or hand guiding; force_N acts on the flange, in the frame of "
           "the "
           "base.\n\n"
           "Inputs and results have shape (rows, joints), forces (rows, 3), is_contact and "
           "is_stopped "
           "(rows,). A position that is more than 0.05 rad from the arm when it begins is refused: "
           "the "
           "arm holds.")
      .def("reset", &ArmSimulation::reset, py::arg("mask") = py::none(),
           "Begins again at the start, in all rows or where the mask is True.")
      .def("end_reaction", &ArmSimulation::end_reaction, py::arg("mask") = py::none(),
           "The arm follows its references again after a contact.");
}

}  // namespace torsio::python
