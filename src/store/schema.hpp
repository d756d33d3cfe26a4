#pragma once

#include "store/database.hpp"

namespace torsio {

/// The version of the tables that this program reads and writes.
inline constexpr std::int64_t kStoreVersion = 1;

/// Creates the tables of an empty store, once also if several programs do so at the same time.
/// @param place of the store, for messages
/// @throws Error for a store of a newer version, or one of an older version that has not been
/// upgraded.
void prepare_schema(Database& database, const std::string& place);

}  // namespace torsio
