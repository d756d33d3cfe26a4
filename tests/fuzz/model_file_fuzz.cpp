#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "files/known_families.hpp"
#include "files/safetensors.hpp"
#include "support/example_model_file.hpp"
#include "support/example_models.hpp"
#include "torsio/core/error.hpp"
#include "torsio/files/model_file.hpp"

// Any bytes are refused as a model file with an Error, or give an estimator whose value is finite.
// The first byte selects how the others become a file: as they are, as changes to a good file (so
// that the fuzzer need not find one), or as the card of one.

namespace {

using Input = std::span<const std::uint8_t>;

std::vector<std::vector<std::byte>> a_file_of_each() {
  std::vector<std::vector<std::byte>> files;
  torsio::KnownFamilies::for_each([&]<class F>(std::type_identity<F> /*family*/) {
    files.push_back(
        torsio::model_bytes(torsio::test::example_model_file(torsio::test::example<F>())));
  });
  return files;
}

const std::vector<std::byte>& good_bytes(std::uint8_t which) {
  static const auto files = a_file_of_each();
  return files[which % files.size()];
}

/// Three bytes a change: where (modulo the length), and the new value.
std::vector<std::byte> changed(std::vector<std::byte> bytes, Input changes) {
  for (; changes.size() >= 3; changes = changes.subspan(3))
    bytes[(changes[0] * std::size_t{256} + changes[1]) % bytes.size()] = std::byte{changes[2]};
  return bytes;
}

std::vector<std::byte> with_card(const std::vector<std::byte>& bytes, Input card) {
  torsio::Safetensors contents = torsio::parse_safetensors(bytes, "good");
  contents.metadata["torsio"] = std::string(card.begin(), card.end());
  return torsio::safetensors_bytes(contents);
}

std::vector<std::byte> file_of(Input data) {
  if (data.empty()) return {};
  const std::uint8_t how = data.front();
  const Input rest = data.subspan(1);
  if (how % 4 == 0) return {std::as_bytes(rest).begin(), std::as_bytes(rest).end()};
  const auto& good = good_bytes(how / 4);
  return how % 4 == 1 ? with_card(good, rest) : changed(good, rest);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const torsio::ModelFile model = torsio::parse_model(file_of({data, size}), "fuzz");
    torsio::Estimator estimator = torsio::make_estimator(model);
    for (const double value : {0.0, 0.1, -1e308, torsio::kNotMeasured, 0.2, -0.3}) {
      const std::vector<double> raw(estimator.raw_inputs().size(), value);
      if (!std::isfinite(estimator.step(raw).value)) std::abort();
    }
    // What was read can be written, and reads the same.
    const auto bytes = torsio::model_bytes(model);
    if (torsio::model_bytes(torsio::parse_model(bytes, "again")) != bytes) std::abort();
  } catch (const torsio::Error& error) {
    if (std::string_view(error.what()).empty()) std::abort();
  }
  return 0;
}
