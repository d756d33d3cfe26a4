#include "fit/common/finite_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "torsio/core/error.hpp"

namespace torsio {

const std::vector<double>& finite_input(const Recording& recording, const std::string& channel) {
  const std::vector<double>& values = recording.channel(channel).values;
  const auto is_finite = [](double value) { return std::isfinite(value); };
  const auto bad = std::ranges::find_if_not(values, is_finite);
  if (bad == values.end()) return values;
  const auto sample = static_cast<std::size_t>(bad - values.begin());
  throw Error(
      {.place = fmt::format("{}: {}", recording.name(), channel),
       .expected = "a finite number in every sample: it is an input of the model",
       .found = fmt::format("{} at t = {:.6g} s (sample {}), the first of {}", *bad,
                            recording.time_s(sample), sample,
                            values.end() - bad - std::count_if(bad, values.end(), is_finite)),
       .advice =
           fmt::format("Bridge it with `hold: [{}]` in the mapping, as a drive does that keeps "
                       "the last value, cut the record there, or choose inputs without it. "
                       "Only the target may have gaps.",
                       channel)});
}

}  // namespace torsio
