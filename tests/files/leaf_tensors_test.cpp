#include "files/leaf_tensors.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "fit/common/usable_table.hpp"
#include "support/dump.hpp"
#include "support/error_message.hpp"

namespace torsio {
namespace {

using test::dump;
using testing::HasSubstr;

struct Spring {
  struct Family {
    static constexpr std::string_view kFamily = "spring";
  };
  double stiffness = 0.0;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("stiffness", self.stiffness);
  }
};

struct Table {
  struct Family {
    static constexpr std::string_view kFamily = "table";
  };
  std::vector<double> knots;
  std::vector<Spring> springs;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("knots", self.knots);
    visit("springs", self.springs);
  }
};

struct Joint {
  double inertia = 0.0;
  std::optional<Table> friction = {};
  std::variant<std::monostate, Spring, Table> load = {};
  std::variant<Spring, Table> gear = {};

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("inertia", self.inertia);
    visit("friction", self.friction);
    visit("load", self.load);
    visit("gear", self.gear);
  }
};

Table table() { return {.knots = {0.1, 0.3}, .springs = {{1.0}, {3.0}}}; }

Safetensors contents_of(const Joint& joint) {
  Safetensors contents;
  put_leaves(contents, "joint", joint);
  return contents;
}

std::vector<std::string> names_of(const Joint& joint) {
  std::vector<std::string> names;
  for (const auto& [name, tensor] : contents_of(joint).tensors) names.push_back(name);
  return names;
}

Joint read(Safetensors contents, Joint joint = {}) {
  take_leaves(contents, "joint", "file", joint, [](std::string_view) { return false; });
  EXPECT_TRUE(contents.tensors.empty());
  return joint;
}

/// The error for a joint with a table on its output after one tensor was added or renamed.
std::string complaint(const std::string& removed, const std::string& added) {
  Safetensors contents = contents_of({.load = table()});
  if (!removed.empty()) contents.tensors.erase(removed);
  if (!added.empty()) contents.tensors[added] = tensor_of(1.0);
  return test::error_message([&] { (void)read(std::move(contents)); });
}

TEST(LeafTensors, NameAnOptionalByItsFieldAndAnAlternativeByItsFamilyToo) {
  EXPECT_THAT(names_of({}), testing::ElementsAre("joint.gear.spring.stiffness", "joint.inertia"));
  EXPECT_THAT(names_of({.friction = Table{.knots = {1.0}, .springs = {}}, .gear = table()}),
              testing::ElementsAre("joint.friction.knots", "joint.gear.table.knots",
                                   "joint.gear.table.springs.0.stiffness",
                                   "joint.gear.table.springs.1.stiffness", "joint.inertia"));
}

TEST(LeafTensors, ComeBackWithTheValueThatWasThere) {
  const std::vector<Joint> joints{{},
                                  {.inertia = 0.1, .friction = table(), .gear = Spring{1e-300}},
                                  {.load = Spring{-0.0}, .gear = table()},
                                  {.friction = Table{}, .load = table()}};
  for (const Joint& before : joints)
    for (const Joint& joint : joints) {
      const Joint loaded = read(contents_of(joint), before);
      EXPECT_EQ(dump(loaded), dump(joint)) << "whatever was there before";
      EXPECT_EQ(loaded.friction.has_value(), joint.friction.has_value());
      EXPECT_EQ(loaded.load.index(), joint.load.index());
      EXPECT_EQ(loaded.gear.index(), joint.gear.index());
    }
}

TEST(LeafTensors, OfTwoAlternativesAreRefused) {
  EXPECT_THAT(complaint("", "joint.load.spring.stiffness"),
              HasSubstr("file: /joint.load.table.knots: expected tensors of one of spring, table, "
                        "found spring and table"));
  EXPECT_THAT(complaint("", "joint.gear.table.knots"),
              HasSubstr("file: /joint.gear.table.knots: expected tensors of one of spring, table"));
}

TEST(LeafTensors, OfAnUnknownAlternativeAreRefused) {
  EXPECT_THAT(complaint("", "joint.load.damper.damping"),
              HasSubstr("file: /joint.load.damper.damping: expected tensors of one of spring, "
                        "table, found 'damper'"));
  for (const char* name : {"joint.load.table", "joint.load.", "joint.load..knots",
                           "joint.load.tables.knots", "joint.load.0.knots"})
    EXPECT_THAT(complaint("", name), HasSubstr(std::string("file: /") + name + ": expected"));
}

TEST(LeafTensors, ThatAreMissingAreNamed) {
  EXPECT_THAT(complaint("joint.gear.spring.stiffness", ""),
              HasSubstr("file: /joint.gear: expected tensors of one of spring, table, found none"));
  EXPECT_THAT(complaint("joint.load.table.knots", ""),
              HasSubstr("file: /joint.load.table.knots: expected a tensor, found none"));
  EXPECT_THAT(complaint("", "joint.friction.unknown"),
              HasSubstr("file: /joint.friction.knots: expected a tensor, found none"));
}

TEST(LeafTensors, OfAnAlternativeHaveNoMoreElementsThanOthers) {
  EXPECT_THAT(complaint("", "joint.load.table.springs.64.stiffness"),
              HasSubstr("at most 64 elements of joint.load.table.springs"));
  EXPECT_THAT(complaint("", "joint.load.table.springs.3.stiffness"),
              HasSubstr("/joint.load.table.springs.2: expected a tensor of that name"));
}

}  // namespace
}  // namespace torsio
