// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/run_context.h"

namespace organbake {

// One bake of a batch: a name, which is its folder's, and what it sets in the recipe.
struct BatchCase {
  std::string name;
  std::vector<std::string> settings;  // "key=value", as bake's --set takes them
};

// Whether a file's name is that of a table that is read: .csv, .tsv or .txt.
bool is_table_name(const std::filesystem::path& file);

// A table with a header, one case a line, as RFC 4180 has it or spreadsheets save it: column `case`
// names it, every other column is a key of the recipe ("ct", "label", "decimate.faces"); an empty
// field sets nothing. Paths of inputs are relative to the table's folder. Throws NoInputError, or
// BadDataError that names the line: no column `case`, a name that is no folder's name or comes
// twice, a row of another length.
std::vector<BatchCase> read_case_table(const std::filesystem::path& table);

// A field of a line with commas, quoted when it must be.
std::string csv_field(const std::string& text);

// The same table with its inputs' paths made absolute, for programs that start elsewhere. Throws
// UsageError for a line break in a value: a table has one case a line.
std::string case_table_text(const std::vector<BatchCase>& cases);

// True for "scans/*.mha" unless a file is really called so. Shells expand patterns themselves, but
// not "**", and not more names than a command line holds.
bool is_file_pattern(const std::string& word);

// The folder that a pattern begins with: "a/b" of "a/b/*/c*.mp4", "." when there is none.
std::filesystem::path folder_of_pattern(const std::string& pattern);

// What a pattern names, in byte order: "*", "?" and "[…]" stay within one name and don't match a
// leading '.', "**" stands for any number of folders. Throws NoInputError when nothing matches,
// IoError when a folder can't be read.
std::vector<std::filesystem::path> files_matching(const std::string& pattern);

// A scan, a clip or a surface that lies in a folder.
struct FoundInput {
  std::string input;  // the recipe's: "ct" (a mask among them), "frames", "surface"
  std::filesystem::path path;
};

// Those in a folder and up to three folders below it, by path. A folder of DICOM slices or of
// frames is one of them; hidden files, bundles and what nobody bakes are passed over. Throws
// NoInputError where the folder is missing or holds none.
std::vector<FoundInput> inputs_in(const std::filesystem::path& folder);

// Empty when the text can name a case's folder, else what is wrong with it.
std::string flaw_of_case_name(const std::string& name);

// The cases of a command's words: one table, or files, folders and patterns of them
// (files_matching), each set as the recipe's input `input`. Such a case is called after its file
// without the ending, or of a pattern after the path below the pattern's fixed folder
// ("2021_july_clip3"), so that its name doesn't depend on what else is there. Throws UsageError
// for two of one name; NoInputError; BadDataError for a bad table.
std::vector<BatchCase> cases_of_words(const std::vector<std::string>& words,
                                      const std::string& input);

// The cases of shard `index` of `count` (from 1): every count-th one. Throws UsageError.
struct Shard {
  std::size_t index = 1, count = 1;
};
Shard parse_shard(const std::string& text);  // "2/8"
std::vector<BatchCase> cases_of_shard(const std::vector<BatchCase>& cases, const Shard& shard);

// What a bake is thought to need, before it starts. Meant to be rather too much than too little.
struct CaseEstimate {
  double cpu_seconds = 0;  // of one core
  double memory_mb = 0;
  std::string flaw;  // why nothing can be told: the bake will fail for the same reason
};

// By the sizes of the inputs and the options that cost time, with constants that were measured
// (case_estimate.cpp). Reads headers, not contents; never throws for what is wrong with a case.
CaseEstimate estimate_case(const std::filesystem::path& recipe,
                           const std::vector<std::string>& settings);

// Voxels of a volume, told by file sizes and headers alone (a thousand cases are looked at in
// seconds): of MetaImage and NRRD by their header, of gzip files by the size that they end with, of
// a DICOM folder or any other file by its bytes (two to a voxel; of compressed ones too few, by
// what the compression saves). Throws NoInputError.
double voxels_in(const std::filesystem::path& volume);

// What became of one case.
struct BatchRow {
  std::string name;
  std::string status;  // "written", "unchanged", "failed", "not started", "left out"
  int exit_code = 0;
  double seconds = 0;
  double peak_mb = 0;
  std::map<std::string, double> figures;  // "decimate.rms_mm" …: what tells a good bake from a bad
  std::vector<std::string> warnings;      // of its stages, as the bake told them
  std::string error;    // the worker's last words, when it failed; why it is left out
  std::string picture;  // of the organ, relative to the batch's folder; may be empty
  std::string page;     // with its player, likewise
};

// What `batch` and `plan` are told of their cases.
struct BatchOptions {
  std::filesystem::path recipe, output, cache;  // cache empty: the user's own
  std::string input = "ct";                     // the recipe's, that files given by name are
  std::vector<std::string> settings;            // "key=value" of all cases
  int jobs = 1;                                 // cases at once
  int threads = 1;                              // of each
  double memory_mb = 0;  // that the cases under way may need together; 0 = no limit
  bool keep_going = true, pictures = true, web = false, strict = false;
};

// Told whenever a case starts, ends, or failed and will be tried again.
struct BatchProgress {
  enum class Event { started, again, ended };
  Event event = Event::started;
  std::size_t cases = 0, done = 0, failed = 0, running = 0;
  double seconds_left = 0;  // by what the cases done so far took
  const BatchRow& row;
};

// Bakes cases, each in a process of its own, so that no crash of one ends the others: first
// `organbake bake`, then `organplay` for a picture and `organbake export` for a page. A case that
// failed by a passing fault (killed from outside, as when memory is short, or exit code 75) is
// tried once more after the others, with none beside it. `memory_mb[i]`: what case i is thought to
// need. Returns a row for each case. When the context is cancelled it stops the workers and returns
// what there is. Throws IoError when a log can't be written.
std::vector<BatchRow> bake_batch(const BatchOptions& options, const std::vector<BatchCase>& cases,
                                 const std::vector<double>& memory_mb,
                                 const std::function<void(const BatchProgress&)>& listener,
                                 const RunContext& context);

// What a batch ends with: 0; 75 when trying again may help a case that failed; else 4.
ExitCode exit_code_of(const std::vector<BatchRow>& rows);

// The figures of a bundle's report.json that the batch shows.
std::map<std::string, double> key_figures(const nlohmann::json& bake_report);

nlohmann::json batch_json(const std::string& recipe, const std::vector<BatchRow>& rows);
// The rows of a batch.json that has been checked.
std::vector<BatchRow> rows_of(const nlohmann::json& batch);
// The rows of all shards of a batch in the order of its cases: every shard holds every n-th.
std::vector<BatchRow> interleaved(const std::vector<std::vector<BatchRow>>& shards);
std::string batch_csv(const std::vector<BatchRow>& rows);
// One page, pictures beside it, the worst first: failures, then what was warned of, then the
// farthest proxies.
std::string batch_page(const std::string& recipe, std::vector<BatchRow> rows);

// A batch cut into tasks for an engine that is not ours: each is `organbake batch` over one shard
// of the table cases.csv in the output folder.
struct JobPlan {
  std::filesystem::path program;       // organbake; absolute, as the other paths
  std::filesystem::path output;        // holds cases.csv
  std::vector<std::string> arguments;  // of batch, besides the table, -o, --threads and --shard
  std::size_t tasks = 1;
  int threads = 0;       // of a task; 0 = all there are (lines only)
  double memory_mb = 0;  // a task's, with a margin
  double minutes = 0;    // a task's, with a margin
};

// As one word of a POSIX shell: quoted unless it needs none.
std::string shell_word(const std::string& text);

// One command a line, for a shell, xargs or GNU parallel.
std::string job_lines(const JobPlan& plan);
// pipelines/cluster/Snakefile with its configuration. Throws UsageError for a path that is not
// UTF-8.
std::string job_snakefile(const JobPlan& plan);
// pipelines/cluster/array.sbatch with its values.
std::string job_array(const JobPlan& plan);

// The cases of a batch with long videos cut up, and what of those is not baked.
struct SpanCases {
  std::vector<BatchCase> cases;
  std::vector<BatchRow> left_out;  // status "left out", the reason as the error
};

// By a recipe with the section `spans` a long video becomes a case for each of its best spans
// (stage spans), named after the second at which it begins: "gallbladder_0312s". The spans are cut
// out without coding anew, by ffmpeg, into the folder's spans/. Cases that are no long videos, and
// those whose video cannot be read, stay as they are: their own bake tells what is wrong.
// `settings` are of all cases, `cache` as Batch has it. Throws IoError when ffmpeg is missing.
SpanCases cases_of_spans(const std::vector<BatchCase>& cases, const std::filesystem::path& recipe,
                         const std::vector<std::string>& settings,
                         const std::filesystem::path& output, const RunContext& context);

}  // namespace organbake
