// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/tetrahedral_body.h"

namespace organbake {

struct Spring {
  std::uint32_t a = 0, b = 0;     // proxy vertices
  double rest_length_mm = 0;      // > 0
  double stiffness_n_per_mm = 0;  // > 0
  double damping_n_s_per_mm = 0;  // ≥ 0
};

// The deformable part of a bundle: masses on the proxy's vertices, springs and dampers between
// them, anchors that don't move (the paper, 2.1.3). Written by the baker's mechanics stage.
struct MechanicsModel {
  std::vector<double> mass_kg;  // one per proxy vertex, > 0
  std::vector<Spring> springs;
  std::vector<std::uint32_t> anchors;  // fixed vertices, increasing
  // The other vertices in the order in which the player's factor best eliminates them; empty: the
  // player looks for one itself, slower and, for large proxies, worse.
  std::vector<std::uint32_t> elimination_order = {};
  double young_modulus_kpa = 0;  // the tissue constants that the springs were made from
  double density_kg_per_m3 = 0;
  double thickness_mm = 0;
  double volume_stiffness = 1;      // 0 = volume free, 1 = kept
  double instrument_radius_mm = 0;  // a default size for tools
  // What a grasp of the tissue holds, N: it slips from a larger pull. 0: it holds any, as in
  // bundles that do not say.
  double grasp_slip_n = 0;
  // How fast what hangs on no anchor loses its speed, 1/s: it lies in a wet cavity. 0: it coasts
  // on, as in bundles that do not say.
  double drag_per_s = 0;
  // How far the lips of a long cut stand apart that nothing pulls on, as skin is stretched at rest.
  double cut_gape_mm = 1.2;
  // The same tissue as finite elements, by which it is played unless springs are asked for.
  std::optional<TetrahedralBody> body = {};
};

std::string mechanics_to_json(const MechanicsModel& model);
// Throws BadDataError naming `name` and the key; vertex_count bounds every index.
MechanicsModel mechanics_from_json(const std::string& text, const std::string& name,
                                   std::size_t vertex_count);

}  // namespace organbake
