#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "data/arrays/placed_bytes.hpp"
#include "data/read_budget.hpp"
#include "files/output_file.hpp"

namespace torsio {

/// The first bytes of a ZIP archive.
inline constexpr std::string_view kZipMark{"PK\x03\x04", 4};

/// A file in an archive.
struct ZipMember {
  std::string name;
  std::uint16_t packing = 0;  ///< 0: stored, 8: deflated
  std::uint32_t checksum = 0;
  std::uint64_t packed_bytes = 0;
  std::uint64_t bytes = 0;
  std::uint64_t start = 0;  ///< place of its header in the archive
};

/// A ZIP archive, with 64-bit sizes or without. Source: PKWARE, APPNOTE 6.3.
class ZipArchive {
 public:
  /// Both must outlive the archive. @throws Error if its directory is damaged, or beyond the budget.
  ZipArchive(const PlacedBytes& bytes, ReadBudget& budget);

  [[nodiscard]] const std::vector<ZipMember>& members() const noexcept { return members_; }
  /// The first bytes, up to `size`, without verification. @throws Error as `read`.
  [[nodiscard]] std::string start(const ZipMember& member, std::uint64_t size) const;
  /// @throws Error if it is damaged, encrypted, packed in another way, or beyond the budget.
  [[nodiscard]] std::string read(const ZipMember& member) const;

 private:
  [[nodiscard]] std::string packed(const ZipMember& member, std::uint64_t size) const;
  [[noreturn]] void refuse(const std::string& problem) const;

  const PlacedBytes& bytes_;
  ReadBudget& budget_;
  std::vector<ZipMember> members_;
};

/// Writes files into an archive, stored as they are. Equal files give equal bytes.
class ZipWriter {
 public:
  explicit ZipWriter(OutputFile& file) : file_(file) {}

  /// @throws Error if the archive would need 64-bit sizes.
  void add(const std::string& name, std::string_view bytes);
  /// Call once, at the end.
  void finish();

 private:
  void put(std::string_view bytes);

  OutputFile& file_;
  std::uint64_t written_ = 0;
  std::vector<ZipMember> members_;
};

}  // namespace torsio
