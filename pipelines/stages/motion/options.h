// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/motion/clip_motion.h"
#include "organbake/motion/feature_tracker.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {

struct MotionStageOptions {
  int key_frames = 12;
  int halvings = 1;                               // of the frames, before depth is sought for
  double field_of_view_rad = 1.2217304763960306;  // 70°: where the search for a lens starts
  // What makes lengths metric, first come.
  std::string known_distance;  // FRAME,X1,Y1,X2,Y2,MM
  double shaft_mm = 0;         // diameter of an instrument in view
  double range_mm = 0;
  bool shading = true;
  bool keep_light = false;
};

inline void bind(OptionList& list, MotionStageOptions& o) {
  list.add("key_frames", &o.key_frames,
           {.help = "frames of which depth is made, evenly spread over the scope's way",
            .range = {2, 200}})
      .add("halvings", &o.halvings,
           {.help = "how often the key frames' size is halved before depth is made",
            .range = {0, 4}})
      .add("field_of_view_deg", Degrees{&o.field_of_view_rad},
           {.help = "across the frame's width, where the search for the lens starts when no "
                    "intrinsics are given",
            .range = {2.9, 160.4}})
      .add("range_mm", &o.range_mm,
           {.help = "median distance of the tissue, makes depth metric; 0 = unknown",
            .range = {0, 10000}})
      .add("shaft_mm", &o.shaft_mm,
           {.help = "diameter of an instrument's straight shaft in view, makes depth metric; its "
                    "tip is taken to touch the tissue at times; 0 = unknown",
            .range = {0, 100}})
      .add("known_distance", &o.known_distance,
           {.help = "FRAME,X1,Y1,X2,Y2,MM: a frame's number from 0, two pixels of it, and the "
                    "millimetres between what they show; makes depth metric, before the others"})
      .add("shading", &o.shading,
           {.help = "fill by the picture's brightness what parallax leaves open"})
      .add("keep_light", &o.keep_light,
           {.help = "leave the scope's light in the surface's colours; else it is divided out, and "
                    "the player lights the tissue anew"})
      .retire("features", "as many are followed as the tissue holds")
      .retire("voxel_mm", "it follows how finely parallax tells depth");
}

inline Stage motion_stage() {
  return {.name = "motion",
          .summary =
              "find how a scope moved through a clip, and from that the tissue's shape: "
              "poses, lens, points, depth, and one surface of all key frames",
          .inputs = {{"frames", InputKind::frames, "a video, or a folder of frames, of one lens"},
                     {"intrinsics", InputKind::lenses,
                      "the lens: OpenCV calibration (YAML, JSON, XML), cameras.json, COLMAP folder "
                      "or transforms.json; else it is found from the clip",
                      false},
                     {"poses", InputKind::posed,
                      "the frames' cameras as another program found them: COLMAP folder, "
                      "transforms.json or cameras.json, named as the frames; else they are found "
                      "from the clip",
                      false}},
          .outputs = {{"surface", "surface.ply", true},
                      {"lighting", "lighting.json", true},
                      {"breath", "breath_field.json", true},
                      {"scope_depth", "."}},
          .make_options = make_options<MotionStageOptions>,
          .on_request = true,
          .by_section_only = true};
}

}  // namespace organbake
