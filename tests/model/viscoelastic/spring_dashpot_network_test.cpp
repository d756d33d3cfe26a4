#include "model/viscoelastic/spring_dashpot_network.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "support/error_message.hpp"
#include "support/random_spring_dashpots.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

using Complex = std::complex<double>;
using testing::ElementsAre;
using testing::HasSubstr;

/// The stiffness operator by the algebra of the tree itself.
Complex by_tree(const SpringDashpotNetwork& network, Complex s) {
  std::vector<Complex> open;
  for (const NetworkNode& node : network.nodes) {
    if (node.is_leaf()) {
      open.push_back(node.is(NetworkKind::spring) ? Complex(node.value) : node.value * s);
      continue;
    }
    const bool is_series = node.is(NetworkKind::series);
    Complex sum = 0.0;
    for (std::size_t i = 0; i < node.children; ++i) {
      sum += is_series ? 1.0 / open.back() : open.back();
      open.pop_back();
    }
    open.push_back(is_series ? 1.0 / sum : sum);
  }
  return open.front();
}

Complex by_spectrum(const RelaxationSpectrum& spectrum, Complex s) {
  Complex sum = spectrum.damping * s + spectrum.stiffness;
  for (const RelaxationBranch& branch : spectrum.branches)
    sum += branch.stiffness * s / (s + branch.rate_1_s);
  return sum;
}

Complex at_Hz(double frequency) { return {0.0, 2.0 * std::numbers::pi * frequency}; }

std::vector<double> rates(const SpringDashpotNetwork& network) {
  std::vector<double> rates;
  for (const RelaxationBranch& branch : relaxation_spectrum(network).branches)
    rates.push_back(branch.rate_1_s);
  return rates;
}

std::string refusal(const std::string& text) {
  return test::error_message([&] { (void)parse_network(text); });
}

TEST(SpringDashpotText, ComesBackAsItWas) {
  for (const char* text :
       {"k1", "d7", "k", "kv(k1, d1)", "maxwell(k, d)", "series(kv(k1, d1), kv(k2, d2), k3)",
        "parallel(k0, maxwell(k1, d1), series(kv(k2, d2), parallel(k3, k4), d999999))",
        "series(d1, k1)", "parallel(parallel(k1, k2), k3)"})
    EXPECT_EQ(text_of(parse_network(text)), text);
  EXPECT_EQ(text_of(parse_network(" parallel( k0=1e2 ,maxwell(k1 , d1=.5))\n"), 3),
            "parallel(k0=100, maxwell(k1, d1=0.5))");
  EXPECT_EQ(parse_network("parallel(k1=1, d1=2)"), parse_network("kv(k1=1, d1=2)"));
  EXPECT_EQ(text_of(parse_network("generalised_maxwell( 2 )")),
            "parallel(k0, maxwell(k1, d1), maxwell(k2, d2))");
}

TEST(SpringDashpotText, NamesItsElementsInOrder) {
  EXPECT_THAT(parse_network("burgers").names(), ElementsAre("k1", "d1", "k2", "d2"));
  EXPECT_THAT(parse_network("003c").names(),
              ElementsAre("k1", "d1", "k7", "k5", "k6", "d3", "k4", "d4"));
  EXPECT_NEAR(parse_network("003a").values()[0], deg_from_rad(3.803), 1e-12);
}

TEST(SpringDashpotText, PointsAtTheMistakeAndStatesWhatWasExpected) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "expected a network like series(kv(k1, d1), k2), or one of hooke, maxwell,"},
      {"series(k1, k2", "column 14: expected ',' or ')', found the end"},
      {"series(k1 k2)", "column 11: expected ',' and a second network to be in series, found 'k2'"},
      {"series(k1)", "column 10: expected ',' and a second network to be in series, found ')'"},
      {"series k1", "column 8: expected '(' after series, found 'k1'"},
      {"seires(k1, k2)", "column 1: expected series, parallel, kv, maxwell, a spring k1 or a"},
      {"series(k1, x2)", "column 12: expected series, parallel, kv, maxwell, a spring k1 or a"},
      {"series(k1,, k2)", "column 11: expected series, parallel, kv, maxwell, a spring k1"},
      {"kv(d1, k1)", "column 4: expected the spring of kv, like k1, found 'd1'"},
      {"kv(k1)", "column 6: expected ',' and the dashpot of kv, found ')'"},
      {"kv(k1, k2)", "column 8: expected the dashpot of kv, like d1, found 'k2'"},
      {"kv(k1, d1, k2)", "column 10: expected ')': kv takes a spring and a dashpot, found ','"},
      {"maxwell(kv(k1, d1), d2)", "column 9: expected the spring of maxwell, like k1, found 'kv'"},
      {"series(kv(k1, d1), k1)",
       "column 20: expected a name that is used only once: each element is a separate "
       "parameter, found 'k1'"},
      {"kv(k1, d1) k2", "column 12: expected the end, found 'k2'"},
      {"kv(k1=, d1)", "column 7: expected a start value, like 0.68, found ','"},
      {"kv(k1=-3, d1)", "column 7: expected a start value from 1e-12 to 1e+12"},
      {"kv(k1=0, d1)", "column 7: expected a start value from 1e-12 to 1e+12"},
      {"kv(k1=1e999, d1)", "column 7: expected a start value from 1e-12 to 1e+12"},
      {"kv(k1=nan, d1)", "column 7: expected a start value from 1e-12 to 1e+12"},
      {"kv(k01, d1)", "column 4: expected the spring of kv, like k1, found 'k01'"},
      {"kv(k1a, d1)", "column 4: expected the spring of kv, like k1, found 'k1a'"},
      {"kv(k1234567, d1)", "column 4: expected the spring of kv, like k1, found 'k1234567'"},
      {"hook", "or one of hooke, maxwell, kelvin_voigt, standard_linear_solid, burgers, 003a"},
      {"series(hooke, d1)", "column 8: expected series, parallel, kv, maxwell, a spring k1"},
      {"generalised_maxwell", "column 20: expected the number of branches in brackets, found the"},
      {"generalised_maxwell(0)", "column 21: expected the number of branches, 1 to 16, found '0'"},
      {"generalised_maxwell(17)", "column 21: expected the number of branches, 1 to 16, found"},
      {"generalised_maxwell(2) k1", "column 24: expected the end, found 'k1'"},
      {"kv(k1, d1\x01)", "column 10: expected ')': kv takes a spring and a dashpot, found '?'"},
  };
  for (const auto& [text, expected] : cases)
    EXPECT_THAT(refusal(text), HasSubstr(expected)) << text;
  EXPECT_THAT(refusal("series(k1, kw(k2, d2))"),
              HasSubstr("\n  series(k1, kw(k2, d2))\n             ^"));
}

TEST(SpringDashpotText, RefusesWhatIsTooLargeWithoutEnd) {
  std::string deep;
  for (int i = 0; i < 60; ++i) deep += "series(k" + std::to_string(i) + ",";
  EXPECT_THAT(refusal(deep), HasSubstr("at most 50 networks in each other"));
  std::string wide = "series(k0";
  for (int i = 1; i < 110; ++i) wide += ",k" + std::to_string(i);
  EXPECT_THAT(refusal(wide + ")"), HasSubstr("at most 100 elements and joins"));
  EXPECT_THAT(refusal(std::string(5000, ' ')), HasSubstr("expected"));
}

TEST(RelaxationSpectrum, RefusesNodesThatAreNoNetwork) {
  const auto message = [](std::vector<NetworkNode> nodes) {
    return test::error_message([&] { (void)relaxation_spectrum({std::move(nodes)}); });
  };
  EXPECT_THAT(message({}), HasSubstr("expected 1 to 100 nodes"));
  EXPECT_THAT(message({{.kind = 0, .value = -1.0}}), HasSubstr("node 0: expected k from 1e-12"));
  EXPECT_THAT(message({{.kind = 0, .value = kNotMeasured}}), HasSubstr("found nan"));
  EXPECT_THAT(message({{.kind = 9, .value = 1.0}}), HasSubstr("found kind 9"));
  EXPECT_THAT(message({{.kind = 0, .value = 1.0}, {.kind = 1, .value = 1.0}}),
              HasSubstr("expected one network, found 2"));
  EXPECT_THAT(message({{.kind = 0, .value = 1.0}, {.kind = 2, .children = 2}}),
              HasSubstr("node 1: expected 2 to 1 networks to join, found 2"));
  EXPECT_THAT(
      message({{.kind = 0, .value = 1.0}, {.kind = 0, .value = 1.0}, {.kind = 2, .children = 2}}),
      HasSubstr("node 1: expected a name that is used only once, found k"));
}

// Specification 7.
TEST(RelaxationSpectrum, Of003aHasItsPolesZerosAndResponse) {
  const SpringDashpotNetwork a = parse_network("003a");
  const auto poles = rates(a);
  ASSERT_EQ(poles.size(), 2U);
  EXPECT_NEAR(poles[0], 0.128345, 5e-7);
  EXPECT_NEAR(poles[1], 2.59325, 5e-6);
  const RelaxationSpectrum spectrum = relaxation_spectrum(a);
  for (const double zero : {-1.750921, -0.041902})
    EXPECT_NEAR(std::abs(by_spectrum(spectrum, zero)) / spectrum.stiffness, 0.0, 1e-4) << zero;
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  for (const auto& [frequency, magnitude, phase] :
       {std::tuple{0.4, 1.4716, 13.00}, {1.0, 1.6665, 7.64}, {4.0, 1.7320, 2.10}}) {
    const Complex response = by_spectrum(spectrum, at_Hz(frequency)) / kDegrees;
    EXPECT_NEAR(std::abs(response), magnitude, 5e-5) << frequency;
    EXPECT_NEAR(std::arg(response) * kDegrees, phase, 5e-3) << frequency;
  }
  // Specification 2.1: its generalised Maxwell equivalent, d = g / p.
  EXPECT_NEAR(spectrum.stiffness / kDegrees, 0.3829, 5e-5);
  EXPECT_NEAR(spectrum.branches[0].stiffness / kDegrees, 0.7701, 5e-5);
  EXPECT_NEAR(spectrum.branches[0].stiffness / poles[0] / kDegrees, 6.0003, 5e-5);
  EXPECT_NEAR(spectrum.branches[1].stiffness / kDegrees, 0.5840, 5e-5);
  EXPECT_NEAR(spectrum.branches[1].stiffness / poles[1] / kDegrees, 0.2252, 5e-5);
}

TEST(RelaxationSpectrum, Of003cHasItsPolesAndZeros) {
  const SpringDashpotNetwork c = parse_network("003c");
  const auto poles = rates(c);
  ASSERT_EQ(poles.size(), 3U);
  EXPECT_NEAR(poles[0], 3.907e-4, 5e-8);
  EXPECT_NEAR(poles[1], 0.127328, 5e-7);
  EXPECT_NEAR(poles[2], 2.51185, 5e-6);
  const RelaxationSpectrum spectrum = relaxation_spectrum(c);
  for (const double zero : {-1.7006, -0.0419, -1.0e-6}) {
    // Between a zero and 5 % beside it the sign turns.
    EXPECT_LT(by_spectrum(spectrum, 1.05 * zero).real() * by_spectrum(spectrum, 0.95 * zero).real(),
              0.0)
        << zero;
  }
}

// Specification 2, 7: the elements that partial fractions of paper 003's (10) give, to start (a)
// from.
TEST(RelaxationSpectrum, OfTheStartValuesIsThePapersTransferFunction) {
  const RelaxationSpectrum spectrum = relaxation_spectrum(
      parse_network("series(kv(k1=0.684218, d1=14.2903), kv(k2=4.52983, d2=4.43722), k3=1.61244)"));
  const ContinuousTransfer g = continuous_of(Paper003::refined);
  constexpr double kGains = 1137.56 * 0.00187;  // slopes of the curves at 0
  for (const double frequency : {0.001, 0.01, 0.1, 0.4, 1.0, 4.0, 20.0}) {
    const Complex s = at_Hz(frequency);
    const Complex expected = kGains * ((g.numerator[0] * s + g.numerator[1]) * s + g.numerator[2]) /
                             ((s + g.denominator[1]) * s + g.denominator[2]);
    EXPECT_NEAR(std::abs(by_spectrum(spectrum, s) / expected - 1.0), 0.0, 2e-5) << frequency;
  }
}

// Specification 2.1: what (b) and (c) are from outside, within the band of the paper.
TEST(RelaxationSpectrum, Of003bAnd003cIsNearlyThatOf003a) {
  const RelaxationSpectrum a = relaxation_spectrum(parse_network("003a"));
  for (const auto& [name, share] : {std::pair{"003b", 0.027}, {"003c", 0.0039}}) {
    const RelaxationSpectrum other = relaxation_spectrum(parse_network(name));
    double difference = 0.0;
    double whole = 0.0;
    for (int i = 0; i < 14; ++i) {
      const Complex s = at_Hz(0.05 * std::pow(400.0, i / 13.0));
      difference += std::norm(by_spectrum(other, s) - by_spectrum(a, s));
      whole += std::norm(by_spectrum(a, s));
    }
    EXPECT_NEAR(std::sqrt(difference / whole) / share, 1.0, 0.03) << name;
  }
}

TEST(RelaxationSpectrum, OfSimpleNetworksIsTheTextbooks) {
  const auto of = [](const char* text) { return relaxation_spectrum(parse_network(text)); };
  EXPECT_EQ(of("kv(k1=3, d1=2)").stiffness, 3.0);
  EXPECT_EQ(of("kv(k1=3, d1=2)").damping, 2.0);
  EXPECT_TRUE(of("kv(k1=3, d1=2)").branches.empty());
  EXPECT_DOUBLE_EQ(of("series(k1=3, k2=6)").stiffness, 2.0);
  EXPECT_DOUBLE_EQ(of("series(d1=3, d2=6)").damping, 2.0);
  const RelaxationSpectrum maxwell = of("maxwell(k1=3, d1=2)");
  EXPECT_EQ(maxwell.stiffness, 0.0);
  EXPECT_EQ(maxwell.damping, 0.0);
  ASSERT_EQ(maxwell.branches.size(), 1U);
  EXPECT_DOUBLE_EQ(maxwell.branches[0].stiffness, 3.0);
  EXPECT_DOUBLE_EQ(maxwell.branches[0].rate_1_s, 1.5);
  // Two branches of one rate are one.
  EXPECT_EQ(of("parallel(maxwell(k1=1, d1=2), maxwell(k2=2, d2=4))").branches.size(), 1U);
}

TEST(RelaxationSpectrum, IsWhatTheAlgebraOfTheTreeGives) {
  rc::check("H(j omega) of random networks", [](std::uint64_t seed) {
    Random random(seed);
    for (int n = 0; n < 30; ++n) {
      const SpringDashpotNetwork network = test::random_spring_dashpots(random, 1e-4, 1e4);
      const RelaxationSpectrum spectrum = relaxation_spectrum(network);
      for (int i = 0; i <= 20; ++i) {
        const Complex s(0.0, std::pow(10.0, 0.5 * i - 5.0));
        const Complex expected = by_tree(network, s);
        RC_ASSERT(std::abs(by_spectrum(spectrum, s) - expected) <= 1e-12 * std::abs(expected));
      }
      RC_ASSERT(spectrum.damping >= 0.0 && spectrum.stiffness >= 0.0);
      double last = 0.0;
      for (const RelaxationBranch& branch : spectrum.branches) {
        RC_ASSERT(branch.stiffness > 0.0 && branch.rate_1_s > last);
        last = branch.rate_1_s;
      }
    }
  });
}

TEST(RelaxationSpectrum, StaysAccurateWhereRatesLieFarApart) {
  const SpringDashpotNetwork network = parse_network(
      "series(k9=1e9, parallel(k0=1e-9, maxwell(k1=1, d1=1e9), maxwell(k2=1e6, d2=1e-3)), "
      "kv(k3=5, d3=1e-9), kv(k4=5, d4=1e-9), kv(k5=2.5, d5=5.000000001e-10))");
  const RelaxationSpectrum spectrum = relaxation_spectrum(network);
  for (int i = 0; i <= 50; ++i) {
    const Complex s(0.0, std::pow(10.0, 0.5 * i - 12.0));
    const Complex expected = by_tree(network, s);
    EXPECT_LE(std::abs(by_spectrum(spectrum, s) - expected), 1e-12 * std::abs(expected)) << s;
  }
}

}  // namespace
}  // namespace torsio
