// torsio_stress [--seed N] [--count N] [--seconds S] [--only PART]: random hostile cases, by parts (tools/stress).
#include <array>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <span>
#include <string>
#include <string_view>

#include "stress/degenerate.hpp"
#include "stress/drifts.hpp"
#include "stress/references.hpp"
#include "stress/streams.hpp"
#include "stress/stress.hpp"

namespace torsio::stress {
namespace {

struct Part {
  std::string_view name;
  Outcome (*run)(const Settings&);
};

constexpr std::array<Part, 4> kParts{{
    {"streams", random_streams},
    {"references", wrong_references},
    {"degenerate", degenerate_training},
    {"drifts", drifting_sensors},
}};

}  // namespace
}  // namespace torsio::stress

int main(int argument_count, char** arguments) {
  using namespace torsio::stress;
  Settings settings;
  std::string only;
  const std::span<char*> words(arguments, static_cast<std::size_t>(argument_count));
  for (std::size_t i = 1; i + 1 < words.size(); i += 2) {
    const std::string_view name = words[i];
    if (name == "--seed") settings.seed = std::strtoull(words[i + 1], nullptr, 10);
    if (name == "--count") settings.count = std::strtoull(words[i + 1], nullptr, 10);
    if (name == "--seconds") settings.seconds = std::strtod(words[i + 1], nullptr);
    if (name == "--only") only = words[i + 1];
  }
  std::size_t failures = 0;
  for (const Part& part : kParts) {
    if (!only.empty() && part.name != only) continue;
    try {
      const Outcome outcome = part.run(settings);
      std::printf("%s: %zu cases, %zu failures\n", part.name.data(), outcome.cases,
                  outcome.failures.size());
      for (const std::string& row : outcome.rows) std::printf("  %s\n", row.c_str());
      for (const std::string& failure : outcome.failures)
        std::printf("  FAILED %s\n", failure.c_str());
      failures += outcome.failures.size();
    } catch (const std::exception& error) {
      std::printf("%s: %s\n", part.name.data(), error.what());
      ++failures;
    }
  }
  return failures == 0 ? 0 : 1;
}
