#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "data/log_summary.hpp"
#include "data/log_table.hpp"

namespace torsio {

/// How sure a guess is.
enum class Certainty : std::uint8_t {
  none,    ///< no guess
  unsure,  ///< one of several that the data allow: to be confirmed
  likely,  ///< usual, and the data agree
  sure     ///< stated in the file, or shown by the data
};
[[nodiscard]] std::string_view name(Certainty certainty) noexcept;

/// What a column of a log is taken for.
struct ColumnGuess {
  ColumnSummary summary = {};
  std::string channel = {};  ///< with its SI unit; empty: none
  std::string unit = {};     ///< suffix of the unit of the numbers; empty: not known
  /// Which of the reasons is that of a unit that is only assumed, by the range of the numbers or
  /// because it is usual; none: it is shown.
  std::optional<std::size_t> assumption = {};
  double sign = 1.0;
  double gear_ratio = 1.0;
  bool needs_ratio = false;  ///< the user has to state the gear ratio
  std::string scale = {};    ///< for the user to complete: "unit: rev, scale: 1/COUNTS"
  double unwrap = 0.0;       ///< the span after which a counter begins again; 0: none
  bool holds = false;        ///< slower than the log
  std::string missing = {};  ///< what the data do not show: the rule is only a comment
  Certainty certainty = Certainty::none;
  std::vector<std::string> reasons = {};  ///< "name: pos", "relation: 100.02 times 'joint'"

  [[nodiscard]] bool is_written() const { return !channel.empty() && missing.empty(); }
  void add(Certainty at_most, std::string reason);
  /// Another unit than the assumed one, whose reason no longer holds.
  void replace_assumption(std::string_view other_unit, Certainty at_most, std::string reason);
  /// The entry of `channels:`, "joint_angle_rad: {from: pos, unit: deg}".
  [[nodiscard]] std::string rule() const;
};

/// A mapping that was guessed from names and values.
struct MappingDraft {
  std::string file = {};                   ///< several: with blanks between them
  std::vector<ColumnGuess> columns = {};   ///< as in the file
  std::vector<std::string> not_read = {};  ///< columns that cannot be channels, with the reason
  std::vector<std::string> dropped = {};   ///< names of those that must be left out
  std::string clock = {};                  ///< the value of `clock:`; empty: the stamps are even
  std::string clock_reason = {};
  double rate_Hz = 0.0;  ///< rows in a second; 0: not known
  std::vector<std::string> remarks = {};
  std::string refusal = {};  ///< why a recording cannot be read with it yet; empty: it can

  [[nodiscard]] const ColumnGuess* of(std::string_view channel) const;
  [[nodiscard]] std::string yaml() const;
};

/// Guesses from tables that were read without mapping, with columns of texts left out: logs of one
/// joint. Names and values are those of the first; the gear ratio and the signs follow from all of
/// them.
/// @throws Error if their columns differ
[[nodiscard]] MappingDraft draft_mapping(std::span<const LogTable> tables);
[[nodiscard]] inline MappingDraft draft_mapping(const LogTable& table) {
  return draft_mapping(std::span(&table, 1));
}

/// Reads the tables with the draft, and adds what their clock needs, or why that does not work
/// (`refusal`).
void try_draft(std::span<const LogTable> tables, MappingDraft& draft);
inline void try_draft(const LogTable& table, MappingDraft& draft) {
  try_draft(std::span(&table, 1), draft);
}

/// Names the clock of a listed log as its draft does, and how long the log lasts by it; leaves both as they are if no
/// column is the clock.
void state_clock(const LogTable& table, LogSummary& summary);

/// A user's answer for a column: a channel with the unit of the numbers ("joint_angle_deg"), "-" for
/// none, nothing for the guess as it is. The gear ratio is that of the same two angles in the units
/// stated; without the joint's it is left open. The remarks are those of the new draft.
/// @throws UsageError if it has no unit or another column is that channel.
void answer(MappingDraft& draft, std::size_t column, std::string_view text);

}  // namespace torsio
