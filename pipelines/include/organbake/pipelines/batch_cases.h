// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

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

}  // namespace organbake
