#include "data/arrays/placed_bytes.hpp"

#include <algorithm>
#include <fstream>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

class BytesInMemory final : public PlacedBytes {
 public:
  explicit BytesInMemory(std::string_view bytes) : bytes_(bytes) {}
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  [[nodiscard]] std::string at(std::uint64_t start, std::uint64_t size) const override {
    return start > bytes_.size() ? std::string() : std::string(bytes_.substr(start, size));
  }

 private:
  std::string_view bytes_;
};

class BytesInFile final : public PlacedBytes {
 public:
  explicit BytesInFile(const std::string& path)
      : path_(path), file_(path, std::ios::binary | std::ios::ate) {
    if (!file_) throw Error({.place = path, .problem = "cannot be opened"});
    size_ = static_cast<std::uint64_t>(file_.tellg());
  }
  [[nodiscard]] std::uint64_t size() const override { return size_; }
  [[nodiscard]] std::string at(std::uint64_t start, std::uint64_t size) const override {
    if (start > size_) return {};
    std::string bytes(std::min(size, size_ - start), '\0');
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(start));
    file_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (file_.bad()) throw Error({.place = path_, .problem = "cannot be read"});
    bytes.resize(static_cast<std::size_t>(file_.gcount()));
    return bytes;
  }

 private:
  std::string path_;
  mutable std::ifstream file_;
  std::uint64_t size_ = 0;
};

}  // namespace

std::unique_ptr<PlacedBytes> placed_bytes(std::string_view bytes) {
  return std::make_unique<BytesInMemory>(bytes);
}

std::unique_ptr<PlacedBytes> placed_bytes_of(const std::string& path) {
  return std::make_unique<BytesInFile>(path);
}

}  // namespace torsio
