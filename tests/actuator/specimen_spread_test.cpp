#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "sim/plant/plant.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr unsigned kPieces = 1000;

using Rows = std::map<std::string, SheetValue>;
Rows rows(const std::string& name) {
  Rows all;
  for (const SheetRow& row : describe(data_sheet(name))) all[row.name] = row.value;
  return all;
}

struct Range {
  double low = HUGE_VAL;
  double high = -HUGE_VAL;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

/// Holds the bounds and reaches nine tenths of both.
void expect_spread(const Range& range, double middle, double bound, const std::string& what) {
  EXPECT_GE(range.low, middle - bound * (1.0 + 1e-9)) << what;
  EXPECT_LE(range.high, middle + bound * (1.0 + 1e-9)) << what;
  EXPECT_LT(range.low, middle - 0.9 * bound) << what;
  EXPECT_GT(range.high, middle + 0.9 * bound) << what;
}

/// The value over the nominal one of a thousand specimens.
void expect_share(const std::string& name, const std::string& row, double bound) {
  const double nominal = rows(name).at(row).value;
  Range range;
  for (unsigned serial = 0; serial < kPieces; ++serial)
    range.add(rows(fmt::format("{}#{}", name, serial)).at(row).value / nominal);
  expect_spread(range, 1.0, bound, name + " " + row);
}

void expect_added(const std::string& name, const std::string& row, double bound) {
  const double nominal = rows(name).at(row).value;
  Range range;
  for (unsigned serial = 0; serial < kPieces; ++serial)
    range.add(rows(fmt::format("{}#{}", name, serial)).at(row).value - nominal);
  expect_spread(range, 0.0, bound, name + " " + row);
}

TEST(PieceSpread, BoundsHoldOverAThousandPiecesAndAreReached) {
  expect_share("dfki-50", "spring_stiffness", 0.03);
  expect_share("dfki-50", "spring_friction", 0.25);
  expect_share("dfki-50", "spring_half_gap", 0.50);
  expect_share("dfki-50", "friction", 0.20);
  expect_share("dfki-50", "bearing_friction", 0.20);
  expect_added("dfki-50", "spring_asymmetry", 0.03);
  for (const char* encoder : {"motor", "middle", "joint"})
    expect_added("dfki-50", fmt::format("{}_encoder_zero", encoder), rad_from_deg(0.02));
  expect_share("elastomer", "coupling_stiffness", 0.03);
  expect_share("elastomer", "coupling_slip_2", 0.25);
  expect_added("elastomer", "twist_sensor_zero", rad_from_deg(0.02));
  expect_share("rubber-clutch", "rubber_stiffness", 0.03);
  expect_share("rubber-clutch", "rubber_slip", 0.25);
  expect_share("harmonic-drive", "tube_stiffness", 0.03);
}

TEST(PieceSpread, StiffnessesOfOnePartGoTogether) {
  const auto share = [](const std::string& name, const std::string& row) {
    return rows(name + "#07").at(row).value / rows(name).at(row).value;
  };
  EXPECT_DOUBLE_EQ(share("dfki-50", "spring_stage_stiffness"),
                   share("dfki-50", "spring_stiffness"));
  for (const char* branch : {"1", "2", "3"})
    EXPECT_DOUBLE_EQ(share("elastomer", fmt::format("coupling_branch_stiffness_{}", branch)),
                     share("elastomer", "coupling_stiffness"));
  EXPECT_EQ(share("rubber-clutch", "rubber_branch_share"), 1.0) << "a share of the stiffness";
}

TEST(PieceSpread, RubberIsAsymmetricByAShareOfItsStiffness) {
  const auto asymmetry = [](const std::string& name) {
    const Rows of = rows(name);
    return of.at("rubber_asymmetry").value / of.at("rubber_stiffness").value;
  };
  Range range;
  for (unsigned serial = 0; serial < kPieces; ++serial)
    range.add(asymmetry(fmt::format("rubber-clutch#{}", serial)));
  expect_spread(range, asymmetry("rubber-clutch"), 0.03, "asymmetry");
}

TEST(PieceSpread, TheSameSerialNumberIsTheSamePieceAndAnotherIsNot) {
  for (const DataSheet& sheet : data_sheets()) {
    const std::string name(sheet.name);
    const Rows third = rows(name + "#03");
    const Rows again = rows(name + "#3");
    const Rows fourth = rows(name + "#04");
    const Rows nominal = rows(name);
    int differing = 0;
    for (const auto& [row, value] : third) {
      EXPECT_EQ(value.value, again.at(row).value) << name << " " << row;
      if (value.value == nominal.at(row).value) {
        EXPECT_EQ(value.value, fourth.at(row).value) << name << " " << row;
        continue;
      }
      ++differing;
      EXPECT_NE(value.value, fourth.at(row).value) << name << " " << row;
      EXPECT_EQ(value.origin, Origin::assumed) << name << " " << row;
    }
    EXPECT_GE(differing, 5) << name;
  }
}

TEST(PieceSpread, AnotherActuatorsPieceOfTheSameNumberHasOtherDraws) {
  const auto share = [](const std::string& name) {
    return rows(name + "#01").at("spring_stiffness").value /
           rows(name).at("spring_stiffness").value;
  };
  EXPECT_NE(share("dfki-120"), share("dfki-300"));
}

TEST(PieceSpread, VariantsOfOnePieceShareItsDraws) {
  for (const DataSheet& sheet : data_sheets()) {
    const std::string base(sheet.name);
    const Rows specimen = rows(base + "#11");
    const Rows nominal = rows(base);
    for (const std::string_view variant : sheet.variants) {
      if (variant.empty()) continue;
      const std::string name = fmt::format("{}:{}", base, variant);
      const Rows nominal_variant = rows(name);
      for (const auto& [row, value] : rows(name + "#11")) {
        const double own = nominal_variant.at(row).value;
        if (row == "rubber_asymmetry") {
          // A share of the stiffness is added before the spread of the stiffness.
          const auto share = [&](double made, double from, const Rows& of) {
            const double spread =
                specimen.at("rubber_stiffness").value / nominal.at("rubber_stiffness").value;
            return (made / spread - from) / of.at("rubber_stiffness").value;
          };
          EXPECT_NEAR(share(value.value, own, nominal_variant),
                      share(specimen.at(row).value, nominal.at(row).value, nominal), 1e-12)
              << name;
        } else if (own == 0.0 || nominal.at(row).value == 0.0) {
          EXPECT_NEAR(value.value - own, specimen.at(row).value - nominal.at(row).value, 1e-15)
              << name << " " << row;
        } else {
          EXPECT_DOUBLE_EQ(value.value / own, specimen.at(row).value / nominal.at(row).value)
              << name << " " << row;
        }
      }
    }
  }
}

TEST(PieceSpread, EveryPieceMakesAPlant) {
  for (const DataSheet& sheet : data_sheets()) {
    for (unsigned serial = 0; serial < 200; ++serial) {
      const std::string name = fmt::format("{}#{}", sheet.name, serial);
      EXPECT_NO_THROW(Plant{plant_parameters(data_sheet(name))}) << name;
    }
  }
}

TEST(PieceSpread, WithoutASerialNumberAPieceIsNominal) {
  for (const DataSheet& sheet : data_sheets()) {
    const Rows of = rows(std::string(sheet.name));
    for (const SheetRow& row : describe(sheet)) {
      EXPECT_EQ(of.at(row.name).value, row.value.value) << sheet.name << " " << row.name;
      EXPECT_EQ(of.at(row.name).origin, row.value.origin) << sheet.name << " " << row.name;
    }
  }
}

}  // namespace
}  // namespace torsio
