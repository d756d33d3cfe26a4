// The commands of docs/link_tour.md: from a joint on a bench, over its link, to torque control with a model of its spring.
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "program/program.hpp"

namespace torsio::test {
namespace {

using Json = nlohmann::json;

/// With T as the program.
constexpr const char* kTour = R"sh(
L="--port 38001 --host-port 38000"
I="spring_deflection_rad, lowpass(rate(spring_deflection_rad), 10Hz), lowpass(rate(joint_angle_rad), 10Hz)"
$T joint dfki-50#03 $L --watchdog 2s --vertical-axis --link-mass 300kg --link-length 1m >joint.txt 2>&1 &
JOINT=$!
trap "kill $JOINT" EXIT
ready() {
  for n in $(seq 100); do
    $T connect describe $L --json - 2>/dev/null | grep -q '"ready"' && return 0
    sleep 0.1
  done
  return 1
}
ready || exit 1
record() {
  for trial in 1 2 3 4; do
    rm -f $2 $2.tsr
    if $T connect play $1_move.csv $L --valid 1s --bridge 50ms -o $2 >note.txt 2>&1; then
      grep -q "are nan" note.txt || return 0
    else
      cat note.txt >&2
      $T connect reset $L && ready || return 1
    fi
  done
  cat note.txt >&2
  return 1
}
record train train.csv && record test test.csv &&
  $T check train.csv test.csv --target truth_torque_Nm --inputs "$I" &&
  $T fit train.csv --target truth_torque_Nm --inputs "$I" --model grey_box -o joint.safetensors &&
  $T compare train.csv --test test.csv --target truth_torque_Nm --inputs "$I" --models linear,grey_box \
    --json compared.json &&
  $T connect upload joint.safetensors $L && record test controlled.csv)sh";

class LinkTours : public Program {
 protected:
  /// References of the torque: two sines that begin and end at 0, in parts of opposite signs, so that the link, which nothing
  /// else brakes, moves equally fast in both directions.
  void write_motion(const std::string& name, int parts, double part_s, double size,
                    double phase_rad) {
    constexpr int kRate_Hz = 100;
    const int part_samples = static_cast<int>(std::lround(part_s * kRate_Hz));
    std::string text = "t_s,torque_Nm\n";
    for (int n = 0; n <= parts * part_samples; ++n) {
      const double t_s = static_cast<double>(n % part_samples) / kRate_Hz;
      const double sign = n / part_samples % 2 == 0 ? 1.0 : -1.0;
      const double fade = std::min({1.0, t_s / 2.0, (part_s - t_s) / 2.0});
      const double turn = 2.0 * std::numbers::pi * t_s;
      const double torque_Nm =
          28.0 * std::sin(0.25 * turn + phase_rad) + 14.0 * std::sin(0.66 * turn);
      text +=
          fmt::format("{},{}\n", static_cast<double>(n) / kRate_Hz, sign * fade * size * torque_Nm);
    }
    folder_.file(name, text);
  }

  /// Columns of a CSV file from 4 s on: a model with memory first needs a motion. Rows without a value are left out.
  /// @returns root mean square of their difference
  [[nodiscard]] double rms_difference(const std::string& file, const std::string& one,
                                      const std::string& other) const {
    std::istringstream text(contents(file));
    std::string line;
    std::getline(text, line);
    const std::vector<std::string> names = split(line);
    const auto column = [&](const std::string& name) {
      for (std::size_t i = 0; i < names.size(); ++i)
        if (names[i] == name) return i;
      ADD_FAILURE() << file << " has no " << name;
      return std::size_t{0};
    };
    const std::size_t a = column(one);
    const std::size_t b = column(other);
    const std::size_t time = column("t_s");
    double sum = 0.0;
    int rows = 0;
    while (std::getline(text, line)) {
      const std::vector<std::string> cells = split(line);
      const double difference = std::stod(cells.at(a)) - std::stod(cells.at(b));
      if (!std::isfinite(difference) || std::stod(cells.at(time)) < 4.0) continue;
      sum += difference * difference;
      ++rows;
    }
    EXPECT_GT(rows, 1000) << file;
    return std::sqrt(sum / rows);
  }

 private:
  static std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
    return cells;
  }
};

TEST_F(LinkTours, FromTheBenchToTorqueControlWithItsModel) {
  write_motion("train_move.csv", 2, 10.0, 1.0, 0.0);
  write_motion("test_move.csv", 1, 8.0, 0.8, 0.4);
  // The link is so heavy that it moves slowly. A recording in which a busy machine has left out more than can be
  // bridged, or so much that the joint ended the motion, is made again.
  const Outcome outcome = shell("T=" + std::string(TORSIO_PROGRAM) + kTour);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err << contents("joint.txt");
  // The estimate of the joint, beside the load cell: the spring of the data sheet, then the model.
  const double spring_Nm = rms_difference("test.csv", "truth_torque_Nm", "torque_Nm");
  const double model_Nm = rms_difference("controlled.csv", "truth_torque_Nm", "torque_Nm");
  EXPECT_GT(spring_Nm, 1.0);
  EXPECT_LT(model_Nm, 0.2 * spring_Nm);
  // The torque is controlled with the model; how well depends more on the lag of the loop than on the model.
  EXPECT_LT(rms_difference("controlled.csv", "truth_torque_Nm", "wanted_torque_Nm"), 5.0);
  EXPECT_NE(contents("joint.txt").find("model accepted"), std::string::npos);
  EXPECT_FALSE(Json::parse(contents("compared.json"), nullptr, false).is_discarded());
}

}  // namespace
}  // namespace torsio::test
