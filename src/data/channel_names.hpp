#pragma once

#include <span>
#include <string>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// In the order of the channels.
[[nodiscard]] inline std::vector<std::string> channel_names(std::span<const Channel> channels) {
  std::vector<std::string> names;
  names.reserve(channels.size());
  for (const Channel& channel : channels) names.push_back(channel.name);
  return names;
}

}  // namespace torsio
