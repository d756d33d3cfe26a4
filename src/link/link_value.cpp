#include "torsio/link/link_value.hpp"

#include <bit>

namespace torsio {

bool LinkValue::operator==(const LinkValue& other) const noexcept {
  if (type != other.type) return false;
  switch (type) {
    case LinkValueType::boolean: return boolean == other.boolean;
    case LinkValueType::int32: return int32 == other.int32;
    case LinkValueType::uint32: return uint32 == other.uint32;
    case LinkValueType::float64:
      return std::bit_cast<std::uint64_t>(float64) == std::bit_cast<std::uint64_t>(other.float64);
    case LinkValueType::text: return text == other.text;
  }
  return false;
}

}  // namespace torsio
