#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/checks.hpp"
#include "core/did_you_mean.hpp"
#include "data/names.hpp"
#include "files/json_text.hpp"
#include "files/safetensors.hpp"
#include "torsio/import/import_network.hpp"

namespace torsio {
namespace {

using nlohmann::json;

struct Weights {
  std::vector<std::size_t> shape;
  std::vector<double> values;
};

/// "10.weight" after "2.weight": digits are compared as numbers.
struct NaturalOrder {
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }
  static std::size_t digits(std::string_view text, std::size_t at) {
    std::size_t end = at;
    while (end < text.size() && is_digit(text[end])) ++end;
    return end - at;
  }
  bool operator()(std::string_view a, std::string_view b) const {
    std::size_t i = 0;
    std::size_t j = 0;
    while (i < a.size() && j < b.size()) {
      const std::size_t in_a = digits(a, i);
      const std::size_t in_b = digits(b, j);
      if (in_a != in_b && in_a > 0 && in_b > 0) return in_a < in_b;
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
    return a.size() - i < b.size() - j;
  }
};
using Tensors = std::map<std::string, Weights, NaturalOrder>;

/// A misspelt key would otherwise be a missing one, or ignored.
void refuse_unknown_keys(const json& object, std::span<const std::string_view> known,
                         const std::string& place) {
  for (const auto& [key, value] : object.items())
    if (std::ranges::find(known, key) == known.end())
      refuse(place, fmt::format("only the keys {}", fmt::join(known, ", ")),
             fmt::format("'{}'", printable(key)), did_you_mean(key, known));
}

std::vector<std::size_t> shape_of(const json& tensor, const std::string& place) {
  const auto shape = tensor.find("shape");
  if (shape == tensor.end() || !shape->is_array() || shape->size() > 8)
    refuse(place + "/shape", "a list of up to 8 sizes", "something else");
  std::vector<std::size_t> sizes;
  for (const json& size : *shape) {
    if (!size.is_number_unsigned() || size.get<std::uint64_t>() > kMaxForeignBytes)
      refuse(place + "/shape", "sizes that a file can hold", size.dump());
    sizes.push_back(size.get<std::size_t>());
  }
  return sizes;
}

Weights weights_of(const json& tensor, const std::string& place) {
  if (!tensor.is_object()) refuse(place, R"({"shape": [...], "data": [...]})", tensor.type_name());
  constexpr std::array<std::string_view, 2> kKeys{"shape", "data"};
  refuse_unknown_keys(tensor, kKeys, place);
  Weights weights{shape_of(tensor, place), {}};
  const auto data = tensor.find("data");
  if (data == tensor.end() || !data->is_array())
    refuse(place + "/data", "a flat list of numbers, row by row", "something else");
  std::size_t count = 1;
  for (const std::size_t size : weights.shape) {
    count *= size;
    if (count > kMaxForeignBytes) break;
  }
  if (data->size() != count)
    refuse(place + "/data",
           fmt::format("{} numbers for the shape {}", count, shape_text(weights.shape)),
           fmt::format("{}", data->size()));
  for (const json& value : *data) {
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      refuse(fmt::format("{}/data[{}]", place, weights.values.size()), "a finite number",
             value.is_structured() ? value.type_name() : value.dump());
    weights.values.push_back(value.get<double>());
  }
  return weights;
}

Tensors tensors_of(const json& document, const std::string& place) {
  constexpr std::array<std::string_view, 2> kKeys{"tensors", "arch"};  // arch: a remark
  if (document.is_object()) refuse_unknown_keys(document, kKeys, place);
  const auto list = document.is_object() ? document.find("tensors") : document.end();
  if (list == document.end() || !list->is_object())
    refuse(place, R"({"tensors": {name: {"shape": [...], "data": [...]}}})", "something else");
  Tensors tensors;
  for (const auto& [name, tensor] : list->items())
    tensors[name] = weights_of(tensor, fmt::format("{}: /tensors/{}", place, name));
  return tensors;
}

/// Returns tensors by name, each once, and refuses those that were not used.
class WeightReader {
 public:
  WeightReader(Tensors tensors, std::string place)
      : tensors_(std::move(tensors)), place_(std::move(place)) {}

  [[nodiscard]] std::optional<Weights> take(const std::string& name) {
    const auto found = tensors_.find(name);
    if (found == tensors_.end()) return std::nullopt;
    Weights weights = std::move(found->second);
    tensors_.erase(found);
    return weights;
  }
  [[nodiscard]] Matrix matrix(const std::string& name) {
    std::optional<Weights> weights = take(name);
    if (!weights) refuse(at(name), "a tensor", "none");
    if (weights->shape.size() != 2 || weights->values.empty())
      refuse(at(name), "a matrix", shape_text(weights->shape));
    Matrix result;
    result.rows = weights->shape[0];
    result.columns = weights->shape[1];
    result.values = std::move(weights->values);
    return result;
  }
  /// 0 if there is none, which is remembered.
  [[nodiscard]] std::vector<double> bias(const std::string& name, std::size_t length) {
    const std::optional<Weights> weights = take(name);
    std::vector<double> none(length, 0.0);
    if (!weights) {
      taken_as_zero_.push_back(name);
      return none;
    }
    if (weights->shape.size() != 1 || weights->values.size() != length)
      refuse(at(name), fmt::format("shape [{}]", length), shape_text(weights->shape));
    return weights->values;
  }
  [[nodiscard]] bool has(const std::string& name) const { return tensors_.contains(name); }
  /// @returns the parts before `suffix` of the names that end in it, in their order
  [[nodiscard]] std::vector<std::string> prefixes_of(std::string_view suffix) const {
    std::vector<std::string> prefixes;
    for (const auto& [name, weights] : tensors_)
      if (name.ends_with(suffix)) prefixes.push_back(name.substr(0, name.size() - suffix.size()));
    return prefixes;
  }
  [[nodiscard]] const std::vector<std::string>& taken_as_zero() const { return taken_as_zero_; }
  void refuse_the_rest() const {
    if (tensors_.empty()) return;
    refuse(
        at(tensors_.begin()->first),
        "weight_ih_l<k>, weight_hh_l<k>, bias_ih_l<k>, bias_hh_l<k> of one LSTM or GRU, weight and "
        "bias of dense layers, in_scale, out_scale",
        "another name",
        "Layers in both directions, projections, normalisation and embeddings are not supported.");
  }
  [[nodiscard]] std::string at(const std::string& name) const {
    return fmt::format("{}: /tensors/{}", place_, name);
  }

 private:
  Tensors tensors_;
  std::string place_;
  std::vector<std::string> taken_as_zero_;
};

void check_columns(const Matrix& matrix, std::size_t expected, const std::string& place) {
  if (matrix.columns != expected)
    refuse(place, fmt::format("{} columns, as many as the layer before has outputs", expected),
           fmt::format("{}", matrix.columns));
}

/// The layers of the one recurrent module, if there is one.
void read_recurrent(WeightReader& reader, std::vector<ForeignStage>& stages) {
  const std::vector<std::string> prefixes = reader.prefixes_of("weight_ih_l0");
  if (prefixes.empty()) return;
  std::size_t width = 0;
  for (std::size_t k = 0;; ++k) {
    const auto name = [&](const char* tensor) {
      return fmt::format("{}{}_l{}", prefixes.front(), tensor, k);
    };
    if (!reader.has(name("weight_ih"))) return;
    RecurrentStage stage;
    stage.input_weights = reader.matrix(name("weight_ih"));
    stage.recurrent_weights = reader.matrix(name("weight_hh"));
    const auto& [rows, units, values] = stage.recurrent_weights;
    if (rows != 4 * units && rows != 3 * units)
      refuse(reader.at(name("weight_hh")), "4 H x H of an LSTM or 3 H x H of a GRU",
             fmt::format("{} x {}", rows, units));
    stage.kind = rows == 4 * units ? RecurrentStage::Kind::lstm : RecurrentStage::Kind::gru;
    if (stage.input_weights.rows != rows)
      refuse(reader.at(name("weight_ih")), fmt::format("{} rows", rows),
             fmt::format("{}", stage.input_weights.rows));
    if (k > 0) check_columns(stage.input_weights, width, reader.at(name("weight_ih")));
    stage.input_bias = reader.bias(name("bias_ih"), rows);
    stage.recurrent_bias = reader.bias(name("bias_hh"), rows);
    width = units;
    stages.emplace_back(std::move(stage));
  }
}

void read_dense(WeightReader& reader, std::optional<Activation> activation,
                std::vector<ForeignStage>& stages) {
  std::optional<std::size_t> width;
  if (!stages.empty()) width = std::get<RecurrentStage>(stages.back()).recurrent_weights.columns;
  bool is_first = true;
  for (const std::string& prefix : reader.prefixes_of("weight")) {
    if (!is_first) {
      if (!activation)
        throw UsageError({.place = reader.at(prefix + "weight"),
                          .expected = "--activation: the function between the dense layers",
                          .found = "none, and the names of the tensors do not contain it"});
      stages.emplace_back(ActivationStage{*activation});
    }
    is_first = false;
    DenseStage stage{reader.matrix(prefix + "weight"), {}};
    if (width) check_columns(stage.weights, *width, reader.at(prefix + "weight"));
    width = stage.weights.rows;
    stage.bias = reader.bias(prefix + "bias", stage.weights.rows);
    stages.emplace_back(std::move(stage));
  }
}

std::size_t input_count(const ForeignStage& first) {
  if (const auto* recurrent = std::get_if<RecurrentStage>(&first))
    return recurrent->input_weights.columns;
  return std::get<DenseStage>(first).weights.columns;
}

AffineStage scale_stage(const Weights& scale, std::size_t width, const std::string& place) {
  if (scale.values.size() != width)
    refuse(place, fmt::format("{} numbers", width), fmt::format("{}", scale.values.size()));
  return {scale.values, std::vector<double>(width, 0.0)};
}

}  // namespace

bool is_weights_json(std::span<const std::byte> bytes) noexcept {
  const auto first = std::ranges::find_if_not(bytes, [](std::byte byte) {
    return byte == std::byte{' '} || byte == std::byte{'\t'} || byte == std::byte{'\n'} ||
           byte == std::byte{'\r'};
  });
  return first != bytes.end() && *first == std::byte{'{'};
}

ForeignNetwork parse_weights_json(std::span<const std::byte> bytes, std::string_view place,
                                  std::optional<Activation> activation) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as the text that they are
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  ForeignNetwork network{.place = std::string(place)};
  WeightReader reader(tensors_of(parse_json(text, place), network.place), network.place);
  const std::optional<Weights> in_scale = reader.take("in_scale");
  const std::optional<Weights> out_scale = reader.take("out_scale");
  read_recurrent(reader, network.stages);
  read_dense(reader, activation, network.stages);
  reader.refuse_the_rest();
  if (network.stages.empty()) refuse(network.place, "weights of at least one layer", "none");
  network.inputs = input_count(network.stages.front());
  if (!reader.taken_as_zero().empty())
    network.notes.push_back(
        fmt::format("the file has no {}: taken as 0, as of a layer without bias",
                    fmt::join(reader.taken_as_zero(), ", ")));
  if (in_scale)
    network.stages.insert(network.stages.begin(),
                          scale_stage(*in_scale, network.inputs, reader.at("in_scale")));
  if (out_scale) network.stages.emplace_back(scale_stage(*out_scale, 1, reader.at("out_scale")));
  return network;
}

}  // namespace torsio
