// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/options/options.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/phantom/phantom.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

struct PhantomStageOptions {
  std::string kind = "organ";
  OrganPhantomOptions organ;
  int truth_subdivisions = 7;
  LaparoscopyOptions laparoscopy;
  // Of a laparoscopy; 0 = what its path asks for.
  int frames = 0, frame_width = 0, frame_height = 0;
  std::string path = "sway";
  MovingClipOptions clip;  // for all paths but `sway`; its view comes from `laparoscopy`
  double bit_rate_mbps = 0;

  bool moves_along_path() const { return path != "sway"; }
  LaparoscopyOptions view() const;        // of either kind of clip
  MovingClipOptions moving_clip() const;  // where it moves along a path
};

// Documents carry numbers as doubles: beyond 2⁵³ whole numbers would silently change.
inline constexpr double kLargestSeed = 9007199254740991.0;

inline constexpr std::array<std::pair<const char*, ScopePath>, 7> kPaths = {
    {{"still", ScopePath::still},
     {"slide", ScopePath::slide},
     {"approach", ScopePath::approach},
     {"turn", ScopePath::turn},
     {"orbit", ScopePath::orbit},
     {"tour", ScopePath::tour},
     {"zoom", ScopePath::zoom}}};

inline std::vector<std::string> path_names() {
  std::vector<std::string> names = {"sway"};
  for (const auto& [name, path] : kPaths) names.emplace_back(name);
  return names;
}

inline void bind_clip(OptionList& list, PhantomStageOptions& o) {
  list.add("path", &o.path,
           {.help =
                "how a laparoscopy's scope moves: sway = some millimetres, over a bumpy bed; the "
                "others over a liver, a gallbladder and fat: not at all, sideways, nearer, "
                "turning about its lens, round in a circle, all of these and back again, or "
                "zooming",
            .choices = path_names()})
      .add("breathing_mm", &o.clip.breathing_mm,
           {.help = "how far a breath pushes the liver that a scope moves over along a path",
            .range = {0, 20}})
      .add("breathing_period_s", &o.clip.breathing_period_s,
           {.help = "time from one breath to the next, at 25 frames a second", .range = {1, 20}})
      .add("blurred", &o.clip.blurred,
           {.help = "share of the frames along a path that a jerk of the scope blurs",
            .range = {0, 1}})
      .add(
          "bit_rate_mbit_per_s", &o.bit_rate_mbps,
          {.help = "write the frames along a path as an H.264 video of this rate, clip.mp4; 0 = as "
                   "PNG files",
           .unit = "Mbit/s",
           .range = {0, 1000}});
}

inline void bind(OptionList& list, PhantomStageOptions& o) {
  list.add("kind", &o.kind, {.help = "what is made", .choices = {"organ", "laparoscopy"}})
      .add("seed", &o.organ.seed,
           {.help = "number that the shape and the noise are drawn from",
            .range = {0, kLargestSeed}})
      .add("size_voxels", &o.organ.ct_size,
           {.help = "size of the CT", .unit = "voxels", .range = {8, 1024}})
      .add("spacing_mm", &o.organ.spacing_mm,
           {.help = "distance between voxels", .range = {0.05, 50}})
      .add("photos", &o.organ.photo_count,
           {.help = "photographs from known poses", .range = {0, 256}})
      .add("photo_size_px", &o.organ.photo_size,
           {.help = "side of a photograph, which is square", .range = {16, 8192}})
      .add("truth_subdivisions", &o.truth_subdivisions,
           {.help = "subdivisions n of the true mesh, which has 20·4ⁿ faces", .range = {1, 9}})
      .add("frames", &o.frames,
           {.help = "number of a laparoscopy's frames; 0 = 8, or 120 along a path",
            .range = {0, 100000}})
      .add("frame_width_px", &o.frame_width,
           {.help = "width of a laparoscopy's frame; 0 = 640, or 1280 along a path",
            .range = {0, 4096}})
      .add("frame_height_px", &o.frame_height,
           {.help = "height of a laparoscopy's frame; 0 = 480, or 720 along a path",
            .range = {0, 4096}})
      .add("texture", &o.laparoscopy.texture,
           {.help = "variation of the albedo of a laparoscopy's tissue", .range = {0, 0.9}})
      .add("instrument", &o.laparoscopy.instrument,
           {.help = "a steel instrument comes into a laparoscopy's view"})
      .add("beam", &o.laparoscopy.beam_exponent,
           {.help = "a laparoscopy's light falls off as cosⁿ of the angle to the axis; 0 = even",
            .range = {0, 20}})
      .add("tilt_deg", Degrees{&o.laparoscopy.tilt_rad},
           {.help = "tilt of a laparoscopy's view onto the tissue; 0 = from above",
            .range = {-40.2, 40.2}})
      .add("baseline_mm", &o.laparoscopy.baseline_mm,
           {.help =
                "distance from the left eye of a stereo laparoscopy to the right one; 0 = one eye",
            .range = {0, 20}})
      .retire("noise_hu", "it is always 10 HU")
      .retire("frame_noise", "it is always 0.005 of full scale")
      .retire("highlights", "they are always as strong as those of wet tissue")
      .retire("light_beside_mm", "the light stands at the lens");
  bind_clip(list, o);
}

inline LaparoscopyOptions PhantomStageOptions::view() const {
  LaparoscopyOptions view = laparoscopy;
  view.seed = organ.seed;
  if (moves_along_path()) view.frames = 120, view.width = 1280, view.height = 720;
  if (frames > 0) view.frames = frames;
  if (frame_width > 0) view.width = frame_width;
  if (frame_height > 0) view.height = frame_height;
  return view;
}

inline MovingClipOptions PhantomStageOptions::moving_clip() const {
  MovingClipOptions moving = clip;
  moving.view = view();
  for (const auto& [name, scope_path] : kPaths)
    if (name == path) moving.path = scope_path;
  return moving;
}

inline Stage phantom_stage() {
  return {.name = "phantom",
          .summary = "make a synthetic organ: CT, photographs, and the truth about both",
          .inputs = {},
          .outputs = {{"ct", "ct.mha"},
                      {"photos", "photos/cameras.json"},
                      {"lighting", "photos/lighting.json"},
                      {"truth", "truth.ply"}},
          .make_options = make_options<PhantomStageOptions>};
}

}  // namespace organbake
