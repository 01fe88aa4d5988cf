// SPDX-License-Identifier: GPL-3.0-or-later
#include "stability/probes.h"

#include <cmath>

#include "stability/trial.h"

namespace organbake {

const std::vector<Probe>& all_probes() {
  static const std::vector<Probe> probes = {
      {"isosurface", "two voxels outside the volume; open or inward surfaces", probe_isosurface},
      {"isosurface of a mask", "a tenth of the label's volume", probe_label_surface},
      {"decimate", "a torn proxy, too many faces", probe_decimate},
      {"place", "a thousandth of the map, by which a vertex lies outside it", probe_place},
      {"capture", "a millionth of the scene between macro + micro and the surface", probe_capture},
      {"deform", "ten times the organ's size, by which a vertex moved", probe_deform},
      {"deform by hard pulls", "four times the organ's size, by which a vertex moved", probe_pulls},
      {"warp", "one byte between two drawings of one frame", probe_warp},
      {"shade", "a depth that is not positive", probe_shade},
      {"register", "a wrong pose that is called ok", probe_register},
      {"volume files", "a volume that is none", probe_volume_files},
      {"mesh files", "a mesh that is none", probe_mesh_files},
      {"picture files", "a picture that is none", probe_picture_files},
      {"documents", "a document that does not come back as it was", probe_documents},
  };
  return probes;
}

void expect_finite(double value, const char* what) {
  if (!std::isfinite(value)) throw NotFinite(what);
}

void expect_finite(const TriangleMesh& mesh, const char* what) {
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    if (!vertex.allFinite()) throw NotFinite(what);
  }
}

}  // namespace organbake
