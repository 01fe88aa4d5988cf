// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "stages/shared/options.h"

namespace organbake {

struct MechanicsStageOptions {
  MechanicsOptions mechanics = {.fem = true};
  MeshFrame frame;
};

inline void bind(OptionList& list, MechanicsStageOptions& options) {
  MechanicsOptions& o = options.mechanics;
  list.add("young_modulus_kpa", &o.young_modulus_kpa,
           {.help = "Young's modulus of the tissue; liver: about 5…15", .range = {1e-3, 1e6}})
      .add("density_kg_per_m3", &o.density_kg_per_m3,
           {.help = "density of the tissue", .unit = "kg/m³", .range = {1, 30000}})
      .add("thickness_mm", &o.thickness_mm,
           {.help = "thickness of the layer of tissue that a surface spring stands for, and of the "
                    "tetrahedra under a surface that only one viewpoint has seen",
            .range = {0.01, 1000}})
      .add("damping_ratio", &o.damping_ratio,
           {.help = "damping of each spring; 1 = critical", .range = {0, 10}})
      .add("volume_stiffness", &o.volume_stiffness,
           {.help = "how much of the volume is kept; 0 = free, 1 = kept", .range = {0, 1}})
      .add("anchor_fraction", &o.anchor_fraction,
           {.help = "share of the vertices that don't move", .range = {0, 0.9}})
      .add("anchor_direction", &o.anchor_direction,
           {.help = "the vertices farthest along it are held; +y of LPS is the patient's back"})
      .add("instrument_radius_mm", &o.instrument_radius_mm,
           {.help = "radius of an instrument's tip, unless a script says another",
            .range = {0.01, 1000}})
      .add("cut_gape_mm", &o.cut_gape_mm,
           {.help = "how far the lips of a long cut stand apart that nothing pulls on",
            .range = {0, 10}})
      .add("grasp_slip_n", &o.grasp_slip_n,
           {.help = "the pull from which a grasp of the tissue slips; 0 = it holds any",
            .range = {0, 1e6}})
      .add("drag_per_s", &o.drag_per_s,
           {.help = "how fast a piece that is cut free and hangs on nothing loses its speed in the "
                    "wet cavity; 0 = it coasts on",
            .unit = "1/s",
            .range = {0, 1000}})
      .add("fem", &o.fem,
           {.help =
                "tetrahedra too, by which organs are then played; a proxy without an inside gets "
                "none, which is said"})
      .add(
          "fem_cell_mm", &o.fem_cell_mm,
          {.help = "cell of the lattice that the tetrahedra are cut from; 0 = by the proxy's edges",
           .range = {0, 1000}})
      .add("poisson_ratio", &o.poisson_ratio,
           {.help = "Poisson's ratio of the tetrahedra; 0.5 would be incompressible",
            .range = {0, 0.49}})
      .retire("fit_to_fem", "springs have the stiffness of their tissue; tetrahedra are fem's",
              true);
  bind(list, options.frame);
}

inline Stage mechanics_stage() {
  return {.name = "mechanics",
          .summary = "give a proxy its springs, masses and anchors",
          .inputs = {{"proxy", InputKind::mesh, "the proxy"}},
          .outputs = {{"mechanics", "mechanics.json"}},
          .make_options = make_options<MechanicsStageOptions>,
          .single_file = true};
}

}  // namespace organbake
