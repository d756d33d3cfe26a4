#include "torsio/arm/contacts_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <string>

#include "support/arm6.hpp"
#include "support/error_message.hpp"
#include "support/file_bytes.hpp"
#include "support/temporary_folder.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

ContactsFile contacts_of_arm6() {
  ContactsFile file{.arm = "arm6", .payload_kg = 8.0};
  for (const ArmJoint& joint : test::arm6().joints)
    file.joints.push_back(
        {.name = joint.name, .detector = {.error = {{0.1, 0.2, 0.003, 0.0}}, .factor = 5.2}});
  file.hours = 10.0;
  file.false_alarms_per_hour = 0.5;
  file.upper_bound_per_hour = 0.3;
  return file;
}

class ContactsFiles : public testing::Test {
 protected:
  ContactsFiles() { save_contacts(folder_.path("contacts.json"), contacts_of_arm6()); }
  [[nodiscard]] std::string text() const { return test::file_bytes(folder_.path("contacts.json")); }
  /// The message about the file with one text replaced.
  std::string message(const std::string& from, const std::string& to) {
    std::string changed = text();
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    folder_.file("changed.json", changed.replace(at, from.size(), to));
    return test::error_message([&] { (void)read_contacts(folder_.path("changed.json")); });
  }

  TemporaryFolder folder_;
};

TEST_F(ContactsFiles, AreReadAsTheyWereWritten) {
  const ContactsFile file = read_contacts(folder_.path("contacts.json"));
  const ContactsFile written = contacts_of_arm6();
  EXPECT_EQ(file.arm, written.arm);
  EXPECT_EQ(file.payload_kg, written.payload_kg);
  EXPECT_EQ(file.hours, written.hours);
  EXPECT_EQ(file.false_alarms_per_hour, written.false_alarms_per_hour);
  ASSERT_EQ(file.joints.size(), written.joints.size());
  for (std::size_t j = 0; j < file.joints.size(); ++j) {
    EXPECT_EQ(file.joints[j].name, written.joints[j].name);
    EXPECT_EQ(file.joints[j].detector.factor, written.joints[j].detector.factor);
    EXPECT_EQ(file.joints[j].detector.error.coefficients,
              written.joints[j].detector.error.coefficients);
  }
}

TEST_F(ContactsFiles, ThatAreWrongAreRefusedWithTheEntry) {
  EXPECT_THAT(message("torsio contacts", "torsio monitor"),
              AllOf(HasSubstr("changed.json"), HasSubstr("learn-contacts")));
  EXPECT_THAT(message("\"format_version\": 1", "\"format_version\": 2"),
              AllOf(HasSubstr("format_version"), HasSubstr("found 2")));
  EXPECT_THAT(message("\"arm\"", "\"arn\""), HasSubstr("arn"));
  EXPECT_THAT(message("\"hours\": 10.0", "\"hours\": \"ten\""),
              AllOf(HasSubstr("hours"), HasSubstr("a number")));
  EXPECT_THAT(message("\"hours\": 10.0", "\"hours\": 0.0"), HasSubstr("above 0"));
  EXPECT_THAT(message("\"hours\": 10.0", "\"hours\": null"), HasSubstr("above 0"));
  EXPECT_THAT(message("\"factor\": 5.2", "\"factor\": 0.0"),
              AllOf(HasSubstr("joints"), HasSubstr("joint 1"), HasSubstr("factor")));
  EXPECT_THAT(message("\"factor\": 5.2", "\"factor\": null"), HasSubstr("factor"));
  EXPECT_THAT(message("\"factor\": 5.2", "\"facto\": 5.2"), HasSubstr("facto"));
  EXPECT_THAT(message("0.003,\n", ""), HasSubstr("4 coefficients"));
  EXPECT_THAT(message("0.003", "-0.003"), HasSubstr("coefficient"));
  EXPECT_THAT(message("0.003", "1e999"), testing::Not(testing::IsEmpty()));
  EXPECT_THAT(message("\"payload_kg\": 8.0", "\"payload_kg\": -8.0"), HasSubstr("payload_kg"));
  EXPECT_THAT(message("{", "{ \"extra\": 1,"), HasSubstr("extra"));
  EXPECT_THAT(message("{", "[{"), testing::Not(testing::IsEmpty()));
  // 10 hours without a false alarm support 0.3 per hour and nothing lower.
  EXPECT_THAT(message("\"false_alarms_per_hour\": 0.5", "\"false_alarms_per_hour\": 0.1"),
              AllOf(HasSubstr("false_alarms_per_hour"), HasSubstr("at least 0.3")));
  EXPECT_THAT(message("\"upper_bound_per_hour\": 0.3", "\"upper_bound_per_hour\": 0.01"),
              HasSubstr("upper_bound_per_hour"));
  folder_.file("empty.json", "");
  EXPECT_THAT(test::error_message([&] { (void)read_contacts(folder_.path("empty.json")); }),
              HasSubstr("empty.json"));
  EXPECT_THAT(test::error_message([&] { (void)read_contacts(folder_.path("none.json")); }),
              HasSubstr("none.json"));
}

TEST_F(ContactsFiles, OfAnotherArmAreRefused) {
  const ContactsFile file = read_contacts(folder_.path("contacts.json"));
  ArmModel arm = test::arm6();
  arm.payload = test::payload_of_8_kg();
  const auto refusal = [&](double bandwidth_rad_s = 100.0) {
    return test::error_message(
        [&] { require_contacts_of(file, arm, bandwidth_rad_s, "contacts.json"); });
  };
  EXPECT_THAT(refusal(), testing::IsEmpty());
  EXPECT_THAT(refusal(50.0), HasSubstr("observer_rad_s"));
  arm.payload.mass_kg = 3.0;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("payload_kg"), HasSubstr("expected 3")));
  arm.payload.mass_kg = 8.0;
  arm.joints[2].name = "elbow";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("'elbow' as joint 3"), HasSubstr("'joint3'")));
  arm.joints.pop_back();
  EXPECT_THAT(refusal(), HasSubstr("5 joints"));
  arm.name = "arm7";
  EXPECT_THAT(refusal(), AllOf(HasSubstr("'arm7'"), HasSubstr("learn")));
}

}  // namespace
}  // namespace torsio
