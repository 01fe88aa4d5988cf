// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_options.h"

namespace organbake {

void bind_unit(OptionList& list, MeshUnit& unit, const char* help) {
  list.add(
      "unit", &unit, {.help = help},
      {{"mm", MeshUnit::mm}, {"cm", MeshUnit::cm}, {"m", MeshUnit::m}, {"in", MeshUnit::inch}});
}

void bind(OptionList& list, InspectStageOptions& o) {
  bind(list, o.reading);
  bind_unit(list, o.unit);
}

void bind(OptionList& list, RepairStageOptions& options) {
  RepairOptions& o = options.repair;
  list.add("mode", &options.mode,
           {.help = "auto: what it needs; none: the surface as it is", .choices = {"auto", "none"}})
      .add(
          "island_share", &o.island_share,
          {.help = "pieces of less than this share of the largest one's area are dropped; 0 = none",
           .min = 0,
           .max = 0.999})
      .add("hole", &o.hole_mm,
           {.help = "holes up to this width are closed; 0 = a tenth of the surface's size",
            .unit = "mm",
            .min = 0,
            .max = 1e6})
      .add("tunnels", &o.most_tunnels,
           {.help = "a surface with more tunnels is wrapped", .min = 0, .max = 1000000})
      .add("wrap", &o.wrap_mm,
           {.help = "what a wrap closes, gaps and tunnels; 0 = a hundredth of the surface's size",
            .unit = "mm",
            .min = 0,
            .max = 1e6});
  bind_unit(list, options.unit);
}

void bind(OptionList& list, DecimateStageOptions& options) {
  DecimateOptions& o = options.decimate;
  list.add("faces", &options.faces,
           {.help =
                "the proxy has at most this many; auto: as many as a tip of tool_radius can dent",
            .min = 4,
            .max = 10000000})
      .add("tool_radius", &options.tool_radius_mm,
           {.help = "radius of the tip that faces = auto makes the proxy for",
            .unit = "mm",
            .min = 0.5,
            .max = 100})
      .add("max_error", &o.max_error_mm,
           {.help = "fewest faces within this distance both ways, measured; 0 = go by faces",
            .unit = "mm",
            .min = 0,
            .max = 1e9})
      .add("method", &o.method,
           {.help = "edge collapse and a fit to the surface; or, to compare, plain collapses or "
                    "the paper's naive clustering"},
           {{"fitted", DecimateMethod::fitted},
            {"lindstrom-turk", DecimateMethod::lindstrom_turk},
            {"quadric", DecimateMethod::quadric},
            {"cluster", DecimateMethod::cluster}})
      .add("objective", &o.objective,
           {.help = "what the fit lowers: the RMS distance with the volume kept, or the largest "
                    "distance"},
           {{"rms", DecimateObjective::rms}, {"max", DecimateObjective::max}})
      .add("flips", &o.flips,
           {.help = "let the fit flip edges where that lowers the distance, up to 500 faces"});
  bind_unit(list, options.unit);
}

void bind(OptionList& list, MechanicsStageOptions& options) {
  MechanicsOptions& o = options.mechanics;
  list.add("young_modulus", &o.young_modulus_kpa,
           {.help = "Young's modulus of the tissue; liver: about 5…15",
            .unit = "kPa",
            .min = 1e-3,
            .max = 1e6})
      .add("density", &o.density_kg_per_m3,
           {.help = "density of the tissue", .unit = "kg/m³", .min = 1, .max = 30000})
      .add("thickness", &o.thickness_mm,
           {.help = "thickness of the layer that a surface spring stands for",
            .unit = "mm",
            .min = 0.01,
            .max = 1000})
      .add("damping_ratio", &o.damping_ratio,
           {.help = "damping of each spring; 1 = critical", .min = 0, .max = 10})
      .add("volume_stiffness", &o.volume_stiffness,
           {.help = "how much of the volume is kept; 0 = free, 1 = kept", .min = 0, .max = 1})
      .add("anchor_fraction", &o.anchor_fraction,
           {.help = "share of the vertices that don't move", .min = 0, .max = 1})
      .add("anchor_direction", &o.anchor_direction,
           {.help = "the vertices farthest along it are held; +y of LPS is the patient's back"})
      .add("instrument_radius", &o.instrument_radius_mm,
           {.help = "radius of an instrument's tip, unless a script says another",
            .unit = "mm",
            .min = 0.01,
            .max = 1000})
      .add("fem", &o.fem, {.help = "tetrahedra too, for organplay --solver fem"})
      .add(
          "fem_cell", &o.fem_cell_mm,
          {.help = "cell of the lattice that the tetrahedra are cut from; 0 = by the proxy's edges",
           .unit = "mm",
           .min = 0,
           .max = 1000})
      .add("poisson_ratio", &o.poisson_ratio,
           {.help = "Poisson's ratio of the tetrahedra; 0.5 would be incompressible",
            .min = 0,
            .max = 0.49})
      .add("fit_to_fem", &o.fit_to_fem,
           {.help = "fit the springs' constants to the tetrahedra's response to dead loads; small "
                    "proxies get springs between all their vertices"});
  bind_unit(list, options.unit);
}

}  // namespace organbake
