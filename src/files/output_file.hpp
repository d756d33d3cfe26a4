#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace torsio {

/// A file that is written completely or not at all.
///
/// It is written under a temporary name in the same folder; `commit` syncs and renames it, so that
/// the target has either its old bytes or all new ones, also after a power loss. Without
/// `commit` it leaves no file. A symbolic link remains a link, and a replaced file keeps its mode. A
/// device or pipe is written directly.
class OutputFile {
 public:
  /// The file that `path` names: the end of its chain of symbolic links, which need not exist.
  [[nodiscard]] static std::filesystem::path target_of(std::filesystem::path path);
  /// Whether `target` is a file that no one may write. Its folder may allow to replace it all the
  /// same, but its owner has protected it.
  [[nodiscard]] static bool is_protected(const std::filesystem::path& target);
  /// Removes the temporary files of all that are neither committed nor destroyed: for the handler of
  /// a signal that ends the program. Async-signal-safe.
  static void remove_unfinished() noexcept;

  /// @throws Error (no such folder, no permission, the target is a directory or protected).
  explicit OutputFile(const std::filesystem::path& path);
  /// Is written directly, too.
  [[nodiscard]] static OutputFile standard_output();
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// @throws Error if the disk is full, or the pipe has no reader any more.
  void write(std::span<const std::byte> bytes);
  /// Call once, at the end. @throws Error; the target is then untouched.
  void commit();

 private:
  OutputFile(std::filesystem::path place, int descriptor);
  [[noreturn]] void refuse() const;

  std::filesystem::path place_;      ///< for messages
  std::filesystem::path target_;     ///< final name of `temporary_`
  std::filesystem::path temporary_;  ///< empty: none to remove
  int descriptor_ = -1;
};

}  // namespace torsio
