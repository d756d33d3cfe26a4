#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// The name of the column that holds the freshness of a channel: "torque_Nm" -> "torque_fresh_1".
[[nodiscard]] std::string freshness_column(std::string_view channel_name);

/// @throws Error if a value is infinite, or a file of this recording would have two columns of one
/// name.
void check_columns(const Recording& recording);

/// A column of a file that holds all of one column before the next.
struct WrittenColumn {
  std::string name;
  std::vector<double> values;
};

/// `t_s`, the channels, and the freshness of those that have it, as 0 and 1.
/// @throws Error as `check_columns`.
[[nodiscard]] std::vector<WrittenColumn> written_columns(const Recording& recording);

}  // namespace torsio
