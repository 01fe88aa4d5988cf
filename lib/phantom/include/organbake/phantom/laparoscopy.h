// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What a laparoscope sees of tissue whose shape, light and motion are known: a bed of bumps, frame
// by frame, and clips of a moving scope over tissue that breathes.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

struct LaparoscopyOptions {
  std::uint64_t seed = 1;
  int width = 640, height = 480;
  int frames = 8;
  double field_of_view_rad = 1.2217304763960306;
  double noise = 0.005;      // share of full scale
  double texture = 0.1;      // of the albedo
  double highlights = 1;     // strength of the mirror reflection
  bool two_tissues = false;  // the bump next to the axis has a colour of its own, and is brighter
  bool instrument = true;
  bool round_view = true;        // black outside the endoscope's stop
  double light_offset_x_mm = 0;  // of the light from the lens
  double beam_exponent = 0;      // the light is cosⁿ of the angle to the lens's axis; 0 = even
  double tilt_rad = 0;           // of the view onto the bed, to the side; 0 = from above
  // Of a second eye to the right of the first, its axis parallel; 0 = there is one eye.
  double baseline_mm = 0;
};

// What a frame shows, exactly.
struct LaparoscopyFrame {
  Rgb8Image image;
  PosedCamera camera;
  Plane depth_mm;  // planar z of the tissue; +inf outside the view and under the instrument
  std::vector<Eigen::Vector3f> normals;  // camera axes, towards the camera
  std::vector<Eigen::Vector3f> albedo;   // linear, of the tissue; zero elsewhere
  Mask highlights;                       // mirror reflection as bright as half the diffuse light
  Mask instrument;
};

// A camera with its light moves over a bumpy bed of tissue of known height field, z = h(x, y) in
// world mm. Brightness ρ cosθ / r² with a mild vignette, texture of the albedo, mirror reflections
// of a moist surface, sRGB, noise; a steel instrument comes in from the right.
class LaparoscopyPhantom {
 public:
  explicit LaparoscopyPhantom(const LaparoscopyOptions& options);

  PosedCamera camera(int frame) const;
  LaparoscopyFrame frame(int index) const;
  // The second eye of a stereo endoscope, at the same time and under the same light.
  PosedCamera right_camera(int frame) const;
  LaparoscopyFrame right_frame(int index) const;
  // The same scene from any camera. `instrument_shift` is where the second eye sees the instrument,
  // in widths of the frame to the left; `noise_stream` tells the frames' noise apart.
  LaparoscopyFrame frame_seen_by(const PosedCamera& view, const Eigen::Vector3d& light_world_mm,
                                 std::uint64_t noise_stream, double instrument_shift = 0) const;
  // The height field and its slopes at world x, y (mm).
  double height_mm(double x_mm, double y_mm) const;

 private:
  struct Bump {
    double x, y, radius, height;
  };
  struct Wave {
    double angle_rad, length_mm, phase_rad;
  };
  Eigen::Vector3d light_world_mm(int frame) const;
  double steepest_slope(double reach_mm) const;  // a bound for what is within reach of the axis
  Eigen::Vector3d normal_world(double x_mm, double y_mm) const;
  double albedo_factor(const Eigen::Vector3d& point) const;
  Eigen::Vector3d tissue_color(const Eigen::Vector3d& point) const;

  LaparoscopyOptions options_;
  std::vector<Bump> bumps_;
  std::size_t middle_bump_ = 0;  // the one next to the axis
  std::vector<Wave> waves_;      // of the albedo
};

// How a scope moves over the tissue of MovingClip. `still`, `turn` (about its own lens) and `zoom`
// have no parallax; `orbit` and `tour` come back to where they began, and a tour goes sideways,
// nearer, and turns on its way.
enum class ScopePath { still, slide, approach, turn, orbit, tour, zoom };

struct ScopePose {
  RigidTransform camera_from_world;  // mm
  double zoom = 1;                   // focal length by the first frame's
};

// Where the scope is after a share 0…1 of the clip. The tissue lies some 30 to 90 mm from it.
ScopePose scope_pose(ScopePath path, double share);

struct MovingClipOptions {
  // Its seed, size, frames, noise, highlights, instrument, light; texture is the standard deviation
  // of the albedo. A second eye, a tilt and two tissues belong to LaparoscopyPhantom.
  LaparoscopyOptions view;
  ScopePath path = ScopePath::tour;
  double breathing_mm = 0;        // how far a breath pushes the liver, 0…20
  double breathing_period_s = 4;  // 1…20
  double blurred = 0;             // share 0…1 of the frames that a jerk of the scope blurs

  void check() const;  // throws UsageError for what a path cannot have
};

// A clip of a scope that moves over a liver, a gallbladder and fat which reach farther than one
// frame shows, lit by a lamp at the lens whose mirror reflections move with it. What the tissue is
// like suits structure from motion as real tissue does: TissueRelief, TissueSkin.
//   Breathing pushes it by excursion · sin⁴(π t / period) (Lujan et al. 1999): long rests, short
// breaths. It is not the same everywhere, so no motion of the scope explains it. A jerk turns the
// scope by 6 to 18 px (of a width of 1280) while a frame is taken. A steel shaft of 5 mm crosses in
// the middle of the clip. The exposure follows the tissue's distance, as a scope's does.
class MovingClip {
 public:
  static constexpr double kFramesPerSecond = 25;

  explicit MovingClip(const MovingClipOptions& options);
  ~MovingClip();
  MovingClip(MovingClip&&) noexcept;

  // Of one frame; the camera is named after it, frame_000012. World: that of the tissue at rest.
  PosedCamera camera(int frame) const;
  double time_s(int frame) const { return frame / kFramesPerSecond; }
  double breath_mm(int frame) const;
  double blur_px(int frame) const;  // length of the trail that the middle of the picture leaves
  LaparoscopyFrame frame(int index, const RunContext& context = {}) const;

  // The tissue at rest, whole, with its albedo as colours.
  TriangleMesh surface() const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace organbake
