// SPDX-License-Identifier: GPL-3.0-or-later
// Every material side by side, on a ball of 60 mm seen from 100 mm: its colours as a bake gives
// them to a surface, with the gloss of the light that they are baked in.
#include <algorithm>
#include <cmath>

#include "organbake/capture/surface_color.h"
#include "organbake/image/png.h"
#include "organbake/image/srgb.h"
#include "organbake/pipelines/export_options.h"
#include "organbake/pipelines/stage.h"

namespace organbake {
namespace {

constexpr double kRadius_mm = 60, kEye_mm = 100, kField = 0.5;  // width over range

struct BallPoints {
  std::vector<Eigen::Vector3d> points, normals, toward_eye;
};

// What each pixel of a square picture sees of the ball about the origin, which fills it to its
// corners.
BallPoints ball_points(int side_px) {
  const Eigen::Vector3d eye(0, 0, kRadius_mm + kEye_mm);
  BallPoints ball;
  for (int y = 0; y < side_px; ++y) {
    for (int x = 0; x < side_px; ++x) {
      const double across = (2 * (x + 0.5) / side_px - 1) * kField / 2;
      const double down = (2 * (y + 0.5) / side_px - 1) * kField / 2;
      const Eigen::Vector3d ray = Eigen::Vector3d(across, -down, -1).normalized();
      const double along = -eye.dot(ray);
      const double beside2 = eye.squaredNorm() - along * along;
      const double half_chord = std::sqrt(std::max(0.0, kRadius_mm * kRadius_mm - beside2));
      const Eigen::Vector3d point = eye + (along - half_chord) * ray;
      ball.points.push_back(point);
      ball.normals.push_back(point.normalized());
      ball.toward_eye.push_back(-ray);
    }
  }
  return ball;
}

void draw_swatch(Tissue tissue, const BallPoints& ball, int left, int top, int side_px,
                 Rgb8Image& sheet) {
  Material material;
  material.tissue = tissue;
  material.light_direction = {-0.4, 0.5, 0.8};
  const Lighting lighting = material.lighting();
  std::vector<Eigen::Vector3f> colors;
  make_material_color(material)->shade(ball.points, ball.normals,
                                       std::vector<RayHit>(ball.points.size()), colors);
  for (int y = 0; y < side_px; ++y) {
    for (int x = 0; x < side_px; ++x) {
      const std::size_t i = std::size_t(y) * side_px + x;
      const Eigen::Vector3d seen =
          colors[i].cast<double>() + lighting.glossy(ball.normals[i], ball.toward_eye[i]);
      std::uint8_t* pixel = sheet.at(left + x, top + y);
      for (int k = 0; k < 3; ++k) pixel[k] = srgb8_from_linear(static_cast<float>(seen[k]));
    }
  }
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<SwatchOptions>();
  const int count = static_cast<int>(Tissue::silicone) + 1;
  const int rows = (count + options.columns - 1) / options.columns;
  const BallPoints ball = ball_points(options.side_px);
  Rgb8Image sheet(options.columns * options.side_px, rows * options.side_px);
  for (int i = 0; i < count; ++i) {
    call.context.throw_if_cancelled();
    draw_swatch(static_cast<Tissue>(i), ball, i % options.columns * options.side_px,
                i / options.columns * options.side_px, options.side_px, sheet);
    call.context.progress(double(i + 1) / count);
  }
  write_png(call.output_folder / kSwatchFile, sheet);
  return {};
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
