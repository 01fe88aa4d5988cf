// SPDX-License-Identifier: GPL-3.0-or-later
// A run told in lines, and the machine that it ran on.
#include "report/report.h"

#include <CGAL/version.h>
#include <OpenMesh/Core/System/config.h>
#include <meshoptimizer.h>
#include <unistd.h>
#include <vtkVersionMacros.h>
#include <Eigen/Core>
#include <fstream>
#include <map>
#include <thread>

#include "organbake/core/text.h"
#include "organbake/core/version.h"
#include "organbake/pipelines/documents.h"
#include "peers/peers.h"

namespace organbake {
namespace {

std::string with_unit(double value, const std::string& unit) {
  return page_number(value) + (unit.empty() ? "" : " " + unit);
}

std::string point_text(const Point& point) {
  std::string text = "  " + point.task + ": " + point.subject + (point.peer ? " (peer)" : "");
  for (const Quantity& knob : point.knobs)
    text += ", " + knob.name + " " + with_unit(knob.value, knob.unit);
  const char* before = ": ";
  if (point.timing.runs > 0) {
    text += before + with_unit(point.timing.wall_ms.median, "ms") + ", CPU " +
            with_unit(point.timing.cpu_ms.median, "ms") + ", " +
            with_unit(point.timing.peak_mb, "MB");
    before = "; ";
  }
  for (const Quantity& error : point.errors) {
    text += before + error.name + " " + with_unit(error.value, error.unit);
    before = "; ";
  }
  return text + "\n";
}

}  // namespace

std::string suite_text(const RunReport::SuiteReport& suite) {
  std::string text = suite.name + ": " + suite.summary + " (" + to_text(suite.seconds, 1) + " s)\n";
  for (const Point& point : suite.result.points) text += point_text(point);
  for (const Figure& f : suite.result.figures) {
    text += std::string(f.met() ? "  reached: " : "  MISSED:  ") + f.what + ": " +
            with_unit(f.value, f.unit) + (f.goal == Figure::Goal::at_most ? " ≤ " : " ≥ ") +
            page_number(f.target) + "\n";
  }
  for (const auto& skipped : suite.result.skipped)
    text += "  left out: " + skipped.what + ": " + skipped.why + "\n";
  if (!suite.result.failure.empty()) text += "  ended early: " + suite.result.failure + "\n";
  return text;
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
