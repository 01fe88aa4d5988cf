// SPDX-License-Identifier: GPL-3.0-or-later
#include "suites.h"

#include "bench.h"

namespace organbake {

const std::vector<Suite>& all_suites() {
  static const std::vector<Suite> suites = {
      {"isosurface", "CT to surface: voxel size against radial error", run_isosurface_suite},
      {"decimate", "surface to proxy: faces and method against distance", run_decimate_suite},
      {"shading", "frames to depth: surfaces, noise, lights and clips against truth",
       run_shading_suite},
      {"motion", "a moving scope's clip to poses, depth and a surface: truth, and COLMAP beside it",
       run_motion_suite},
      {"registration", "photo to pose: pyramid and iterations against mTRE",
       run_registration_suite},
      {"place", "surface to cameras: candidates and samples against coverage and count",
       run_place_suite},
      {"capture", "surface and photos to maps: rays and packing against error, time and size",
       run_capture_suite},
      {"player", "poked frames: maps against image error and time, deformation, start",
       run_player_suite},
      {"cutting", "blades: random sweeps, how wide cuts open, the step in which they grow",
       run_cutting_suite},
      {"appearance", "a CT liver beside frames of a laparoscopy: colours, highlights, grain",
       run_appearance_suite},
      {"bake",
       "a whole CT to a bundle: draft, standard, fine and what lies between, against the picture",
       run_bake_suite},
      {"scaling", "time against work: the exponent of every stage's main size, and threads",
       run_scaling_suite},
      {"skip", "what a scene does not need: everything against skipping, to the same bytes",
       run_skip_suite},
      {"stability", "seeded and adversarial inputs to every stage: what breaks, and by which seed",
       run_stability_suite},
  };
  return suites;
}

}  // namespace organbake
