#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <string>

#include "export/c_guards.hpp"
#include "export/c_inputs.hpp"
#include "export/c_text.hpp"

namespace torsio {

/// What the writers of the guards have in common.
class CGuardParts {
 public:
  CGuardParts(CText& c, const CGuards& guards)
      : c_(c),
        list_(guards.listing),
        settings_(guards.settings),
        inputs_(guards.inputs),
        features_(guards.settings.features.inputs.size()) {}

 protected:
  [[nodiscard]] static std::string type(const CInput& input) {
    return input.is_counted() ? "int64_t" : "@real";
  }
  [[nodiscard]] std::string number(double value) const {
    return c_.number(value, "a number of the guards");
  }
  /// Joined over the raw inputs.
  [[nodiscard]] std::string over_inputs(const std::string& separator,
                                        const std::function<std::string(std::size_t)>& text) const {
    std::string all;
    for (std::size_t i = 0; i < inputs_.size(); ++i) all += (i == 0 ? "" : separator) + text(i);
    return all;
  }
  [[nodiscard]] bool has_limit(std::size_t i) const { return std::isfinite(list_.jump_limits[i]); }
  [[nodiscard]] bool has_jumps() const {
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      if (has_limit(i)) return true;
    return false;
  }

  [[nodiscard]] bool has_strokes() const { return list_.longest_stroke > 0.0; }

  CText& c_;
  const GuardListing& list_;
  const EstimatorSettings& settings_;
  const std::vector<CInput>& inputs_;
  std::size_t features_;
};

/// Writes the functions around what the memory of the model has missed, of `detail::MemoryError`.
/// @returns whether `NAME_miss_others` is among them
bool write_memory_error(CText& c, const CGuards& guards);

/// Writes the functions that follow the strokes of the first input, for guards that have them.
void write_strokes(CText& c, const CGuards& guards);

/// Writes the functions that detect jumps of the raw inputs, if it can be known what a jump is.
void write_jumps(CText& c, const CGuards& guards);

}  // namespace torsio
