// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/image/channel_image.h"
#include "organbake/phantom/phantom.h"

namespace organbake {

// The only light of a photograph, in camera axes. It casts no shadow beyond the side that it
// doesn't face, as most renderers draw it.
struct PhotoLight {
  Eigen::Vector3d lamp_camera_mm = Eigen::Vector3d::Zero();  // where the lamp sits
  double falloff = 2;        // power of the distance by which it weakens; 0: not at all
  double beam_exponent = 0;  // of the cosine to the optical axis; 0: the same all round
  // Set: far away instead, in this direction (surface → light), with some ambient light.
  std::optional<Eigen::Vector3d> toward;
  double ambient = 0.2;  // share of the light, for `toward`
};

// The phantom as an endoscope sees it: the only lamp sits at the camera's centre,
//   L = albedo · cos θ / r² + highlights,
// r the distance to the camera, θ the angle between the normal and the way there; or where `light`
// says.
struct LampScene {
  bool textured = false;    // the organ's albedo; else white
  bool highlights = false;  // Blinn (1977), exponent 180: the wet film's glints
  PhotoLight light = {};
};

// Linear radiance, 1 for white skin that faces the lamp at the organ's centre's distance; several
// rays to a pixel, each refined to the formula's surface.
struct LampPicture {
  int width = 0, height = 0;
  std::vector<Eigen::Vector3f> radiance;
};
LampPicture picture_by_lamp(const OrganPhantom& phantom, const TriangleMesh& near_surface,
                            const PosedCamera& camera, const LampScene& scene,
                            const RunContext& context = {});

// The same of a mesh with smooth normals: for organs without a formula, and for questions in which
// the error that a mesh makes of the formula has no place. `albedo` of a surface point (world mm)
// where the scene is textured.
using AlbedoAt = std::function<Eigen::Vector3d(const Eigen::Vector3d& world_mm)>;
LampPicture picture_of_mesh_by_lamp(const TriangleMesh& mesh, const PosedCamera& camera,
                                    const LampScene& scene = {}, const AlbedoAt& albedo = {},
                                    const RunContext& context = {});

// How a sensor turns radiance into 8-bit sRGB. All in shares of its linear range.
struct Sensor {
  double gain = 0.6;
  double offset = 0.1;  // far enough from black that the noise is not clipped there
  double noise = 0.02;  // standard deviation, the same in all three channels of a pixel
  double vignette = 0;  // light lost in the picture's corners, falling with the radius squared
  std::uint64_t seed = 1;
};
Rgb8Image develop(const LampPicture& picture, const Sensor& sensor);

}  // namespace organbake
