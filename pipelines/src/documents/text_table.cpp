// SPDX-License-Identifier: GPL-3.0-or-later
#include "documents/text_table.h"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

void append_utf8(std::string& text, std::uint32_t c) {
  const auto byte = [&](std::uint32_t b) { text += static_cast<char>(b); };
  if (c < 0x80) return byte(c);
  if (c < 0x800) return byte(0xC0 | c >> 6), byte(0x80 | (c & 0x3F));
  if (c < 0x10000)
    return byte(0xE0 | c >> 12), byte(0x80 | (c >> 6 & 0x3F)), byte(0x80 | (c & 0x3F));
  byte(0xF0 | c >> 18), byte(0x80 | (c >> 12 & 0x3F)), byte(0x80 | (c >> 6 & 0x3F)),
      byte(0x80 | (c & 0x3F));
}

// "Unicode text" of spreadsheets: UTF-16 behind a byte order mark.
std::string from_utf16(const std::string& bytes, bool big_endian) {
  const auto unit = [&](std::size_t i) -> std::uint32_t {
    const auto first = static_cast<unsigned char>(bytes[i]);
    const auto second = static_cast<unsigned char>(bytes[i + 1]);
    return big_endian ? first << 8 | second : second << 8 | first;
  };
  std::string text;
  for (std::size_t i = 2; i + 1 < bytes.size(); i += 2) {
    std::uint32_t c = unit(i);
    if (c >= 0xD800 && c < 0xDC00 && i + 3 < bytes.size()) {
      const std::uint32_t low = unit(i + 2);
      if (low >= 0xDC00 && low < 0xE000) {
        c = 0x10000 + ((c - 0xD800) << 10) + (low - 0xDC00);
        i += 2;
      }
    }
    append_utf8(text, c);
  }
  return text;
}

std::string without_mark(std::string bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) return bytes.substr(3);
  if (bytes.starts_with("\xFF\xFE")) return from_utf16(bytes, false);
  if (bytes.starts_with("\xFE\xFF")) return from_utf16(bytes, true);
  return bytes;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines(1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool pair = text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n';
    if (pair) continue;
    if (text[i] == '\n' || text[i] == '\r') {
      lines.emplace_back();
    } else {
      lines.back() += text[i];
    }
  }
  return lines;
}

std::vector<std::string> fields_of(const std::string& line, char separator,
                                   const std::string& where) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted) {
      if (c != '"') {
        fields.back() += c;
      } else if (i + 1 < line.size() && line[i + 1] == '"') {
        fields.back() += line[++i];
      } else {
        quoted = false;
      }
    } else if (c == '"' && fields.back().empty()) {
      quoted = true;
    } else if (c == separator) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  if (quoted) throw BadDataError(where + ": a quoted field is not closed on its line");
  return fields;
}

// What spreadsheets write into a first line of its own.
std::optional<char> separator_told_by(const std::string& line) {
  if (line.size() == 5 && line.starts_with("sep=")) return line[4];
  return std::nullopt;
}

char separator_of(const std::string& header, const std::string& where) {
  char best = ',';
  std::size_t most = 1;
  for (const char separator : {',', ';', '\t'}) {
    const std::size_t fields = fields_of(header, separator, where).size();
    if (fields > most) {
      most = fields;
      best = separator;
    }
  }
  return best;
}

bool is_blank(const std::vector<std::string>& fields) {
  return std::all_of(fields.begin(), fields.end(),
                     [](const std::string& field) { return field.empty(); });
}

// A spreadsheet that once had more columns goes on to save them, empty.
void drop_nameless_columns(TextTable& table, const fs::path& file) {
  for (std::size_t k = table.header.size(); k-- > 0;) {
    if (!table.header[k].empty()) continue;
    for (TextTable::Row& row : table.rows) {
      if (!row.fields[k].empty())
        throw BadDataError(file.string() + ":" + std::to_string(row.line) + ": '" + row.fields[k] +
                           "' stands in column " + std::to_string(k + 1) +
                           ", which has no name in the header");
      row.fields.erase(row.fields.begin() + static_cast<std::ptrdiff_t>(k));
    }
    table.header.erase(table.header.begin() + static_cast<std::ptrdiff_t>(k));
  }
}

}  // namespace

TextTable read_text_table(const fs::path& file) {
  const std::vector<std::string> lines = lines_of(without_mark(read_text_file(file)));
  const auto where = [&](std::size_t i) { return file.string() + ":" + std::to_string(i + 1); };
  const std::optional<char> told = separator_told_by(lines.front());
  const std::size_t first = told && lines.size() > 1 ? 1 : 0;
  const char separator = told.value_or(separator_of(lines[first], where(first)));
  TextTable table{fields_of(lines[first], separator, where(first)), first + 1, {}};
  for (std::string& key : table.header) key = trimmed(key, " ");
  for (std::size_t i = first + 1; i < lines.size(); ++i) {
    std::vector<std::string> fields = fields_of(lines[i], separator, where(i));
    if (is_blank(fields)) continue;
    if (fields.size() != table.header.size()) {
      const std::string mark = separator == '\t' ? "tab" : std::string("'") + separator + "'";
      throw BadDataError(where(i) + ": " + std::to_string(fields.size()) +
                         " fields, but the header has " + std::to_string(table.header.size()) +
                         "; put a field with a " + mark + " in quotes");
    }
    table.rows.push_back({i + 1, std::move(fields)});
  }
  drop_nameless_columns(table, file);
  return table;
}

bool is_table_name(const fs::path& file) {
  const std::string ending = lower_ending(file);
  return ending == ".csv" || ending == ".tsv" || ending == ".txt";
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

}  // namespace organbake
