// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organ_shape.h"
#include "organ_texture.h"
#include "organbake/phantom/phantom.h"

namespace organbake {

struct Organ {
  OrganShape shape;
  OrganTexture texture;

  // What a photograph shows of a surface point apart from highlights; linear RGB, not clamped.
  Eigen::Vector3d diffuse(const Eigen::Vector3d& world_mm, const Eigen::Vector3d& normal) const;
};

// The scan's grid: its size and spacing as asked for, LPS axes, its centre away from the world's.
Eigen::Vector3d scan_center_mm();
Volume scan_organ(const OrganShape& shape, const OrganPhantomOptions& options,
                  const RunContext& context);

// The formula's surface over an icosphere's directions, with its diffuse colours when `texture`.
TriangleMesh organ_surface(const Organ& organ, int subdivisions, bool colored,
                           const RunContext& context);

std::vector<PosedCamera> cameras_round(const TriangleMesh& surface, int count, int size);

}  // namespace organbake
