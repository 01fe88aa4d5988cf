// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stages/phantom/options.h"

#include "pipelines/stage_binding.h"

namespace organbake {
namespace {

// Documents carry numbers as doubles: beyond 2⁵³ whole numbers would silently change.
constexpr double kLargestSeed = 9007199254740991.0;

}  // namespace

void bind(OptionList& list, PhantomStageOptions& o) {
  list.add("kind", &o.kind, {.help = "what is made", .choices = {"organ", "laparoscopy"}})
      .add("seed", &o.organ.seed,
           {.help = "number that the shape and the noise are drawn from",
            .min = 0,
            .max = kLargestSeed})
      .add("size", &o.organ.ct_size,
           {.help = "size of the CT", .unit = "voxels", .min = 8, .max = 1024})
      .add("spacing", &o.organ.spacing_mm,
           {.help = "distance between voxels", .unit = "mm", .min = 0.05, .max = 50})
      .add("noise", &o.organ.noise_hu,
           {.help = "standard deviation of the CT's noise", .unit = "HU", .min = 0, .max = 500})
      .add("photos", &o.organ.photo_count,
           {.help = "photographs from known poses", .min = 0, .max = 256})
      .add("photo_size", &o.organ.photo_size,
           {.help = "side of a photograph, which is square", .unit = "px", .min = 16, .max = 8192})
      .add("truth_subdivisions", &o.truth_subdivisions,
           {.help = "subdivisions n of the true mesh, which has 20·4ⁿ faces", .min = 1, .max = 9})
      .add("frames", &o.laparoscopy.frames,
           {.help = "number of a laparoscopy's frames", .min = 1, .max = 100000})
      .add("frame_width", &o.laparoscopy.width,
           {.help = "width of a laparoscopy's frame", .unit = "px", .min = 16, .max = 4096})
      .add("frame_height", &o.laparoscopy.height,
           {.help = "height of a laparoscopy's frame", .unit = "px", .min = 16, .max = 4096})
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
      .add("light_beside", &o.laparoscopy.light_offset_x_mm,
           {.help = "how far a laparoscopy's light stands to the right of its lens",
            .unit = "mm",
            .min = -20,
            .max = 20})
      .add("beam", &o.laparoscopy.beam_exponent,
           {.help = "a laparoscopy's light falls off as cosⁿ of the angle to the axis; 0 = even",
            .min = 0,
            .max = 20})
      .add("tilt", &o.laparoscopy.tilt_rad,
           {.help = "tilt of a laparoscopy's view onto the tissue; 0 = from above",
            .unit = "rad",
            .min = -0.7,
            .max = 0.7})
      .add("baseline", &o.laparoscopy.baseline_mm,
           {.help =
                "distance from the left eye of a stereo laparoscopy to the right one; 0 = one eye",
            .unit = "mm",
            .min = 0,
            .max = 20});
}

Stage phantom_stage() {
  return {.name = "phantom",
          .version = 2,
          .summary = "make a synthetic organ: CT, photographs, and the truth about both",
          .inputs = {},
          .outputs = {{"ct", "ct.mha"},
                      {"photos", "photos/cameras.json"},
                      {"lighting", "photos/lighting.json"},
                      {"truth", "truth.ply"}},
          .make_options = make_options<PhantomStageOptions>};
}

}  // namespace organbake
