#include "torsio/files/model_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <string>

#include "files/safetensors.hpp"
#include "files/whole_file.hpp"
#include "support/error_message.hpp"
#include "support/example_model_file.hpp"
#include "support/examples/linear.hpp"
#include "support/examples/network.hpp"
#include "support/grey_box_examples.hpp"
#include "support/numbers.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::kInfinity;
using test::kNaN;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

std::vector<std::byte> good_bytes() {
  return model_bytes(test::example_model_file(test::example<LinearCoulomb>()));
}

std::string complaint(const std::vector<std::byte>& bytes) {
  return error_message([&] { (void)parse_model(bytes, "elbow"); });
}

/// What is said of a good file after `spoil` has been at its contents.
std::string complaint_after(const std::function<void(Safetensors&)>& spoil) {
  Safetensors contents = parse_safetensors(good_bytes(), "elbow");
  spoil(contents);
  return complaint(safetensors_bytes(contents));
}

/// The same with a piece of the card's text replaced.
std::string complaint_about_card(std::string_view old_text, std::string_view new_text) {
  return complaint_after([&](Safetensors& contents) {
    std::string& card = contents.metadata.at("torsio");
    const auto at = card.find(old_text);
    ASSERT_NE(at, std::string::npos) << old_text << " is not in " << card;
    card.replace(at, old_text.size(), new_text);
  });
}

/// The same with a piece of the header's text replaced by one of the same length.
std::string complaint_about_header(std::string_view old_text, std::string_view new_text) {
  EXPECT_EQ(old_text.size(), new_text.size());
  std::vector<std::byte> bytes = good_bytes();
  const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto at = all.find(old_text);
  EXPECT_NE(at, std::string_view::npos) << old_text;
  std::memcpy(bytes.data() + at, new_text.data(), new_text.size());
  return complaint(bytes);
}

TEST(BrokenModelFile, IsRefusedAtEveryLengthThatItMayBeCutTo) {
  const std::vector<std::byte> whole = good_bytes();
  ASSERT_EQ(complaint(whole), "");
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_THAT(complaint({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)}),
                StartsWith("elbow: "))
        << length;
}

TEST(BrokenModelFile, IsRefusedWithBytesBehindItsEnd) {
  std::vector<std::byte> bytes = good_bytes();
  bytes.push_back({});
  EXPECT_THAT(complaint(bytes), AllOf(HasSubstr("bytes of data"), HasSubstr("damaged")));
}

TEST(BrokenModelFile, SaysWhatIsThereInstead) {
  const TemporaryFolder folder;
  EXPECT_THAT(error_message([&] { (void)load_model(folder.path("none")); }),
              HasSubstr("none: cannot open: No such file or directory"));
  EXPECT_THAT(error_message([&] { (void)load_model(folder.path("")); }),
              HasSubstr("expected a regular file, found a directory"));
  EXPECT_THAT(error_message([&] { (void)load_model(folder.file("empty", "")); }),
              HasSubstr("empty: expected a safetensors file of at least 8 bytes, found 0 bytes"));
  EXPECT_THAT(
      error_message([&] { (void)load_model(folder.file("rec.csv", "t_s,torque_Nm\n1,2\n")); }),
      AllOf(HasSubstr("rec.csv: header length: expected at most 1048576 bytes, found text"),
            HasSubstr("If it is a recording: the model comes first")));
}

TEST(BrokenModelFile, IsRefusedForItsSizeBeforeMemoryIsTaken) {
  const TemporaryFolder folder;
  const std::string path = folder.file("huge", "");
  std::filesystem::resize_file(path, std::uintmax_t{1} << 40);  // takes no space on disk
  EXPECT_THAT(error_message([&] { (void)load_model(path); }),
              HasSubstr("huge: expected at most 268435456 bytes, found 1099511627776"));
}

TEST(BrokenModelFile, MustHaveACard) {
  EXPECT_THAT(complaint_after([](Safetensors& contents) { contents.metadata.clear(); }),
              AllOf(HasSubstr("elbow: /__metadata__/torsio: expected the card of a torsio model"),
                    HasSubstr("safetensors file of another program")));
  EXPECT_THAT(complaint_after([](Safetensors& contents) { contents.metadata["torsio"] = "hello"; }),
              HasSubstr("elbow: card: expected JSON, found something else at byte 1"));
  EXPECT_THAT(complaint_after([](Safetensors& contents) { contents.metadata["torsio"] = "[1]"; }),
              HasSubstr("elbow: card: expected an object, found array"));
  EXPECT_THAT(complaint_after([](Safetensors& contents) {
                contents.metadata["torsio"] = std::string(100'000, '[');
              }),
              HasSubstr("elbow: card: expected at most 8 levels of nesting"));
}

TEST(BrokenModelFile, OfAnotherVersionSaysWhatToDo) {
  EXPECT_THAT(complaint_about_card(R"("format_version":1)", R"("format_version":2)"),
              AllOf(HasSubstr("elbow: card/format_version: expected 1, which torsio "),
                    HasSubstr("found 2"), HasSubstr("update torsio, or fit the model again")));
  EXPECT_THAT(complaint_about_card(R"("format_version":1)", R"("format_version":0)"),
              HasSubstr("No release wrote this version"));
  EXPECT_THAT(complaint_about_card(R"("format_version":1)", R"("format_version":"1")"),
              HasSubstr("card/format_version: expected a whole number from 0, found \"1\""));
}

TEST(BrokenModelFile, NamesTheEntryOfTheCardThatIsWrong) {
  EXPECT_THAT(complaint_about_card(R"("family":"linear_coulomb")", R"("family":"telepathy")"),
              AllOf(HasSubstr("card/family: expected one of linear, linear_coulomb"),
                    HasSubstr("A build with -DTORSIO_FAMILIES has only those that it names")));
  EXPECT_THAT(complaint_about_card(R"("family":"linear_coulomb")", R"("familie":"linear_coulomb")"),
              HasSubstr("card/family: expected an entry, found none"));
  EXPECT_THAT(complaint_about_card(R"("seed":18446744073709551615)", R"("seed":-1)"),
              HasSubstr("card/seed: expected a whole number from 0, found -1"));
  EXPECT_THAT(complaint_about_card(R"("sha256":"0123abcd")", R"("sha256":17)"),
              HasSubstr("card/training_files/0/sha256: expected a text, found 17"));
  EXPECT_THAT(complaint_about_card(R"("rmse":0.1)", R"("rmse":[])"),
              HasSubstr("card/metrics/rmse: expected a number, found array"));
  EXPECT_THAT(complaint_about_card(R"("mid_range":false)", R"("mid_range":0)"),
              HasSubstr("card/zeros/0/mid_range: expected true or false, found 0"));
  EXPECT_THAT(complaint_about_card(R"("seed":)", R"("family":"linear","seed":)"),
              HasSubstr("card: expected each key once, found \"family\" twice"));
}

TEST(BrokenModelFile, WithInputsThatCannotBeComputedSaysWhich) {
  EXPECT_THAT(complaint_about_card("50Hz", "5000Hz"),
              AllOf(StartsWith("elbow: "), HasSubstr("5000")));
  EXPECT_THAT(complaint_about_card(R"("inputs":["spring_deflection_rad",)", R"("inputs":[)"),
              HasSubstr("elbow: inputs: expected 2, as many as the model takes, found 1"));
  EXPECT_THAT(complaint_about_card(R"("sample_rate_Hz":1000.0)", R"("sample_rate_Hz":null)"),
              HasSubstr("sample rate"));
}

TEST(BrokenModelFile, OfAnotherFamilyThanItsCardSays) {
  EXPECT_THAT(complaint_about_card(R"("family":"linear_coulomb")", R"("family":"polynomial")"),
              HasSubstr("elbow: /model.degree: expected a tensor, found none"));
  EXPECT_THAT(complaint_about_card(R"("family":"linear_coulomb")", R"("family":"linear")"),
              HasSubstr("elbow: /model.rate_feature: expected only tensors of the family linear"));
}

TEST(BrokenModelFile, NamesTheTensorThatIsWrong) {
  const auto with = [](const char* name, const Tensor& tensor) {
    return complaint_after([&](Safetensors& contents) { contents.tensors[name] = tensor; });
  };
  EXPECT_THAT(
      complaint_after([](Safetensors& contents) { contents.tensors.erase("fallback.slope"); }),
      HasSubstr("elbow: /fallback.slope: expected a tensor, found none"));
  EXPECT_THAT(with("model.rate_scale", {{1}, std::vector{1.0}}),
              HasSubstr("elbow: /model.rate_scale: expected one F64 of shape [], found shape [1]"));
  EXPECT_THAT(
      with("model.rate_feature", {{}, std::vector{1.0}}),
      HasSubstr("/model.rate_feature: expected one I64 of shape [], found another element"));
  EXPECT_THAT(with("model.rate_feature", {{}, std::vector<std::int64_t>{-1}}),
              HasSubstr("/model.rate_feature: expected a number from 0, found -1"));
  EXPECT_THAT(with("model.rate_feature", {{}, std::vector<std::int64_t>{7}}),
              AllOf(StartsWith("elbow: "), HasSubstr("rate_feature")));
  EXPECT_THAT(with("model.coefficients.scheduled", {{}, std::vector<std::uint8_t>{2}}),
              HasSubstr("/model.coefficients.scheduled: expected 0 or 1, found 2"));
  EXPECT_THAT(with("model.coefficients.values", {{0, 1U << 30U}, std::vector<double>{}}),
              HasSubstr("/model.coefficients.values: expected an empty table of at most 65536"));
  EXPECT_THAT(with("model.coefficients.values", {{1, 3}, std::vector{1.0, 2.0, 3.0}}),
              StartsWith("elbow: "));
  EXPECT_THAT(with("guards.ranges.lowest", {{3}, std::vector{0.0, 0.0, 0.0}}),
              HasSubstr("elbow: guards.ranges.lowest: expected 2 values, found 3"));
}

TEST(BrokenModelFile, WithNumbersThatAreNotFinite) {
  const auto with = [](const char* name, double value) {
    return complaint_after([&](Safetensors& contents) {
      std::get<std::vector<double>>(contents.tensors.at(name).values)[0] = value;
    });
  };
  EXPECT_THAT(with("model.coefficients.values", kNaN),
              HasSubstr("elbow: /model.coefficients.values: expected finite numbers, found nan at "
                        "index 0"));
  EXPECT_THAT(with("model.rate_scale", kInfinity), HasSubstr("found inf at index 0"));
  EXPECT_THAT(with("guards.ranges.highest", kNaN), HasSubstr("/guards.ranges.highest"));
  EXPECT_THAT(with("fallback.slope", -kInfinity), HasSubstr("/fallback.slope"));
  EXPECT_THAT(with("residuals.edges", kNaN), HasSubstr("/residuals.edges"));
  EXPECT_THAT(with("residuals.std_dev", kInfinity), HasSubstr("/residuals.std_dev"));
  EXPECT_EQ(with("residuals.std_dev", kNaN), "") << "an error bar may lack evidence";
}

/// What is said of a network's file after `spoil` has been at its contents.
std::string complaint_about_network(const std::function<void(Safetensors&)>& spoil) {
  Safetensors contents =
      parse_safetensors(model_bytes(test::example_model_file(test::example<Lstm>())), "elbow");
  spoil(contents);
  return complaint(safetensors_bytes(contents));
}

TEST(BrokenModelFile, WithLayersThatAreNotOneBehindTheOther) {
  EXPECT_EQ(complaint_about_network([](Safetensors&) {}), "");
  const auto rename = [](const std::string& from, const std::string& to) {
    return complaint_about_network([&](Safetensors& contents) {
      for (const char* field : {"input_weights", "recurrent_weights", "bias"}) {
        auto node = contents.tensors.extract(from + field);
        node.key() = to + field;
        contents.tensors.insert(std::move(node));
      }
    });
  };
  EXPECT_THAT(rename("model.layers.1.", "model.layers.2."),
              HasSubstr("elbow: /model.layers.1: expected a tensor of that name, found none, but "
                        "model.layers.2"));
  EXPECT_THAT(rename("model.layers.1.", "model.layers.64."),
              AllOf(HasSubstr("expected at most 64 elements of model.layers"),
                    HasSubstr("found one of index 64")));
  EXPECT_THAT(rename("model.layers.1.", "model.layers.18446744073709551616."),
              HasSubstr("expected only tensors of the family lstm"));
  EXPECT_THAT(rename("model.layers.1.", "model.layers.01."),
              HasSubstr("/model.layers.1.input_weights: expected a tensor, found none"));
  EXPECT_THAT(rename("model.layers.1.", "model.layers.x."),
              HasSubstr("/model.layers.x.bias: expected only tensors of the family lstm"));
  EXPECT_THAT(rename("model.layers.1.", "model.layers."),
              HasSubstr("expected only tensors of the family lstm"));
  EXPECT_THAT(complaint_about_network([](Safetensors& contents) {
                std::erase_if(contents.tensors, [](const auto& named) {
                  return named.first.starts_with("model.layers.");
                });
              }),
              HasSubstr("elbow: lstm: layers: expected 1 to 64 layers, found 0"));
}

TEST(BrokenModelFile, WithWeightsThatLie) {
  const auto with = [](const char* name, const Tensor& tensor) {
    return complaint_about_network(
        [&](Safetensors& contents) { contents.tensors.at(name) = tensor; });
  };
  EXPECT_THAT(with("model.layers.1.bias", {{12}, std::vector<double>(12)}),
              HasSubstr("elbow: /model.layers.1.bias: expected F32 of shape [n], found another "
                        "element type"));
  EXPECT_THAT(with("model.layers.1.bias", {{3, 4}, std::vector<float>(12)}),
              HasSubstr("expected F32 of shape [n], found shape [3, 4]"));
  EXPECT_THAT(with("model.layers.1.bias", {{11}, std::vector<float>(11)}),
              HasSubstr("elbow: lstm: layers.1.bias: expected 12 numbers, found 11"));
  EXPECT_THAT(with("model.layers.1.recurrent_weights", {{3, 12}, std::vector<float>(36)}),
              HasSubstr("elbow: lstm: layers.1.recurrent_weights: expected 4 rows for each of"));
  EXPECT_THAT(with("model.head.0.weights", {{0, 1U << 30U}, std::vector<float>{}}),
              HasSubstr("/model.head.0.weights: expected an empty table of at most 65536"));
  EXPECT_THAT(with("model.head.0.weights", {{4, 1U << 10U}, std::vector<float>(4U << 10U)}),
              HasSubstr("elbow: lstm: head.0.weights: expected 4 x 3, found 4 x 1024"));
  std::vector<float> unmeasured(12, 0.0F);
  unmeasured[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(with("model.layers.1.bias", {{12}, unmeasured}),
              HasSubstr("elbow: /model.layers.1.bias: expected finite numbers, found nan at "
                        "index 5"));
  EXPECT_THAT(with("model.sample_period_s", {{}, std::vector{0.01}}),
              HasSubstr("elbow: sample rate: expected 100 Hz, at which the lstm was trained"));
}

TEST(BrokenModelFile, WithAResidualThatIsNotOneModel) {
  const auto after = [](const std::function<void(Safetensors&)>& spoil) {
    const GreyBox box = test::example<test::GreyBoxWithMlp>();
    Safetensors contents = parse_safetensors(model_bytes(test::example_model_file(box)), "elbow");
    spoil(contents);
    return complaint(safetensors_bytes(contents));
  };
  const auto add = [&](const char* name) {
    return after([&](Safetensors& contents) { contents.tensors[name] = {{}, std::vector{1.0}}; });
  };
  const auto without = [&](const std::string& prefix) {
    return after([&](Safetensors& contents) {
      std::erase_if(contents.tensors,
                    [&](const auto& named) { return named.first.starts_with(prefix); });
    });
  };
  EXPECT_EQ(without("nothing"), "");
  EXPECT_EQ(without("model.residual."), "") << "a box without a residual";
  EXPECT_THAT(add("model.residual.model.dgmm.clamp.width"),
              AllOf(HasSubstr("elbow: /model.residual.model.mlp."),
                    HasSubstr("expected tensors of one of mlp, dgmm, products, parametric_gp, "
                              "found dgmm and mlp")));
  EXPECT_THAT(add("model.residual.model.lstm.sample_period_s"),
              HasSubstr("elbow: /model.residual.model.lstm.sample_period_s: expected tensors of "
                        "one of mlp, dgmm, products, parametric_gp, found 'lstm'"));
  EXPECT_THAT(add("model.residual.mlp"), HasSubstr("elbow: /model.residual.mlp: expected only"));
  EXPECT_THAT(without("model.residual.model."),
              HasSubstr("elbow: /model.residual.model: expected tensors of one of mlp, dgmm, "
                        "products, parametric_gp, found none"));
  EXPECT_THAT(without("model.residual.bound"),
              HasSubstr("elbow: /model.residual.bound: expected a tensor, found none"));
  EXPECT_THAT(add("model.residual.model.mlp.layers.64.bias"), HasSubstr("at most 64 elements"));
}

TEST(BrokenModelFile, WithTensorsThatOverlapOrRunOut) {
  // fallback.intercept, fallback.residual_std: 8 bytes each, the first two of the file.
  EXPECT_THAT(complaint_about_header(R"("data_offsets":[8,16])", R"("data_offsets":[0,08])"),
              HasSubstr("elbow: header: expected JSON"));
  EXPECT_THAT(complaint_about_header(R"("data_offsets":[8,16])", R"("data_offsets":[0,8] )"),
              HasSubstr("(overlap)"));
  EXPECT_THAT(complaint_about_header(R"("data_offsets":[8,16])", R"("data_offsets":[9,17])"),
              HasSubstr("/fallback.residual_std/data_offsets: expected begin 8, where the tensor "
                        "before it ends, found 9 (gap)"));
  EXPECT_THAT(complaint_about_header(R"("data_offsets":[8,16])", R"("data_offsets":[8,99])"),
              HasSubstr("/fallback.residual_std: expected 8 bytes for F64 [], found 91"));
}

}  // namespace
}  // namespace torsio
