#pragma once

#include <string_view>

namespace torsio {

/// Refuses an entry of `model_choices` other than `all` that names a family or a setting that does not exist, where
/// there are no data yet.
/// @throws UsageError
void check_model_entry(std::string_view entry);

}  // namespace torsio
