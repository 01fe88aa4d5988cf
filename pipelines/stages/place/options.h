// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "organbake/viewpoints/placement.h"
#include "stages/shared/options.h"

namespace organbake {

struct PlaceStageOptions {
  PlacementOptions placement;
  Eigen::Vector3d cone_axis = ViewingCone().axis;
  double cone_angle_rad = 0;      // half angle; 0 = cameras all round
  CoverageGoal goal{.share = 0};  // share 0 = go by count
  int size_limit_px = 2048;       // of maps as fine as a picture
  CoverageDetail report = CoverageDetail::brief;
  MeshFrame frame;

  PlacementOptions resolved() const;
};

inline PlacementOptions PlaceStageOptions::resolved() const {
  PlacementOptions options = placement;
  if (cone_angle_rad > 0) options.cone = ViewingCone{cone_axis, cone_angle_rad};
  if (goal.share > 0) options.coverage = goal;
  return options;
}

inline void bind(OptionList& list, PlaceStageOptions& o) {
  list.add("count", &o.placement.count,
           {.help = "virtual cameras, evenly spread", .range = {1, 256}})
      .add("coverage", &o.goal.share,
           {.help = "instead of a count: the fewest cameras that see this share of the reachable "
                    "area, 0.5…1; 0 = go by count",
            .range = {0, 1}})
      .add("overlap", &o.goal.overlap,
           {.help = "cameras that must see it, of a coverage", .range = {1, 4}})
      .add("texel_mm", &o.goal.texel_mm,
           {.help = "longest side of a texel on what counts as seen; 0 = any", .range = {0, 1000}})
      .add("candidates", &o.goal.candidates,
           {.help = "directions that a coverage chooses from", .range = {16, 8192}})
      .add("samples", &o.goal.samples,
           {.help = "points of the surface that a coverage chooses by; where it is deeply folded "
                    "the hardest "
                    "to see of a hundred times as many",
            .range = {64, 65536}})
      .add("size_px", &o.placement.map_size,
           {.help = "side of the cameras' maps, which are square; 0 = as fine as the pixels of the "
                    "picture that the surface was read from, or 512 without one",
            .range = {0, 16384}})
      .add("size_limit_px", &o.size_limit_px,
           {.help = "with size_px 0, maps as fine as a picture are no larger than this",
            .range = {64, 16384}})
      .add("field_of_view_deg", Degrees{&o.placement.field_of_view_rad},
           {.help = "angle of view of each camera", .range = {0.5, 143.5}})
      .add("margin", &o.placement.margin,
           {.help = "free border round the organ, share of the map", .range = {0, 0.4}})
      .add("cone_axis", &o.cone_axis, {.help = "axis of the viewing cone, from the organ's centre"})
      .add("cone_angle_deg", Degrees{&o.cone_angle_rad},
           {.help = "half angle of the viewing cone, 90 = a hemisphere; 0 = cameras all round",
            .range = {0, 90}})
      .add("report", &o.report,
           {.help = "brief: coverage and texel sizes, from fewer samples; full: what views miss as "
                    "well, at rest and poked, and the surface painted by what cameras see"},
           {{"brief", CoverageDetail::brief}, {"full", CoverageDetail::full}})
      .retire("view_gap", "views may always miss 0.1 %");
  bind(list, o.frame);
}

inline Stage place_stage() {
  return {.name = "place",
          .summary = "place virtual cameras round a surface or inside a viewing cone",
          .inputs = {{"surface", InputKind::mesh, "the organ's surface"},
                     {"scope_photo", InputKind::photos,
                      "the posed picture that the surface was read from, as shade and stereo write "
                      "it; for maps as fine as its pixels",
                      false}},
          .outputs = {{"cameras", "cameras.json"}, {"vpm", "vpm.ply"}},
          .make_options = make_options<PlaceStageOptions>};
}

}  // namespace organbake
