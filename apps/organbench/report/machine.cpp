// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/machine.h"

#include <CGAL/version.h>
#include <meshoptimizer.h>
#include <unistd.h>
#include <vtkVersionMacros.h>

#include <OpenMesh/Core/System/config.h>
#include <Eigen/Core>
#include <fstream>
#include <thread>

#include "organbake/core/version.h"
#include "peers/embree_scene.h"

namespace organbake {
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
      {"Embree", RTC_VERSION_STRING},
      {"Eigen", std::to_string(EIGEN_WORLD_VERSION) + "." + std::to_string(EIGEN_MAJOR_VERSION) +
                    "." + std::to_string(EIGEN_MINOR_VERSION)}};
}

}  // namespace organbake
