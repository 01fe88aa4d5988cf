// SPDX-License-Identifier: GPL-3.0-or-later
// A photograph of the phantom under a lamp at the lens to its pose: how fine and how often against
// error and time, from a start, without one, of an open patch, and along a clip.
#include <algorithm>

#include "bench.h"
#include "measuring/programs.h"
#include "measuring/scenes.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/phantom/phantom.h"
#include "organbake/registration/register_photo.h"

namespace organbake {
namespace {

// The phantom under a lamp at the camera, photographed from a pose that is known.
class LampPhoto {
 public:
  explicit LampPhoto(int size_px)
      : phantom_({.photo_count = 8, .photo_size = size_px}),
        surface_(white(phantom_.surface(6))),
        camera_(phantom_.photo_cameras().front()),
        picture_(picture_by_lamp(phantom_, surface_.mesh(), camera_, {})) {}

  const RegisteredSurface& surface() const { return surface_; }
  const PosedCamera& camera() const { return camera_; }

  // The start is 10 mm and 10° off.
  PhotoToRegister photo(std::uint64_t seed) const {
    PhotoToRegister photo;
    photo.image = develop(picture_, {.seed = seed});
    photo.intrinsics = camera_.intrinsics;
    photo.start = start_from(surface_, camera_.camera_from_world, 10, 10, seed);
    return photo;
  }
  double mtre_mm(const RegisteredPhoto& found) const {
    return surface_.mean_distance_mm(camera_.camera_from_world, found.camera.camera_from_world);
  }

  // The largest piece of the faces near the point in the middle of the picture.
  RegisteredSurface patch() const {
    const TriangleMesh& mesh = surface_.mesh();
    Ray ray{camera_.center_world_mm(), camera_.view_direction_world()};
    RayHit hit;
    surface_.scene().first_hits({&ray, 1}, {&hit, 1});
    const Eigen::Vector3d middle = ray.origin + hit.t * ray.direction;
    TriangleMesh near{mesh.vertices, {}, {}};
    std::copy_if(mesh.faces.begin(), mesh.faces.end(), std::back_inserter(near.faces),
                 [&](const Face& face) {
                   return (mesh.vertices[face[0]] - middle).norm() < 0.6 * surface_.radius_mm();
                 });
    return RegisteredSurface(largest_components(near, 1));
  }

 private:
  static TriangleMesh white(TriangleMesh mesh) {
    mesh.colors.clear();
    return mesh;
  }

  OrganPhantom phantom_;
  RegisteredSurface surface_;
  PosedCamera camera_;
  LampPicture picture_;
};

// Run time against error: how fine the pyramid's last level is.
void sweep_pyramid(Bench& bench, const LampPhoto& scene) {
  const std::string task = "phantom photograph, 81,920 faces, start 10 mm / 10°";
  const PhotoToRegister photo = scene.photo(1);
  for (const int side : {128, 256, 512, 1024}) {
    if (side > photo.intrinsics.width) continue;
    const RegistrationOptions options{.finest_side_px = side};
    RegisteredPhoto found;
    const Timing timing = bench.time(
        [&] { found = register_photo(scene.surface(), photo, options, bench.context()); });
    bench.point(task, "organbake register", timing, {{"mTRE", "mm", scene.mtre_mm(found)}},
                {{"finest side", "px", double(side)}});
  }
}

void promise_seconds(Bench& bench, const std::string& what, double target_s,
                     const RegisteredSurface& surface, const PhotoToRegister& photo) {
  bench.now(what);
  const Timing timing = bench.time([&] { register_photo(surface, photo, {}, bench.context()); });
  bench.at_most(what, "s", timing.wall_ms.median / 1000, target_s);
}

void promise_time(Bench& bench, const LampPhoto& scene) {
  PhotoToRegister photo = scene.photo(2);
  const std::string size = std::to_string(photo.intrinsics.width) + "² photo, 81,920 faces";
  promise_seconds(bench, size + ", from a start: time", 1, scene.surface(), photo);
  photo.start.reset();
  promise_seconds(bench, size + ", no start: time", 10, scene.surface(), photo);
}

// A clip of the phantom in which it moves by about a millimetre and a degree a frame.
void promise_tracking(Bench& bench, const LampPhoto& scene) {
  const int frames = bench.count(6, 12);
  bench.now("a clip of " + std::to_string(frames) + " frames");
  std::vector<PosedCamera> cameras;
  std::vector<Rgb8Image> clip;
  for (int i = 0; i < frames; ++i) {
    PosedCamera camera = scene.camera();
    camera.intrinsics = {640, 480, 700, 702, 322, 238};
    camera.camera_from_world =
        start_from(scene.surface(), camera.camera_from_world, 0.5 * i, 0.5 * i, 1);
    clip.push_back(
        develop(picture_of_mesh_by_lamp(scene.surface().mesh(), camera), {.noise = 0.01}));
    cameras.push_back(camera);
  }
  std::vector<double> errors_mm;
  const Timing timing = bench.time([&] {
    PoseTracker tracker(scene.surface(), cameras.front().intrinsics, {});
    tracker.start_from(cameras.front().camera_from_world);
    errors_mm.clear();
    for (int i = 0; i < frames; ++i)
      errors_mm.push_back(scene.surface().mean_distance_mm(
          cameras[i].camera_from_world,
          tracker.next(clip[i], {}, bench.context()).camera.camera_from_world));
  });
  bench.point("a clip of 640×480 that is tracked", "organbake register",
              of_one(timing, clip.size()), {{"mTRE, median", "mm", spread_of(errors_mm).median}},
              {{"frames", "", double(frames)}});
  bench.at_least("a clip that is tracked: frames a second", "1/s",
                 1000 * frames / timing.wall_ms.median, 10);
}

void run_registration(Bench& bench) {
  const LampPhoto scene(bench.quick() ? 256 : 1024);
  sweep_pyramid(bench, scene);
  if (!bench.quick()) promise_time(bench, scene);  // it is promised of the whole photograph
  promise_seconds(bench, "an open patch from 10 mm / 10°: time", 2, scene.patch(), scene.photo(3));
  promise_tracking(bench, scene);
}

const RegisteredPart kRegistration("registration", run_registration,
                                   "photo to pose: pyramid and iterations against mTRE");

}  // namespace
}  // namespace organbake
