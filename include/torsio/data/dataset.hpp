#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/load_target.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

enum class Role : std::uint8_t { train, validation, test };

[[nodiscard]] std::string_view name(Role role) noexcept;

/// Samples [begin, end) of a recording and their role. Samples in no segment (an embargo) are
/// not used for training or scores, but filters and hidden states are run through them.
struct Segment {
  std::size_t begin = 0;
  std::size_t end = 0;
  Role role = Role::train;
  bool operator==(const Segment&) const = default;
};

struct DatasetRecord {
  Recording recording;
  std::vector<Segment> segments;  ///< in order, without overlap

  [[nodiscard]] bool has_role(Role role) const noexcept;
};

/// Recordings with their roles, at one sample rate. Splits are by recording or by contiguous block,
/// never by shuffled sample.
struct Dataset {
  std::vector<DatasetRecord> records;
  std::string target = "torque_Nm";
  /// Named lists of input expressions that the manifest proposes; the first is the default. May be
  /// empty.
  std::vector<std::pair<std::string, std::vector<std::string>>> input_sets;
  /// Channels that the target was computed from ("torque from motor current"): a leak if used as an
  /// input.
  std::vector<std::string> target_computed_from;
  /// The target is the torque of a known load (`add_load_target`); not `is_used`: it was measured.
  LoadTarget load_target = {};
  /// Channel with the standard error of each value of such a target; empty: it was measured.
  std::string target_error = {};
  /// Measured samples at the start of each recording that initialise a model with memory; they
  /// are not scored.
  std::size_t initialise_samples = 50;
  /// Description of the split, printed with its scores: "interpolation within one cycle".
  std::string label;

  /// Paths of the recordings, manifests and mappings that were read for it.
  std::vector<std::string> files;

  [[nodiscard]] double sample_rate_Hz() const;  ///< @throws Error if empty
  [[nodiscard]] bool has_role(Role role) const noexcept;
  /// @throws Error if the records differ in sample rate or lack the target.
  void check() const;
};

/// One segment over the whole record.
[[nodiscard]] std::vector<Segment> whole_record(std::size_t samples, Role role);

/// Cuts a record into `blocks` blocks of equal length and gives every `test_every`-th (the last of
/// each group) the role test, the others train. `embargo_samples` are left out of the training side
/// at every border between the roles.
/// @throws Error if a block is not longer than the embargo.
[[nodiscard]] std::vector<Segment> interleaved_blocks(std::size_t samples, std::size_t blocks,
                                                      std::size_t test_every,
                                                      std::size_t embargo_samples);

/// The first `train_fraction` of a record trains, the rest tests, with the embargo between them.
[[nodiscard]] std::vector<Segment> contiguous_blocks(std::size_t samples, double train_fraction,
                                                     std::size_t embargo_samples);

}  // namespace torsio
