// SPDX-License-Identifier: GPL-3.0-or-later
// Tables as spreadsheets save them (RFC 4180, with what programs make of it), the cases of a batch
// in one, and the files that a pattern names.
#include <fnmatch.h>
#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/recipe.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

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

// "Unicode text" of spreadsheets: UTF-16 behind a byte order mark.
std::string from_utf16(const std::string& bytes, bool big_endian, const fs::path& file) {
  std::u16string text;
  for (std::size_t i = 2; i + 1 < bytes.size(); i += 2) {
    const auto first = static_cast<unsigned char>(bytes[i]);
    const auto second = static_cast<unsigned char>(bytes[i + 1]);
    text += static_cast<char16_t>(big_endian ? first << 8 | second : second << 8 | first);
  }
  try {
    return fs::path(text).string();
  } catch (const fs::filesystem_error&) {
    throw BadDataError(file, "holds bytes that are no UTF-16 text");
  }
}

std::string without_mark(std::string bytes, const fs::path& file) {
  if (bytes.starts_with("\xEF\xBB\xBF")) return bytes.substr(3);
  if (bytes.starts_with("\xFF\xFE")) return from_utf16(bytes, false, file);
  if (bytes.starts_with("\xFE\xFF")) return from_utf16(bytes, true, file);
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

// Reads a table as RFC 4180 has it and as spreadsheets save it: commas, semicolons or tabs (of
// those, what parts the header into most fields, or what a first line "sep=;" says), with or
// without a byte order mark, in UTF-8 or UTF-16, lines ended by LF, CR LF or CR. Fields may be
// quoted, but not span lines. Rows without a single text and columns without any are left out.
// Throws NoInputError, or BadDataError that names the line.
TextTable read_text_table(const fs::path& file) {
  const std::vector<std::string> lines = lines_of(without_mark(read_text_file(file), file));
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

// A relative path of an input, seen from the table's folder.
std::string resolved(const std::string& key, const std::string& value, const fs::path& folder) {
  if (!is_recipe_input(key) || fs::path(value).is_absolute()) return value;
  return (folder / value).lexically_normal().string();
}

std::size_t name_column_of(const TextTable& table, const std::string& where) {
  const auto found = std::find(table.header.begin(), table.header.end(), "case");
  if (found == table.header.end())
    throw BadDataError(where +
                       ": the header has no column 'case'; write for example: case,ct,mask,label");
  return static_cast<std::size_t>(found - table.header.begin());
}

}  // namespace

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

std::vector<BatchCase> read_case_table(const fs::path& file) {
  const TextTable table = read_text_table(file);
  const auto where = [&](std::size_t line) { return file.string() + ":" + std::to_string(line); };
  const std::size_t name_column = name_column_of(table, where(table.header_line));
  std::vector<BatchCase> cases;
  std::set<std::string> names;
  for (const TextTable::Row& row : table.rows) {
    BatchCase one{row.fields[name_column], {}};
    const std::string flaw = flaw_of_case_name(one.name);
    if (!flaw.empty())
      throw BadDataError(where(row.line) + ": the case's name '" + one.name + "' " + flaw);
    if (!names.insert(one.name).second) {
      throw BadDataError(where(row.line) + ": case '" + one.name + "' is there twice");
    }
    for (std::size_t k = 0; k < table.header.size(); ++k) {
      const std::string &key = table.header[k], &value = row.fields[k];
      if (k == name_column || value.empty()) continue;
      one.settings.push_back(key + "=" + resolved(key, value, file.parent_path()));
    }
    cases.push_back(std::move(one));
  }
  if (cases.empty()) throw BadDataError(file, "the table holds no case below its header");
  return cases;
}

std::string case_table_text(const std::vector<BatchCase>& cases) {
  std::vector<std::map<std::string, std::string>> rows;
  std::set<std::string> keys;
  for (const BatchCase& one : cases) {
    auto& row = rows.emplace_back();
    for (const std::string& setting : one.settings) {
      const std::string key = setting.substr(0, setting.find('='));
      const std::string value = setting.substr(std::min(setting.size(), key.size() + 1));
      if (setting.find_first_of("\r\n") != std::string::npos) {
        throw UsageError("case '" + one.name + "': " + key +
                         " holds a line break, which no list of commands can carry; rename it");
      }
      row[key] = is_recipe_input(key) ? fs::absolute(value).lexically_normal().string() : value;
      keys.insert(key);
    }
  }
  std::string text = "case";
  for (const std::string& key : keys) text += "," + csv_field(key);
  text += "\n";
  for (std::size_t i = 0; i < cases.size(); ++i) {
    text += csv_field(cases[i].name);
    for (const std::string& key : keys) text += "," + csv_field(rows[i][key]);
    text += "\n";
  }
  return text;
}

namespace {

bool has_wildcard(const std::string& text) { return text.find_first_of("*?[") != text.npos; }

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    entries.push_back(at->path());
  }
  if (error) throw IoError::reading(folder, error.message());
  return entries;
}

// A link to a folder is followed only when the pattern names it: "**" would run in circles.
bool is_folder_to_enter(const fs::path& path) {
  return fs::is_directory(fs::symlink_status(path)) && path.filename().string().front() != '.';
}

using Segments = std::vector<std::string>;

void collect(const fs::path& folder, const Segments& segments, std::size_t at,
             std::set<std::string>& found) {
  const bool last = at + 1 == segments.size();
  if (segments[at] == "**") {
    if (!last) collect(folder, segments, at + 1, found);
    for (const fs::path& entry : entries_of(folder)) {
      if (is_folder_to_enter(entry)) collect(entry, segments, at, found);
      if (last && fs::is_regular_file(entry)) found.insert(entry.string());
    }
    return;
  }
  for (const fs::path& entry : entries_of(folder)) {
    const std::string name = entry.filename().string();
    if (::fnmatch(segments[at].c_str(), name.c_str(), FNM_PERIOD) != 0) continue;
    if (last) {
      found.insert(entry.string());
    } else if (fs::is_directory(entry)) {
      collect(entry, segments, at + 1, found);
    }
  }
}

}  // namespace

bool is_file_pattern(const std::string& word) {
  std::error_code ignored;
  return has_wildcard(word) && !fs::exists(word, ignored);
}

fs::path folder_of_pattern(const std::string& pattern) {
  fs::path folder;
  for (const fs::path& part : fs::path(pattern).parent_path()) {
    if (has_wildcard(part.string())) break;
    folder /= part;
  }
  return folder.empty() ? fs::path(".") : folder;
}

std::vector<fs::path> files_matching(const std::string& pattern) {
  const fs::path folder = folder_of_pattern(pattern);
  if (!fs::is_directory(folder)) throw NoInputError(pattern, folder.string() + " is no folder");
  const fs::path rest = fs::path(pattern).lexically_relative(folder);
  const Segments segments(rest.begin(), rest.end());
  std::set<std::string> found;
  collect(folder, segments, 0, found);
  if (found.empty()) throw NoInputError(pattern, "no file has such a name");
  return {found.begin(), found.end()};
}

}  // namespace organbake
