// SPDX-License-Identifier: GPL-3.0-or-later
// The page of a run, and the machine that it ran on.
#include "organbake/pipelines/documents.h"
#include "report/report.h"

#include <CGAL/version.h>
#include <OpenMesh/Core/System/config.h>
#include <meshoptimizer.h>
#include <unistd.h>
#include <vtkVersionMacros.h>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <fstream>
#include <thread>

#include "organbake/core/text.h"
#include "organbake/core/version.h"
#include "peers/peers.h"

namespace organbake {
namespace {

constexpr const char* kStyle =
    "h3{font-size:1rem;margin:1.5rem 0 .3rem}table{margin:.5rem 0 1rem}"
    ".figures td+td{white-space:nowrap}.met{color:#00702f}.missed{color:#b00020;font-weight:600}"
    "svg{max-width:100%;font:11px system-ui,sans-serif}.grid{stroke:#e6e6e6}"
    ".front{fill:none;stroke:#444}figure{margin:1rem 0}figure img{max-width:100%;height:auto}";

std::string heading(const Quantity& q) {
  return html_heading(q.name + (q.unit.empty() ? "" : ", " + q.unit));
}

std::string figures_table(const std::vector<Figure>& figures) {
  if (figures.empty()) return {};
  std::string html =
      "<table class='figures'><tr><th>figure</th><th>target</th><th>measured</th></tr>";
  for (const Figure& f : figures) {
    const std::string goal = f.goal == Figure::Goal::at_most ? "≤ " : "≥ ";
    html += "<tr>" + html_cell(f.what) + html_cell(goal + page_number(f.target) + " " + f.unit) +
            "<td class='" + (f.met() ? "met" : "missed") + "'>" + page_number(f.value) + " " +
            escape_html(f.unit) + (f.met() ? "" : " – missed") + "</td></tr>";
  }
  return html + "</table>";
}

Quantities::const_iterator find_like(const Quantities& all, const Quantity& wanted) {
  return std::find_if(all.begin(), all.end(), [&](const Quantity& q) {
    return q.name == wanted.name && q.unit == wanted.unit;
  });
}

// Whatever any of the points has, in the order of its first appearance: not all have the same.
Quantities columns(const std::vector<Point>& points, Quantities Point::*list) {
  Quantities all;
  for (const Point& p : points) {
    for (const Quantity& q : p.*list) {
      if (find_like(all, q) == all.end()) all.push_back(q);
    }
  }
  return all;
}

std::string cells(const Quantities& columns, const Quantities& values) {
  std::string html;
  for (const Quantity& column : columns) {
    const auto found = find_like(values, column);
    html += html_cell(found == values.end() ? "" : page_number(found->value));
  }
  return html;
}

std::string timing_cells(const Timing& timing) {
  if (timing.runs == 0) return html_cell("") + html_cell("") + html_cell("") + html_cell("");
  const Spread& wall = timing.wall_ms;
  const std::string spread = " (" + page_number(wall.least) + "–" + page_number(wall.most) + ")";
  return html_cell(page_number(wall.median) + (timing.runs > 1 ? spread : "")) +
         html_cell(std::to_string(timing.runs)) + html_cell(page_number(timing.cpu_ms.median)) +
         html_cell(page_number(timing.peak_mb));
}

std::string points_table(const std::vector<Point>& points) {
  const Quantities knobs = columns(points, &Point::knobs), errors = columns(points, &Point::errors);
  std::string html = "<table><tr><th>who</th>";
  for (const Quantity& q : knobs) html += heading(q);
  // What it took is not always the question.
  const bool timed =
      std::any_of(points.begin(), points.end(), [](const Point& p) { return p.timing.runs > 0; });
  if (timed) html += "<th>ms (least–most)</th><th>runs</th><th>CPU ms</th><th>peak MB</th>";
  for (const Quantity& q : errors) html += heading(q);
  html += "</tr>";
  for (const Point& p : points) {
    html += "<tr>" + html_cell(p.subject + (p.peer ? " (peer)" : "")) + cells(knobs, p.knobs) +
            (timed ? timing_cells(p.timing) : "") + cells(errors, p.errors) + "</tr>";
  }
  return html + "</table>";
}

std::string figure_of(const Picture& picture) {
  return "<figure><img alt='" + escape_html(picture.caption) + "' width='" +
         std::to_string(picture.width) + "' height='" + std::to_string(picture.height) + "' src='" +
         picture.data_uri + "'><figcaption class='quiet'>" + escape_html(picture.caption) +
         "</figcaption></figure>";
}

bool has_errors_to_draw(const std::vector<Point>& points) {
  return std::any_of(points.begin(), points.end(), [](const Point& p) {
    return p.timing.runs > 0 && !p.errors.empty() && p.errors.front().value > 0;
  });
}

// Points of one task belong together, wherever they stand in the list; tasks in order of their
// first point.
std::vector<std::vector<Point>> by_task(const std::vector<Point>& points) {
  std::vector<std::vector<Point>> tasks;
  for (const Point& p : points) {
    auto found = std::find_if(tasks.begin(), tasks.end(),
                              [&](const auto& task) { return task.front().task == p.task; });
    if (found == tasks.end()) found = tasks.insert(tasks.end(), std::vector<Point>{});
    found->push_back(p);
  }
  return tasks;
}

std::string suite_section(const RunReport::SuiteReport& suite) {
  std::string html = "<h2 id='" + suite.name + "'>" + escape_html(suite.name) + "</h2><p>" +
                     escape_html(suite.summary) + " <span class='quiet'>(" +
                     page_number(suite.seconds) + " s)</span></p>";
  if (!suite.result.failure.empty()) {
    html += "<p class='missed'>ended early: " + escape_html(suite.result.failure) + "</p>";
  }
  html += figures_table(suite.result.figures);
  for (const Picture& picture : suite.result.pictures) html += figure_of(picture);
  for (const std::vector<Point>& task : by_task(suite.result.points)) {
    html += "<h3>" + escape_html(task.front().task) + "</h3>";
    if (has_errors_to_draw(task)) html += time_error_chart(task);
    if (shows_growth(task)) html += time_work_chart(task);
    html += points_table(task);
  }
  for (const auto& skipped : suite.result.skipped) {
    html += "<p class='quiet'>left out: " + escape_html(skipped.what) + " – " +
            escape_html(skipped.why) + "</p>";
  }
  return html;
}

std::string between_dots(const std::vector<std::string>& pieces) {
  std::string html;
  for (const std::string& piece : pieces) html += (html.empty() ? "" : " · ") + piece;
  return html;
}

// What there is, and how much of it reached its figures.
std::string contents(const RunReport& report) {
  std::vector<std::string> suites;
  for (const RunReport::SuiteReport& suite : report.suites) {
    const auto& figures = suite.result.figures;
    const auto met =
        std::count_if(figures.begin(), figures.end(), [](const Figure& f) { return f.met(); });
    std::string link = "<a href='#" + suite.name + "'>" + escape_html(suite.name) + "</a>";
    if (!figures.empty()) link += " " + std::to_string(met) + "/" + std::to_string(figures.size());
    suites.push_back(link);
  }
  return "<p>Figures reached of those promised: " + between_dots(suites) + "</p>";
}

std::string how_measured(const RunReport& report) {
  double seconds = 0;
  for (const RunReport::SuiteReport& suite : report.suites) seconds += suite.seconds;
  constexpr std::array kEfforts = {
      "Quick run: small inputs, few rounds.",
      "Standard run: whole inputs, of the promised cases as many as 20 minutes allow.",
      "Thorough run: every promised case."};
  return std::string(kEfforts[std::size_t(report.effort)]) + " It took " +
         to_text(seconds / 60, 1) + " minutes.";
}

}  // namespace

std::string report_page(const RunReport& report) {
  std::vector<std::string> machine;
  for (const auto& [key, value] : report.machine)
    machine.push_back(escape_html(key + ": " + value));
  std::string html = "<h1>organbench: run time against error</h1><p>" + how_measured(report) +
                     " Rings mark points that nothing beats in both time and error; peers are "
                     "dashed.</p><p class='quiet'>" +
                     between_dots(machine) + "</p>" + contents(report);
  for (const RunReport::SuiteReport& suite : report.suites) html += suite_section(suite);
  return html_page("organbench", kStyle, html);
}

namespace {

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

std::string memory() {
  constexpr double kBytesPerGb = double(1 << 30);
  const double bytes = double(::sysconf(_SC_PHYS_PAGES)) * double(::sysconf(_SC_PAGE_SIZE));
  return std::to_string(int(bytes / kBytesPerGb + 0.5)) + " GB";
}

std::string version(int major, int minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

std::map<std::string, std::string> describe_machine() {
  return {
      {"processor", processor()},
      {"cores", std::to_string(std::thread::hardware_concurrency())},
      {"memory", memory()},
      {"compiler", "g++ " __VERSION__},
      {"organbake", kVersion},
      {"VTK", VTK_VERSION},
      {"CGAL", CGAL_VERSION_STR},
      {"OpenMesh", version((OM_VERSION & 0xF0000) >> 16, (OM_VERSION & 0xFF00) >> 8)},
      // 1000 × major + 10 × minor + patch
      {"meshoptimizer", version(MESHOPTIMIZER_VERSION / 1000, MESHOPTIMIZER_VERSION % 1000 / 10)},
      {"Embree", embree_version()},
      {"Eigen", std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) +
                    "." + std::to_string(EIGEN_MINOR_VERSION)}};
}

}  // namespace organbake
