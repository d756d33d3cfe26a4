#include "data/ros/unpack_chunk.hpp"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <cstdint>
#include <limits>
#include <memory>

namespace torsio {
namespace {

bool unpack_zstd(std::string_view packed, std::string& unpacked) {
  const std::size_t size =
      ZSTD_decompress(unpacked.data(), unpacked.size(), packed.data(), packed.size());
  return ZSTD_isError(size) == 0 && size == unpacked.size();
}

bool unpack_lz4(std::string_view packed, std::string& unpacked) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) return false;
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      made, &LZ4F_freeDecompressionContext);
  std::size_t from = 0;
  std::size_t to = 0;
  std::size_t wanted = 1;
  while (wanted != 0 && from < packed.size()) {
    std::size_t taken = packed.size() - from;
    std::size_t given = unpacked.size() - to;
    wanted = LZ4F_decompress(context.get(), unpacked.data() + to, &given, packed.data() + from,
                             &taken, nullptr);
    if (LZ4F_isError(wanted) != 0 || (taken == 0 && given == 0)) return false;
    from += taken;
    to += given;
  }
  return wanted == 0 && to == unpacked.size();
}

bool unpack_bz2(std::string_view packed, std::string& unpacked) {
  constexpr auto kMax = std::numeric_limits<unsigned>::max();
  if (packed.size() > kMax || unpacked.size() > kMax) return false;
  auto size = static_cast<unsigned>(unpacked.size());
  // The library does not change what it reads.
  const int code =
      BZ2_bzBuffToBuffDecompress(unpacked.data(), &size, const_cast<char*>(packed.data()),
                                 static_cast<unsigned>(packed.size()), 0, 0);
  return code == BZ_OK && size == unpacked.size();
}

}  // namespace

bool unpack_chunk(std::string_view packing, std::string_view packed, std::size_t size,
                  std::string& unpacked) {
  if (packing.empty() || packing == "none") {
    unpacked = packed;
    return packed.size() == size;
  }
  unpacked.resize(size);
  if (packing == "zstd") return unpack_zstd(packed, unpacked);
  if (packing == "lz4") return unpack_lz4(packed, unpacked);
  if (packing == "bz2") return unpack_bz2(packed, unpacked);
  return false;
}

bool unpack_message(std::string_view packed, ReadBudget& budget, std::string& unpacked) {
  constexpr std::uint64_t kMaxBytes = std::uint64_t{256} << 20;
  constexpr std::uint64_t kBytesPerElement = 16;
  // What is unknown, or an error, is a larger number.
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size > kMaxBytes) return false;
  budget.require(size);
  budget.work(1 + size / kBytesPerElement);
  return unpack_chunk("zstd", packed, size, unpacked);
}

}  // namespace torsio
