#include "data/read_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "data/arrays/mat.hpp"
#include "data/arrays/npz.hpp"
#include "data/arrays/zip_archive.hpp"
#include "data/bag/bag_records.hpp"
#include "data/bam/bam_log.hpp"
#include "data/byte_source.hpp"
#include "data/csv/csv_table.hpp"
#include "data/db3/db3_messages.hpp"
#include "data/foreign_format.hpp"
#include "data/log_summary.hpp"
#include "data/mcap/mcap_records.hpp"
#include "data/names.hpp"
#include "data/ros/message_topics.hpp"
#include "data/yaml_reader.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

/// A source whose first bytes were looked at.
class PeekedBytes final : public ByteSource {
 public:
  explicit PeekedBytes(std::unique_ptr<ByteSource> source) : source_(std::move(source)) {
    constexpr std::size_t kStartBytes = 4096;  // marks are shorter, but not lines of JSON
    start_.resize(kStartBytes);
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
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override { return source_->bytes_read(); }

 private:
  std::unique_ptr<ByteSource> source_;
  std::string start_;
  std::size_t given_ = 0;
};

enum class Format : std::uint8_t { text, mcap, bag, db3, npz, mat, bam };

struct Mark {
  std::string_view mark;
  Format format;
};

constexpr std::array<Mark, 6> kMarks{{{kMcapMark, Format::mcap},
                                      {kBagMark, Format::bag},
                                      {kDb3Mark, Format::db3},
                                      {kZipMark, Format::npz},
                                      {"MATLAB 5.0 MAT", Format::mat},
                                      {"MATLAB 7.3 MAT", Format::mat}}};

/// By the first bytes; MATLAB's version 4 has none that are its own, and other programs leave them
/// out of version 7.3.
Format format_of(std::string_view start, const std::string& path) {
  for (const Mark& mark : kMarks)
    if (start.starts_with(mark.mark)) return mark.format;
  if (is_bam_log(start)) return Format::bam;
  return path.ends_with(".mat") ? Format::mat : Format::text;
}

std::string name_of(const std::string& path) { return path == "-" ? "standard input" : path; }

/// Whether the bytes of the path can be read once more, and in any order.
bool is_file(const std::string& path) {
  std::error_code unknown;
  return path != "-" && std::filesystem::is_regular_file(path, unknown);
}

/// For formats whose libraries open the file themselves.
void refuse_pipe(const std::string& path, const char* format) {
  if (is_file(path)) return;
  throw Error({.place = name_of(path),
               .problem = std::string(format) + " cannot be read from a pipe",
               .advice = "Give the name of the file."});
}

constexpr std::array<std::string_view, 6> kEndingsOfMessages{".mcap", ".mcap.zstd", ".mcap.zst",
                                                             ".db3",  ".db3.zstd",  ".db3.zst"};

bool is_equal(const YamlValue& value, std::string_view upper_or_lower) {
  const std::string text = value.is_scalar() ? value.texts_or_empty().front() : std::string();
  return std::ranges::equal(text, upper_or_lower, [](unsigned char a, unsigned char b) {
    return std::tolower(a) == std::tolower(b);
  });
}

/// A file of the metadata; it may have been unpacked, or packed, since.
std::string present_file(std::string path) {
  constexpr std::string_view kPacked = ".zstd";
  std::error_code absent;
  if (std::filesystem::exists(path, absent)) return path;
  std::string other = path.ends_with(kPacked) ? path.substr(0, path.size() - kPacked.size())
                                              : path + std::string(kPacked);
  return std::filesystem::exists(other, absent) ? other : path;
}

/// The only file of messages in a folder whose recorder was stopped before it wrote the metadata.
std::string only_file_of_bag(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code unreadable;
  for (const auto& entry : std::filesystem::directory_iterator(folder, unreadable)) {
    const std::string name = entry.path().filename().string();
    if (std::ranges::any_of(kEndingsOfMessages,
                            [&](std::string_view ending) { return name.ends_with(ending); }))
      names.push_back(name);
  }
  std::ranges::sort(names);
  if (names.size() == 1) return (folder / names.front()).string();
  throw Error({.place = folder.string(),
               .expected = "a file, or a folder of rosbag2 with metadata.yaml",
               .found = names.empty() ? "another folder"
                                      : "a folder without it, with the files " + joined(names),
               .advice = names.empty() ? "Name the files in it."
                                       : "Name one of the files, or write the metadata:  ros2 bag "
                                         "reindex " +
                                             folder.string()});
}

/// The files of a folder of rosbag2, in the order of its metadata.
std::vector<std::string> files_of_bag(const std::filesystem::path& folder,
                                      const Progress& progress) {
  const std::string metadata = (folder / "metadata.yaml").string();
  std::error_code absent;
  if (!std::filesystem::exists(metadata, absent)) return {only_file_of_bag(folder)};
  const YamlValue bag = YamlValue::read(metadata, progress).at("rosbag2_bagfile_information");
  const auto mode = bag.find("compression_mode");
  const auto format = bag.find("compression_format");
  if (mode && format && is_equal(*mode, "MESSAGE") && !is_equal(*format, "zstd"))
    format->refuse("zstd, or no compression of messages",
                   "Convert the bag with  ros2 bag convert  to one without compression.");
  const YamlValue paths = bag.at("relative_file_paths");
  std::vector<std::string> files;
  for (const std::string& file : paths.texts())
    files.push_back(present_file((folder / std::filesystem::path(file).filename()).string()));
  if (files.empty()) paths.refuse("at least one file");
  return files;
}

/// The bytes of the files of one recording, of which the first bytes were looked at.
struct OpenFiles {
  std::vector<std::string> paths;
  std::vector<std::unique_ptr<PeekedBytes>> sources;

  OpenFiles(const std::string& path, const Progress& progress) : paths({path}) {
    std::error_code absent;
    if (path != "-" && std::filesystem::is_directory(path, absent))
      paths = files_of_bag(path, progress);
    for (const std::string& file : paths)
      sources.push_back(std::make_unique<PeekedBytes>(open_bytes(file, progress)));
  }
  [[nodiscard]] Format format() const { return format_of(sources.front()->start(), paths.front()); }
  /// The bytes of all files are read to the end, whoever read them before.
  [[nodiscard]] std::string sha256() const {
    if (sources.size() > 1) return {};
    std::array<char, 1 << 16> block{};
    while (sources.front()->read(block.data(), block.size()) > 0) {
    }
    return sources.front()->sha256();
  }
};

void refuse_if_foreign(const OpenFiles& files) {
  if (files.format() == Format::bam) return;
  for (std::size_t i = 0; i < files.paths.size(); ++i)
    refuse_foreign_format(files.sources[i]->start(), name_of(files.paths[i]));
}

/// The messages of files of one format.
class OpenMessages {
 public:
  OpenMessages(const OpenFiles& files, Format format, const Progress& progress) {
    for (std::size_t i = 0; i < files.paths.size(); ++i) {
      const std::string name = name_of(files.paths[i]);
      add(*files.sources[i], files.paths[i], name, format, progress);
      named_.push_back({.name = name, .messages = sources_.back().get()});
    }
  }
  [[nodiscard]] std::span<const NamedMessages> all() const noexcept { return named_; }

 private:
  void add(PeekedBytes& bytes, const std::string& path, const std::string& name, Format format,
           const Progress& progress) {
    if (format == Format::mcap) {
      sources_.push_back(std::make_unique<McapRecords>(bytes, name, McapLimits{}, progress));
    } else if (format == Format::bag) {
      sources_.push_back(std::make_unique<BagRecords>(bytes, name, BagLimits{}, progress));
    } else if (is_file(path) && placed_bytes_of(path)->at(0, kDb3Mark.size()) == kDb3Mark) {
      sources_.push_back(std::make_unique<Db3Messages>(path, progress));
    } else {
      sources_.push_back(std::make_unique<Db3Messages>(bytes, name, progress));
    }
  }

  std::vector<std::unique_ptr<MessageSource>> sources_;
  std::vector<NamedMessages> named_;
};

ReadArrays read_archive(const std::string& path, ByteSource& source,
                        const ReadLogOptions& options) {
  if (is_file(path)) {
    const auto bytes = placed_bytes_of(path);
    if (bytes->at(0, kZipMark.size()) == kZipMark)  // not packed once more
      return read_npz(*bytes, path, options.wanted, options.progress);
  }
  return read_npz(source, name_of(path), options.wanted, options.progress);
}

bool has_messages(Format format) {
  return format == Format::mcap || format == Format::bag || format == Format::db3;
}

/// Otherwise the message about what is missing lists all arrays, also those that are not wanted.
bool has_all(const std::vector<NamedArray>& arrays, const std::vector<std::string>& wanted) {
  return std::ranges::all_of(wanted, [&](const std::string& name) {
    return std::ranges::find(arrays, name, &NamedArray::name) != arrays.end();
  });
}

LogTable table_of_files(const OpenFiles& files, const std::string& path,
                        const ReadLogOptions& options) {
  const std::string name = name_of(path);
  const Format format = files.format();
  refuse_if_foreign(files);
  if (format == Format::text)
    return read_csv(*files.sources.front(), name,
                    {.skip = options.skip, .wanted = options.wanted, .rules = options.csv});
  LogTable table;
  if (has_messages(format)) {
    const OpenMessages messages(files, format, options.progress);
    table = table_of_messages(messages.all(), name, {.wanted = options.wanted});
  } else if (format == Format::bam) {
    table = read_bam_log(*files.sources.front(), name, options.progress);
  } else if (format == Format::npz) {
    table =
        table_of_arrays(read_archive(path, *files.sources.front(), options), name, options.wanted);
  } else {
    refuse_pipe(path, "a MATLAB file");
    ReadArrays arrays = read_mat(path, options.wanted, options.progress);
    if (!has_all(arrays.arrays, options.wanted)) arrays = read_mat(path, {}, options.progress);
    table = table_of_arrays(std::move(arrays), name, options.wanted);
  }
  table.source.sha256 = files.sha256();
  return table;
}

/// The entries of a log of BAM as one topic, with the header.
LogSummary summary_of_bam(LogTable table) {
  const std::vector<double>& times_s = table.columns.front().values;
  const auto ns = [](double time_s) {
    return static_cast<std::int64_t>(std::llround(1e9 * time_s));
  };
  TopicSummary entries;
  entries.topic = "entries";
  entries.schema = "BAM";
  entries.encoding = "json";
  entries.messages = table.rows();
  if (!times_s.empty()) {
    entries.first_ns = ns(times_s.front());
    entries.last_ns = ns(*std::ranges::max_element(times_s));
  }
  for (std::size_t row = 1; row < times_s.size(); ++row)
    entries.largest_gap_ns =
        std::max(entries.largest_gap_ns, ns(times_s[row]) - ns(times_s[row - 1]));
  entries.fields = table.column_names();
  return {.topics = {std::move(entries)},
          .is_unfinished = table.is_unfinished,
          .conditions = std::move(table.conditions),
          .labels = std::move(table.labels)};
}

/// The column of the time stamps, if its unit shows it.
const LogColumn* clock_of(const LogTable& table) {
  const auto is_clock = [](const LogColumn& column) {
    const auto name = split_channel_name(column.full_name());
    return column.time == TimeKind::date_time || column.time == TimeKind::time_of_day ||
           (name && name->unit->si_suffix == "s" && std::ranges::is_sorted(column.values));
  };
  const auto at = std::ranges::find_if(table.columns, is_clock);
  return at == table.columns.end() ? nullptr : &*at;
}

LogSummary summary_of_table(const LogTable& table) {
  LogSummary summary{.columns = column_summaries(table),
                     .rows = table.rows(),
                     .not_read = table.not_read,
                     .notes = table.notes,
                     .is_unfinished = table.is_unfinished};
  if (const LogColumn* const clock = clock_of(table); clock != nullptr) {
    const auto name = split_channel_name(clock->full_name());
    const double scale = clock->time == TimeKind::none && name ? name->unit->scale : 1.0;
    summary.clock = clock->name;
    summary.duration_s = scale * (clock->values.back() - clock->values.front());
  }
  return summary;
}

}  // namespace

LogTable read_log(const std::string& path, const ReadLogOptions& options) {
  return table_of_files(OpenFiles(path, options.progress), path, options);
}

LogSummary list_log(const std::string& path, const Progress& progress) {
  const OpenFiles files(path, progress);
  const Format format = files.format();
  refuse_if_foreign(files);
  if (format == Format::bam)
    return summary_of_bam(read_bam_log(*files.sources.front(), name_of(path), progress));
  if (!has_messages(format))
    return summary_of_table(
        table_of_files(files, path, {.progress = progress, .csv = {.leaves_out_texts = true}}));
  return summary_of_messages(OpenMessages(files, format, progress).all());
}

}  // namespace torsio
