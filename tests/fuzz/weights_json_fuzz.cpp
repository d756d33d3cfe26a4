#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "import/network_parameters.hpp"
#include "torsio/core/error.hpp"
#include "torsio/import/import_network.hpp"

// Any bytes are refused as weights with an Error, or give a network that steps. With the first byte odd
// they are the inside of {"tensors": {...}}.

namespace {

std::string text_of(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return {};
  const std::string rest(data + 1, data + size);
  return data[0] % 2 == 0 ? rest : R"({"tensors": {)" + rest + "}}";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = text_of(data, size);
  try {
    const torsio::ForeignNetwork network = torsio::parse_weights_json(
        std::as_bytes(std::span(text)), "fuzz", torsio::Activation::tanh);
    torsio::AnyModel model(torsio::network_parameters(network, 0.01, 0));
    const std::vector<double> features(model.input_count(), 0.1);
    (void)model.step(features);
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
