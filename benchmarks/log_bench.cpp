#include <fmt/format.h>
#include <matio.h>

#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "rows.hpp"
#include "torsio/core/random.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/write.hpp"

namespace torsio::bench {
namespace {

constexpr std::size_t kSamples = 500000;

/// Seven noisy channels at 1 kHz.
Recording joint_log() {
  Random random(1);
  Recording recording("log", 1000.0);
  for (const char* name : {"motor_angle_rad", "gear_angle_rad", "joint_angle_rad",
                           "motor_current_A", "joint_speed_rad_s", "temperature_K", "torque_Nm"}) {
    Channel channel{.name = name, .values = {}};
    for (std::size_t i = 0; i < kSamples; ++i)
      channel.values.push_back(std::sin(7e-4 * static_cast<double>(i)) + 1e-3 * random.normal());
    recording.add(std::move(channel));
  }
  return recording;
}

/// @param bytes of the numbers that are read
Row rate_of_loading(const std::string& file, double bytes) {
  const double seconds = best_seconds([&] {
    if (load_recordings(file).at(0).size() != kSamples)
      throw std::runtime_error(file + ": samples are missing");
  });
  return {.value = 1e-6 * bytes / seconds, .unit = "MB/s"};
}

struct CloseMat {
  void operator()(mat_t* file) const noexcept { Mat_Close(file); }
};

/// As MATLAB's `save -v7`: packed by zlib.
void write_packed(const Recording& recording, const std::string& path) {
  const std::unique_ptr<mat_t, CloseMat> file(Mat_CreateVer(path.c_str(), nullptr, MAT_FT_MAT5));
  const auto write = [&](const std::string& name, std::vector<double> values) {
    std::array<std::size_t, 2> sizes{values.size(), 1};
    matvar_t* const made =
        Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, sizes.data(), values.data(), 0);
    const bool is_written =
        made != nullptr && Mat_VarWrite(file.get(), made, MAT_COMPRESSION_ZLIB) == 0;
    Mat_VarFree(made);
    if (!is_written) throw std::runtime_error(path + ": cannot be written");
  };
  std::vector<double> clock;
  for (std::size_t i = 0; i < recording.size(); ++i) clock.push_back(recording.time_s(i));
  write("t_s", std::move(clock));
  for (const Channel& channel : recording.channels()) write(channel.name, channel.values);
}

}  // namespace

// Messages of seven numbers in chunks packed by zstd: unpacked, decoded, checked, hashed.
Row mcap_read() {
  constexpr double kMessageBytes = 20.0 + 8.0 * 8.0;  // head and stamp, then t_s and the channels
  const std::string file = (scratch_folder() / "log.mcap").string();
  write_recording(joint_log(), file);
  return rate_of_loading(file, kMessageBytes * kSamples);
}

Row mat_read() {
  const std::string file = (scratch_folder() / "log.mat").string();
  write_recording(joint_log(), file);
  return rate_of_loading(file, 8.0 * 8.0 * kSamples);
}

Row mat_read_v7() {
  const std::string file = (scratch_folder() / "log_v7.mat").string();
  write_packed(joint_log(), file);
  return rate_of_loading(file, 8.0 * 8.0 * kSamples);
}

}  // namespace torsio::bench
