#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "sim/plant/plant.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/error.hpp"
#include "torsio/sim/bench/sheet_file.hpp"

/// Any text is a sheet from which a plant can be built and which its own YAML gives back, or an
/// Error. The first byte chooses a built-in sheet, in which the text replaces the line at the place
/// that the second byte chooses; or none, and the text is the whole sheet.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  std::string text(reinterpret_cast<const char*>(data + 2), size - 2);
  const auto sheets = torsio::data_sheets();
  if (data[0] % 8 < sheets.size()) {
    std::string whole = torsio::data_sheet_yaml(sheets[data[0] % 8]);
    // From a line's beginning to its end.
    std::size_t begin = whole.find('\n', whole.size() * data[1] / 256);
    if (begin == std::string::npos) begin = whole.size() - 1;
    const std::size_t end = whole.find('\n', begin + 1);
    if (end != std::string::npos) whole.replace(begin + 1, end - begin - 1, text);
    text = whole;
  }
  std::string yaml;
  std::string hash;
  try {
    const torsio::DataSheet sheet = torsio::parse_data_sheet(text, "fuzz.yaml");
    yaml = torsio::data_sheet_yaml(sheet);
    hash = torsio::sheet_hash(sheet);
  } catch (const torsio::Error&) {
    return 0;
  }
  // What was accepted is given back: an Error from here on is a finding.
  const torsio::DataSheet again = torsio::parse_data_sheet(yaml, "again.yaml");
  if (torsio::sheet_hash(again) != hash) std::abort();
  const torsio::Plant plant(torsio::plant_parameters(again));
  if (!(plant.longest_step() > 0.0)) std::abort();
  return 0;
}
