// zstd for the readers of MCAP.
import zstd from "@foxglove/wasm-zstd";

export async function ZstdDecoder() {
  await zstd.isLoaded;
  return (packed, size) => zstd.decompress(packed, size);
}
