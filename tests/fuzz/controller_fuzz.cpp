#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "torsio/actuator/controller_file.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/error.hpp"

namespace {

const std::string& example() {
  static const std::string text = [] {
    const torsio::DataSheet sheet = torsio::data_sheet("dfki-50");
    return torsio::controller_yaml(
        {.actuator = "dfki-50",
         .sample_rate_Hz = 1000.0,
         .settings = {.torque = {.deflection = {.joint = torsio::series_elastic_joint(sheet)}},
                      .limits = {.speed_rad_s = torsio::speed_limit_of(sheet)}},
         .stop = torsio::joint_stop_settings(sheet)});
  }();
  return text;
}

}  // namespace

/// Any text is a controller that can be built and that its own YAML gives back, or an Error. With the first byte odd, the
/// text replaces the line of an example at the place that the second byte chooses.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  std::string text(reinterpret_cast<const char*>(data + 2), size - 2);
  if (data[0] % 2 == 1) {
    std::string whole = example();
    const std::size_t begin = whole.rfind('\n', whole.size() * data[1] / 256) + 1;
    const std::size_t end = whole.find('\n', begin);
    whole.replace(begin, end == std::string::npos ? end : end - begin, text);
    text = whole;
  }
  std::string yaml;
  try {
    yaml = torsio::controller_yaml(torsio::parse_controller(text, "fuzz.yaml"));
  } catch (const torsio::Error&) {
    return 0;
  }
  // What was accepted is given back: an Error from here on is a finding.
  if (torsio::controller_yaml(torsio::parse_controller(yaml, "again.yaml")) != yaml) std::abort();
  return 0;
}
