#pragma once

#include "store/database.hpp"

namespace torsio {

/// The version of the tables that this program reads and writes.
inline constexpr std::int64_t kStoreVersion = 3;

/// Creates the tables of an empty store, once also if several programs do so at the same time.
/// @param place name of the store, for messages
/// @throws Error for a store of a newer version, or one of an older version that has not been
/// upgraded.
void prepare_schema(Database& database, const std::string& place);

/// Upgrades the tables to `version`, each version in a transaction of its own, once also if several
/// programs do so at the same time. An empty store gets all tables in one transaction.
/// @returns the version before. @throws Error for a store of a newer version.
std::int64_t upgrade_schema(Database& database, const std::string& place,
                            std::int64_t version = kStoreVersion);

}  // namespace torsio
