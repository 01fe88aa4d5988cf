// SPDX-License-Identifier: GPL-3.0-or-later
// What a batch came to, as JSON, a table and a page; and what a cluster runs in its place:
// commands, a Slurm array, a Snakefile.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "embedded_files.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/documents.h"

namespace organbake {
// But for the name, which documents call "case"; older ones lack warnings and the page.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(BatchRow, status, exit_code, seconds, peak_mb,
                                                figures, warnings, error, picture, page)
namespace {

using Json = nlohmann::json;

struct KeyFigure {
  const char *stage, *figure;
};
constexpr KeyFigure kKeyFigures[] = {
    {"isosurface", "volume_ml"},   {"shade", "frames_shaded"},   {"shade", "surface_frame"},
    {"shade", "frames_ok"},        {"shade", "frames_doubtful"}, {"shade", "frames_failed"},
    {"stereo", "frames_matched"},  {"stereo", "surface_frame"},  {"stereo", "frames_ok"},
    {"stereo", "frames_doubtful"}, {"stereo", "frames_failed"},  {"motion", "frames_read"},
    {"motion", "frames_posed"},    {"motion", "mean_error_px"},  {"decimate", "faces"},
    {"decimate", "rms_mm"},        {"decimate", "max_mm"},       {"decimate", "volume_change"}};

std::string key_of(const KeyFigure& figure) {
  return std::string(figure.stage) + "." + figure.figure;
}

// A row is a line, whatever a program said.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

bool bad(const BatchRow& row) { return row.exit_code != 0; }

// Failures first, then what was warned of; a strict bake that warned is there all the same.
int badness(const BatchRow& row) {
  if (bad(row) && row.figures.empty()) return 2;
  return bad(row) || !row.warnings.empty() ? 1 : 0;
}

double rms_of(const BatchRow& row) {
  const auto found = row.figures.find("decimate.rms_mm");
  return found == row.figures.end() ? 0 : found->second;
}

std::string figure_text(const BatchRow& row, const std::string& key) {
  const auto found = row.figures.find(key);
  return found == row.figures.end() ? "" : to_text(std::round(1000 * found->second) / 1000 + 0.0);
}

// Of those figures, what any of these cases has: volumes have no frames, clips no HU.
std::vector<std::string> columns_of(const std::vector<BatchRow>& rows) {
  std::vector<std::string> columns;
  for (const KeyFigure& figure : kKeyFigures) {
    const std::string key = key_of(figure);
    if (std::any_of(rows.begin(), rows.end(),
                    [&](const BatchRow& row) { return row.figures.contains(key); })) {
      columns.push_back(key);
    }
  }
  return columns;
}

// A figure's name may break where its stage's name ends.
std::string heading(const std::string& column) {
  const std::size_t stage = column.find('.') + 1;
  return "<th>" + column.substr(0, stage) + "<wbr>" + column.substr(stage) + "</th>";
}

// Of both rows of a case, that of its figures and that of its warnings.
std::string tall_cell(const BatchRow& row, const std::string& text) {
  return (row.warnings.empty() ? "<td>" : "<td rowspan=\"2\">") + text + "</td>";
}

// Warnings are sentences, which a column beside a dozen figures would break after every word: they
// stand below the figures.
std::string warnings_row(const BatchRow& row, const std::string& begin, std::size_t columns) {
  if (row.warnings.empty()) return "";
  std::string html = begin + "<td class=\"text\" colspan=\"" + std::to_string(columns) + "\">";
  for (const std::string& warning : row.warnings) html += "<p>" + escape_html(warning) + "</p>";
  return html + "</td></tr>\n";
}

std::string page_row(const BatchRow& row, const std::vector<std::string>& columns) {
  const std::string picture =
      row.picture.empty() ? "" : "<img alt=\"\" src=\"" + url_of(row.picture) + "\">";
  const std::string name = row.page.empty() ? escape_html(row.name) : html_link(row.page, row.name);
  const std::string begin = bad(row) ? "<tr class=\"failed\">" : "<tr>";
  std::string html =
      begin + tall_cell(row, name) + tall_cell(row, picture) +
      html_cell(row.status + (bad(row) ? " (" + std::to_string(row.exit_code) + ")" : "")) +
      html_cell(to_text(row.seconds, 2)) + html_cell(to_text(row.peak_mb, 0));
  // A failed case has no figures: its error stands in their place; so does why one is left out.
  if (!row.error.empty() && row.figures.empty()) {
    html += "<td class=\"text\" colspan=\"" +
            std::to_string(std::max<std::size_t>(1, columns.size())) + "\">" +
            escape_html(row.error) + "</td>";
  } else {
    for (const std::string& column : columns) html += html_cell(figure_text(row, column));
  }
  return html + "</tr>\n" + warnings_row(row, begin, 3 + std::max<std::size_t>(1, columns.size()));
}

constexpr const char* kBatchPageStyle =
    "td.text{text-align:left}td.text "
    "p{margin:0}td[rowspan]{vertical-align:top}tr.failed{background:#fdecec}img{height:96px}";

}  // namespace

std::map<std::string, double> key_figures(const Json& bake_report) {
  std::map<std::string, double> figures;
  for (const Json& stage : bake_report.at("stages")) {
    for (const KeyFigure& wanted : kKeyFigures) {
      if (stage.at("stage") != wanted.stage) continue;
      const auto found = stage.at("figures").find(wanted.figure);
      if (found == stage.at("figures").end() || !found->is_number()) continue;
      figures[key_of(wanted)] = found->get<double>();
    }
  }
  return figures;
}

Json batch_json(const std::string& recipe, const std::vector<BatchRow>& rows) {
  Json cases = Json::array();
  for (const BatchRow& row : rows) {
    cases.push_back(row);
    cases.back()["case"] = row.name;
  }
  return {{"schema", "organbake/batch/1"}, {"recipe", recipe}, {"cases", cases}};
}

std::vector<BatchRow> rows_of(const Json& batch) {
  std::vector<BatchRow> rows;
  for (const Json& one : batch.at("cases")) {
    rows.push_back(one.get<BatchRow>());
    rows.back().name = one.at("case");
  }
  return rows;
}

std::vector<BatchRow> interleaved(const std::vector<std::vector<BatchRow>>& shards) {
  std::vector<BatchRow> rows;
  for (std::size_t i = 0;; ++i) {
    const std::size_t before = rows.size();
    for (const auto& shard : shards) {
      if (i < shard.size()) rows.push_back(shard[i]);
    }
    if (rows.size() == before) return rows;
  }
}

std::string batch_csv(const std::vector<BatchRow>& rows) {
  std::string csv = "case,status,exit_code,seconds,peak_mb";
  for (const KeyFigure& figure : kKeyFigures) csv += "," + key_of(figure);
  csv += ",warnings,error\n";
  for (const BatchRow& row : rows) {
    csv += csv_field(row.name) + "," + row.status + "," + std::to_string(row.exit_code) + "," +
           to_text(row.seconds, 3) + "," + to_text(row.peak_mb, 1);
    for (const KeyFigure& figure : kKeyFigures) {
      const auto found = row.figures.find(key_of(figure));
      csv += ",";
      if (found != row.figures.end()) csv += to_text(found->second);
    }
    csv += "," + csv_field(one_line(joined(row.warnings, "; "))) + "," +
           csv_field(one_line(row.error)) + "\n";
  }
  return csv;
}

std::string batch_page(const std::string& recipe, std::vector<BatchRow> rows) {
  std::stable_sort(rows.begin(), rows.end(), [](const BatchRow& a, const BatchRow& b) {
    return badness(a) != badness(b) ? badness(a) > badness(b) : rms_of(a) > rms_of(b);
  });
  const auto failed = std::count_if(rows.begin(), rows.end(), bad);
  const std::vector<std::string> columns = columns_of(rows);
  std::string html = "<h1>" + escape_html(recipe) + ": " + std::to_string(rows.size()) +
                     " cases, " + std::to_string(failed) +
                     " failed</h1><table><tr><th>case</th><th></th><th>status</th><th>s</th>"
                     "<th>MB</th>";
  for (const std::string& column : columns) html += heading(column);
  html += "</tr>\n";
  for (const BatchRow& row : rows) html += page_row(row, columns);
  return html_page("organbake batch", kBatchPageStyle, html + "</table>");
}

namespace {

// Of pipelines/cluster/.
std::string cluster_file(std::string_view name) {
  for (const EmbeddedFile& file : embedded_files()) {
    if (file.name == name) return std::string(file.text);
  }
  throw std::logic_error("no embedded file of this name");
}

// Of a task, without what tells it from the others.
std::vector<std::string> batch_arguments(const JobPlan& plan) {
  std::vector<std::string> words = {(plan.output / "cases.csv").string()};
  words.insert(words.end(), plan.arguments.begin(), plan.arguments.end());
  words.insert(words.end(), {"-o", plan.output.string()});
  return words;
}

std::string whole(double value) { return std::to_string(std::llround(std::ceil(value))); }

}  // namespace

std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789/._-+:,@=";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string job_lines(const JobPlan& plan) {
  std::string start = shell_word(plan.program.string()) + " batch " +
                      joined(batch_arguments(plan), " ", shell_word);
  if (plan.threads > 0) start += " --threads " + std::to_string(plan.threads);
  const std::string count = std::to_string(plan.tasks);
  std::string text;
  for (std::size_t i = 1; i <= plan.tasks; ++i) {
    text += start + " --shard " + std::to_string(i) + "/" + count + "\n";
  }
  return text;
}

std::string job_snakefile(const JobPlan& plan) {
  const Json config = {{"program", plan.program.string()},
                       {"arguments", plan.arguments},
                       {"output", plan.output.string()},
                       {"tasks", plan.tasks},
                       {"threads", plan.threads},
                       {"memory_mb", std::llround(std::ceil(plan.memory_mb))},
                       {"minutes", std::llround(std::ceil(plan.minutes))}};
  try {  // What JSON has of strings, numbers and lists is Python as well.
    return "config.update(" + config.dump(4) + ")\n\n" + cluster_file("Snakefile");
  } catch (const Json::exception&) {
    throw UsageError("a path is no UTF-8 text, which a Snakefile must be; rename it");
  }
}

std::string job_array(const JobPlan& plan) {
  const std::string script = cluster_file("array.sbatch");
  const std::size_t first_line = script.find('\n') + 1, body = script.find("\n\n") + 1;
  const std::string count = std::to_string(plan.tasks);
  return script.substr(0, first_line) + "#SBATCH --array=1-" + count +
         "\n#SBATCH --cpus-per-task=" + std::to_string(plan.threads) +
         "\n#SBATCH --mem=" + whole(plan.memory_mb) + "M\n#SBATCH --time=" + whole(plan.minutes) +
         "\n" + script.substr(first_line, body - first_line) +
         "\nprogram=" + shell_word(plan.program.string()) + " tasks=" + count + "\nset -- " +
         joined(batch_arguments(plan), " ", shell_word) + script.substr(body);
}

}  // namespace organbake
