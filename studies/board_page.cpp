#include <fmt/format.h>

#include <string>
#include <string_view>

#include "studies/board_rows.hpp"
#include "studies/board_run.hpp"

namespace torsio {
namespace {

constexpr std::string_view kIntroduction =
    R"md(# Board of public recordings

Written by `torsio reproduce board --recorded --page docs/board.md` from `studies/board_rows.csv` and the list of sets in
`studies/board_sets.cpp`.

Public recordings of actuators, each with a fixed split into training and test. A model is scored in free run: it is
given the inputs of a test recording and no measured output but that of the first samples. Each table has published
figures, the families of torsio, and the rows of all who joined, lowest error first.

    torsio reproduce board                 # fits every family again: about half an hour on two cores
    torsio reproduce board --recorded      # the tables of this page, without a fit and without recordings

The recordings are not part of torsio. They are read from the folder that `TORSIO_DATA` names, else from
`../shared/data`; [recordings](#recordings) lists where each file is published, how it is converted, and the hash of its
content. A set whose files are missing is left out with one line; a file with another content is refused.

    torsio reproduce board --rows studies/board_rows.csv

writes the rows of a run to the file from which the rows of the program are built; sets that were left out keep theirs.

## Join

1. Write the samples that are to be predicted, and those to train on:

       torsio reproduce board --set emps --template test.csv --training train.csv

   A line is a sample of a recording: `set`, `recording`, `sample` (from 0), `t_s`, whether it is scored (`scored_1`) or
   trained on (`train_1`), the inputs, and the target where a model may use it: at the start, and in the training blocks
   of a recording that has both kinds. Any program can train on these files; the original files may be used as well.
2. Predict every sample with `scored_1` = 1 and write a CSV file with a header and one line for each of them:

       set,recording,sample,prediction_m
       emps,emps_val,20,0.000303
       emps,emps_val,21,0.000331

   The name of the last column ends in the unit of the set: `prediction_m`, `prediction_Nm` or `prediction_rad`. `t_s`
   may take the place of `sample`; where both are there, they have to agree. The order of lines and columns is free,
   further columns and lines that begin with `#` are ignored, and so are predictions of samples that are not scored, which
   may also be left empty. Fields are separated by commas, a point is the decimal separator, quotes around a field are
   removed, and the encoding is UTF-8. A file is for one set and may be gzipped.
3. Score it:

       torsio reproduce board --predictions mine.csv --name "my model"

   This prints the table of the set with the new row, *your predictions*. It is computed by the code that scores the
   families of torsio. A column that is missing or there twice, another unit, an unknown set or recording, and a scored
   sample that occurs twice or has no finite prediction are errors that name the line; of scored samples that are missing
   the number and the first one are stated. An error larger than that of predicting the mean is remarked.
4. To stay on this page, add the line that the call prints to `studies/board_rows.csv`, with the address of a
   description or of the program in its last field; its origin there is *joined*. Build the program again, so that it
   contains the row, sort the rows and write the page with

       torsio reproduce board --recorded --rows studies/board_rows.csv --page docs/board.md

   and open a pull request with the file of predictions attached.

Rules: a prediction may use the inputs of its recording up to its sample, the target of earlier samples where the template
states it, and a model that was trained on the training part of the split. Settings are chosen within the training part. In `xl330_gain` all recordings are
test recordings: the model of each is trained on those of the other three gains. Its measured speed and duty follow from
the angle, so that they are not inputs and not in the template.

## What the columns mean

The error is in the unit of the set, over all scored samples together (RMSE) or as the mean over recordings (mean
|error|). `+-` is the standard deviation of one run, for families whose fit depends on a seed. The origin is
*published* (printed by others), *measured here* (a family of torsio, run by the command above) or *joined* (predictions
of others, scored here). Measured and joined rows have the same condition, unless the row states another: the split of the
set, free run, the same scored samples. A remark states where a family has no estimate because its filters or its window
had not settled; a family without an estimate at more than a tenth of the samples has no error. In
[benchmarks](results/benchmarks.md) 50 samples start a model of `emps`, here 20, as the benchmark prescribes. Of a
published figure it is stated:

- *same training and test*: the same two recordings, in free run. How many samples at the start were not scored
  is not always printed.
- *same test*: the same test recording in free run; the model may have been trained on other data of the same system.
- *same test, as quoted by the source*: the figure was read in the comparison of another paper.
- *another test*: the authors tested on a recording of their own. The figure is shown for orientation only.

No torque error was published for `desr_*` and `cycloidal_*`, and no error at a gain that was left out for `xl330_gain`:
BAM's models there were fitted here, by the search of `torsio identify`.
)md";

constexpr std::string_view kNotOnTheBoard = R"md(
## Not on the board

- `anydrive_lstm` (legged_gym, the LSTM of the ANYdrive series-elastic joint): weights and test vectors, no recording. The
  tests compare torsio's import with them.
- Servos STS3250 (Rhoban/bam, commit b53408c, `data_raw_feetech/*.json`, four recordings), MX-64 and MX-106 (BAM): their
  files were not at hand, so that no hash can be stated.
- Simulated joints: [model comparison](results/model_comparison.md).
)md";

std::string table_of(const BoardSet& set, std::span<const BoardRow> rows) {
  std::string text = fmt::format(
      "\n### {}: `{}`\n\nSplit: {}. Target `{}`, unit {}, score {}; {} scored samples. The first "
      "{} "
      "measured sample{} of a recording may be used and {} not scored.\n\n"
      "| | model | {} [{}] | +- | runs | origin | condition and source |\n"
      "|---|---|---|---|---|---|---|\n",
      set.title, set.name, set.split, set.target, set.unit, name(set.measure), set.scored_samples,
      set.initialise_samples, set.initialise_samples == 1 ? "" : "s",
      set.initialise_samples == 1 ? "is" : "are",
      set.measure == BoardMeasure::rmse ? "RMSE" : "mean error", set.unit);
  std::size_t place = 0;
  for (const BoardRow& row : rows_of(set, rows))
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", ++place, row.model,
                        row.text.empty() ? "-" : row.text, spread_text(row),
                        row.runs > 0 ? fmt::format("{}", row.runs) : std::string(),
                        name(row.origin), row.remark);
  return text;
}

std::string settings_text() {
  std::string text =
      "\n## Settings of the families\n\nFamilies without a line have their defaults. Those whose "
      "defaults would take minutes on each set have cheaper settings: fewer starts, samples or "
      "epochs. [Benchmarks](results/benchmarks.md) describes how those of `boucwen` and `emps` "
      "were chosen on the training recording. `grey_box` and the other torque models are on the "
      "sets with a torque; `rigid_drive` and `dynamic_bouc_wen` simulate a position from a force. "
      "The column of runs states of how many fits with different seeds a row is the mean.\n\n";
  for (const std::string& setting : board_settings()) text += fmt::format("- `{}`\n", setting);
  return text;
}

std::string recordings_text() {
  std::string text =
      "\n## Recordings\n\nThe hash is the SHA-256 of the unpacked content (`zcat FILE | "
      "sha256sum`), so that it does not depend on the program that packed the file. Recordings "
      "whose licence does not permit a copy are fetched by everyone from the address.\n\n"
      "    tools/board_files ORIGINALS FOLDER\n\n"
      "converts the files that it finds below ORIGINALS, for example clones of those repositories "
      "at "
      "those commits, to FOLDER, the value of `TORSIO_DATA`, and compares the hashes. HDF5 and MAT "
      "need Debian's `python3-h5py` and `python3-scipy`.\n\n"
      "| folder | what | published at | licence | may be redistributed | files |\n"
      "|---|---|---|---|---|---|\n";
  for (const BoardSource& source : board_sources())
    text += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", source.folder, source.title,
                        source.address, source.licence,
                        source.may_be_redistributed ? "yes" : "not known", source.columns);
  text += "\n| file | SHA-256 of its content |\n|---|---|\n";
  for (const BoardFile& file : board_files())
    text += fmt::format("| `{}/{}` | `{}` |\n", file.folder, file.file, file.sha256);
  return text;
}

}  // namespace

std::string board_page(std::span<const BoardRow> rows) {
  std::string page(kIntroduction);
  page += "\n## The tables\n";
  for (const BoardSet& set : board_sets()) page += table_of(set, rows);
  return page + settings_text() + recordings_text() + std::string(kNotOnTheBoard);
}

}  // namespace torsio
