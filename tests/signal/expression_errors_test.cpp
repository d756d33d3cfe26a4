#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

std::string message(std::string input, std::vector<ChannelDefinition> definitions = {}) {
  try {
    const FeaturePipeline pipeline(
        {.inputs = {std::move(input)}, .definitions = std::move(definitions)}, 1000.0);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

constexpr const char* kFunctionList =
    "\n  the functions are rate, lowpass, lag, stop, dahl, sign, tanh, sin, cos, atan, abs, sqrt, "
    "exp, "
    "min, max";

TEST(ExpressionError, StatesPlaceExpectedAndFound) {
  const std::string samples =
      "a whole number of samples from 0 to 100000, or their time, like 10ms";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "input '': column 1: expected a channel, a number, a function or '(', found the end"},
      {"a +",
       "input 'a +': column 4: expected a channel, a number, a function or '(', found the end"},
      {"a b", "input 'a b': column 3: expected an operator or the end, found 'b'"},
      {"a )", "input 'a )': column 3: expected an operator or the end, found ')'"},
      {"(a", "input '(a': column 3: expected ')', found the end"},
      {"a * $",
       "input 'a * $': column 5: expected a channel, a number, a function or '(', found '$'"},
      {"a\x01", "input 'a?': column 2: expected an operator or the end, found byte 0x01"},
      {"\xc2\xb5m",
       "input '??m': column 1: expected a channel, a number, a function or '(', found byte 0xc2"},
      {"1.2.3", "input '1.2.3': column 4: expected an operator or the end, found '.'"},
      {"1e999", "input '1e999': column 1: expected a number that a double can hold, found '1e999'"},
      {"1 / 0", "input '1 / 0': column 1: expected a finite constant, found an infinite one"},
      {"a + sqrt(-1)", "input 'a + sqrt(-1)': column 5: expected a finite constant, found NaN"},
      {"rate(a, b)",
       "input 'rate(a, b)': column 7: expected ')': rate takes 1 argument, found ','"},
      {"min(a)", "input 'min(a)': column 6: expected ',' and argument 2 of min, found ')'"},
      {"rate()",
       "input 'rate()': column 6: expected a channel, a number, a function or '(', found ')'"},
      {"lowpass(a, b)",
       "input 'lowpass(a, b)': column 12: expected a constant frequency as cut-off, like 10Hz, "
       "found 'b'"},
      {"lowpass(a, 10s )",
       "input 'lowpass(a, 10s )': column 12: expected a constant frequency as cut-off, like 10Hz, "
       "found '10s'"},
      {"lowpass(a, 0.5kHz)",
       "input 'lowpass(a, 0.5kHz)': column 12: expected a cut-off from 0.001 Hz to below 500 Hz, "
       "half the sample rate, found 500 Hz"},
      {"stop(a, 0)",
       "input 'stop(a, 0)': column 9: expected a positive constant in the unit of the first "
       "argument, found '0'"},
      {"stop(a, b)",
       "input 'stop(a, b)': column 9: expected a positive constant in the unit of the first "
       "argument, found 'b'"},
      {"lag(a, 1.5)", "input 'lag(a, 1.5)': column 8: expected " + samples + ", found '1.5'"},
      {"lag(a, 100001)",
       "input 'lag(a, 100001)': column 8: expected " + samples + ", found '100001'"},
      {"lag(a, -1)", "input 'lag(a, -1)': column 8: expected " + samples + ", found '-1'"},
      {"lag(a, 5.5ms)", "input 'lag(a, 5.5ms)': column 8: expected " + samples +
                            ", found '5.5ms'\n  One sample is 1 ms."},
      {"lag(a, 5Hz)", "input 'lag(a, 5Hz)': column 8: expected " + samples + ", found '5Hz'"},
      {"lag(a, b)", "input 'lag(a, b)': column 8: expected " + samples + ", found 'b'"},
  };
  for (const auto& [input, expected] : cases) EXPECT_EQ(message(input), expected);
}

TEST(ExpressionError, ListsTheFunctionsForOneThatIsUnknown) {
  EXPECT_EQ(message("x + lowpas(a, 10Hz)"),
            std::string("input 'x + lowpas(a, 10Hz)': column 5: expected a function, found "
                        "'lowpas'") +
                kFunctionList);
}

TEST(ExpressionError, ListsTheUnitsForOneThatIsUnknown) {
  const std::string text = message("tanh(x / 3furlong)");
  EXPECT_NE(text.find("column 11: expected a unit or an operator after the number, found "
                      "'furlong'\n  a product needs its '*'; the units are "),
            std::string::npos)
      << text;
}

TEST(ExpressionError, NamesTheDefinitionThatIsWrong) {
  EXPECT_EQ(message("b_rad", {{"b_rad", "a_rad *"}}),
            "definition b_rad = 'a_rad *': column 8: expected a channel, a number, a function or "
            "'(', found the end");
  EXPECT_EQ(message("a_rad", {{"b_rad", "1 +"}}),
            "definition b_rad = '1 +': column 4: expected a channel, a number, a function or '(', "
            "found the end");
  EXPECT_EQ(message("a", {{"2b", "a"}}),
            "definition 1 '2b': expected a name of letters, digits and '_' that starts with a "
            "letter, found '2b'");
  EXPECT_EQ(message("a", {{"b", "a"}, {"b", "a"}}),
            "definition 2 'b': there is already a definition of this name");
}

TEST(ExpressionError, NamesTheDefinitionThatNeedsItself) {
  EXPECT_EQ(message("a", {{"a", "1 + a"}}),
            "definition a = '1 + a': column 5: expected a definition that does not need itself, "
            "found 'a', which is being defined");
  EXPECT_EQ(message("x", {{"a", "2 * b"}, {"b", "c"}, {"c", "rate(a)"}}),
            "definition c = 'rate(a)': column 6: expected a definition that does not need itself, "
            "found 'a', which is being defined");
}

std::string numbered(std::string text, std::size_t number) {
  return text.append(std::to_string(number));
}

std::string repeated(const std::string& text, std::size_t times) {
  std::string result;
  for (std::size_t i = 0; i < times; ++i) result += text;
  return result;
}

TEST(ExpressionError, StopsHostileNestingBeforeTheStackEnds) {
  constexpr std::size_t kMany = 4'000;
  const std::string limit = "expected at most 100 levels of nesting, found more";
  for (const std::string opening : {"(", "-", "+", "rate(", "2^", "min(1,", "1^-("})
    EXPECT_NE(
        message(repeated(opening, opening.size() > 3 ? kMany / 3 : kMany / opening.size()) + "a")
            .find(limit),
        std::string::npos)
        << opening;
  EXPECT_EQ(message(repeated("(", 99).append("a").append(repeated(")", 99))), "no error");
  EXPECT_EQ(message(repeated("a + ", 2'000).append("a")), "no error");

  std::vector<ChannelDefinition> chain{{"d0", "a"}};
  for (std::size_t i = 1; i < 5'000; ++i) chain.push_back({numbered("d", i), numbered("d", i - 1)});
  EXPECT_NE(message("d4999", chain).find(limit), std::string::npos);
}

TEST(ExpressionError, LimitsLengthAndMemory) {
  EXPECT_NE(message(repeated("a", 10'001)).find("expected at most 10000 characters, found 10001"),
            std::string::npos);
  std::string lags = "lag(a, 99999)";
  for (std::size_t i = 1; i < 12; ++i) lags += numbered(" + lag(a, ", 99'999 - i) + ")";
  EXPECT_EQ(message(lags),
            "feature pipeline: expected lags of at most 1000000 samples together, found more");
}

TEST(ExpressionError, ShowsTheNeighbourhoodInALongExpression) {
  const std::string text = message(repeated("a + ", 500) + "$" + repeated(" + b", 500));
  EXPECT_NE(text.find("column 2001"), std::string::npos);
  EXPECT_NE(text.find("a + a + $ + b + b"), std::string::npos);
  EXPECT_LT(text.size(), 300U);
}

TEST(ExpressionError, DoesNotGrowWithDefinitionsThatDouble) {
  std::vector<ChannelDefinition> doubling{{"d0", "rate(a)"}};
  for (std::size_t i = 1; i < 60; ++i)
    doubling.push_back({numbered("d", i), numbered("d", i - 1) + " + " + numbered("d", i - 1)});
  EXPECT_EQ(message("d59", doubling), "no error");  // 2^59 rates if they were written out
}

}  // namespace
}  // namespace torsio
