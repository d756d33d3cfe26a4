#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "model/viscoelastic/viscoelastic.hpp"
#include "torsio/core/error.hpp"

// Any text must either be refused with an Error or give a network that comes back as its text and,
// given the values that it lacks, can be stepped.

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    torsio::SpringDashpotNetwork network = torsio::parse_network(text);
    if (torsio::text_of(torsio::parse_network(torsio::text_of(network))) !=
        torsio::text_of(network))
      std::abort();
    std::vector<double> values = network.values();
    for (std::size_t i = 0; i < values.size(); ++i)
      if (std::isnan(values[i])) values[i] = 1.0 + static_cast<double>(i);
    network.set_values(values);
    torsio::Viscoelastic model(
        {.network = network, .offset = 0.0, .sample_period_s = 1e-3, .inputs = 1});
    for (int n = 0; n < 8; ++n) {
      const double deflection = n % 3 == 0 ? 0.1 : -0.2;
      if (!std::isfinite(model.step({&deflection, 1}).value)) std::abort();
    }
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
