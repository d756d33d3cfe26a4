#include "files/safetensors.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cstring>
#include <limits>
#include <numbers>
#include <string>

#include "support/error_message.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

std::vector<std::byte> file_bytes(std::string_view header, std::size_t data_bytes = 0) {
  const std::uint64_t length = header.size();
  std::vector<std::byte> bytes(8 + header.size() + data_bytes);
  std::memcpy(bytes.data(), &length, 8);
  std::memcpy(bytes.data() + 8, header.data(), header.size());
  return bytes;
}

std::string complaint(std::string_view header, std::size_t data_bytes = 0) {
  return test::error_message(
      [&] { (void)parse_safetensors(file_bytes(header, data_bytes), "m.safetensors"); });
}

Safetensors example_tensors() {
  Safetensors contents;
  contents.metadata["note"] = "a \"quoted\" µ";
  contents.tensors["weights"] = {.shape = {2, 3},
                                 .values = std::vector{0.1, -0.0, 1e-310, 4., 5., 6.}};
  contents.tensors["bias"] = {.shape = {}, .values = std::vector{std::numbers::pi}};
  contents.tensors["none"] = {.shape = {0, 7}, .values = std::vector<double>{}};
  contents.tensors["count"] = {.shape = {1}, .values = std::vector<std::int64_t>{-3}};
  contents.tensors["b_floats"] = {.shape = {3}, .values = std::vector{0.1F, -0.0F, 1e-40F}};
  contents.tensors["a_flag"] = {.shape = {}, .values = std::vector<std::uint8_t>{1}};
  return contents;
}

TEST(Safetensors, ComeBackAsTheyWere) {
  EXPECT_EQ(parse_safetensors(safetensors_bytes(example_tensors()), "m"), example_tensors());
  EXPECT_EQ(parse_safetensors(safetensors_bytes({}), "m"), Safetensors{});
}

TEST(Safetensors, AreTheSameBytesEachTime) {
  const auto bytes = safetensors_bytes(example_tensors());
  EXPECT_EQ(safetensors_bytes(parse_safetensors(bytes, "m")), bytes);
}

RC_GTEST_PROP(Safetensors, KeepEveryBitOfADouble, (const std::vector<std::uint64_t>& bits)) {
  std::vector<double> values;
  for (const std::uint64_t pattern : bits) values.push_back(std::bit_cast<double>(pattern));
  Safetensors contents;
  contents.tensors["x"] = {.shape = {values.size()}, .values = values};
  const Safetensors back = parse_safetensors(safetensors_bytes(contents), "m");
  const auto& read = std::get<std::vector<double>>(back.tensors.at("x").values);
  RC_ASSERT(read.size() == bits.size());
  for (std::size_t i = 0; i < bits.size(); ++i)
    RC_ASSERT(std::bit_cast<std::uint64_t>(read[i]) == bits[i]);
}

TEST(Safetensors, AlignEveryTensorToItsElements) {
  const auto bytes = safetensors_bytes(example_tensors());
  std::uint64_t header = 0;
  std::memcpy(&header, bytes.data(), 8);
  EXPECT_EQ(header % 8, 0U);
  const std::string text(reinterpret_cast<const char*>(bytes.data()) + 8, header);
  EXPECT_LT(text.find("weights"), text.find("b_floats")) << "floats follow the doubles";
  EXPECT_LT(text.find("b_floats"), text.find("a_flag")) << "bytes follow the floats";
}

TEST(Safetensors, RefuseValuesThatDoNotFillTheirShape) {
  Safetensors contents;
  contents.tensors["x"] = {.shape = {2, 2}, .values = std::vector{1.0, 2.0, 3.0}};
  EXPECT_THAT(test::error_message([&] { (void)safetensors_bytes(contents); }),
              HasSubstr("/x: expected values that fill [2, 2], found 3 values"));
}

TEST(Safetensors, RefuseToWriteAHeaderThatTheyWouldNotRead) {
  Safetensors contents;
  contents.metadata["long"] = std::string(kMaxHeaderBytes, 'x');
  EXPECT_THROW((void)safetensors_bytes(contents), Error);
}

TEST(Safetensors, RefuseAHugeHeaderBeforeTheyReadIt) {
  auto bytes = file_bytes("{}");
  const std::uint64_t huge = std::numeric_limits<std::uint64_t>::max();
  std::memcpy(bytes.data(), &huge, 8);
  EXPECT_THAT(test::error_message([&] { (void)parse_safetensors(bytes, "m"); }),
              HasSubstr("m: header length: expected at most 1048576 bytes"));
}

TEST(Safetensors, RefuseWhatIsNoHeader) {
  EXPECT_THAT(complaint(""), HasSubstr("m.safetensors: header: expected JSON"));
  EXPECT_THAT(complaint("[]"), HasSubstr("expected a JSON object, found array"));
  EXPECT_THAT(complaint("{\"x\": 1e999}"), HasSubstr("numbers that a double can hold"));
  EXPECT_THAT(complaint("{\"x\": \"\xff\"}"), HasSubstr("expected JSON"));
  EXPECT_THAT(complaint(R"({"__metadata__":{"a":1}})"),
              HasSubstr("/__metadata__/a: expected a string, found number"));
  EXPECT_THAT(complaint(R"({"x":7})"), HasSubstr("/x: expected an object of dtype, shape"));
  EXPECT_THAT(complaint(R"({"x":{"dtype":"F64","shape":[],"offsets":[0,8]}})", 8),
              HasSubstr("/x: expected the key 'data_offsets', found none"));
}

TEST(Safetensors, RefuseDeepNestingAndKeysThatComeTwice) {
  const std::string deep = R"({"x":)" + std::string(500'000, '[') + std::string(500'000, ']') + "}";
  EXPECT_THAT(complaint(deep), HasSubstr("expected at most 8 levels of nesting, found more"));
  EXPECT_THAT(complaint(R"({"x":{"dtype":"U8","shape":[],"dtype":"F64","data_offsets":[0,8]}})", 8),
              HasSubstr("expected each key once, found \"dtype\" twice"));
}

TEST(Safetensors, RefuseTypesAndShapesThatTheyDoNotKnow) {
  EXPECT_THAT(complaint(R"({"x":{"dtype":"F16","shape":[1],"data_offsets":[0,2]}})", 2),
              HasSubstr(R"(/x/dtype: expected "F64", "I64", "F32" or "U8", found "F16")"));
  EXPECT_THAT(complaint(R"({"x":{"dtype":"F64","shape":[-1],"data_offsets":[0,8]}})", 8),
              HasSubstr("/x/shape: expected whole numbers from 0, found -1"));
  EXPECT_THAT(complaint(R"({"x":{"dtype":"F64","shape":[1.0],"data_offsets":[0,8]}})", 8),
              HasSubstr("/x/shape: expected whole numbers"));
  EXPECT_THAT(
      complaint(R"({"x":{"dtype":"U8","shape":[1,1,1,1,1,1,1,1,1],"data_offsets":[0,1]}})", 1),
      HasSubstr("/x/shape: expected a list of at most 8 sizes"));
}

TEST(Safetensors, RefuseShapesWhoseSizeOverflows) {
  EXPECT_THAT(
      complaint(R"({"x":{"dtype":"F64","shape":[4294967296,4294967296],"data_offsets":[0,0]}})"),
      HasSubstr("/x: expected countless bytes for F64 [4294967296, 4294967296], found 0"));
  EXPECT_THAT(
      complaint(R"({"x":{"dtype":"F64","shape":[2305843009213693952],"data_offsets":[0,0]}})"),
      HasSubstr("expected countless bytes"));
}

TEST(Safetensors, RefuseTensorsThatOverlapLeaveGapsOrRunOut) {
  const auto with_second = [](std::string_view second) {
    return std::string(R"({"a":{"dtype":"U8","shape":[4],"data_offsets":[0,4]},"b":)") +
           std::string(second) + "}";
  };
  EXPECT_THAT(
      complaint(with_second(R"({"dtype":"U8","shape":[4],"data_offsets":[2,6]})"), 6),
      HasSubstr(
          "/b/data_offsets: expected begin 4, where the tensor before it ends, found 2 (overlap)"));
  EXPECT_THAT(complaint(with_second(R"({"dtype":"U8","shape":[4],"data_offsets":[5,9]})"), 9),
              HasSubstr("found 5 (gap)"));
  EXPECT_THAT(complaint(with_second(R"({"dtype":"U8","shape":[4],"data_offsets":[4,8]})"), 7),
              HasSubstr("/b/data_offsets: expected an end within the 7 bytes of data, found 8"));
  EXPECT_THAT(complaint(with_second(R"({"dtype":"U8","shape":[4],"data_offsets":[4,8]})"), 9),
              HasSubstr("m.safetensors: expected 8 bytes of data, found 9"));
  EXPECT_THAT(complaint(with_second(R"({"dtype":"U8","shape":[4],"data_offsets":[8,4]})"), 8),
              HasSubstr("/b/data_offsets: expected begin and end"));
  EXPECT_THAT(complaint(with_second(R"({"dtype":"U8","shape":[5],"data_offsets":[4,8]})"), 8),
              HasSubstr("/b: expected 5 bytes for U8 [5], found 4"));
}

}  // namespace
}  // namespace torsio
