#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace torsio {

/// A header longer than this is refused before it is read.
inline constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 20;

/// Numbers with a shape, row-major. The element type is the file's: F64, I64, F32 or U8.
struct Tensor {
  using Values = std::variant<std::vector<double>, std::vector<std::int64_t>, std::vector<float>,
                              std::vector<std::uint8_t>>;

  std::vector<std::size_t> shape;  ///< empty for a single number
  Values values;                   ///< as many as the product of `shape`
  bool operator==(const Tensor&) const = default;
};

/// The contents of a safetensors file: 8 bytes with the length of the header (little-endian), the
/// header as JSON, then the tensors' bytes without a gap. Source: the format's own description,
/// https://github.com/huggingface/safetensors
struct Safetensors {
  std::map<std::string, Tensor> tensors;
  std::map<std::string, std::string> metadata;
  bool operator==(const Safetensors&) const = default;
};

/// "[3, 4]", for messages; "[]" for a single number.
[[nodiscard]] std::string shape_text(std::span<const std::size_t> shape);

/// Reads untrusted bytes. Types, shapes and positions of all tensors are checked against the size
/// in `bytes` before memory is allocated for them.
/// @param place the file's name, for messages.
/// @throws Error if the header is too long, not JSON, nested too deep, names something twice, or
/// describes tensors that overlap, leave gaps or end elsewhere than the file.
[[nodiscard]] Safetensors parse_safetensors(std::span<const std::byte> bytes,
                                            std::string_view place);

/// The same contents always give the same bytes: wide element types first, so that every tensor is
/// aligned, then by name.
/// @throws Error if a tensor's values do not fill its shape or the header gets too long.
[[nodiscard]] std::vector<std::byte> safetensors_bytes(const Safetensors& contents);

}  // namespace torsio
