#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "torsio/link/joint_connection.hpp"
#include "torsio/realtime/recorder.hpp"

/// Telemetry of a joint into a file whose ending names the format, with the channels' own names. It is first written as
/// a recorder's file (.tsr), which is complete up to the last tenth of a second however the program ends, and then converted.
class TelemetryFile {
 public:
  struct Summary {
    std::size_t frames = 0;
    std::size_t missing = 0;  ///< ticks without a frame, up to the last one
    std::vector<std::string> channels = {};
    double rate_Hz = 0.0;
  };

  /// Subscribes. @param channels empty: all whose name ends in an SI unit; others are named in a remark
  /// @throws torsio::Error if the joint refuses or the file cannot be written
  TelemetryFile(torsio::JointConnection& joint, const std::vector<std::string>& channels,
                double rate_Hz, const std::string& path);

  void add(const torsio::LinkTelemetry& telemetry);
  /// The disk does not take the frames any more.
  [[nodiscard]] bool has_dropped() const { return recorder_->dropped() > 0; }
  /// Completes the file. @throws torsio::Error with the name of the recorder's file, which remains, if that cannot be done
  Summary close();

 private:
  std::string path_;
  std::string recorded_;  ///< the recorder's file
  torsio::JointConnection::Subscription subscription_;
  std::unique_ptr<torsio::Recorder> recorder_;
  std::optional<std::uint64_t> first_ns_ = {};
  std::int64_t last_tick_ = -1;
  std::vector<double> values_ = {};
};
