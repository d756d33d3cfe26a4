#pragma once

#include <string>

namespace torsio {

/// Where a recording came from, for the card of whatever is trained on it.
struct Source {
  std::string file;    ///< as the user named it
  std::string sha256;  ///< hash of the file's bytes; empty for a recording that was made in memory
  bool operator==(const Source&) const = default;
};

/// A zero that is taken from each record's own start, or (offline only) from its middle.
struct ZeroRule {
  std::string channel;
  double first_s = 0.0;    ///< mean over this much of the start; 0 with `mid_range`
  bool mid_range = false;  ///< (min + max) / 2 of the record: not causal, and result rows state it
  bool operator==(const ZeroRule&) const = default;
};

}  // namespace torsio
