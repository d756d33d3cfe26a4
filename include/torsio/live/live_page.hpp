#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "torsio/live/web_server.hpp"

namespace torsio {

/// A page on this machine that shows what joints do, in a browser: time series, the hysteresis loop, estimates with their standard
/// deviations beside the measured torque. A thread of its own serves it; nothing that a browser does, or does not do, slows a caller.
///
///     LivePage page({.rate_Hz = 1000.0, .joints = {{.id = 1, .name = "joint", .channels = {"torque_Nm"}}}});
///     std::puts(page.url().c_str());
///     while (...) {
///       page.add(0, sample, values);                         // at rate_Hz
///       page.flush();                                        // at 60 Hz
///       for (const LivePage::Request& each : page.take_requests()) ...
///     }
///
/// Whoever has the token of the URL can open the page and make requests; pages of other origins are refused, also with the token.
/// One page is connected at a time: a second one is refused with the reason, and shows it.
class LivePage {
 public:
  struct Model {
    std::string name = {};
    std::string target = {};  ///< channel that it estimates
    bool is_on = true;
  };
  struct Joint {
    std::uint8_t id = 0;
    std::string name = {};
    std::string actuator = {};
    std::vector<std::string> channels = {};  ///< telemetry
    std::vector<Model> models = {};  ///< each has two more values: estimate and standard deviation
    /// Values of a sample: those of the channels, then two for each model.
    [[nodiscard]] std::size_t values() const noexcept {
      return channels.size() + 2 * models.size();
    }
  };
  struct Settings {
    WebServer::Settings server =
        {};                  ///< address, port and limits; its files and endpoints are replaced
    std::string token = {};  ///< empty: a random one of 128 bits
    double rate_Hz = 1000.0;
    std::string reference = "truth_torque_Nm";  ///< channel of the torque that is measured
    std::vector<Joint> joints = {};
  };
  /// What the page asks for; the caller does it.
  struct Request {
    enum class Kind : std::uint8_t { begin_recording, end_recording, switch_model };
    Kind kind = Kind::begin_recording;
    std::size_t joint = 0;  ///< index of the joint with the model
    std::size_t model = 0;
    bool is_on = false;
  };
  struct JointStatus {
    std::string state = {};    ///< state of the drive
    std::string monitor = {};  ///< empty: unknown
    bool is_silent = false;
    std::uint64_t lost = 0;         ///< samples
    std::vector<bool> models = {};  ///< whether they are on
  };
  struct Status {
    std::string trouble =
        {};  ///< why the last recording was not begun, or has ended; empty: no reason
    std::vector<std::string> recorded_files = {};  ///< empty: nothing is recorded
    double recorded_s = 0.0;
    std::vector<JointStatus> joints = {};
  };
  struct Counts {
    std::uint64_t pages = 0;  ///< that were connected
    std::uint64_t refused =
        0;  ///< another page, or a message that is not one of the page; wrong tokens: `server`
    std::uint64_t messages_B = 0;  ///< messages with samples, given to the server
    WebServer::Counts server = {};
  };

  /// @throws Error as `WebServer`; if no joint or no rate is given
  explicit LivePage(Settings settings);
  ~LivePage();
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  /// "http://127.0.0.1:8080/?token=..."
  [[nodiscard]] std::string url() const;
  /// Adds a sample of a joint. @param number counts at `rate_Hz`, from about the same beginning for all joints; what is left out is shown
  /// as a gap, and an older one than the last is ignored. @param values as `Joint::values` counts them
  void add(std::size_t joint, std::uint64_t number, std::span<const double> values);
  /// Sends what was added since the last time, if a page is connected.
  void flush();
  void show(const Status& status);
  [[nodiscard]] std::vector<Request> take_requests();
  [[nodiscard]] bool is_connected() const;
  [[nodiscard]] Counts counts() const;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace torsio
