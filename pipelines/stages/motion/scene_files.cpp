// SPDX-License-Identifier: GPL-3.0-or-later
// The scene that a clip tells, for other programs and to be looked at.
#include <algorithm>
#include <utility>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/files.h"
#include "organbake/formats/camera_files.h"
#include "organbake/image/png.h"
#include "stages/motion/motion_clip.h"

namespace organbake {
namespace {

// The frames that are views, in the order of SparsePoint's images.
CameraSet view_cameras(const FollowedClip& clip, const ClipMotion& motion,
                       std::vector<std::size_t>& image_of_view) {
  CameraSet set;
  image_of_view.assign(motion.view_frames.size(), 0);
  for (std::size_t view = 0; view < motion.view_frames.size(); ++view) {
    if (!motion.scene.is_posed(view)) continue;
    image_of_view[view] = set.cameras.size();
    const std::string& name = clip.names[motion.view_frames[view]];
    set.cameras.push_back({name, motion.scene.lens, *motion.scene.camera_from_world[view]});
    set.images.push_back(name + ".png");
  }
  return set;
}

std::vector<SparsePoint> sparse_points(const ClipMotion& motion, const ClipPictures& pictures,
                                       const std::vector<std::size_t>& image_of_view) {
  std::vector<SparsePoint> points;
  for (const Landmark& landmark : motion.scene.landmarks) {
    if (!landmark.place) continue;
    SparsePoint point;
    point.place_mm = *landmark.place;
    for (const Sighting& seen : landmark.seen) {
      if (!seen.agrees || !motion.scene.is_posed(seen.view)) continue;
      // As the first view shows it.
      if (point.seen.empty()) {
        const Rgb8Image& picture = pictures.color(motion.view_frames[seen.view]);
        std::copy_n(picture.at(int(seen.pixel.x()), int(seen.pixel.y())), 3, point.srgb.begin());
      }
      point.seen.push_back({static_cast<std::uint32_t>(image_of_view[seen.view]), seen.pixel});
    }
    if (point.seen.size() >= 2) points.push_back(std::move(point));
  }
  return points;
}

void draw_dot(Rgb8Image& picture, const Eigen::Vector2d& at, int radius,
              const std::array<std::uint8_t, 3>& color) {
  for (int dy = -radius; dy <= radius; ++dy)
    for (int dx = -radius; dx <= radius; ++dx) {
      const int x = static_cast<int>(at.x()) + dx, y = static_cast<int>(at.y()) + dy;
      if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) continue;
      std::copy(color.begin(), color.end(), picture.at(x, y));
    }
}

}  // namespace

void write_scene(const std::filesystem::path& folder, const FollowedClip& clip,
                 const ClipMotion& motion, const ClipPictures& pictures) {
  CameraSet all;
  for (std::size_t frame = 0; frame < motion.camera_from_world.size(); ++frame)
    if (motion.camera_from_world[frame])
      all.cameras.push_back(
          {clip.names[frame], motion.scene.lens, *motion.camera_from_world[frame]});
  write_file_atomically(folder / "cameras.json", cameras_to_json(all));
  std::vector<std::size_t> image_of_view;
  const CameraSet views = view_cameras(clip, motion, image_of_view);
  const std::vector<SparsePoint> points = sparse_points(motion, pictures, image_of_view);
  make_folder(folder / "colmap");
  write_file_atomically(folder / "colmap" / "cameras.txt", colmap_cameras_text(views));
  write_file_atomically(folder / "colmap" / "images.txt", colmap_images_text(views, points));
  write_file_atomically(folder / "colmap" / "points3D.txt", colmap_points_text(points));
  write_file_atomically(folder / "points.ply", point_cloud_ply(points));
  if (motion.breath)
    write_file_atomically(folder / "breath_field.json", breath_to_json(*motion.breath));
}

void write_overlay(const std::filesystem::path& folder, const ClipMotion& motion,
                   const ClipPictures& pictures, std::size_t frame) {
  Rgb8Image picture = pictures.color(frame);
  const RigidTransform& pose = *motion.camera_from_world[frame];
  std::vector<std::pair<double, Eigen::Vector2d>> seen;
  for (const Landmark& landmark : motion.scene.landmarks) {
    if (!landmark.place) continue;
    const Eigen::Vector3d point = pose * *landmark.place;
    if (point.z() > 0) seen.emplace_back(point.z(), project(motion.scene.lens, point));
  }
  std::sort(seen.begin(), seen.end(),
            [](const auto& a, const auto& b) { return a.first > b.first; });
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const double near = static_cast<double>(i) / static_cast<double>(seen.size());
    draw_dot(picture, seen[i].second, 1,
             {static_cast<std::uint8_t>(60 + 195 * near), static_cast<std::uint8_t>(200 * near),
              static_cast<std::uint8_t>(255 - 225 * near)});
  }
  // The way of the scope, seen from above: to the right is right, up is away.
  std::vector<Eigen::Vector3d> way;
  for (const auto& camera : motion.camera_from_world)
    if (camera) way.push_back(pose * camera->inverse().translation);
  double extent = 1e-9;
  for (const Eigen::Vector3d& place : way) extent = std::max(extent, place.norm());
  const double radius = 0.12 * picture.width;
  const Eigen::Vector2d middle(radius + 10, picture.height - radius - 10);
  for (const Eigen::Vector3d& place : way)
    draw_dot(picture, middle + Eigen::Vector2d(place.x(), -place.z()) * (radius / extent), 1,
             {255, 255, 255});
  write_png(folder / "motion.png", picture);
}

}  // namespace organbake
