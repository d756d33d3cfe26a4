#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "rows.hpp"
#include "torsio/core/random.hpp"
#include "torsio/data/load.hpp"

namespace torsio::bench {
namespace {

constexpr std::size_t kRows = 1000000;

// Eight columns at 1 kHz with the usual number of digits; the angles are converted.
void write_log(const std::filesystem::path& file) {
  Random random(1);
  std::string text =
      "t_s,motor_angle_deg,gear_angle_deg,joint_angle_deg,motor_current_A,joint_speed_rad_s,"
      "temperature_degC,torque_Nm\n";
  for (std::size_t i = 0; i < kRows; ++i) {
    const double t_s = 1e-3 * static_cast<double>(i);
    const double angle_deg = 40.0 * std::sin(0.7 * t_s) + 1e-3 * random.normal();
    const double torque_Nm = 30.0 * std::sin(0.7 * t_s + 0.1) + 0.05 * random.normal();
    fmt::format_to(
        std::back_inserter(text), "{:.3f},{:.4f},{:.5f},{:.5f},{:.5f},{:.6f},{:.2f},{:.4f}\n", t_s,
        100.0 * angle_deg, angle_deg + 0.1 * torque_Nm, angle_deg, 0.11 * torque_Nm,
        0.5 * std::cos(0.7 * t_s) + 0.01 * random.normal(), 31.0 + 1e-3 * t_s, torque_Nm);
  }
  std::ofstream out(file, std::ios::binary);
  out.exceptions(std::ios::failbit | std::ios::badbit);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
}

void read_once(const std::filesystem::path& file, std::vector<char>& block) {
  std::ifstream in;
  in.rdbuf()->pubsetbuf(nullptr, 0);  // straight into `block`
  in.open(file, std::ios::binary);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  while (in) in.read(block.data(), static_cast<std::streamsize>(block.size()));
}

}  // namespace

// As for a user: parsed, checked, hashed (SHA-256), converted to SI.
Row csv_load() {
  const std::filesystem::path file = scratch_folder() / "log.csv";
  write_log(file);
  const double megabytes = 1e-6 * static_cast<double>(std::filesystem::file_size(file));
  const double seconds = best_seconds([&] {
    if (load_recordings(file.string()).at(0).size() != kRows)
      throw std::runtime_error("csv_load: rows are missing");
  });
  std::vector<char> block(std::size_t{256} << 10);
  const double reading_s = best_seconds([&] { read_once(file, block); });
  return {.value = megabytes / seconds, .unit = "MB/s", .floor = megabytes / reading_s};
}

}  // namespace torsio::bench
