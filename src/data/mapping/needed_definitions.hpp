#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// The definitions that channels are computed from, directly or through another definition.
/// @param wanted these channels; on return with all channels that the definitions use
[[nodiscard]] inline std::vector<ChannelDefinition> needed_definitions(
    const std::vector<ChannelDefinition>& definitions, std::vector<std::string>& wanted) {
  for (std::size_t i = 0; i < wanted.size(); ++i)
    for (const ChannelDefinition& definition : definitions)
      if (definition.name == wanted[i])
        for (std::string& channel : channels_of(definition.expression))
          if (std::ranges::find(wanted, channel) == wanted.end())
            wanted.push_back(std::move(channel));
  std::vector<ChannelDefinition> needed;
  std::ranges::copy_if(definitions, std::back_inserter(needed),
                       [&](const ChannelDefinition& definition) {
                         return std::ranges::find(wanted, definition.name) != wanted.end();
                       });
  return needed;
}

}  // namespace torsio
