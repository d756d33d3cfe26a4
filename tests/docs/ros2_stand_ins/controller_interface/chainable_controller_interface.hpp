#pragma once

// What docs/robot/ros2_control.md uses from ROS 2, with declarations of our own: enough to compile the controller, nothing
// to run it. They show that its calls of torsio are right, not that ROS 2 has these names.

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace rclcpp {
class Time {
 public:
  [[nodiscard]] double seconds() const;
};
class Duration {};
class Logger {};
class Parameter {
 public:
  [[nodiscard]] std::string as_string() const;
};
}  // namespace rclcpp

namespace rclcpp_lifecycle {
class State {};
class LifecycleNode {
 public:
  [[nodiscard]] const char* get_name() const;
  [[nodiscard]] rclcpp::Logger get_logger() const;
  [[nodiscard]] rclcpp::Parameter get_parameter(const std::string& name) const;
};
}  // namespace rclcpp_lifecycle

void log_error(const rclcpp::Logger& logger, const char* format, ...);
#define RCLCPP_ERROR(logger, ...) log_error(logger, __VA_ARGS__)

namespace hardware_interface {
class StateInterface {
 public:
  StateInterface(const std::string& prefix, const std::string& name, double* value);
};
class CommandInterface {};
class LoanedStateInterface {
 public:
  [[nodiscard]] std::optional<double> get_optional() const;
};
}  // namespace hardware_interface

namespace controller_interface {

enum class CallbackReturn { SUCCESS, FAILURE, ERROR };
enum class return_type { OK, ERROR };
enum class interface_configuration_type { ALL, INDIVIDUAL, NONE };
struct InterfaceConfiguration {
  interface_configuration_type type;
  std::vector<std::string> names;
};

class ChainableControllerInterface {
 public:
  virtual ~ChainableControllerInterface() = default;
  virtual CallbackReturn on_init() = 0;
  [[nodiscard]] virtual InterfaceConfiguration command_interface_configuration() const = 0;
  [[nodiscard]] virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual CallbackReturn on_configure(const rclcpp_lifecycle::State& before);
  virtual CallbackReturn on_activate(const rclcpp_lifecycle::State& before);
  virtual return_type update_reference_from_subscribers(const rclcpp::Time& time,
                                                        const rclcpp::Duration& period) = 0;
  virtual return_type update_and_write_commands(const rclcpp::Time& time,
                                                const rclcpp::Duration& period) = 0;

 protected:
  virtual std::vector<hardware_interface::CommandInterface> on_export_reference_interfaces();
  virtual std::vector<hardware_interface::StateInterface> on_export_state_interfaces();
  template <class Value>
  Value auto_declare(const std::string& name, const Value& value);
  [[nodiscard]] std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() const;
  [[nodiscard]] unsigned get_update_rate() const;

  std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;
};

}  // namespace controller_interface
