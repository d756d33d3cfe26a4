#include "data/read_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <string_view>
#include <utility>

#include "data/byte_source.hpp"
#include "data/csv/csv_table.hpp"
#include "data/mcap/mcap_table.hpp"
#include "data/yaml_reader.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/log_summary.hpp"

namespace torsio {
namespace {

/// A source whose first bytes were looked at.
class PeekedBytes final : public ByteSource {
 public:
  explicit PeekedBytes(std::unique_ptr<ByteSource> source) : source_(std::move(source)) {
    constexpr std::size_t kLongestMark = 16;
    start_.resize(kLongestMark);
    std::size_t size = 0;
    while (size < start_.size()) {
      const std::size_t got = source_->read(start_.data() + size, start_.size() - size);
      if (got == 0) break;
      size += got;
    }
    start_.resize(size);
  }

  [[nodiscard]] std::string_view start() const noexcept { return start_; }

  std::size_t read(char* out, std::size_t size) override {
    const std::size_t left = start_.size() - given_;
    if (left == 0) return source_->read(out, size);
    const std::size_t count = std::min(left, size);
    start_.copy(out, count, given_);
    given_ += count;
    return count;
  }
  std::string sha256() override { return source_->sha256(); }

 private:
  std::unique_ptr<ByteSource> source_;
  std::string start_;
  std::size_t given_ = 0;
};

struct ForeignFormat {
  std::string_view mark;
  std::string_view name;
  std::string_view advice;
};

constexpr std::array<ForeignFormat, 6> kForeign{
    {{"#ROSBAG V2.0", "a bag of ROS 1", "Convert it: mcap convert RUN.bag RUN.mcap"},
     {"SQLite format 3", "a database, perhaps rosbag2's .db3",
      "Convert it: ros2 bag convert with storage_id: mcap"},
     {"MATLAB 5.0 MAT", "a MATLAB file", "Write a table: writetable(t, 'run.csv')"},
     {"MATLAB 7.3 MAT", "a MATLAB file", "Write a table: writetable(t, 'run.csv')"},
     {"\x89HDF\r\n", "an HDF5 file", "Write a CSV file with one column for each signal."},
     {"PK\x03\x04", "a ZIP archive, perhaps numpy's .npz",
      "Write a CSV file with one column for each signal."}}};

void refuse_foreign(std::string_view start, const std::string& name) {
  for (const ForeignFormat& format : kForeign)
    if (start.starts_with(format.mark))
      throw Error({.place = name,
                   .expected = "a CSV or MCAP file",
                   .found = std::string(format.name),
                   .advice = std::string(format.advice)});
}

std::string name_of(const std::string& path) { return path == "-" ? "standard input" : path; }

/// The files of a folder of rosbag2, in the order of its metadata.
std::vector<std::string> files_of_bag(const std::filesystem::path& folder,
                                      const Progress& progress) {
  const std::string metadata = (folder / "metadata.yaml").string();
  std::error_code absent;
  if (!std::filesystem::exists(metadata, absent))
    throw Error({.place = folder.string(),
                 .expected = "a file, or a folder of rosbag2 with metadata.yaml",
                 .found = "another folder"});
  const YamlValue paths = YamlValue::read(metadata, progress)
                              .at("rosbag2_bagfile_information")
                              .at("relative_file_paths");
  std::vector<std::string> files;
  for (const std::string& file : paths.texts())
    files.push_back((folder / std::filesystem::path(file).filename()).string());
  if (files.empty()) paths.refuse("at least one file");
  return files;
}

/// The open files of a recording in MCAP.
struct OpenFiles {
  std::vector<std::unique_ptr<PeekedBytes>> sources;
  std::vector<NamedBytes> named;

  void add(const std::string& path, const Progress& progress) {
    sources.push_back(std::make_unique<PeekedBytes>(open_bytes(path, progress)));
    named.push_back({.name = name_of(path), .bytes = sources.back().get()});
  }
};

OpenFiles open_log(const std::string& path, const Progress& progress) {
  OpenFiles files;
  std::error_code absent;
  if (path != "-" && std::filesystem::is_directory(path, absent)) {
    for (const std::string& file : files_of_bag(path, progress)) files.add(file, progress);
  } else {
    files.add(path, progress);
  }
  return files;
}

}  // namespace

LogTable read_log(const std::string& path, const ReadLogOptions& options) {
  const OpenFiles files = open_log(path, options.progress);
  const std::string name = name_of(path);
  PeekedBytes& first = *files.sources.front();
  if (files.sources.size() > 1 || first.start().starts_with(kMcapMark))
    return read_mcap(files.named, name, {.wanted = options.wanted});
  refuse_foreign(first.start(), name);
  return read_csv(first, name, {.skip = options.skip});
}

LogSummary list_log(const std::string& path, const Progress& progress) {
  const OpenFiles files = open_log(path, progress);
  const std::string_view start = files.sources.front()->start();
  refuse_foreign(start, name_of(path));
  if (!start.starts_with(kMcapMark))
    throw Error({.place = name_of(path),
                 .expected = "an MCAP file or the folder of rosbag2",
                 .found = "another file",
                 .advice = "The columns of a CSV file are in its first line."});
  return list_mcap(files.named);
}

}  // namespace torsio
