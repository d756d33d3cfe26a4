// What holds after any sequence of additions, promotions and roll backs of several devices.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>
#include <span>
#include <string>
#include <vector>

#include "store/each_registry.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// What a device is expected to have.
struct ExpectedDevice {
  std::vector<std::int64_t> models = {};
  std::vector<std::int64_t> promoted = {};  ///< the last one is current
  std::vector<std::int64_t> history = {};   ///< the current models in their order
};
using ExpectedDevices = std::map<std::string, ExpectedDevice>;

void check_devices(Registry& registry, const ExpectedDevices& devices) {
  for (const auto& [serial, expected] : devices) {
    const auto current = registry.current(serial);
    RC_ASSERT(current.has_value() == !expected.promoted.empty());
    if (current) {
      RC_ASSERT(current->id == expected.promoted.back());
      RC_ASSERT(current->device == serial);
      const std::string bytes = registry.model_bytes(serial, current->id);
      const ModelFile file = parse_model(std::as_bytes(std::span(bytes)), "current");
      RC_ASSERT(file.card.device_serial == serial);
    }
    std::vector<std::int64_t> history;
    for (const Promotion& each : registry.promotions(serial)) {
      RC_ASSERT(each.device == serial);
      history.push_back(each.model);
    }
    RC_ASSERT(history == expected.history);
    for (const RegisteredModel& model : registry.models(serial)) RC_ASSERT(model.device == serial);
  }
}

/// A promotion of any model by any device: that of another device is refused.
void promote_any(Registry& registry, ExpectedDevices& devices, const std::string& serial) {
  std::vector<std::int64_t> all;
  for (const auto& [other, device] : devices)
    all.insert(all.end(), device.models.begin(), device.models.end());
  if (all.empty()) return;
  const std::int64_t model = *rc::gen::elementOf(all);
  ExpectedDevice& device = devices.at(serial);
  if (std::ranges::find(device.models, model) == device.models.end()) {
    RC_ASSERT_THROWS_AS(registry.promote(serial, model, "robot"), UsageError);
    RC_ASSERT_THROWS_AS((void)registry.model_bytes(serial, model), UsageError);
    return;
  }
  const bool is_current = !device.promoted.empty() && device.promoted.back() == model;
  RC_ASSERT(registry.promote(serial, model, "robot") == !is_current);
  if (is_current) return;
  device.promoted.push_back(model);
  device.history.push_back(model);
}

void roll_back_one(Registry& registry, ExpectedDevice& device, const std::string& serial) {
  if (device.promoted.size() < 2) {
    RC_ASSERT_THROWS_AS(registry.roll_back(serial, "robot"), Error);
    return;
  }
  device.promoted.pop_back();
  RC_ASSERT(registry.roll_back(serial, "robot") == device.promoted.back());
  device.history.push_back(device.promoted.back());
}

class RegistryLaws : public test::EachRegistry {};

TEST_P(RegistryLaws, AModelIsOnlyThatOfItsDeviceAndHistoriesOnlyGrow) {
  Registry registry(address_);
  int run = 0;
  const auto law = [&] {
    ++run;
    ExpectedDevices devices;
    std::vector<std::string> serials;
    for (int k = 0; k < 3; ++k) serials.push_back(fmt::format("run {} joint {}", run, k));
    for (const std::string& serial : serials) {
      registry.add_device({.serial = serial});
      devices[serial] = {};
    }
    std::uint64_t seed = 0;
    for (int step = *rc::gen::inRange(1, 16); step > 0; --step) {
      const std::string serial = *rc::gen::elementOf(serials);
      switch (*rc::gen::inRange(0, 5)) {
        case 0:
        case 1:
          devices.at(serial).models.push_back(
              registry.add_model(test::new_model_of(serial, ++seed)));
          break;
        case 2:
        case 3: promote_any(registry, devices, serial); break;
        default: roll_back_one(registry, devices.at(serial), serial); break;
      }
    }
    check_devices(registry, devices);
  };
  EXPECT_TRUE(rc::check("models of serial numbers never mix", law));
  for (const RegistryFinding& each : registry.verify())
    EXPECT_FALSE(each.is_error) << each.place << ": " << each.text;
}

INSTANTIATE_TEST_SUITE_P(Kinds, RegistryLaws, testing::Values("memory", "sqlite", "postgresql"),
                         [](const auto& kind) { return kind.param; });

}  // namespace
}  // namespace torsio
