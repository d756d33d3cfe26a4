#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <type_traits>
#include <vector>

#include "files/known_families.hpp"
#include "support/example_model_file.hpp"
#include "support/example_models.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/files/model_file.hpp"

// Any bytes in place of the members of a saved state, under a right header, are refused or loaded; the value of each
// step after that is finite. The first byte selects the family.

namespace {

using Input = std::span<const std::uint8_t>;

std::vector<torsio::Estimator> an_estimator_of_each() {
  std::vector<torsio::Estimator> estimators;
  torsio::KnownFamilies::for_each([&]<class F>(std::type_identity<F> /*family*/) {
    estimators.push_back(
        torsio::make_estimator(torsio::test::example_model_file(torsio::test::example<F>())));
  });
  return estimators;
}

/// Three bytes a change: where (modulo the length), and the new value.
void change(std::span<std::byte> bytes, Input changes) {
  for (; changes.size() >= 3; changes = changes.subspan(3))
    bytes[(changes[0] * std::size_t{256} + changes[1]) % bytes.size()] = std::byte{changes[2]};
}

void run(torsio::Estimator& estimator, int steps) {
  std::vector<double> raw(estimator.raw_inputs().size());
  for (int n = 0; n < steps; ++n) {
    for (double& value : raw) value = 0.4 * std::sin(0.05 * n);
    if (!std::isfinite(estimator.step(raw).value)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static std::vector<torsio::Estimator> estimators = an_estimator_of_each();
  if (size == 0) return 0;
  torsio::Estimator& estimator = estimators[data[0] % estimators.size()];
  estimator.reset();
  run(estimator, 20);
  std::vector<std::byte> state(estimator.state_size());
  if (!estimator.save(state)) return 0;
  change(std::span(state).subspan(torsio::detail::kStateHeaderBytes), {data + 1, size - 1});
  torsio::detail::write_state_header(state, estimator.state_identity());
  static_cast<void>(estimator.load(state));
  run(estimator, 20);
  return 0;
}
