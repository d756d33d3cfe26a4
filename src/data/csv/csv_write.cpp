#include <cmath>
#include <set>
#include <string>

#include "core/report_progress.hpp"
#include "data/csv/csv_table.hpp"
#include "data/text_sink.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/data/csv.hpp"
#include "torsio/files/output_file.hpp"

namespace torsio {
namespace {

void check_writable(const Recording& recording) {
  std::set<std::string> names;
  for (const Channel& channel : recording.channels()) {
    for (const double value : channel.values)
      if (std::isinf(value))
        throw Error({.place = recording.name() + ": " + channel.name,
                     .problem = "an infinite value cannot be written"});
    const bool is_clock = channel.name == "t_s" || channel.name == "time_s";
    bool is_new = !is_clock && names.insert(channel.name).second;
    if (!channel.fresh.empty())
      is_new = names.insert(freshness_column(channel.name)).second && is_new;
    if (!is_new)
      throw Error({.place = recording.name() + ": " + channel.name,
                   .problem = "the CSV file would have two columns of the same name"});
  }
}

}  // namespace

std::string freshness_column(std::string_view channel_name) {
  const auto parts = split_channel_name(channel_name);
  return std::string(parts ? parts->quantity : channel_name) + "_fresh_1";
}

void write_csv(const Recording& recording, const std::string& path, const Progress& progress) {
  constexpr std::size_t kRowsPerReport = 8192;
  check_writable(recording);
  OutputFile file = path == "-" ? OutputFile::standard_output() : OutputFile(path);
  TextSink text(file, path.ends_with(".gz"));
  text.add("t_s");
  for (const Channel& channel : recording.channels()) {
    text.add(",");
    text.add(channel.name);
    if (channel.fresh.empty()) continue;
    text.add(",");
    text.add(freshness_column(channel.name));
  }
  text.add("\n");
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (i % kRowsPerReport == 0)
      report_progress(progress, static_cast<double>(i) / static_cast<double>(recording.size()),
                      "writing");
    text.add(recording.time_s(i));
    for (const Channel& channel : recording.channels()) {
      text.add(",");
      text.add(channel.values[i]);
      if (!channel.fresh.empty()) text.add(channel.fresh[i] != 0 ? ",1" : ",0");
    }
    text.add("\n");
  }
  text.finish();
  file.commit();
}

}  // namespace torsio
