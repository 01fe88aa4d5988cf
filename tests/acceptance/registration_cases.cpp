// SPDX-License-Identifier: GPL-3.0-or-later
#include "registration_cases.h"

#include <Eigen/Cholesky>

#include "measuring/scenes.h"
#include "organbake/core/random.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/geometry/mesh_checks.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

OrganPhantomOptions phantom_options(int size, std::uint64_t seed = 1) {
  OrganPhantomOptions options;
  options.seed = seed;
  options.photo_count = 8;
  options.photo_size = size;
  return options;
}

TriangleMesh organ_mesh(const OrganPhantom& phantom) {
  TriangleMesh mesh = phantom.surface(6);
  mesh.colors.clear();
  return mesh;
}

}  // namespace

LampScenes::LampScenes(int photo_size, int cameras, PhotographedSurface photographed)
    : phantom_(phantom_options(photo_size)),
      photographed_(photographed),
      surface_(std::make_unique<RegisteredSurface>(organ_mesh(phantom_))),
      cameras_(phantom_.photo_cameras()) {
  cameras_.resize(std::min(cameras_.size(), static_cast<std::size_t>(cameras)));
}

const RegisteredSurface& LampScenes::other_organ(int seed) const {
  auto& other = others_[seed];
  if (!other) {
    const OrganPhantom phantom(phantom_options(64, static_cast<std::uint64_t>(seed)));
    other = std::make_unique<RegisteredSurface>(organ_mesh(phantom));
  }
  return *other;
}

TriangleMesh LampScenes::mirrored() const {
  TriangleMesh mesh = surface_->mesh();
  const double middle = surface_->center().x();
  for (Vector3d& v : mesh.vertices) v.x() = 2 * middle - v.x();
  for (Face& face : mesh.faces) std::swap(face[1], face[2]);
  return mesh;
}

LampPicture LampScenes::picture(const PosedCamera& camera, const LampScene& scene) const {
  if (photographed_ == PhotographedSurface::mesh)
    return picture_of_mesh_by_lamp(surface_->mesh(), camera);
  return picture_by_lamp(phantom_, surface_->mesh(), camera, scene);
}

PhotoToRegister LampScenes::photo(std::size_t camera, std::uint64_t seed, bool hard) const {
  LampPicture& known = pictures_[{camera, hard}];
  if (known.radiance.empty()) known = picture(cameras_[camera], {hard, hard});
  Sensor sensor;
  sensor.seed = seed;
  if (hard) {
    sensor.gain = 0.9;
    sensor.vignette = 0.4;
  }
  PhotoToRegister photo;
  photo.image = develop(known, sensor);
  photo.intrinsics = cameras_[camera].intrinsics;
  return photo;
}

void LampScenes::put_instrument(Rgb8Image& photo, std::uint64_t seed) const {
  RandomStream random(seed, 78);
  const double angle = random.uniform(0, 2 * std::numbers::pi);
  const double x0 = photo.width / 2.0, y0 = photo.height / 2.0;
  const double half_width = 0.06 * photo.width, tip = -0.25 * photo.width;
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x) {
      const double along = (x - x0) * std::cos(angle) + (y - y0) * std::sin(angle);
      const double across = ((y - y0) * std::cos(angle) - (x - x0) * std::sin(angle)) / half_width;
      if (along < tip || std::abs(across) > 1) continue;
      const double round = std::sqrt(1 - across * across) * (0.6 + 0.4 * across);
      std::fill_n(photo.at(x, y), 3, static_cast<std::uint8_t>(40 + 170 * round));
    }
}

RigidTransform LampScenes::start(std::size_t camera, double shift_mm, double turn_deg,
                                 std::uint64_t seed) const {
  RandomStream random(seed, 79);
  const double shift = random.uniform(), turn = random.uniform();
  return start_at_least(camera, shift * shift_mm, turn * turn_deg, seed);
}

RigidTransform LampScenes::start_at_least(std::size_t camera, double shift_mm, double turn_deg,
                                          std::uint64_t seed) const {
  return start_from(*surface_, cameras_[camera].camera_from_world, shift_mm, turn_deg, seed);
}

double LampScenes::mtre_mm(std::size_t camera, const RigidTransform& camera_from_world) const {
  return surface_->mean_distance_mm(cameras_[camera].camera_from_world, camera_from_world);
}

double LampScenes::reprojection_px(std::size_t camera,
                                   const RigidTransform& camera_from_world) const {
  const PosedCamera& truth = cameras_[camera];
  double sum = 0;
  for (const SurfaceSample& sample : surface_->samples())
    sum += (project(truth.intrinsics, truth.camera_from_world * sample.point) -
            project(truth.intrinsics, camera_from_world * sample.point))
               .norm();
  return sum / static_cast<double>(surface_->samples().size());
}

double LampScenes::floor_mm(std::size_t camera) const {
  if (floors_mm_.contains(camera)) return floors_mm_.at(camera);
  const PosedCamera& truth = cameras_[camera];
  const ObjectPose pose = object_pose(truth.camera_from_world, surface_->center());
  const LampPicture middle = picture(truth, {});
  const auto pixels = static_cast<Eigen::Index>(middle.radiance.size());
  Eigen::MatrixXd j(pixels, 6);
  // About half a pixel each way.
  const double turn = 0.5 * pose.center_camera_mm.z() / truth.intrinsics.fx / surface_->radius_mm();
  const double shift = 0.5 * pose.center_camera_mm.z() / truth.intrinsics.fx;
  for (int k = 0; k < 6; ++k) {
    const double step = k < 3 ? turn : k < 5 ? shift : 4 * shift;
    LampPicture sides[2];
    for (int side = 0; side < 2; ++side) {
      PosedCamera moved_camera = truth;
      const Motion motion = (side == 0 ? step : -step) * Motion::Unit(k);
      moved_camera.camera_from_world = rigid_transform(moved(pose, motion), surface_->center());
      sides[side] = picture(moved_camera, {});
    }
    for (Eigen::Index i = 0; i < pixels; ++i)
      j(i, k) = (sides[0].radiance[i][0] - sides[1].radiance[i][0]) / (2 * step);
  }
  // Gain and offset are nuisances: their columns are projected out.
  Eigen::MatrixXd nuisance(pixels, 2);
  for (Eigen::Index i = 0; i < pixels; ++i) nuisance.row(i) << middle.radiance[i][0], 1;
  const Eigen::Matrix2d normal = nuisance.transpose() * nuisance;
  j -= nuisance * normal.ldlt().solve(nuisance.transpose() * j);
  const Sensor sensor;
  const Eigen::Matrix<double, 6, 6> covariance =
      std::pow(sensor.noise / sensor.gain, 2) *
      (j.transpose() * j).ldlt().solve(Eigen::Matrix<double, 6, 6>::Identity());
  const Eigen::Matrix3d rotation = truth.camera_from_world.rotation;
  double sum = 0;
  for (const SurfaceSample& sample : surface_->samples()) {
    const Vector3d d = rotation * (sample.point - surface_->center());
    Eigen::Matrix<double, 3, 6> motion;
    motion << 0, d.z(), -d.y(), 1, 0, 0, -d.z(), 0, d.x(), 0, 1, 0, d.y(), -d.x(), 0, 0, 0, 1;
    sum += (motion * covariance * motion.transpose()).trace();
  }
  return floors_mm_[camera] = std::sqrt(sum / static_cast<double>(surface_->samples().size()));
}

namespace {

namespace fs = std::filesystem;

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

// A camera from anywhere round the organ, whose radius then is that share of the picture's height
// within the bounds; it looks up to `aside` of the radius past the organ's middle.
PosedCamera camera_round(const RegisteredSurface& surface, double least, double most, double aside,
                         RandomStream& random) {
  PosedCamera camera;
  camera.intrinsics = random_lens(random);
  const double radius_px = kHeight * random.uniform(least, most);
  const double distance = camera.intrinsics.fx * surface.radius_mm() / radius_px;
  const Vector3d past = aside * surface.radius_mm() * random_direction(random);
  camera.camera_from_world = look_at(surface.center() + distance * random_direction(random),
                                     surface.center() + past, random_direction(random));
  return camera;
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
  const PosedCamera camera = camera_round(surface, 0.3, 0.44, 0.12, random);
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
  // So near that the organ is as large as the picture or half as large again.
  const PosedCamera camera = camera_round(surface, 0.7, 1.1, 0.3, random);
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
