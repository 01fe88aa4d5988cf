// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/camera.h"
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

  void check() const;  // throws UsageError
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

}  // namespace organbake
