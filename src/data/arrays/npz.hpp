#pragma once

#include <string>
#include <vector>

#include "data/arrays/array_table.hpp"
#include "data/arrays/placed_bytes.hpp"
#include "data/byte_source.hpp"
#include "files/output_file.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// The arrays of numbers of numpy's `.npz`, packed or not: real and integer numbers, booleans and times (in
/// seconds) of one or two dimensions, or of more if these are of length 1; single numbers are arrays of
/// length 1. Source: numpy, format 1.0 to 3.0.
/// @throws Error for an archive without arrays, and for objects (pickles), structured and complex arrays and
/// texts if one of `wanted` is such an array; otherwise those are listed.
[[nodiscard]] ReadArrays read_npz(const PlacedBytes& bytes, const std::string& name,
                                  const std::vector<std::string>& wanted = {},
                                  const Progress& progress = {});
/// The same of a pipe or a packed file, which is read into memory first.
[[nodiscard]] ReadArrays read_npz(ByteSource& source, const std::string& name,
                                  const std::vector<std::string>& wanted = {},
                                  const Progress& progress = {});

/// An array of float64 for `t_s`, each channel, and the freshness of those that have it.
void write_npz(const Recording& recording, OutputFile& file, const Progress& progress = {});

}  // namespace torsio
