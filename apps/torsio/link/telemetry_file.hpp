#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "torsio/link/joint_connection.hpp"
#include "torsio/realtime/recorder.hpp"

struct TelemetrySummary {
  std::size_t frames = 0;
  std::size_t missing = 0;  ///< ticks without a frame, up to the last one
  std::size_t bridged = 0;  ///< such ticks in short gaps, which were bridged
  std::vector<std::string> channels = {};
  double rate_Hz = 0.0;
};
/// "run.csv: 15000 samples of 21 channels at 1000 Hz, 20 of which did not arrive: 15 are bridged, 5 are nan"
[[nodiscard]] std::string text_of(const std::string& path, const TelemetrySummary& summary);

/// Telemetry of a joint into a file whose ending names the format, with the channels' own names. It is first written as
/// a recorder's file (.tsr), which is complete up to the last tenth of a second however the program ends, and then converted.
class TelemetryFile {
 public:
  /// Refuses a path that cannot be written, or whose ending is none of the formats. Before a joint is asked for anything.
  static void check(const std::string& path);
  /// The channels that can be recorded: those whose name ends in an SI unit; others are named in a remark.
  [[nodiscard]] static std::vector<std::string> recorded(const std::vector<std::string>& channels);

  /// @param bridge_s longest gap that `close` bridges (`bridge_lost_samples`); not in a .tsr file
  /// @throws torsio::Error if the file cannot be written
  TelemetryFile(torsio::JointConnection::Subscription subscription, const std::string& path,
                double bridge_s);

  void add(const torsio::LinkTelemetry& telemetry);
  /// The disk does not take the frames any more.
  [[nodiscard]] bool has_dropped() const { return recorder_->dropped() > 0; }
  /// Completes the file. @throws torsio::Error with the name of the recorder's file, which remains, if that cannot be done
  TelemetrySummary close();

 private:
  void remove_recorded() const;

  std::string path_;
  double bridge_s_;
  std::string recorded_;  ///< the recorder's file
  torsio::JointConnection::Subscription subscription_;
  std::unique_ptr<torsio::Recorder> recorder_;
  std::optional<std::uint64_t> first_ns_ = {};
  std::int64_t first_tick_ = 0;  ///< tick at `first_ns_`
  std::int64_t last_tick_ = -1;
  std::uint64_t last_ns_ = 0;
  std::vector<double> values_ = {};
};
