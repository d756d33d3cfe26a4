#include "torsio/link/register_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <vector>

#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

class RegistersOfAJoint : public testing::Test {
 protected:
  double torque_Nm_ = 20.0;
  bool is_damped_ = false;
  std::int32_t offset_ = -3;
  std::uint32_t count_ = 5;
  std::vector<LinkRegister> registers_ = {
      variable_register({.name = "largest_torque_Nm",
                         .unit = "Nm",
                         .description = "Limit of the torque.",
                         .access = LinkAccess::write,
                         .is_persistent = true,
                         .lowest = 0.0,
                         .highest = 50.0},
                        torque_Nm_),
      variable_register({.name = "is_damped", .access = LinkAccess::write_when_disabled},
                        is_damped_),
      variable_register(
          {.name = "offset", .access = LinkAccess::write, .lowest = -10.0, .highest = 10.0},
          offset_),
      variable_register({.name = "count"}, count_),
      {.name = "model",
       .type = LinkValueType::text,
       .access = LinkAccess::write,
       .get = [](const void*) noexcept { return LinkValue::of("grey \xFF box"); },
       .set =
           [](void*, const LinkValue& value) noexcept {
             return value.text == "lstm" ? LinkRefusal::none : LinkRefusal::not_supported;
           }}};
  RegisterTable table_ = RegisterTable(registers_);
};

TEST_F(RegistersOfAJoint, AreReadAndWritten) {
  LinkValue value;
  EXPECT_EQ(table_.read(0, value), LinkRefusal::none);
  EXPECT_EQ(value, LinkValue::of(20.0));
  EXPECT_EQ(table_.write(0, LinkValue::of(30.0), false), LinkRefusal::none);
  EXPECT_EQ(torque_Nm_, 30.0);
  EXPECT_EQ(table_.write(2, LinkValue::of(std::int32_t{10}), false), LinkRefusal::none);
  EXPECT_EQ(offset_, 10);
  EXPECT_EQ(table_.find("count"), 3);
  EXPECT_EQ(table_.find("nothing"), std::nullopt);
  EXPECT_EQ(table_.read(5, value), LinkRefusal::unknown_register);
}

TEST_F(RegistersOfAJoint, RefuseAValueWithItsReasonAndKeepTheirOwn) {
  EXPECT_EQ(table_.write(5, LinkValue::of(1.0), true), LinkRefusal::unknown_register);
  EXPECT_EQ(table_.write(3, LinkValue::of(std::uint32_t{1}), true), LinkRefusal::read_only);
  EXPECT_EQ(table_.write(0, LinkValue::of(std::int32_t{1}), true), LinkRefusal::wrong_type);
  EXPECT_EQ(table_.write(0, LinkValue::of(50.001), true), LinkRefusal::out_of_range);
  EXPECT_EQ(table_.write(0, LinkValue::of(-1e-9), true), LinkRefusal::out_of_range);
  EXPECT_EQ(table_.write(2, LinkValue::of(std::int32_t{11}), true), LinkRefusal::out_of_range);
  for (const double number :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(table_.write(0, LinkValue::of(number), true), LinkRefusal::not_finite);
  EXPECT_EQ(table_.write(4, LinkValue::of("gru"), true), LinkRefusal::not_supported);
  EXPECT_EQ(table_.write(1, LinkValue::of(true), false), LinkRefusal::only_when_disabled);
  EXPECT_FALSE(is_damped_);
  EXPECT_EQ(table_.write(1, LinkValue::of(true), true), LinkRefusal::none);
  EXPECT_TRUE(is_damped_);
  EXPECT_EQ(torque_Nm_, 20.0);
}

TEST_F(RegistersOfAJoint, AreDescribed) {
  LinkRegisterDescription description;
  EXPECT_EQ(table_.describe(0, description), LinkRefusal::none);
  EXPECT_EQ(description.name, "largest_torque_Nm");
  EXPECT_EQ(description.count, 5);
  EXPECT_EQ(description.highest, 50.0);
  EXPECT_EQ(description.is_persistent, 1);
  EXPECT_EQ(table_.describe(5, description), LinkRefusal::unknown_register);
}

TEST_F(RegistersOfAJoint, AreWrittenAsJson) {
  torque_Nm_ = std::numeric_limits<double>::quiet_NaN();
  const std::string json = json_of(table_);
  EXPECT_THAT(json, HasSubstr(R"("name": "largest_torque_Nm",
  "value": null,
  "unit": "Nm",
  "type": "float64",
  "access": "write",
  "persistent": true,
  "lowest": 0.0,
  "highest": 50.0,
  "description": "Limit of the torque.")"));
  EXPECT_THAT(json, HasSubstr("\"value\": \"grey \xEF\xBF\xBD box\""));
}

TEST(RegisterTable, IsRefusedWhereARegisterIsWrong) {
  double number = 0.0;
  const LinkRegister good = variable_register({.name = "a", .access = LinkAccess::write}, number);
  const auto message = [](LinkRegister first, LinkRegister second) {
    return test::error_message([&] { RegisterTable table(std::array{first, second}); });
  };
  EXPECT_THAT(message(good, good),
              HasSubstr("register 1: expected a name of its own, found 'a', which register 0 has"));
  LinkRegister bad = good;
  bad.name = "";
  EXPECT_THAT(message(bad, good), HasSubstr("expected a name"));
  bad = good;
  bad.lowest = 2.0;
  bad.highest = 1.0;
  EXPECT_THAT(message(bad, good), HasSubstr("limits in ascending order, found 2 and 1"));
  bad = good;
  bad.set = nullptr;
  EXPECT_THAT(message(bad, good), HasSubstr("a function that writes the value"));
  bad = good;
  bad.unit = "a unit that is much too long";
  EXPECT_THAT(message(bad, good), HasSubstr("a unit of at most 16 bytes, found 28"));
}

}  // namespace
}  // namespace torsio
