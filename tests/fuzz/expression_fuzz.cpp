#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/signal/feature_pipeline.hpp"

// Any text must either be refused with an Error or give a pipeline that can be stepped. The first
// line is a list of inputs, each further line a definition "name = expression".

namespace {

torsio::FeatureSpec spec_of(std::string_view text) {
  torsio::FeatureSpec spec;
  bool is_first = true;
  while (is_first || !text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const std::size_t equals = line.find('=');
    if (is_first)
      spec.inputs = torsio::split_inputs(line);
    else if (equals != std::string_view::npos)
      spec.definitions.push_back(
          {std::string(line.substr(0, equals)), std::string(line.substr(equals + 1))});
    is_first = false;
  }
  return spec;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    torsio::FeaturePipeline pipeline(spec_of(text), 1000.0);
    std::vector<double> raw(pipeline.raw_inputs().size(), 0.5);
    for (int n = 0; n < 8; ++n) {
      for (double& value : raw) value = 1.0 - 3.0 * value;
      if (pipeline.step(raw).size() != pipeline.feature_count()) std::abort();
    }
    for (const std::string& input : pipeline.spec().inputs) (void)torsio::channels_of(input);
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
