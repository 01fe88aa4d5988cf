// SPDX-License-Identifier: Apache-2.0
#include "truth/pixel_normals.h"

#include <Eigen/Geometry>
#include <cmath>

#include "core/parallel.h"

namespace organbake {
namespace {

using Eigen::Vector3f;

// Along one axis of the picture: the difference across both neighbours where the skin goes on
// evenly, else to the one that lies less far off in depth.
class Tangents {
 public:
  explicit Tangents(const PixelTruth& truth) : truth_(truth) {}

  Vector3f along(std::size_t at, int place, int size, std::size_t step) const {
    const bool before = place > 0 && same(at, at - step),
               after = place + 1 < size && same(at, at + step);
    const Vector3f& here = truth_.point[at];
    const Vector3f back = before ? Vector3f(here - truth_.point[at - step]) : Vector3f::Zero();
    const Vector3f on = after ? Vector3f(truth_.point[at + step] - here) : Vector3f::Zero();
    if (!before) return on;
    if (!after) return back;
    // A step in depth that is many times the other is where skin hides skin.
    constexpr float kBreak = 4;
    const float fall = std::abs(back.z()), rise = std::abs(on.z());
    const float pixel = back.head<2>().norm() + on.head<2>().norm();
    if (fall > kBreak * rise + pixel) return on;
    if (rise > kBreak * fall + pixel) return back;
    return back + on;
  }

 private:
  bool same(std::size_t a, std::size_t b) const { return truth_.label[a] == truth_.label[b]; }

  const PixelTruth& truth_;
};

}  // namespace

void put_skin_normals(PixelTruth& truth) {
  const Tangents tangents(truth);
  const std::size_t width = truth.width;
  parallel_for(0, truth.height, [&](int y) {
    for (int x = 0; x < truth.width; ++x) {
      const std::size_t at = y * width + x;
      if (truth.solid_at(at) != 0) continue;
      truth.normal[at].setZero();
      if (truth.label[at] == 0) continue;
      const Vector3f right = tangents.along(at, x, truth.width, 1),
                     down = tangents.along(at, y, truth.height, width);
      Vector3f normal = down.cross(right);  // rows run down: towards the eye
      const float length = normal.norm();
      const Vector3f to_eye = -truth.point[at].normalized();
      if (!(length > 0)) {
        truth.normal[at] = to_eye;
        continue;
      }
      normal /= length;
      truth.normal[at] = normal.dot(to_eye) < 0 ? Vector3f(-normal) : normal;
    }
  });
}

}  // namespace organbake
