#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "studies/studies.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

const std::vector<QuantityRow>& identification_rows() {
  static const Study study =
      run_study(find_study("000-arm-identification"), {.seed = 5, .repeats = 1, .is_quick = true});
  return std::get<QuantityTable>(study.table).rows;
}

const QuantityRow& identification_row(const std::string& condition, const std::string& quantity) {
  const auto& rows = identification_rows();
  const auto found = std::ranges::find_if(rows, [&](const QuantityRow& of) {
    return of.condition == condition && of.quantity.starts_with(quantity);
  });
  if (found == rows.end()) throw Error({.problem = condition + ", " + quantity});
  return *found;
}

TEST(ArmIdentificationStudy, FindsPayloadsBetterWithLearnedSpringsAndCalibratesTheJoints) {
  const double linear = identification_row("payload, linear springs", "error of the centre").value;
  const double learned = identification_row("payload, grey_box", "error of the centre").value;
  EXPECT_LT(learned, linear);
  EXPECT_LT(identification_row("payload, grey_box", "error of the mass").value, 3.0);
  for (const char* joint : {"joint2 (dfki-300)", "joint3 (dfki-120)", "joint5 (dfki-28)"}) {
    const std::string condition = std::string("calibrated in the arm, ") + joint;
    EXPECT_GT(identification_row(condition, "largest torque").value, 5.0) << joint;
    EXPECT_LT(identification_row(condition, "ratio").value, 3.0) << joint;
  }
}

}  // namespace
}  // namespace torsio
