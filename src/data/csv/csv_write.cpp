#include <string>

#include "core/report_progress.hpp"
#include "data/text_sink.hpp"
#include "data/written_columns.hpp"
#include "files/output_file.hpp"
#include "torsio/data/write.hpp"

namespace torsio {
void write_csv(const Recording& recording, const std::string& path, const Progress& progress) {
  constexpr std::size_t kRowsPerReport = 8192;
  check_columns(recording);
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
