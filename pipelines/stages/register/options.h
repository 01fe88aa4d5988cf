// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/formats/mesh_files.h"
#include "organbake/options/options.h"
#include "organbake/pipelines/stage.h"
#include "organbake/registration/register_photo.h"
#include "stages/shared/options.h"

namespace organbake {

// Which files a pose is written to besides our own.
enum class CameraExport { none, colmap, transforms };

struct RegisterStageOptions {
  RegistrationOptions registration;
  bool closed_outline = false;  // the organ ends where the mesh does
  bool vertex_albedo = false;   // the surface's colours are its albedo
  CameraExport also = CameraExport::none;
  MeshFrame frame;
};

inline void bind(OptionList& list, RegisterStageOptions& o) {
  RegistrationOptions& r = o.registration;
  list.add("light", &r.light,
           {.help = "where the light is: at the camera; near it, with a beam of its own; "
                    "anywhere, estimated with the pose; auto: what the photo says"},
           {{"auto", LightModel::automatic},
            {"camera", LightModel::camera},
            {"beam", LightModel::beam},
            {"estimated", LightModel::estimated}})
      .add("similarity", &r.similarity,
           {.help = "what is correlated: radiance, as in the paper; or, near a start, the "
                    "silhouette with what has the organ's colours"},
           {{"radiance", Similarity::radiance}, {"silhouette", Similarity::silhouette}})
      .add("free_focal", &r.free_focal, {.help = "seek one scale of the focal lengths, too"})
      .add("closed_outline", &o.closed_outline,
           {.help = "the organ ends where the mesh has a border; else it goes on there, unseen"})
      .add("vertex_albedo", &o.vertex_albedo,
           {.help = "take the surface's vertex colours for its albedo"})
      .add("also", &o.also, {.help = "write the cameras for other programs as well"},
           {{"none", CameraExport::none},
            {"colmap", CameraExport::colmap},
            {"transforms", CameraExport::transforms}})
      .retire("from_poses", "give the document as init as well")
      .retire("light_direction", "the light estimated finds its direction with the pose")
      .retire("form", "patches are always correlated one by one")
      .retire("finest_side_px", "photos are read with up to 1440 px a side")
      .retire("outer_iterations", "there are always 4")
      .retire("solver_iterations", "there are always 8");
  bind(list, o.frame);
}

inline Stage register_stage() {
  return {
      .name = "register",
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
