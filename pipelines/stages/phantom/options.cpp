// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/phantom/options.h"

#include <array>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/pipelines/stage_binding.h"

namespace organbake {
namespace {

// Documents carry numbers as doubles: beyond 2⁵³ whole numbers would silently change.
constexpr double kLargestSeed = 9007199254740991.0;

constexpr std::array<std::pair<const char*, ScopePath>, 7> kPaths = {
    {{"still", ScopePath::still},
     {"slide", ScopePath::slide},
     {"approach", ScopePath::approach},
     {"turn", ScopePath::turn},
     {"orbit", ScopePath::orbit},
     {"tour", ScopePath::tour},
     {"zoom", ScopePath::zoom}}};

std::vector<std::string> path_names() {
  std::vector<std::string> names = {"sway"};
  for (const auto& [name, path] : kPaths) names.emplace_back(name);
  return names;
}

void bind_clip(OptionList& list, PhantomStageOptions& o) {
  list.add("path", &o.path,
           {.help =
                "how a laparoscopy's scope moves: sway = some millimetres, over a bumpy bed; the "
                "others over a liver, a gallbladder and fat: not at all, sideways, nearer, "
                "turning about its lens, round in a circle, all of these and back again, or "
                "zooming",
            .choices = path_names()})
      .add("breathing_mm", &o.clip.breathing_mm,
           {.help = "how far a breath pushes the liver that a scope moves over along a path",
            .unit = "mm",
            .min = 0,
            .max = 20})
      .add("breathing_period_s", &o.clip.breathing_period_s,
           {.help = "time from one breath to the next, at 25 frames a second",
            .unit = "s",
            .min = 1,
            .max = 20})
      .add("blurred", &o.clip.blurred,
           {.help = "share of the frames along a path that a jerk of the scope blurs",
            .min = 0,
            .max = 1})
      .add(
          "bit_rate_mbit_per_s", &o.bit_rate_mbps,
          {.help = "write the frames along a path as an H.264 video of this rate, clip.mp4; 0 = as "
                   "PNG files",
           .unit = "Mbit/s",
           .min = 0,
           .max = 1000});
}

}  // namespace

void bind(OptionList& list, PhantomStageOptions& o) {
  list.add("kind", &o.kind, {.help = "what is made", .choices = {"organ", "laparoscopy"}})
      .add("seed", &o.organ.seed,
           {.help = "number that the shape and the noise are drawn from",
            .min = 0,
            .max = kLargestSeed})
      .add("size_voxels", &o.organ.ct_size,
           {.help = "size of the CT", .unit = "voxels", .min = 8, .max = 1024})
      .add("spacing_mm", &o.organ.spacing_mm,
           {.help = "distance between voxels", .unit = "mm", .min = 0.05, .max = 50})
      .add("noise_hu", &o.organ.noise_hu,
           {.help = "standard deviation of the CT's noise", .unit = "HU", .min = 0, .max = 500})
      .add("photos", &o.organ.photo_count,
           {.help = "photographs from known poses", .min = 0, .max = 256})
      .add("photo_size_px", &o.organ.photo_size,
           {.help = "side of a photograph, which is square", .unit = "px", .min = 16, .max = 8192})
      .add("truth_subdivisions", &o.truth_subdivisions,
           {.help = "subdivisions n of the true mesh, which has 20·4ⁿ faces", .min = 1, .max = 9})
      .add("frames", &o.frames,
           {.help = "number of a laparoscopy's frames; 0 = 8, or 120 along a path",
            .min = 0,
            .max = 100000})
      .add("frame_width_px", &o.frame_width,
           {.help = "width of a laparoscopy's frame; 0 = 640, or 1280 along a path",
            .unit = "px",
            .min = 0,
            .max = 4096})
      .add("frame_height_px", &o.frame_height,
           {.help = "height of a laparoscopy's frame; 0 = 480, or 720 along a path",
            .unit = "px",
            .min = 0,
            .max = 4096})
      .add("frame_noise", &o.laparoscopy.noise,
           {.help = "noise of a laparoscopy's frames, as a share of full scale",
            .min = 0,
            .max = 0.5})
      .add("texture", &o.laparoscopy.texture,
           {.help = "variation of the albedo of a laparoscopy's tissue", .min = 0, .max = 0.9})
      .add("highlights", &o.laparoscopy.highlights,
           {.help = "strength of a laparoscopy's mirror reflections", .min = 0, .max = 10})
      .add("instrument", &o.laparoscopy.instrument,
           {.help = "a steel instrument comes into a laparoscopy's view"})
      .add("light_beside_mm", &o.laparoscopy.light_offset_x_mm,
           {.help = "how far a laparoscopy's light stands to the right of its lens",
            .unit = "mm",
            .min = -20,
            .max = 20})
      .add("beam", &o.laparoscopy.beam_exponent,
           {.help = "a laparoscopy's light falls off as cosⁿ of the angle to the axis; 0 = even",
            .min = 0,
            .max = 20})
      .add("tilt_deg", Degrees{&o.laparoscopy.tilt_rad},
           {.help = "tilt of a laparoscopy's view onto the tissue; 0 = from above",
            .unit = "deg",
            .min = -40.2,
            .max = 40.2})
      .add("baseline_mm", &o.laparoscopy.baseline_mm,
           {.help =
                "distance from the left eye of a stereo laparoscopy to the right one; 0 = one eye",
            .unit = "mm",
            .min = 0,
            .max = 20});
  bind_clip(list, o);
}

LaparoscopyOptions PhantomStageOptions::view() const {
  LaparoscopyOptions view = laparoscopy;
  view.seed = organ.seed;
  if (moves_along_path()) view.frames = 120, view.width = 1280, view.height = 720;
  if (frames > 0) view.frames = frames;
  if (frame_width > 0) view.width = frame_width;
  if (frame_height > 0) view.height = frame_height;
  return view;
}

MovingClipOptions PhantomStageOptions::moving_clip() const {
  MovingClipOptions moving = clip;
  moving.view = view();
  for (const auto& [name, scope_path] : kPaths)
    if (name == path) moving.path = scope_path;
  return moving;
}

Stage phantom_stage() {
  return {.name = "phantom",
          .version = 3,
          .summary = "make a synthetic organ: CT, photographs, and the truth about both",
          .inputs = {},
          .outputs = {{"ct", "ct.mha"},
                      {"photos", "photos/cameras.json"},
                      {"lighting", "photos/lighting.json"},
                      {"truth", "truth.ply"}},
          .make_options = make_options<PhantomStageOptions>};
}

}  // namespace organbake
