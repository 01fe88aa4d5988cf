// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct MechanicsOptions {
  double young_modulus_kpa = 10;  // liver: about 5–15; more is stiffer
  double density_kg_per_m3 = 1060;
  double thickness_mm = 15;       // of the layer of tissue that a surface spring stands for
  double damping_ratio = 0.7;     // of each spring, 1 = critical
  double volume_stiffness = 1;    // 0 = volume free … 1 = kept
  double anchor_fraction = 0.15;  // share of the vertices held, farthest along anchor_direction
  Eigen::Vector3d anchor_direction = {0, 1, 0};  // world; +y of LPS is the patient's back
  double instrument_radius_mm = 5;
  double cut_gape_mm = 1.2;     // between the lips of a long cut that nothing pulls on
  double grasp_slip_n = 25;     // the pull from which a grasp slips; 0 = holds any
  double drag_per_s = 3;        // of pieces that hang on nothing, in a wet cavity; 0 = they coast
  bool fem = false;             // tetrahedra too, for the player's other solver
  double fem_cell_mm = 0;       // of the lattice they are cut from; 0 = by the proxy's edges
  double poisson_ratio = 0.45;  // of the tetrahedra; tissue is nearly incompressible
};

// Fits masses and springs to the proxy (the paper, 2.1.3): edges, bending springs across edges, and
// struts through the body so that it keeps its shape. A spring stands for a bar of tissue of the
// cross-section A that falls to it, k = E·A/L (for an edge of triangles E·t·ΣArea/L²: Van Gelder
// 1998), and is damped by damping_ratio · 2√(k m), m the reduced mass of its two ends. Every part
// of the proxy hangs together and on the anchors, of which there are at least three and never all.
// Need not be manifold. Tetrahedra (mechanics/lattice_body.h)
// fill a closed proxy; of one that is a sheet, what one viewpoint has seen, the layer of tissue
// thickness_mm deep under it, whose underside is held. Throws BadDataError for a proxy without
// area or of less than 0.01 mm, and when it is to have tetrahedra and is neither closed nor a
// sheet.
MechanicsModel make_mechanics(const TriangleMesh& proxy, const MechanicsOptions& options,
                              const RunContext& context = {});

}  // namespace organbake
