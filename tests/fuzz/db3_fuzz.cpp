#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "data/read_log.hpp"
#include "fuzz/budget_oracle.hpp"
#include "torsio/core/error.hpp"

namespace {

/// A file that each input overwrites; SQLite opens it by its name.
class ReusedFile {
 public:
  ReusedFile() : descriptor_(mkstemp(name_.data())) {}
  ~ReusedFile() {
    close(descriptor_);
    unlink(name_.c_str());
  }
  ReusedFile(const ReusedFile&) = delete;
  ReusedFile& operator=(const ReusedFile&) = delete;

  /// @returns whether the file has the bytes
  bool write(const std::uint8_t* data, std::size_t size) {
    return descriptor_ >= 0 && ftruncate(descriptor_, 0) == 0 &&
           pwrite(descriptor_, data, size, 0) == static_cast<ssize_t>(size);
  }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  std::string name_ = "/tmp/torsio_fuzz_db3_XXXXXX";
  int descriptor_;
};

}  // namespace

/// Any bytes, and any damaged or foreign database, are a table or an Error within the budget.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static ReusedFile file;
  if (!file.write(data, size)) return 0;
  torsio::fuzz::within_budget([&] {
    try {
      static_cast<void>(torsio::read_log(file.name()));
    } catch (const torsio::Error&) {
      return;
    }
  });
  return 0;
}
