// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

// A table of texts: a header, and rows as long as it is.
struct TextTable {
  struct Row {
    std::size_t line = 0;  // of the file, from 1
    std::vector<std::string> fields;
  };
  std::vector<std::string> header;
  std::size_t header_line = 1;
  std::vector<Row> rows;
};

// Reads a table as RFC 4180 has it and as spreadsheets save it: commas, semicolons or tabs (of
// those, what parts the header into most fields, or what a first line "sep=;" says), with or
// without a byte order mark, in UTF-8 or UTF-16, lines ended by LF, CR LF or CR. Fields may be
// quoted, but not span lines. Rows without a single text and columns without any are left out.
// Throws NoInputError, or BadDataError that names the line.
TextTable read_text_table(const std::filesystem::path& file);

// Whether a file's name is that of a table that is read: .csv, .tsv or .txt.
bool is_table_name(const std::filesystem::path& file);

// A field of a line with commas, quoted when it must be.
std::string csv_field(const std::string& text);

}  // namespace organbake
