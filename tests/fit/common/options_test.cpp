#include "torsio/fit/common/options.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fit/common/option_fields.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

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

TEST(Options, StateWhichValueTheyExpect) {
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

enum class Shape : std::uint8_t { round, square };
constexpr std::array<std::string_view, 2> kShapes{"round", "square"};
constexpr std::array<std::string_view, 3> kPerhapsShapes{"none", "round", "square"};

struct OwnOptions {
  double scale = 0.003;
  double width = kNotMeasured;
  std::optional<std::size_t> order = {};
  Shape shape = Shape::square;
  std::optional<Shape> other = {};
  bool is_searched = true;
  std::vector<std::size_t> layers = {50, 20};

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    visit(self.scale, {.name = "scale", .maximum = 1, .help = "a", .takes_auto = true});
    visit(self.width, {.name = "width", .maximum = 1, .help = "b"});
    visit(self.order, {.name = "order", .maximum = 9, .help = "c"});
    visit(self.shape, {.name = "shape", .help = "d", .choices = kShapes});
    visit(self.other, {.name = "other", .help = "e", .choices = kPerhapsShapes});
    visit(self.is_searched, {.name = "search", .help = "f"});
    visit(self.layers, {.name = "layers", .help = "g"});
  }
};

TEST(OptionFields, TakeKindAndDefaultFromTheField) {
  using Kind = OptionInfo::Kind;
  const auto options = options_of<OwnOptions>();
  std::string defaults;
  std::vector<Kind> kinds;
  for (const OptionInfo& option : options) {
    defaults += std::string(option.default_value) + " ";
    kinds.push_back(option.kind);
  }
  EXPECT_EQ(defaults, "0.003 auto auto square none true 50-20 ");
  EXPECT_EQ(kinds, (std::vector{Kind::number, Kind::number, Kind::integer, Kind::choice,
                                Kind::choice, Kind::boolean, Kind::text}));
  EXPECT_EQ(range_of(options[0]), " (0 to 1)");
  EXPECT_EQ(range_of(options[3]), " (round, square)");
}

TEST(OptionFields, AreFilledFromWhatIsGiven) {
  const OwnOptions plain = filled<OwnOptions>(Options(options_of<OwnOptions>(), {}));
  EXPECT_EQ(plain.scale, 0.003);
  EXPECT_TRUE(std::isnan(plain.width));
  EXPECT_FALSE(plain.order.has_value());
  EXPECT_EQ(plain.shape, Shape::square);
  EXPECT_FALSE(plain.other.has_value());
  EXPECT_EQ(plain.layers, (std::vector<std::size_t>{50, 20}));
  const OwnOptions own = filled<OwnOptions>(Options(options_of<OwnOptions>(), {{"scale", "auto"},
                                                                               {"width", "0.5"},
                                                                               {"order", "0"},
                                                                               {"shape", "round"},
                                                                               {"other", "square"},
                                                                               {"search", "false"},
                                                                               {"layers", "7,3"}}));
  EXPECT_TRUE(std::isnan(own.scale));
  EXPECT_EQ(own.width, 0.5);
  EXPECT_EQ(own.order, 0U);
  EXPECT_EQ(own.shape, Shape::round);
  EXPECT_EQ(own.other, Shape::square);
  EXPECT_FALSE(own.is_searched);
  EXPECT_EQ(own.layers, (std::vector<std::size_t>{7, 3}));
}

TEST(OptionFields, RefuseWhatIsNoChoice) {
  EXPECT_EQ(test::error_message([] {
              (void)Options(options_of<OwnOptions>(), {{"shape", "oval"}});
            }),
            "option shape: expected one of round, square, found \"oval\"");
  const Options wrong(options_of<OwnOptions>(), {{"layers", "7-"}});
  EXPECT_EQ(test::error_message([&] { (void)filled<OwnOptions>(wrong); }),
            "option layers: expected numbers of units with - between them: 50-20-10, found \"7-\"");
}

}  // namespace
}  // namespace torsio
