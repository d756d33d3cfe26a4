// The advice of a verb, followed as a user would.
#include <gmock/gmock.h>

#include <algorithm>
#include <string>

#include "program/program.hpp"

namespace torsio::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class FollowedAdvice : public Program {
 protected:
  void expect_done(const std::string& call) {
    const Outcome outcome = torsio(call);
    ASSERT_EQ(outcome.exit_code, 0) << call << "\n" << outcome.err;
  }
};

TEST_F(FollowedAdvice, AZeroThatChangedAtPowerUpIsTakenFromEachRecording) {
  expect_done("simulate dfki-50 sweep --duration 20s --lever 0.24m -o a.csv");
  expect_done("simulate dfki-50 sweep --duration 20s --lever 0.24m --seed 2 -o b.csv");
  ASSERT_EQ(shell("awk -F, -v OFS=, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == "
                  "\"joint_angle_rad\") c = i } NR > 1 { $c += 0.02 } 1' b.csv > later.csv")
                .exit_code,
            0);
  expect_done("fit a.csv --model grey_box -o m.safetensors");
  EXPECT_THAT(torsio("evaluate m.safetensors b.csv").out, Not(HasSubstr("throughout")));
  const Outcome moved = torsio("evaluate m.safetensors later.csv");
  ASSERT_EQ(moved.exit_code, 0) << moved.err;
  EXPECT_THAT(moved.out, HasSubstr("later: the estimate is 11.8 Nm too low throughout"));
  EXPECT_THAT(moved.out, HasSubstr("was the zero of an encoder changed"));
  EXPECT_THAT(moved.out, Not(HasSubstr("add a training recording")));
  const std::string rules = "zero: [";
  const std::size_t begin = moved.out.find(rules);
  const std::size_t end = moved.out.find("])", begin);
  ASSERT_NE(end, std::string::npos) << moved.out;
  const std::string advised = moved.out.substr(begin, end + 1 - begin);
  ASSERT_EQ(shell("echo '" + advised + "' > zero.yaml").exit_code, 0);
  expect_done("fit a.csv --mapping zero.yaml --model grey_box -o z.safetensors");
  const Outcome zeroed = torsio("evaluate z.safetensors later.csv --mapping zero.yaml --json -");
  ASSERT_EQ(zeroed.exit_code, 0) << zeroed.err;
  EXPECT_THAT(zeroed.out, Not(HasSubstr("\"warnings\"")));
}

TEST_F(FollowedAdvice, ASpringThatDoesNotLastLastsWithTheOptionsOfTheNote) {
  for (const std::string call :
       {"design spring --torque 120Nm --angle 6deg --max-diameter 20mm --max-length 120mm",
        "design spring --torque 30Nm --angle 6deg --max-diameter 40mm --max-length 100mm",
        "design actuator --continuous 45Nm --peak 90Nm --speed 60deg/s --deflection 5deg "
        "--link-inertia 0.3kgm2"}) {
    const Outcome weak = torsio(call);
    ASSERT_EQ(weak.exit_code, 0) << weak.err;
    const std::string words = "in both directions: ";
    const std::size_t begin = weak.out.find(words);
    ASSERT_NE(begin, std::string::npos) << call << "\n" << weak.out;
    std::string options = weak.out.substr(begin + words.size());
    options.resize(options.find(" makes it last"));
    for (std::size_t at = 0; at < options.size();) {
      const std::size_t end = std::min(options.find(" or ", at), options.size());
      const std::string way = options.substr(at, end - at);
      std::string changed = call;  // an option of the advice replaces that of the call
      for (const std::string option : {" --max-length ", " --max-diameter "})
        if (const std::size_t old = changed.find(option);
            way.find(option) != std::string::npos && old != std::string::npos)
          changed.erase(old, changed.find(' ', old + option.size()) - old);
      const Outcome strong = torsio(changed + " " + way);
      EXPECT_EQ(strong.exit_code, 0) << options << "\n" << strong.err;
      EXPECT_THAT(strong.out, Not(HasSubstr("does not last under"))) << call << " " << options;
      at = end + 4;
    }
  }
}

TEST_F(FollowedAdvice, AnInputThatWasConstantIsLeftOutAndGuardsNoLonger) {
  expect_done("simulate dfki-50 sweep --duration 20s --lever 0.24m -o plain.csv");
  const std::string with = "awk -F, -v OFS=, 'NR == 1 { print $0, \"oil_K\" } NR > 1 { print $0, ";
  ASSERT_EQ(
      shell(with + "300 }' plain.csv > a.csv; " + with + "305 }' plain.csv > warm.csv").exit_code,
      0);
  const Outcome fitted = torsio(
      "fit a.csv --model grey_box --inputs 'gear_angle_rad - joint_angle_rad, oil_K' -o "
      "m.safetensors");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_THAT(fitted.err, HasSubstr("oil_K was constant in the training, but a guard reports"));
  EXPECT_THAT(torsio("evaluate m.safetensors warm.csv").out,
              HasSubstr("it was constant in the training: fit again with --inputs, without it"));
  const std::string words = "leave it out with  ";
  const std::size_t begin = fitted.err.find(words);
  ASSERT_NE(begin, std::string::npos) << fitted.err;
  const std::string option =
      fitted.err.substr(begin + words.size(), fitted.err.find('\n', begin) - begin - words.size());
  expect_done("fit a.csv --model grey_box " + option + " -o n.safetensors");
  EXPECT_THAT(torsio("evaluate n.safetensors warm.csv --json -").out,
              Not(HasSubstr("\"warnings\"")));
}

TEST_F(FollowedAdvice, CountsOfAModelsMappingAreTakenForTheC99Program) {
  expect_done("simulate dfki-50 sweep --duration 20s --lever 0.24m -o a.csv");
  // Counts of a motor encoder before a gear of 80.
  ASSERT_EQ(shell("awk -F, -v OFS=, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == "
                  "\"gear_angle_rad\") c = i; $c = \"inc\" } NR > 1 { $c = "
                  "sprintf(\"%.0f\", $c / 6.283185307179586 * 16384 * 80) } 1' a.csv > inc.csv")
                .exit_code,
            0);
  folder_.file("m.yaml",
               "channels:\n  gear_angle_rad: {from: inc, unit: rev, scale: 1/16384, gear_ratio: "
               "80}\n");
  expect_done("fit inc.csv --mapping m.yaml --model linear_coulomb -o m.safetensors");
  const std::string call = "export m.safetensors --c99 joint -o fw --overwrite --counts ";
  const Outcome wrong = torsio(call + "gear_angle_rad=16384");
  EXPECT_EQ(wrong.exit_code, 0) << wrong.err;
  EXPECT_THAT(wrong.err, HasSubstr("gear_angle_rad=16384, but the recordings that the model was "
                                   "trained with had 1310720 (16384 in a turn of the encoder"));
  EXPECT_THAT(wrong.err, HasSubstr("take --counts gear_angle_rad=auto"));
  const Outcome followed = torsio(call + "gear_angle_rad=auto");
  EXPECT_EQ(followed.exit_code, 0) << followed.err;
  EXPECT_THAT(followed.err, Not(HasSubstr("warning")));
  EXPECT_THAT(contents("fw/joint.h"),
              HasSubstr("gear_angle_rad: 1310720 counts in a turn of the joint."));
  EXPECT_THAT(torsio(call + "gear_angle_rad=1310720").err, Not(HasSubstr("warning")));
  EXPECT_THAT(torsio(call + "gear_angle_rad=-1310720").err, HasSubstr("warning"));
  EXPECT_EQ(torsio(call + "joint_angle_rad=auto").exit_code, kCallWasWrong);
}

}  // namespace
}  // namespace torsio::test
