#pragma once

#include <string>
#include <vector>

#include "data/arrays/array_table.hpp"
#include "files/output_file.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// Whether the library that reads MATLAB files is installed.
[[nodiscard]] bool has_mat_library();

/// The real and integer arrays of a MATLAB file, version 4 to 7.3, with those of nested structures:
/// "log.motor.q_rad"; elements of an array of structures are "log/0.q_rad". Texts, cells, complex and
/// sparse numbers are not read, but listed. Tables, timetables, timeseries, datetimes and strings are objects of
/// MATLAB's own, which no other program can read. The file is read by libmatio in a child process.
/// @param wanted variables of other names are not read; empty: all
/// @throws Error if the file is damaged, or if a variable that is wanted is such an object; Cancelled.
[[nodiscard]] ReadArrays read_mat(const std::string& path,
                                  const std::vector<std::string>& wanted = {},
                                  const Progress& progress = {});

/// Columns of doubles for `t_s`, each channel, and the freshness of those that have it, as MATLAB
/// writes them by `save -v6`. Source: MathWorks, MAT-File Format.
/// @throws Error for a name that no variable of MATLAB may have.
void write_mat(const Recording& recording, OutputFile& file, const Progress& progress = {});

}  // namespace torsio
