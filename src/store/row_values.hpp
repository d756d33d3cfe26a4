#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "store/database.hpp"
#include "torsio/store/study_store.hpp"

// Values of rows of the tables of a store.
namespace torsio {

inline std::int64_t number(TrialState state) noexcept { return static_cast<std::int64_t>(state); }
inline std::int64_t whole(const DatabaseValue& value) { return std::get<std::int64_t>(value); }
inline const std::string& text(const DatabaseValue& value) { return std::get<std::string>(value); }

}  // namespace torsio
