#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "studies/study.hpp"

namespace torsio {

/// Public recordings in one folder of `TORSIO_DATA`.
struct BoardSource {
  std::string_view folder;
  std::string_view title;
  std::string_view address;  ///< where they are published
  std::string_view licence;
  bool may_be_redistributed = false;
  std::string_view columns;  ///< columns of the files, and what was changed from the published ones
};

/// A file of a source with the SHA-256 of its content, unpacked: how it is packed does not matter.
struct BoardFile {
  std::string_view folder;
  std::string_view file;
  std::string_view sha256;
};

enum class BoardMeasure : std::uint8_t {
  rmse,      ///< over all scored samples together
  mean_abs,  ///< mean |error| of each recording, and the mean of these
};

[[nodiscard]] std::string_view name(BoardMeasure measure) noexcept;

/// One table of the board: test recordings that are scored together.
struct BoardSet {
  std::string_view name;  ///< in the column `set` of files
  std::string_view title;
  std::string_view folder;  ///< `BoardSource::folder`
  std::string_view
      data;  ///< sets of the same data share their fits: "boucwen", a recorded plan, ...
  std::string_view recording;  ///< test recording that is scored; empty: all
  std::string_view split;      ///< what is trained on and tested on
  bool is_split_official = false;
  std::string_view target;
  std::string_view unit;
  /// Channels of the test recordings that a model must not use, since they follow from the target.
  std::array<std::string_view, 2> hidden = {};
  std::size_t initialise_samples =
      0;  ///< measured samples at the start of a recording that a model may use; they are not scored
  std::size_t scored_samples = 0;
  BoardMeasure measure = BoardMeasure::rmse;
};

/// A figure of others on a set.
struct BoardPublished {
  std::string_view set;
  std::string_view model;
  std::string_view text;  ///< the digits as printed
  double value = kNotMeasured;
  std::string_view condition;  ///< whether it is the condition of the board
  std::string_view source;
};

[[nodiscard]] std::span<const BoardSource> board_sources() noexcept;
[[nodiscard]] std::span<const BoardFile> board_files() noexcept;
[[nodiscard]] std::span<const BoardSet> board_sets() noexcept;
[[nodiscard]] std::span<const BoardPublished> board_published() noexcept;

/// @param place what named it, for the message
/// @throws UsageError that lists the sets.
[[nodiscard]] const BoardSet& find_board_set(std::string_view name, const std::string& place);
[[nodiscard]] const BoardSource& source_of(const BoardSet& set);

/// The bytes of a file, unpacked if it is gzipped. @throws Error if it cannot be read.
[[nodiscard]] std::string unpacked_content(const std::string& path);

/// Checks the files of a source in a folder of recordings.
/// @returns the first file that is missing, relative to the folder; empty: all are there
/// @throws Error naming the file if its content has another hash.
[[nodiscard]] std::string missing_file(const BoardSource& source, const std::string& folder);

}  // namespace torsio
