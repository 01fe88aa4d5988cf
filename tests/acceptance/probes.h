// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <stdexcept>
#include <vector>

#include "organbake/core/random.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

using ProbeFolder = std::filesystem::path;

// Puts one stage to an input drawn from a random stream, often an adversarial one.
struct Probe {
  const char* name;     // letters and digits
  const char* allowed;  // what an error of 1 means
  // The result's error as a share of what is allowed; 0 where there is nothing to measure. Throws
  // an organbake::Error when the input is refused, NotFinite. `folder` is for files.
  double (*run)(RandomStream& random, const ProbeFolder& folder);
};

// Thrown by a probe that got a result with numbers that are none.
struct NotFinite : std::runtime_error {
  using std::runtime_error::runtime_error;
};
// Throws NotFinite naming `what`.
void expect_finite(double value, const char* what);
void expect_finite(const TriangleMesh& mesh, const char* what);

// Of stages that make surfaces; bundles of them, and what plays those; photographs; files.
std::vector<Probe> surface_probes();
std::vector<Probe> bundle_probes();
std::vector<Probe> photo_probes();
std::vector<Probe> file_probes();

}  // namespace organbake
