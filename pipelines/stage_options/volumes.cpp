// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stage_options.h"

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

void bind(OptionList& list, ReadStageOptions& o) {
  list.add("series", &o.series,
           {.help =
                "series of a DICOM folder, by its UID or number; else the one that is a CT volume",
            .number_too = true})
      .add("time", &o.time,
           {.help = "time point of a 4-D file or series, from 1; 0 = it has only one",
            .min = 0,
            .max = 1000000})
      .add(
          "strict", &o.strict,
          {.help = "refuse a DICOM series with uneven, missing, repeated or damaged slices instead "
                   "of mending it"})
      .add("roi", &o.roi,
           {.help = "two corners x0,y0,z0,x1,y1,z1 of the box that is read; else all",
            .unit = "mm, LPS"});
}

void bind(OptionList& list, IsosurfaceStageOptions& options) {
  IsosurfaceOptions& o = options.surface;
  list.add("iso", &o.iso_hu,
           {.help = "level of the surface when no mask is given; the organ lies above it; auto = "
                    "half-way between the histogram's two peaks",
            .unit = "HU",
            .min = -32768,
            .max = 32767})
      .add("method", &o.method, {.help = "the same triangles, fast, or as the paper makes them"},
           {{"flying-edges", IsosurfaceMethod::flying_edges},
            {"marching-cubes", IsosurfaceMethod::marching_cubes}})
      .add("label", &options.label,
           {.help = "the organ in the mask: its label's number or name; several, parted by commas, "
                    "become one organ",
            .min = 1,
            .max = 32767,
            .number_too = true})
      .add("each_label", &options.each_label,
           {.help = "a surface for every label of the mask, named for it, in the folder -o DIR"})
      .add("largest", &o.largest,
           {.help = "components kept, by area; 0 = all", .min = 0, .max = 1000000})
      .add("min_size", &o.min_size_mm,
           {.help = "components whose box is nowhere longer are dropped",
            .unit = "mm",
            .min = 0,
            .max = 10000})
      .add("refine", &o.refine,
           {.help = "place a CT's surface by all voxels across the edge, not by two of them: right "
                    "inside thick slices"})
      .add("smooth", &o.smooth_mm,
           {.help = "Gaussian on a mask before its surface is taken; 0 leaves voxel stairs",
            .unit = "mm",
            .min = 0,
            .max = 50})
      .add("taubin", &o.taubin_steps,
           {.help = "steps of Taubin smoothing on the surface; its volume is kept",
            .min = 0,
            .max = 1000})
      .add("cap", &o.cap, {.help = "close the surface where it leaves the volume"});
  bind(list, options.reading);
}

}  // namespace organbake
