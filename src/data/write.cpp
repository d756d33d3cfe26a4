#include "torsio/data/write.hpp"

#include "data/arrays/mat.hpp"
#include "data/arrays/npz.hpp"
#include "data/mcap/mcap_write.hpp"
#include "files/output_file.hpp"

namespace torsio {

void write_recording(const Recording& recording, const std::string& path,
                     const Progress& progress) {
  const auto write = [&](auto format) {
    OutputFile file(path);
    format(recording, file, progress);
    file.commit();
  };
  if (path.ends_with(".mcap")) return write(write_mcap);
  if (path.ends_with(".npz")) return write(write_npz);
  if (path.ends_with(".mat")) return write(write_mat);
  write_csv(recording, path, progress);
}

}  // namespace torsio
