#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "torsio/data/mapping.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// The rule of the mapping that makes a channel.
[[nodiscard]] std::optional<ChannelRule> rule_of(const Recording& recording,
                                                 const std::string& name);

/// The column that a channel was read from; null where it is not known. The clock is `t_s`.
[[nodiscard]] const ColumnOfChannel* column_of(const Recording& recording, std::string_view name);

/// What a number of its column is multiplied by to give the channel in SI; none where the column is not known.
[[nodiscard]] std::optional<double> scale_of_column(const Recording& recording,
                                                    const std::string& name);

/// What to write in a mapping so that the rule of a channel has these entries, literally where the column is known:
/// "Mapping:  channels: {torque_Nm: {from: torque_mNm, unwrap: 65536}}".
/// @param entries such as "unwrap: 65536"
[[nodiscard]] std::string rule_advice(const Recording& recording, const std::string& name,
                                      std::string_view entries);

}  // namespace torsio
