#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace torsio {

/// A file that grows by whole blocks: of a block that the disk does not take nothing stays.
class BlockFile {
 public:
  /// @throws Error if the file exists, or cannot be made.
  explicit BlockFile(const std::filesystem::path& path);
  ~BlockFile();
  BlockFile(const BlockFile&) = delete;
  BlockFile& operator=(const BlockFile&) = delete;

  /// False if the disk did not take all of it; `trouble` then contains the reason.
  bool append(std::span<const std::byte> block);
  bool sync();
  void close();
  [[nodiscard]] const std::string& trouble() const noexcept { return trouble_; }

 private:
  void note(int code);

  int descriptor_ = -1;
  std::int64_t size_ = 0;  ///< size of the complete blocks
  std::string trouble_;
};

}  // namespace torsio
