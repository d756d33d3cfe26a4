#include "torsio/data/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "data/channel_names.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

void require_marks(const std::string& place, std::size_t samples,
                   const std::vector<std::uint8_t>& fresh) {
  if (fresh.size() != samples)
    throw Error({.place = place,
                 .expected = fmt::format("{} marks of freshness", samples),
                 .found = fmt::format("{}", fresh.size())});
}

}  // namespace

Recording::Recording(std::string name, double sample_rate_Hz, double start_s)
    : name_(std::move(name)), sample_rate_Hz_(sample_rate_Hz), start_s_(start_s) {
  if (!(sample_rate_Hz > 0.0) || !std::isfinite(sample_rate_Hz) || !std::isfinite(start_s))
    throw Error({.place = name_,
                 .expected = "a positive sample rate",
                 .found = fmt::format("{} Hz from {} s on", sample_rate_Hz, start_s)});
}

bool Recording::has(std::string_view channel) const noexcept {
  return std::ranges::find(channels_, channel, &Channel::name) != channels_.end();
}

const Channel& Recording::channel(std::string_view name) const {
  const auto at = std::ranges::find(channels_, name, &Channel::name);
  if (at != channels_.end()) return *at;
  const std::vector<std::string> names = channel_names(channels_);
  throw Error({.place = name_,
               .problem = fmt::format("there is no channel '{}'", name),
               .found = "the channels " + joined(names) +
                        (not_read.empty() ? "" : "; not read: " + listed(not_read)),
               .advice = did_you_mean(name, names)});
}

void Recording::add(Channel channel) {
  const std::string place = name_ + ": " + channel.name;
  const auto parts = split_channel_name(channel.name);
  if (!parts || parts->si() != channel.name)
    throw Error({.place = place,
                 .expected = "a name that ends in an SI unit, such as torque_Nm",
                 .found = "'" + channel.name + "'"});
  if (has(channel.name)) throw Error({.place = place, .problem = "the channel exists already"});
  if (!channels_.empty() && channel.values.size() != size())
    throw Error({.place = place,
                 .expected = fmt::format("{} samples, as in {}", size(), channels_.front().name),
                 .found = fmt::format("{}", channel.values.size())});
  if (!channel.fresh.empty()) require_marks(place, channel.values.size(), channel.fresh);
  channels_.push_back(std::move(channel));
}

void Recording::mark_fresh(std::string_view channel, std::vector<std::uint8_t> fresh) {
  const auto marked = channels_.begin() + (&this->channel(channel) - channels_.data());
  require_marks(name_ + ": " + marked->name, marked->values.size(), fresh);
  marked->fresh = std::move(fresh);
}

void Recording::add_condition(std::string name, double value) {
  if (!std::isfinite(value))
    throw Error({.place = name_ + ": " + name, .problem = "the condition is not finite"});
  add({.name = name, .values = std::vector<double>(size(), value)});
  conditions_.push_back(std::move(name));
}

Recording Recording::part(std::size_t begin, std::size_t end) const {
  Recording result = *this;
  result.start_s_ = time_s(begin);
  const auto cut = [&](auto& values) {
    if (values.empty()) return;
    values.erase(values.begin() + static_cast<std::ptrdiff_t>(end), values.end());
    values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(begin));
  };
  for (Channel& channel : result.channels_) {
    cut(channel.values);
    cut(channel.fresh);
  }
  return result;
}

}  // namespace torsio
