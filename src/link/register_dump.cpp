#include <cmath>
#include <nlohmann/json.hpp>

#include "torsio/link/register_table.hpp"

namespace torsio {
namespace {

using RegisterJson = nlohmann::ordered_json;

RegisterJson finite_json(double number) {
  return std::isfinite(number) ? RegisterJson(number) : RegisterJson(nullptr);
}

RegisterJson value_json(const LinkValue& value) {
  switch (value.type) {
    case LinkValueType::boolean: return value.boolean;
    case LinkValueType::int32: return value.int32;
    case LinkValueType::uint32: return value.uint32;
    case LinkValueType::float64: return finite_json(value.float64);
    case LinkValueType::text: return value.text;
  }
  return nullptr;
}

}  // namespace

std::string json_of(const RegisterTable& table) {
  RegisterJson all = RegisterJson::array();
  for (const LinkRegister& each : table.registers()) {
    RegisterJson one{{"name", each.name},           {"value", value_json(each.get(each.context))},
                     {"unit", each.unit},           {"type", name(each.type)},
                     {"access", name(each.access)}, {"persistent", each.is_persistent}};
    if (std::isfinite(each.lowest)) one["lowest"] = each.lowest;
    if (std::isfinite(each.highest)) one["highest"] = each.highest;
    one["description"] = each.description;
    all.push_back(std::move(one));
  }
  return all.dump(1, ' ', false, RegisterJson::error_handler_t::replace);
}

}  // namespace torsio
