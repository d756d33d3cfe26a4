#include "link/lost_samples.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace {

constexpr std::string_view kWithoutUnit = "_1";

std::vector<bool> lost_in(const torsio::Recording& recording) {
  std::vector<bool> lost(recording.size(), !recording.channels().empty());
  for (const torsio::Channel& channel : recording.channels())
    for (std::size_t k = 0; k < lost.size(); ++k)
      lost[k] = lost[k] && std::isnan(channel.values[k]);
  return lost;
}

/// values[begin, end) between their neighbours.
void fill(std::span<double> values, std::size_t begin, std::size_t end, bool holds) {
  const double before = values[begin - 1];
  const double after = values[end];
  const auto steps = static_cast<double>(end - begin + 1);
  for (std::size_t k = begin; k < end; ++k) {
    const double share = static_cast<double>(k - begin + 1) / steps;
    values[k] = std::isnan(after) ? after : before + (holds ? 0.0 : share * (after - before));
  }
}

}  // namespace

BridgedRecording bridge_lost_samples(const torsio::Recording& recording, double longest_s) {
  const std::vector<bool> lost = lost_in(recording);
  const auto longest = static_cast<std::size_t>(
      std::floor(std::max(longest_s, 0.0) * recording.sample_rate_Hz() + 1e-6));
  BridgedRecording result{.recording = recording};
  std::vector<std::pair<std::size_t, std::size_t>> gaps;
  for (std::size_t begin = 0; begin < lost.size();) {
    if (!lost[begin]) {
      ++begin;
      continue;
    }
    std::size_t end = begin;
    while (end < lost.size() && lost[end]) ++end;
    const bool is_short = begin > 0 && end < lost.size() && end - begin <= longest;
    (is_short ? result.bridged : result.left) += end - begin;
    if (is_short) gaps.emplace_back(begin, end);
    begin = end;
  }
  if (gaps.empty()) return result;
  torsio::Recording bridged(recording.name(), recording.sample_rate_Hz(), recording.time_s(0));
  bridged.source = recording.source;
  for (torsio::Channel channel : recording.channels()) {
    const bool holds = std::string_view(channel.name).ends_with(kWithoutUnit);
    for (const auto& [begin, end] : gaps) fill(channel.values, begin, end, holds);
    bridged.add(std::move(channel));
  }
  result.recording = std::move(bridged);
  return result;
}
