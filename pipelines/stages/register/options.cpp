// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/register/options.h"

#include "organbake/pipelines/stage_binding.h"
#include "stages/shared/reading_options.h"

namespace organbake {

void bind(OptionList& list, RegisterStageOptions& o) {
  RegistrationOptions& r = o.registration;
  list.add(
          "light", &r.light,
          {.help = "where the light is: at the camera; near it, with a beam of its own; in "
                   "light_direction; anywhere, estimated with the pose; auto: what the photo says"},
          {{"auto", LightModel::automatic},
           {"camera", LightModel::camera},
           {"beam", LightModel::beam},
           {"direction", LightModel::direction},
           {"estimated", LightModel::estimated}})
      .add("light_direction", &r.light_direction,
           {.help = "surface to light in the camera's axes: x right, y down, z forward"})
      .add(
          "similarity", &r.similarity,
          {.help = "what is correlated: radiance, as in the paper; its gradient; or, near a start, "
                   "the silhouette with what has the organ's colours"},
          {{"radiance", Similarity::radiance},
           {"gradient", Similarity::gradient},
           {"silhouette", Similarity::silhouette}})
      .add("form", &r.window,
           {.help = "one correlation per patch with a robust loss, or one for the whole picture"},
           {{"patches", SimilarityWindow::patches}, {"whole", SimilarityWindow::whole}})
      .add("free_focal", &r.free_focal, {.help = "seek one scale of the focal lengths, too"})
      .add("closed_outline", &o.closed_outline,
           {.help = "the organ ends where the mesh has a border; else it goes on there, unseen"})
      .add("vertex_albedo", &o.vertex_albedo,
           {.help = "take the surface's vertex colours for its albedo"})
      .add("from_poses", &o.from_poses,
           {.help = "start unposed photos from the poses in their document"})
      .add("finest_side_px", &r.finest_side_px,
           {.help = "a photo is halved until no side is longer",
            .unit = "px",
            .min = 64,
            .max = 8192})
      .add("outer_iterations", &r.outer_iterations,
           {.help = "per pyramid level: overlap, light and weights anew", .min = 1, .max = 50})
      .add("solver_iterations", &r.solver_iterations,
           {.help = "iterations of the solver within each of those", .min = 1, .max = 100})
      .add("also", &o.also, {.help = "write the cameras for other programs as well"},
           {{"none", CameraExport::none},
            {"colmap", CameraExport::colmap},
            {"transforms", CameraExport::transforms}});
  bind(list, o.frame);
}

Stage register_stage() {
  return {
      .name = "register",
      .version = 11,
      .summary = "find a photograph's pose on the surface, with a verdict",
      .inputs = {{"surface", InputKind::mesh, "the organ's surface"},
                 {.name = "photo",
                  .kind = InputKind::file,
                  .help = "photographs, PNG or JPEG, or one video, whose frames follow the scope's "
                          "motion; where it tells none, each starts from the last",
                  .unless = "unposed",
                  .many = true},
                 {.name = "intrinsics",
                  .kind = InputKind::lenses,
                  .help =
                      "the lens: calibration of OpenCV (YAML, JSON, XML), Kalibr or MATLAB (JSON), "
                      "cameras.json, COLMAP folder or transforms.json",
                  .unless = "unposed"},
                 {.name = "init",
                  .kind = InputKind::lenses,
                  .help = "poses to start from: pose.json, COLMAP folder or transforms.json; else "
                          "a search all round",
                  .required = false},
                 {.name = "photo_mask",
                  .kind = InputKind::file,
                  .help = "picture of the photos' size, black where they don't count",
                  .required = false,
                  .flag = "mask"},
                 {.name = "pairs",
                  .kind = InputKind::file,
                  .help = "text with lines 'x y z u v': surface points in mm and their pixels",
                  .required = false},
                 {.name = "scope_depth",
                  .kind = InputKind::frames,
                  .help = "what is known of the photo's depth: a folder or depth map of stereo, "
                          "motion or shade, or a fused surface; of a video the folder of motion, "
                          "else motion runs first",
                  .required = false,
                  .made_from = "left",
                  .flag = "depth"},
                 {.name = "unposed",
                  .kind = InputKind::photos,
                  .help = "instead of photos and intrinsics: a cameras.json with images",
                  .required = false}},
      .outputs = {{"photos", "pose.json"}},
      .make_options = make_options<RegisterStageOptions>,
      .single_file = true};
}

}  // namespace organbake
