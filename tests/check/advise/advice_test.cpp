#include "torsio/check/advise/advice.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/report/check.hpp"
#include "torsio/signal/excitation.hpp"

namespace torsio {
namespace {

/// A spring with friction that moves in triangles; torque = k x (1 + stiffening x^2) + friction.
struct Motions {
  double amplitude_rad = 0.02;
  double frequency_Hz = 0.5;
  double duration_s = 60.0;
  double stiffening = 0.0;
  double factor = 1.0;  ///< factor of the stiffness
  std::uint64_t seed = 1;
};

Recording moved(const std::string& name, const Motions& motions) {
  constexpr double kRate_Hz = 200.0;
  Triangle triangle({.amplitude = motions.amplitude_rad, .frequency_Hz = motions.frequency_Hz},
                    kRate_Hz);
  Random random(motions.seed);
  Channel deflection{"spring_deflection_rad", {}};
  Channel torque{"torque_Nm", {}};
  double before = 0.0;
  const auto samples = static_cast<std::size_t>(kRate_Hz * motions.duration_s);
  for (std::size_t n = 0; n < samples; ++n) {
    const double x = triangle.step();
    deflection.values.push_back(x);
    torque.values.push_back(motions.factor * 300.0 * x * (1.0 + motions.stiffening * x * x) +
                            (x > before ? 0.3 : -0.3) + 0.02 * random.normal());
    before = x;
  }
  Recording recording(name, kRate_Hz);
  recording.add(std::move(deflection));
  recording.add(std::move(torque));
  return recording;
}

Dataset dataset_of(std::vector<Recording> recordings) {
  Dataset dataset;
  for (Recording& recording : recordings)
    test::add_record(dataset, std::move(recording), Role::train);
  return dataset;
}

Advice advice_on(const Dataset& dataset, const std::vector<WantedRange>& wanted = {}) {
  return advise(dataset, resolve_inputs(dataset, {}), wanted);
}

bool has(const std::vector<std::string>& texts, const std::string& part) {
  return std::ranges::any_of(
      texts, [&](const std::string& text) { return text.find(part) != std::string::npos; });
}

TEST(Advice, ProposesTheAmplitudeThatIsWantedAndMissing) {
  const Dataset dataset =
      dataset_of({moved("small", {.amplitude_rad = 0.02, .stiffening = 300.0}),
                  moved("smaller", {.amplitude_rad = 0.01, .stiffening = 300.0, .seed = 2})});
  const Advice advice = advice_on(dataset, {{"input", -0.05, 0.05}});
  ASSERT_FALSE(advice.proposals.empty());
  const Proposal& first = advice.proposals.front();
  ASSERT_TRUE(first.motion);
  EXPECT_NEAR(first.motion->amplitude, 0.05, 0.02) << first.recording;
  EXPECT_GT(first.expected_reduction, 0.05) << advice_text(advice);
  EXPECT_NE(first.reason.find("strokes"), std::string::npos) << first.reason;
}

TEST(Advice, ReportsThatASpringThatIsKnownToItsNoiseNeedsNothing) {
  std::vector<Recording> recordings;
  std::uint64_t seed = 0;
  for (const double amplitude_rad : {0.01, 0.02, 0.04})
    for (const double frequency_Hz : {0.15, 0.5, 1.5})
      recordings.push_back(
          moved(std::to_string(++seed),
                {.amplitude_rad = amplitude_rad, .frequency_Hz = frequency_Hz, .seed = seed}));
  const Advice advice = advice_on(dataset_of(std::move(recordings)));
  for (const Proposal& proposal : advice.proposals)
    EXPECT_FALSE(proposal.expected_reduction > 0.05) << proposal.recording;
  EXPECT_LT(advice.same_again_reduction, 0.05);
  EXPECT_TRUE(has(advice.limits, "near the noise of torque_Nm")) << advice_text(advice);
}

TEST(Advice, StatesWhatOneRecordingDoesNotDetermine) {
  const Advice advice = advice_on(dataset_of({moved("one", {})}));
  EXPECT_TRUE(has(advice.undetermined, "there is only one"));
  EXPECT_TRUE(has(advice.undetermined, "temperature"));
  EXPECT_TRUE(has(advice.undetermined, "creep"));
  ASSERT_FALSE(advice.proposals.empty());
  EXPECT_TRUE(std::isnan(advice.proposals.front().expected_reduction))
      << "a single motion does not show how the error grows with the distance from it";
  EXPECT_NE(advice_text(advice).find("cannot be determined from these recordings"),
            std::string::npos);
}

TEST(Advice, OnTooFewStrokesProposesOnlyTheirRecording) {
  const Advice advice = advice_on(dataset_of({moved("short", {.duration_s = 5.0})}));
  EXPECT_TRUE(advice.proposals.empty());
  EXPECT_TRUE(advice.learning_curve.empty());
  ASSERT_EQ(advice.undetermined.size(), 1U);
  EXPECT_NE(advice.undetermined.front().find("at least 10"), std::string::npos)
      << advice.undetermined.front();
}

TEST(Advice, RefusesWhatFitRefuses) {
  Recording still = moved("still", {});
  Recording constant("still", still.sample_rate_Hz());
  for (Channel channel : still.channels()) {
    if (channel.name != "torque_Nm") std::ranges::fill(channel.values, 0.1);
    constant.add(std::move(channel));
  }
  const Dataset dataset = dataset_of({std::move(constant)});
  EXPECT_NE(test::error_message([&] {
              (void)advice_on(dataset);
            }).find("at least one input that changes"),
            std::string::npos);
}

/// Recordings of a spring that softens with the temperature.
Dataset at_temperatures(const std::vector<double>& temperatures_K) {
  std::vector<Recording> recordings;
  for (const double temperature_K : temperatures_K) {
    const double share = (temperature_K - 290.0) / 50.0;
    recordings.push_back(
        moved(std::to_string(temperature_K), {.duration_s = 40.0,
                                              .factor = 1.0 - 0.3 * share - 0.4 * share * share,
                                              .seed = static_cast<std::uint64_t>(temperature_K)}));
    recordings.back().add_condition("temperature_K", temperature_K);
  }
  return dataset_of(std::move(recordings));
}

TEST(Advice, ProposesTheConditionInTheWidestGap) {
  const Advice advice = advice_on(at_temperatures({270.0, 280.0, 290.0, 300.0, 340.0}));
  const auto at = std::ranges::find(advice.proposals, "temperature_K", &Proposal::condition);
  ASSERT_NE(at, advice.proposals.end()) << advice_text(advice);
  EXPECT_NEAR(at->condition_value, 320.0, 1.0);
  EXPECT_GT(at->expected_reduction, 0.02);
}

TEST(Advice, DoesNotGuessTheEffectOfAConditionThatIsTheSameEverywhere) {
  const Advice advice = advice_on(at_temperatures({300.0, 300.0}));
  EXPECT_TRUE(has(advice.undetermined, "it is 300 K in every recording")) << advice_text(advice);
  const Advice of_two = advice_on(at_temperatures({280.0, 320.0}));
  const auto at = std::ranges::find(of_two.proposals, "temperature_K", &Proposal::condition);
  ASSERT_NE(at, of_two.proposals.end());
  EXPECT_TRUE(std::isnan(at->expected_reduction)) << "two values do not show the error between";
}

TEST(Advice, ReportsRecordingsThatDifferAtEqualMotion) {
  std::vector<Recording> recordings;
  for (const double factor : {0.8, 1.0, 1.2})
    recordings.push_back(moved(std::to_string(factor), {.factor = factor}));
  const Advice advice = advice_on(dataset_of(std::move(recordings)));
  EXPECT_TRUE(has(advice.limits, "the recordings differ at equal motion")) << advice_text(advice);
  EXPECT_GT(advice.between_recordings, 1.5);
}

TEST(Advice, StopsOnRequest) {
  const Dataset dataset = dataset_of({moved("one", {}), moved("two", {.amplitude_rad = 0.01})});
  EXPECT_THROW((void)advise(dataset, resolve_inputs(dataset, {}), {},
                            [](double, std::string_view) { return false; }),
               Cancelled);
}

TEST(Advice, IsPartOfTheJsonOfCheck) {
  const Advice advice = advice_on(dataset_of({moved("one", {})}));
  const std::string json = check_json({}, &advice);
  for (const char* key :
       {"\"schema_version\"", "\"advice\"", "\"intended_use\"", "\"proposals\"",
        "\"expected_reduction\": null", "\"regions\"", "\"learning_curve\"", "\"undetermined\""})
    EXPECT_NE(json.find(key), std::string::npos) << key;
  EXPECT_EQ(check_json({}).find("\"advice\""), std::string::npos);
}

WantedRange wanted(const std::string& text) {
  const Dataset dataset = at_temperatures({280.0, 320.0});
  return parse_wanted(text, dataset, resolve_inputs(dataset, {}));
}

TEST(WantedRange, IsReadWithUnits) {
  EXPECT_NEAR(wanted("input=-3deg:0.1rad").lowest, -0.05236, 1e-5);
  EXPECT_EQ(wanted("input=-3deg:0.1rad").highest, 0.1);
  EXPECT_EQ(wanted("frequency=0.05Hz:2").highest, 2.0);
  EXPECT_EQ(wanted("speed=2rad/s").highest, 2.0);
  const WantedRange cold = wanted("temperature_degC=-10:40");
  EXPECT_EQ(cold.quantity, "temperature_K");
  EXPECT_NEAR(cold.lowest, 263.15, 1e-9);
  EXPECT_NEAR(wanted("temperature_K=250:300").highest, 300.0, 1e-9);
}

TEST(WantedRange, OfAnUnknownQuantityOrAnEmptyRangeIsRefused) {
  const auto refusal = [](const std::string& text) {
    return test::error_message([&] { (void)wanted(text); });
  };
  EXPECT_NE(refusal("temprature_K=1:2").find("temperature_K"), std::string::npos);
  EXPECT_NE(refusal("lever_m=1:2").find("one of input, frequency, speed, temperature_K"),
            std::string::npos);
  EXPECT_NE(refusal("input").find("QUANTITY=LOWEST:HIGHEST"), std::string::npos);
  EXPECT_NE(refusal("input=1").find("a range LOWEST:HIGHEST"), std::string::npos);
  EXPECT_NE(refusal("input=2:1").find("LOWEST < HIGHEST"), std::string::npos);
  EXPECT_NE(refusal("frequency=0:1").find("0 < LOWEST"), std::string::npos);
  EXPECT_NE(refusal("input=1Nm:2Nm"), "");
  EXPECT_NE(refusal("input=nan:1"), "");
}

}  // namespace
}  // namespace torsio
