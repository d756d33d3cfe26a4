#include "evaluate/compared_target.hpp"

#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

std::string compared_target(const ModelFile& file, const std::string& wanted) {
  if (wanted.empty()) return file.settings.target;
  const auto name = split_channel_name(wanted);
  const auto own = split_channel_name(file.settings.target);
  if (!name || !own || name->unit->si_suffix != own->unit->si_suffix)
    throw UsageError(
        {.place = "target " + wanted,
         .expected = "a channel in the unit of the model's target, " + file.settings.target,
         .found = name ? "one in " + std::string(name->unit->si_suffix) : "a name without a unit"});
  return name->si();
}

}  // namespace torsio
