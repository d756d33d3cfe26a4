#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>
#include <string>

#include "import/network_parameters.hpp"
#include "model/network/lstm.hpp"
#include "support/error_message.hpp"
#include "torsio/import/import_network.hpp"

namespace torsio {
namespace {

using testing::AllOf;
using testing::HasSubstr;

ForeignNetwork parse_text(const std::string& text, std::optional<Activation> activation = {}) {
  return parse_weights_json(std::as_bytes(std::span(text)), "net.json", activation);
}

std::string tensor(const std::string& name, const std::string& shape, const std::string& data) {
  return fmt::format(R"("{}": {{"shape": [{}], "data": [{}]}})", name, shape, data);
}

/// An LSTM of one cell and one input, and a dense layer.
std::string small_lstm(const std::string& more = {}) {
  return fmt::format(R"({{"tensors": {{{}, {}, {}{}{}}}}})",
                     tensor("m.weight_ih_l0", "4, 1", "1, 2, 3, 4"),
                     tensor("m.weight_hh_l0", "4, 1", "1, 2, 3, 4"),
                     tensor("h.weight", "1, 1", "2"), more.empty() ? "" : ",", more);
}

std::string json_refusal(const std::string& text) {
  return test::error_message([&] { (void)parse_text(text); });
}

TEST(WeightsJson, TakesScalesIntoTheStandardisation) {
  const ForeignNetwork network = parse_text(
      small_lstm(tensor("in_scale", "1, 1, 1", "0.25") + "," + tensor("out_scale", "1", "20")));
  const auto lstm = network_parameters(network, 0.005, 0).get<Lstm::Parameters>();
  EXPECT_EQ(lstm.scaling.inputs.scale.at(0), 4.0);
  EXPECT_EQ(lstm.scaling.target_scale, 20.0);
  EXPECT_EQ(lstm.layers.at(0).input_weights.values, (std::vector<float>{1, 2, 3, 4}));
  EXPECT_EQ(lstm.layers.at(0).bias, std::vector<float>(4, 0.0F));
}

TEST(WeightsJson, NotesTheBiasesThatItTookForZero) {
  const ForeignNetwork network = parse_text(small_lstm(tensor("m.bias_ih_l0", "4", "1, 2, 3, 4")));
  EXPECT_EQ(network.notes,
            (std::vector<std::string>{"the file has no m.bias_hh_l0, h.bias: taken as "
                                      "0, as of a layer without bias"}));
}

TEST(WeightsJson, KeepsTwoBiasesSeparateUnlessTheyAreFolded) {
  ForeignNetwork network = parse_text(small_lstm(tensor("m.bias_ih_l0", "4", "1, 2, 3, 4") + "," +
                                                 tensor("m.bias_hh_l0", "4", "5, 6, 7, 8")));
  const auto bias = [&] {
    return network_parameters(network, 0.005, 0).get<Lstm::Parameters>().layers.at(0).bias;
  };
  EXPECT_EQ(bias(), (std::vector<float>{1, 2, 3, 4, 5, 6, 7, 8}));
  network.fold_biases = true;
  EXPECT_EQ(bias(), (std::vector<float>{6, 8, 10, 12}));
}

TEST(WeightsJson, RefusesWhatItCannotMean) {
  EXPECT_THAT(json_refusal("{"), HasSubstr("net.json"));
  EXPECT_THAT(json_refusal("{}"), HasSubstr("tensors"));
  EXPECT_THAT(json_refusal(R"({"tensors": {}})"), HasSubstr("at least one layer"));
  EXPECT_THAT(json_refusal(R"({"tensors": {"a.weight": 3}})"), HasSubstr("a.weight"));
  EXPECT_THAT(json_refusal(R"({"tensors": {"a.weight": {"shape": [1, 2], "data": [1]}}})"),
              AllOf(HasSubstr("a.weight/data"), HasSubstr("[1, 2]")));
  EXPECT_THAT(json_refusal(R"({"tensors": {"a.weight": {"shape": [1, 1], "data": [null]}}})"),
              AllOf(HasSubstr("a.weight/data[0]"), HasSubstr("finite")));
  EXPECT_THAT(json_refusal(R"({"tensors": {"a.weight": {"shape": [-1, 1], "data": [1]}}})"),
              HasSubstr("a.weight/shape"));
  EXPECT_THAT(json_refusal(R"({"tensors": {"a.weight": {"shape": [9999999999, 1], "data": [1]}}})"),
              HasSubstr("a.weight/shape"));
  EXPECT_THAT(json_refusal(small_lstm(tensor("m.weight_ih_l0_reverse", "4, 1", "1, 2, 3, 4"))),
              AllOf(HasSubstr("weight_ih_l0_reverse"), HasSubstr("both directions")));
  EXPECT_THAT(json_refusal(small_lstm(tensor("m.bias_ih_l0", "3", "1, 2, 3"))),
              AllOf(HasSubstr("m.bias_ih_l0"), HasSubstr("[4]"), HasSubstr("[3]")));
  EXPECT_THAT(json_refusal(small_lstm(tensor("m.weight_ih_l1", "4, 2", "1, 2, 3, 4, 5, 6, 7, 8") +
                                      "," + tensor("m.weight_hh_l1", "4, 1", "1, 2, 3, 4"))),
              AllOf(HasSubstr("m.weight_ih_l1"), HasSubstr("1 columns"), HasSubstr("found 2")));
  EXPECT_THAT(json_refusal(R"({"tensors": {)" + tensor("m.weight_ih_l0", "2, 1", "1, 2") + "," +
                           tensor("m.weight_hh_l0", "2, 2", "1, 2, 3, 4") + "}}"),
              HasSubstr("4 H x H of an LSTM or 3 H x H of a GRU"));
  EXPECT_THAT(json_refusal(small_lstm(tensor("o.weight", "1, 1", "2"))), HasSubstr("--activation"));
}

TEST(WeightsJson, NamesTheNearestOfAnUnknownKey) {
  EXPECT_THAT(json_refusal(R"({"tensor": {}})"),
              AllOf(HasSubstr("net.json: expected only the keys tensors, arch"),
                    HasSubstr("found 'tensor'"), HasSubstr("Did you mean 'tensors'?")));
  EXPECT_THAT(json_refusal(R"({"tensors": {"a.weight": {"shape": [1, 1], "dats": [1]}}})"),
              AllOf(HasSubstr("/tensors/a.weight: expected only the keys shape, data"),
                    HasSubstr("Did you mean 'data'?")));
  EXPECT_THAT(
      json_refusal(R"({"tensors": {"a.weight": {"shape": [1, 1], "data": [1], "scale": 2}}})"),
      HasSubstr("found 'scale'"));
  const ForeignNetwork network =
      parse_text(R"({"arch": "one layer", "tensors": {)" + tensor("a.weight", "1, 1", "1") + "}}");
  EXPECT_EQ(network.inputs, 1U);
}

/// Seconds to parse a file of so many dense layers of one number.
double seconds_of(std::size_t layers) {
  std::string text = R"({"tensors": {)";
  for (std::size_t k = 0; k < layers; ++k)
    text += tensor(fmt::format("{}.weight", k), "1, 1", "1") + "," +
            tensor(fmt::format("{}.bias", k), "1", "0") + ",";
  text.back() = '}';
  text += '}';
  const std::clock_t start = std::clock();  // processor time: other programs may run
  EXPECT_EQ(parse_text(text, Activation::tanh).stages.size(), 2 * layers - 1);
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

TEST(WeightsJson, TakesTimeInProportionToTheNumberOfTensors) {
  // Proportional: a factor of 16 and that of the maps' logarithm. Quadratic: 256.
  double least = seconds_of(1000);
  for (int k = 0; k < 4; ++k) least = std::min(least, seconds_of(1000));
  // Other programs may interrupt a run.
  double many = seconds_of(16000);
  for (int k = 0; k < 2; ++k) many = std::min(many, seconds_of(16000));
  EXPECT_LT(many, 80.0 * least);
}

TEST(WeightsJson, RefusesTwoOutputsAndWeightsBeyondFloat) {
  const auto refusal_of_parameters = [](const std::string& shape, const std::string& data) {
    return test::error_message([&] {
      (void)network_parameters(
          parse_text(R"({"tensors": {)" + tensor("a.weight", shape, data) + "}}"), 1.0, 0);
    });
  };
  EXPECT_THAT(refusal_of_parameters("2, 1", "1, 2"), HasSubstr("one output"));
  EXPECT_THAT(refusal_of_parameters("1, 1", "1e39"), HasSubstr("float32"));
}

}  // namespace
}  // namespace torsio
