#include "files/safetensors.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/checks.hpp"
#include "files/json_text.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "the format's byte order is ours");

constexpr std::size_t kLengthBytes = 8;
constexpr std::size_t kMaxDimensions = 8;
constexpr std::string_view kMetadataKey = "__metadata__";
constexpr std::string_view kDamaged = "The file is damaged: copy it again or fit the model again.";

/// The element types, in the order of `Tensor::Values`.
struct ElementType {
  std::string_view name;
  std::size_t bytes;
};
constexpr auto kElementTypes =
    std::to_array<ElementType>({{"F64", 8}, {"I64", 8}, {"F32", 4}, {"U8", 1}});
static_assert(kElementTypes.size() == std::variant_size_v<Tensor::Values>);

[[noreturn]] void refuse_file(const ErrorPlace& place, std::string_view expected,
                              std::string_view found) {
  refuse(place, expected, found, kDamaged);
}

/// `first` times all factors; nothing if that overflows.
std::optional<std::size_t> product(std::span<const std::size_t> factors, std::size_t first = 1) {
  std::size_t result = first;
  for (const std::size_t factor : factors) {
    if (factor != 0 && result > std::numeric_limits<std::size_t>::max() / factor) return {};
    result *= factor;
  }
  return result;
}

// ---- reading

/// The header's entry of one tensor, checked by itself.
struct Entry {
  std::string name;
  std::size_t type = 0;  ///< index in kElementTypes
  std::vector<std::size_t> shape;
  std::size_t begin = 0;  ///< in the data after the header
  std::size_t end = 0;
};

std::vector<std::size_t> sizes(const json& list, std::size_t most, const std::string& place) {
  if (!list.is_array() || list.size() > most)
    refuse_file(place, fmt::format("a list of at most {} sizes", most), list.type_name());
  std::vector<std::size_t> result;
  for (const json& size : list) {
    if (!size.is_number_unsigned()) refuse_file(place, "whole numbers from 0", size.dump());
    result.push_back(size.get<std::size_t>());
  }
  return result;
}

const json& member(const json& object, const char* key, const std::string& place) {
  const auto found = object.find(key);
  if (found == object.end()) refuse_file(place, fmt::format("the key '{}'", key), "none");
  return *found;
}

Entry parse_entry(const std::string& name, const json& value, const std::string& place) {
  if (!value.is_object() || value.size() != 3)
    refuse_file(place, "an object of dtype, shape and data_offsets", value.type_name());
  Entry entry;
  entry.name = name;
  const json& type = member(value, "dtype", place);
  const auto* const known = std::ranges::find_if(
      kElementTypes, [&](const ElementType& known_type) { return type == known_type.name; });
  if (known == kElementTypes.end())
    refuse_file(place + "/dtype", R"("F64", "I64", "F32" or "U8")", type.dump());
  entry.type = static_cast<std::size_t>(known - kElementTypes.begin());
  entry.shape = sizes(member(value, "shape", place), kMaxDimensions, place + "/shape");
  const auto offsets = sizes(member(value, "data_offsets", place), 2, place + "/data_offsets");
  if (offsets.size() != 2 || offsets[0] > offsets[1])
    refuse_file(place + "/data_offsets", "begin and end", fmt::format("{}", offsets));
  entry.begin = offsets[0];
  entry.end = offsets[1];

  const auto bytes = product(entry.shape, known->bytes);
  if (bytes != entry.end - entry.begin)
    refuse_file(place,
                fmt::format("{} bytes for {} {}", bytes ? fmt::format("{}", *bytes) : "countless",
                            known->name, shape_text(entry.shape)),
                fmt::format("{}", entry.end - entry.begin));
  return entry;
}

std::map<std::string, std::string> parse_metadata(const json& value, const std::string& place) {
  if (!value.is_object()) refuse_file(place, "an object of strings", value.type_name());
  std::map<std::string, std::string> metadata;
  for (const auto& [key, text] : value.items()) {
    if (!text.is_string())
      refuse_file(fmt::format("{}/{}", place, key), "a string", text.type_name());
    metadata[key] = text.get<std::string>();
  }
  return metadata;
}

/// Tensors must lie end to end: no two share a byte, no byte is hidden between them.
void check_layout(std::vector<Entry>& entries, std::size_t data_bytes, std::string_view place) {
  std::ranges::sort(entries, {},
                    [](const Entry& entry) { return std::pair(entry.begin, entry.end); });
  std::size_t at = 0;
  for (const Entry& entry : entries) {
    const std::string where = fmt::format("{}: /{}/data_offsets", place, entry.name);
    if (entry.begin != at)
      refuse_file(where, fmt::format("begin {}, where the tensor before it ends", at),
                  fmt::format("{} ({})", entry.begin, entry.begin < at ? "overlap" : "gap"));
    if (entry.end > data_bytes)
      refuse_file(where, fmt::format("an end within the {} bytes of data", data_bytes),
                  fmt::format("{}", entry.end));
    at = entry.end;
  }
  if (at != data_bytes)
    refuse_file(std::string(place), fmt::format("{} bytes of data", at),
                fmt::format("{}", data_bytes));
}

template <class T>
std::vector<T> copied(std::span<const std::byte> bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

Tensor::Values copied_values(std::size_t type, std::span<const std::byte> bytes) {
  switch (type) {
    case 0: return copied<double>(bytes);
    case 1: return copied<std::int64_t>(bytes);
    case 2: return copied<float>(bytes);
    default: return copied<std::uint8_t>(bytes);
  }
}

bool is_text(std::span<const std::byte> bytes) {
  return std::ranges::all_of(bytes, [](std::byte byte) {
    return (byte >= std::byte{0x20} && byte < std::byte{0x7f}) || byte == std::byte{'\t'} ||
           byte == std::byte{'\r'} || byte == std::byte{'\n'};
  });
}

std::string_view header_of(std::span<const std::byte> bytes, std::string_view place) {
  if (bytes.size() < kLengthBytes)
    refuse_file(std::string(place), "a safetensors file of at least 8 bytes",
                fmt::format("{} bytes", bytes.size()));
  std::uint64_t length = 0;
  std::memcpy(&length, bytes.data(), kLengthBytes);
  if (length > kMaxHeaderBytes)
    throw Error(
        {.place = fmt::format("{}: header length", place),
         .expected = fmt::format("at most {} bytes", kMaxHeaderBytes),
         .found = is_text(bytes.first(kLengthBytes)) ? "text" : fmt::format("{}", length),
         .advice = is_text(bytes.first(kLengthBytes))
                       ? "This is not a model file. If it is a recording: the model comes first, "
                         "then the recordings."
                       : "This is not a safetensors file, or torsio did not write it."});
  if (length > bytes.size() - kLengthBytes)
    refuse_file(fmt::format("{}: header", place), fmt::format("{} bytes", length),
                fmt::format("{} (the file is truncated)", bytes.size() - kLengthBytes));
  return {reinterpret_cast<const char*>(bytes.data()) + kLengthBytes, length};
}

// ---- writing

std::size_t value_count(const Tensor& tensor) {
  return std::visit([](const auto& values) { return values.size(); }, tensor.values);
}

std::span<const std::byte> value_bytes(const Tensor& tensor) {
  return std::visit([](const auto& values) { return std::as_bytes(std::span(values)); },
                    tensor.values);
}

}  // namespace

std::string shape_text(std::span<const std::size_t> shape) {
  return fmt::format("[{}]", fmt::join(shape, ", "));
}

Safetensors parse_safetensors(std::span<const std::byte> bytes, std::string_view place) {
  const std::string_view text = header_of(bytes, place);
  const auto data = bytes.subspan(kLengthBytes + text.size());
  const json header = parse_json(text, fmt::format("{}: header", place));
  if (!header.is_object())
    refuse_file(fmt::format("{}: header", place), "a JSON object", header.type_name());

  Safetensors contents;
  std::vector<Entry> entries;
  for (const auto& [name, value] : header.items()) {
    const std::string where = fmt::format("{}: /{}", place, name);
    if (name == kMetadataKey) {
      contents.metadata = parse_metadata(value, where);
    } else {
      entries.push_back(parse_entry(name, value, where));
    }
  }
  check_layout(entries, data.size(), place);
  for (Entry& entry : entries)
    contents.tensors[entry.name] = {
        .shape = std::move(entry.shape),
        .values = copied_values(entry.type, data.subspan(entry.begin, entry.end - entry.begin))};
  return contents;
}

std::vector<std::byte> safetensors_bytes(const Safetensors& contents) {
  std::vector<const std::pair<const std::string, Tensor>*> ordered;
  for (const auto& named : contents.tensors) ordered.push_back(&named);
  std::ranges::stable_sort(ordered, std::greater<>{}, [](const auto* named) {
    return kElementTypes[named->second.values.index()].bytes;
  });

  nlohmann::ordered_json header = nlohmann::ordered_json::object();
  if (!contents.metadata.empty()) header[std::string(kMetadataKey)] = contents.metadata;
  std::size_t at = 0;
  for (const auto* named : ordered) {
    const auto& [name, tensor] = *named;
    if (product(tensor.shape) != value_count(tensor))
      throw Error({.place = "/" + name,
                   .expected = fmt::format("values that fill {}", shape_text(tensor.shape)),
                   .found = fmt::format("{} values", value_count(tensor))});
    const std::size_t end = at + value_bytes(tensor).size();
    header[name] = {{"dtype", kElementTypes[tensor.values.index()].name},
                    {"shape", tensor.shape},
                    {"data_offsets", {at, end}}};
    at = end;
  }
  // Bytes that are not UTF-8 (in a file's name) become the replacement character.
  std::string text = header.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  text.resize((text.size() + kLengthBytes - 1) / kLengthBytes * kLengthBytes, ' ');
  if (text.size() > kMaxHeaderBytes)
    throw Error({.place = "safetensors header",
                 .expected = fmt::format("at most {} bytes", kMaxHeaderBytes),
                 .found = fmt::format("{}", text.size())});

  std::vector<std::byte> bytes(kLengthBytes + text.size() + at);
  auto cursor = bytes.begin();
  const auto put = [&cursor](std::span<const std::byte> more) {
    cursor = std::ranges::copy(more, cursor).out;
  };
  const std::uint64_t length = text.size();
  put(std::as_bytes(std::span(&length, 1)));
  put(std::as_bytes(std::span(text)));
  for (const auto* named : ordered) put(value_bytes(named->second));
  return bytes;
}

}  // namespace torsio
