#include "torsio/fit/common/options.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::array kKnown{
    OptionInfo{"scale", OptionInfo::Kind::number, "auto", 0.1, 10.0, "a number"},
    OptionInfo{"gain", OptionInfo::Kind::number, "2.5", -1.0, 10.0, "a number"},
    OptionInfo{"degree", OptionInfo::Kind::integer, "5", 1, 20, "a whole number"},
    OptionInfo{"branch", OptionInfo::Kind::boolean, "false", 0, 0, "a choice"},
    OptionInfo{"schedule", OptionInfo::Kind::text, "", 0, 0, "an input"},
};

TEST(Options, HaveTheirDefaults) {
  const Options options(kKnown, {});
  EXPECT_TRUE(std::isnan(options.number("scale")));
  EXPECT_EQ(options.number("gain"), 2.5);
  EXPECT_EQ(options.integer("degree"), 5U);
  EXPECT_FALSE(options.boolean("branch"));
  EXPECT_EQ(options.text("schedule"), "");
}

TEST(Options, TakeWhatIsGiven) {
  const Options options(kKnown, {{"scale", "0.5"},
                                 {"gain", "-1e-1"},
                                 {"degree", "7"},
                                 {"branch", "true"},
                                 {"schedule", "support_m"}});
  EXPECT_EQ(options.number("scale"), 0.5);
  EXPECT_EQ(options.number("gain"), -0.1);
  EXPECT_EQ(options.integer("degree"), 7U);
  EXPECT_TRUE(options.boolean("branch"));
  EXPECT_EQ(options.text("schedule"), "support_m");
  EXPECT_TRUE(std::isnan(Options(kKnown, {{"scale", "auto"}}).number("scale")));
}

std::string refusal(const std::string& name, const std::string& value) {
  try {
    const Options options(kKnown, {{name, value}});
  } catch (const UsageError& error) {
    return error.what();
  }
  return {};
}

TEST(Options, RefuseAnUnknownNameAndListTheKnownOnes) {
  EXPECT_EQ(refusal("grade", "3"),
            "unknown option \"grade\"; expected one of scale, gain, degree, branch, schedule");
}

TEST(Options, SayWhatValueTheyExpect) {
  EXPECT_EQ(refusal("degree", "5.5"),
            "option degree: expected a whole number from 1 to 20, found \"5.5\"");
  EXPECT_EQ(refusal("scale", "11"),
            "option scale: expected a number from 0.1 to 10 or auto, found \"11\"");
  EXPECT_EQ(refusal("branch", "yes"), "option branch: expected true or false, found \"yes\"");
}

TEST(Options, RefuseEveryWrongValue) {
  for (const char* value :
       {"", " 3", "3 ", "3x", "-3", "21", "0", "1e1", "auto", "99999999999999999999999"})
    EXPECT_FALSE(refusal("degree", value).empty()) << value;
  for (const char* value : {"", "nan", "inf", "auto", "-1.01", "1,5"})
    EXPECT_FALSE(refusal("gain", value).empty()) << value;
}

TEST(Options, HaveNoOtherNames) { EXPECT_THROW((void)Options(kKnown, {}).number("grade"), Error); }

}  // namespace
}  // namespace torsio
