// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration_cases.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "measuring/known_poses.h"
#include "organbake/core/random.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr int kWidth = 640, kHeight = 512;
// Streams of one case's seed.
enum : std::uint64_t { kCameraStream = 801, kLightStream = 802, kSensorStream = 803 };

TriangleMesh white(TriangleMesh mesh) {
  mesh.colors.clear();
  return mesh;
}

Intrinsics random_lens(RandomStream& random) {
  Intrinsics k;
  k.width = kWidth;
  k.height = kHeight;
  k.fx = k.fy = kWidth * random.uniform(0.8, 1.5);
  k.cx = kWidth / 2.0 + random.uniform(-10, 10);
  k.cy = kHeight / 2.0 + random.uniform(-10, 10);
  return k;
}

PhotoLight random_light(StudioLight light, RandomStream& random) {
  PhotoLight drawn;
  switch (light) {
    case StudioLight::at_lens:
      break;
    case StudioLight::beside_lens: {
      const double angle = random.uniform(0, 2 * std::numbers::pi);
      drawn.lamp_camera_mm = random.uniform(3, 9) * Vector3d(std::cos(angle), std::sin(angle), 0);
      drawn.beam_exponent = random.uniform(1, 6);
      break;
    }
    case StudioLight::headlight:
      drawn.falloff = 0;
      break;
    case StudioLight::far_away:
      drawn.toward = (random.uniform(0.3, 1) * random_direction(random) - Vector3d::UnitZ());
      drawn.ambient = random.uniform(0.1, 0.4);
      break;
  }
  return drawn;
}

Sensor random_sensor(std::uint64_t seed) {
  RandomStream random(seed, kSensorStream);
  Sensor sensor;
  sensor.gain = random.uniform(0.35, 0.6);
  sensor.offset = random.uniform(0.03, 0.12);
  sensor.noise = random.uniform(0.005, 0.02);
  sensor.seed = seed;
  return sensor;
}

// Gain such that a highlight here and there is blown, as exposure control leaves it.
double exposed_gain(const LampPicture& picture) {
  constexpr double kShare = 0.98, kLevel = 0.75;
  std::vector<float> luminance;
  for (const Eigen::Vector3f& color : picture.radiance) luminance.push_back(color.maxCoeff());
  const auto at = luminance.begin() + static_cast<std::ptrdiff_t>(kShare * luminance.size());
  std::nth_element(luminance.begin(), at, luminance.end());
  return kLevel / std::max(1e-6f, *at);
}

// The point of the surface in the middle of the picture.
Vector3d seen_in_the_middle(const RegisteredSurface& surface, const PosedCamera& camera) {
  Ray ray;
  ray.origin = camera.center_world_mm();
  ray.direction = camera.view_direction_world();
  RayHit hit;
  surface.scene().first_hits({&ray, 1}, {&hit, 1});
  if (hit.face == kNoHit) return surface.center();
  return ray.origin + hit.t * ray.direction;
}

// Faces that lie within `radius_mm` of a point; the largest piece of them.
TriangleMesh cut_out(const TriangleMesh& mesh, const Vector3d& center, double radius_mm) {
  TriangleMesh patch;
  patch.vertices = mesh.vertices;
  for (const Face& face : mesh.faces) {
    const bool near = std::all_of(face.begin(), face.end(), [&](std::uint32_t v) {
      return (mesh.vertices[v] - center).norm() < radius_mm;
    });
    if (near) patch.faces.push_back(face);
  }
  return largest_components(patch, 1);
}

}  // namespace

const char* name_of(StudioLight light) {
  switch (light) {
    case StudioLight::at_lens:
      return "a lamp at the lens";
    case StudioLight::beside_lens:
      return "a lamp beside the lens";
    case StudioLight::headlight:
      return "a headlight without fall-off";
    default:
      return "a light far away";
  }
}

RegistrationCases::RegistrationCases(const fs::path& data) : texture_(OrganPhantomOptions{}) {
  add_organ("phantom", white(texture_.surface(7)), white(texture_.surface(6)));
  for (const auto& [name, path] :
       {std::pair{"liver H07", "registration/rendered_liver/liver-H07.ply"},
        std::pair{"liver with vessels", "mesh/liver/liver.vtk"}}) {
    if (data.empty() || !fs::exists(data / path)) continue;
    const TriangleMesh mesh = white(largest_components(read_mesh(data / path), 1));
    add_organ(name, mesh, mesh);
  }
}

void RegistrationCases::add_organ(const std::string& name, TriangleMesh drawn,
                                  TriangleMesh registered) {
  organs_.push_back(
      {name, std::move(drawn), std::make_unique<RegisteredSurface>(std::move(registered))});
}

RegistrationCase RegistrationCases::whole_organ(std::size_t organ, StudioLight light,
                                                std::uint64_t seed) const {
  const PhotographedOrgan& shown = organs_[organ];
  const RegisteredSurface& surface = *shown.whole;
  RandomStream random(seed, kCameraStream);
  PosedCamera camera;
  camera.intrinsics = random_lens(random);
  const double radius_px = kHeight * random.uniform(0.3, 0.44);
  const double distance = camera.intrinsics.fx * surface.radius_mm() / radius_px;
  const Vector3d aside = 0.12 * surface.radius_mm() * random_direction(random);
  camera.camera_from_world = look_at(surface.center() + distance * random_direction(random),
                                     surface.center() + aside, random_direction(random));
  RandomStream lit(seed, kLightStream);
  const LampScene scene{false, false, random_light(light, lit)};
  RegistrationCase made;
  made.photo.image =
      develop(picture_of_mesh_by_lamp(shown.drawn, camera, scene), random_sensor(seed));
  made.photo.intrinsics = camera.intrinsics;
  made.camera_from_world = camera.camera_from_world;
  made.photo.start = start_from(surface, camera.camera_from_world, 10 * random.uniform(),
                                10 * random.uniform(), seed);
  return made;
}

RegistrationCase RegistrationCases::open_patch(std::size_t organ, std::uint64_t seed) const {
  const PhotographedOrgan& shown = organs_[organ];
  const RegisteredSurface& surface = *shown.whole;
  RandomStream random(seed, kCameraStream);
  PosedCamera camera;
  camera.intrinsics = random_lens(random);
  // So near that the organ is as large as the picture or half as large again.
  const double radius_px = kHeight * random.uniform(0.7, 1.1);
  const double distance = camera.intrinsics.fx * surface.radius_mm() / radius_px;
  const Vector3d aside = 0.3 * surface.radius_mm() * random_direction(random);
  camera.camera_from_world = look_at(surface.center() + distance * random_direction(random),
                                     surface.center() + aside, random_direction(random));
  RandomStream lit(seed, kLightStream);
  LampScene scene{true, true, random_light(StudioLight::beside_lens, lit)};
  const Vector3d to_texture = texture_.surface(2).vertices.front() - shown.drawn.vertices.front();
  const auto albedo = [&](const Vector3d& x) -> Vector3d {
    return texture_.albedo(x + to_texture).cast<double>();
  };
  const LampPicture picture = picture_of_mesh_by_lamp(shown.drawn, camera, scene, albedo);
  Sensor sensor = random_sensor(seed);
  sensor.gain = exposed_gain(picture);
  sensor.offset = 0.005;
  sensor.noise = 0.005;
  RegistrationCase made;
  made.photo.image = develop(picture, sensor);
  made.photo.intrinsics = camera.intrinsics;
  made.camera_from_world = camera.camera_from_world;
  const double patch_radius = surface.radius_mm() * random.uniform(0.45, 0.7);
  made.patch = std::make_unique<RegisteredSurface>(
      cut_out(surface.mesh(), seen_in_the_middle(surface, camera), patch_radius));
  made.photo.start = start_from(*made.patch, camera.camera_from_world, 10, 8, seed);
  return made;
}

}  // namespace organbake
