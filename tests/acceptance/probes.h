// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/random.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"
#include "support/testing.h"

namespace organbake {

// What users and other programs hand over, good and bad, drawn from a seed.

bool chance(RandomStream& random, double share);
// Of very different sizes: 10^low … 10^high.
double any_size(RandomStream& random, double low, double high);
// NaN, infinities, zero, the least and the largest there are.
double odd_number(RandomStream& random);
Eigen::Vector3d any_direction(RandomStream& random);  // unit
// One in ten has an odd number.
Eigen::Vector3d any_point(RandomStream& random, double most_mm);

// A closed, lumpy, star-shaped organ of 80…1,280 faces, outward, with colours.
TriangleMesh sound_organ(RandomStream& random);
// The same; or moved far away, tiny, huge, flat, mirrored, torn, with faces doubled, flipped or
// without area, with spikes, without vertices, with bad indices or numbers that are none.
TriangleMesh any_organ(RandomStream& random);

// Looks at the middle of the box from outside, so that it is in the picture.
PosedCamera camera_round(RandomStream& random, const Bounds& box, int size);

// Puts one stage to an input drawn from a random stream, often an adversarial one.
struct Probe {
  const char* name;     // letters and digits
  const char* allowed;  // what an error of 1 means
  // The result's error as a share of what is allowed; 0 where there is nothing to measure. Throws
  // an organbake::Error when the input is refused, NotFinite.
  double (*run)(RandomStream& random);
};

// Thrown by a probe that got a result with numbers that are none.
struct NotFinite : std::runtime_error {
  using std::runtime_error::runtime_error;
};
// Throws NotFinite naming `what`.
void expect_finite(double value, const char* what);
void expect_finite(const TriangleMesh& mesh, const char* what);

// Of stages that make surfaces; bundles of them, and what plays those; photographs. Damaged files
// and meshes are tests/fuzz's.
std::vector<Probe> surface_probes();
std::vector<Probe> bundle_probes();
std::vector<Probe> photo_probes();

}  // namespace organbake
