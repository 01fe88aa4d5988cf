// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/capture/surface_color.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// One posed photograph and what it sees of a surface. Every factor of the weight is continuous over
// the surface, so that colours blended by it have no seams:
//   facing      cos² of the incidence, faded out below cos = 0.4 … 0.2
//   border      faded out over the frame's last 8 %: a close-up ends in the middle of a surface
//   outlines    0 within 1.5 texels of a depth edge in the photo (there its pixels mix two
//               surfaces, or the background), 1 from 5 texels on; texels of a depth map of at most
//               512, as coarse as or coarser than the photo
//   occlusion   1 where the point's depth is the depth map's, 0 where it lies behind
//   resolution  (focal length / depth)², 1 at the middle of the surface
// The depth map stands in for shadow rays: it costs a lookup instead of a traversal, and a ray's
// yes or no would leave a seam round every shadow.
class PhotoView {
 public:
  // Throws BadDataError when the image's size is not the camera's.
  PhotoView(Photo photo, const TracedSurface& surface);

  // The photo's colour of a point, linear. Weight 0 when the photo does not see it.
  struct Look {
    float weight = 0;
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
  };
  Look look_at_point(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;

 private:
  void trace_depth(const TracedSurface& surface);
  double seen(const Eigen::Vector2d& pixel, double depth) const;
  Eigen::Vector3f linear_color(const Eigen::Vector2d& pixel) const;

  Photo photo_;
  Eigen::Vector3d eye_;
  double middle_depth_;
  int map_width_ = 0, map_height_ = 0;
  double map_per_pixel_ = 1, map_focal_px_ = 1;
  struct Seen {
    float depth_mm;  // +inf = background
    float clear;     // 0…1: how far from an outline
  };
  std::vector<Seen> map_;
};

}  // namespace organbake
