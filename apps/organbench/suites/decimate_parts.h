// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "bench.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct NamedProxy {
  std::string name;
  TriangleMesh proxy;
};

// The surface seen from one side, painted by its distance to each of its proxies.
void show_distances(Bench& bench, const TriangleMesh& surface,
                    const std::vector<NamedProxy>& proxies);

}  // namespace organbake
