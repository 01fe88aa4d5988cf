// SPDX-License-Identifier: GPL-3.0-or-later

#include <algorithm>
#include <filesystem>
#include <optional>
#include <sstream>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/camera_files.h"
#include "organbake/formats/lens_files.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/formats/photo.h"
#include "organbake/image/png.h"
#include "organbake/pipelines/stage.h"
#include "organbake/registration/register_photo.h"
#include "stages/register/options.h"
#include "stages/register/registering.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

struct NamedPhoto {
  std::string name;
  fs::path path;
  PhotoToRegister photo;
};

std::vector<PointPair> read_pairs(const fs::path& path) {
  std::istringstream text(read_text_file(path));
  std::vector<PointPair> pairs;
  for (std::string line; std::getline(text, line);) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line.front() == '#') continue;
    std::istringstream words(line);
    PointPair pair;
    words >> pair.point_world_mm.x() >> pair.point_world_mm.y() >> pair.point_world_mm.z() >>
        pair.pixel.x() >> pair.pixel.y();
    if (!words) throw BadDataError(path, "'" + line + "' is not five numbers x y z u v");
    pairs.push_back(pair);
  }
  return pairs;
}

// The start for an image: the camera of its name, else the only one there is.
RigidTransform start_for(const CameraSet& set, const std::string& image, const fs::path& path) {
  if (const auto named = camera_with_image(set, image)) {
    return set.cameras[*named].camera_from_world;
  }
  if (set.cameras.size() == 1) return set.cameras.front().camera_from_world;
  throw BadDataError(path, "has no camera with the image '" + image + "'");
}

std::vector<NamedPhoto> photos_of_document(const fs::path& document) {
  const CameraSet set = read_cameras(document);
  if (set.images.empty()) throw BadDataError(document, "names no images: nothing to register");
  std::vector<NamedPhoto> photos;
  for (std::size_t i = 0; i < set.images.size(); ++i) {
    NamedPhoto named{set.images[i], document.parent_path() / set.images[i], {}};
    named.photo.image = read_photo(named.path);
    named.photo.intrinsics = set.cameras[i].intrinsics;
    check_lens_of_picture(named.photo.intrinsics, named.photo.image.width, named.photo.image.height,
                          document, named.name);
    photos.push_back(std::move(named));
  }
  return photos;
}

std::vector<NamedPhoto> read_photos(const StageCall& call) {
  if (const auto* document = call.input("unposed")) return photos_of_document(*document);
  std::vector<NamedPhoto> photos;
  for (const auto& [name, path] : call.inputs_of("photo")) {
    NamedPhoto named{name, path, {}};
    named.photo.image = read_photo(path);
    named.photo.intrinsics =
        lens_of_photo(*call.input("intrinsics"), name, named.photo.image, call.context);
    photos.push_back(std::move(named));
  }
  return photos;
}

// Mask, start, point pairs and the depth's folder hold for all photographs of the call.
void complete(const StageCall& call, std::vector<NamedPhoto>& photos) {
  const auto* mask = call.input("photo_mask");
  const auto* init = call.input("init");
  const auto* pairs = call.input("pairs");
  const auto* depth = call.input("scope_depth");
  if (pairs && photos.size() > 1) throw UsageError("--pairs belongs to one photo");
  const CameraSet starts = init ? read_camera_file(*init, call.context) : CameraSet{};
  const Rgb8Image photo_mask = mask ? read_photo(*mask) : Rgb8Image{};  // empty: all counts
  for (NamedPhoto& named : photos) {
    named.photo.mask = photo_mask;
    if (init) named.photo.start = start_for(starts, named.name, *init);
    if (pairs) named.photo.pairs = read_pairs(*pairs);
    if (depth)
      named.photo.depth = read_seen_depth(*depth, named.name, named.photo.intrinsics, call.context);
  }
}

RegisteredPhoto register_named(const RegisteredSurface& surface, const NamedPhoto& named,
                               const PhotoToRegister& straight, const RegistrationOptions& options,
                               const RunContext& context) {
  try {
    return register_photo(surface, straight, options, context);
  } catch (const BadDataError& error) {
    throw BadDataError(named.path, error.what());
  }
}

void write_cameras_for_others(const CameraSet& set, CameraExport also, const fs::path& folder) {
  if (also == CameraExport::transforms)
    write_file_atomically(folder / "transforms.json", transforms_json(set));
  if (also != CameraExport::colmap) return;
  make_folder(folder / "colmap");
  write_file_atomically(folder / "colmap" / "cameras.txt", colmap_cameras_text(set));
  write_file_atomically(folder / "colmap" / "images.txt", colmap_images_text(set));
  write_file_atomically(folder / "colmap" / "points3D.txt", colmap_points_text());
}

// Neighbours of one verdict and reason are told together: frames of one rigid scene share theirs.
void tell_not_ok(const std::vector<NamedPose>& poses, StageReport& report) {
  const auto alike = [](const NamedPose& a, const NamedPose& b) {
    const PoseQuality &p = a.registered.quality, &q = b.registered.quality;
    return p.verdict == q.verdict && p.reason == q.reason;
  };
  for (auto pose = poses.begin(); pose != poses.end();) {
    const auto last =
        std::find_if_not(pose, poses.end(),
                         [&](const NamedPose& other) { return alike(*pose, other); }) -
        1;
    const PoseQuality& q = pose->registered.quality;
    if (q.verdict != Verdict::ok) {
      const bool one = pose == last;
      const std::string what =
          one ? "photo " + pose->image : "photos " + pose->image + " to " + last->image;
      const std::string told = std::string(name_of(q.verdict)) + ": " + q.reason;
      report.skipped.push_back({what, told});
      if (!report.quality_gate.empty()) report.quality_gate += "; ";
      report.quality_gate += what + (one ? " is " : " are ") + told;
    }
    pose = last + 1;
  }
}

// Depth without a unit gets one by the surface; frames of a rigid scene share it.
void tell_scale(const std::vector<NamedPose>& poses, const RunContext& context) {
  const auto relative = std::find_if(poses.begin(), poses.end(), [](const NamedPose& pose) {
    return pose.registered.quality.depth && pose.registered.quality.depth->relative;
  });
  if (relative == poses.end()) return;
  const DepthFit& fit = *relative->registered.quality.depth;
  context.info("the depth has no unit; by the surface's size one of it is " +
               to_text(fit.scale, 3) + " mm (± " + percent(fit.scale_sd, 1) + ")");
}

void tell(const std::vector<NamedPose>& poses, StageReport& report) {
  std::vector<double> correlations, uncertainties_mm;
  std::vector<std::string> verdicts, lights;
  std::size_t registered = 0;
  for (const NamedPose& pose : poses) {
    const PoseQuality& q = pose.registered.quality;
    verdicts.push_back(pose.image + ": " + name_of(q.verdict));
    lights.push_back(pose.image + ": " + name_of(pose.registered.light));
    correlations.push_back(q.correlation);
    uncertainties_mm.push_back(q.surface_sd_mm);
    registered += q.verdict == Verdict::ok;
  }
  tell_not_ok(poses, report);
  report.add("photos", poses.size());
  report.add("registered", registered);
  report.add("verdicts", verdicts);
  report.add("lights", lights);
  report.add("correlations", correlations);
  report.add("uncertainties_mm", uncertainties_mm);
}

// The video among the photographs; nothing without one. Throws UsageError when it is not alone.
std::optional<fs::path> clip_of(const StageCall& call) {
  const auto photos = call.inputs_of("photo");
  const auto video = std::find_if(photos.begin(), photos.end(),
                                  [](const auto& photo) { return is_video(photo.second); });
  if (video == photos.end()) return std::nullopt;
  if (photos.size() > 1) throw UsageError("a video is registered alone, without photographs");
  if (call.input("pairs")) throw UsageError("--pairs belongs to a photo, not to a video");
  return video->second;
}

// By the clip's motion where it tells one, and depth then finds the surface; else frame by frame.
std::vector<NamedPose> track_without_depth(const StageCall& call, const RegisteredSurface& surface,
                                           const ClipToTrack& clip,
                                           const RegistrationOptions& options,
                                           const fs::path& beside, StageReport& report) {
  const fs::path motion = beside / "motion";
  std::string why = find_motion_of_clip(clip, motion, call.context);
  if (const std::size_t first = why.empty() && clip.start ? first_frame_of_motion(motion) : 0)
    why =
        "the start is of frame 0, and the motion has no pose before frame " + std::to_string(first);
  if (why.empty()) {
    StageReport followed;
    std::vector<NamedPose> poses =
        follow_motion(surface, clip, motion, options, beside, call.context, followed);
    const PoseQuality quality = poses.empty() ? PoseQuality() : poses.front().registered.quality;
    if (quality.verdict != Verdict::failed) {
      report = std::move(followed);
      return poses;
    }
    why = "the depth that its motion tells does not find the surface (" + quality.reason + ")";
  }
  fs::remove_all(motion);
  call.context.info("the frames are registered one by one: " + why);
  return track_clip(surface, clip, options, beside, call.context, report.bad_data);
}

std::vector<NamedPose> track(const StageCall& call, const RegisteredSurface& surface,
                             const fs::path& video, const RegistrationOptions& options,
                             const fs::path& beside, StageReport& report) {
  ClipToTrack clip{video, *call.input("intrinsics"), {}, {}};
  if (const auto* mask = call.input("photo_mask")) clip.mask = read_photo(*mask);
  const double inset_share = leave_insets_out(call.context, clip);
  if (const auto* init = call.input("init"))
    clip.start = start_for(read_camera_file(*init, call.context),
                           video.stem().string() + "_000000.png", *init);
  const auto* motion = call.input("scope_depth");
  std::vector<NamedPose> poses =
      motion ? follow_motion(surface, clip, *motion, options, beside, call.context, report)
             : track_without_depth(call, surface, clip, options, beside, report);
  report.add("inset_share", inset_share);
  return poses;
}

std::vector<NamedPose> register_all(const StageCall& call, const RegisteredSurface& surface,
                                    const std::vector<NamedPhoto>& photos,
                                    const RegistrationOptions& options, const fs::path& beside) {
  std::vector<NamedPose> poses;
  for (const NamedPhoto& named : photos) {
    call.context.info("photo " + named.name);
    const PhotoToRegister straight = straight_photo(named.photo);
    RegisteredPhoto registered = register_named(surface, named, straight, options, call.context);
    const std::string stem = fs::path(named.name).stem().string();
    write_png(beside / (photos.size() == 1 ? "overlay.png" : "overlay_" + stem + ".png"),
              draw_overlay(surface, straight.image, registered), 1);
    registered.camera = camera_as_taken(registered, named.photo.intrinsics);
    poses.push_back({named.name, std::move(registered)});
    // Those that register for a bake need the pictures beside the cameras.
    if (call.input("unposed")) {
      make_folder((call.output_folder / named.name).parent_path());
      write_file_atomically(call.output_folder / named.name, read_file(named.path));
    }
  }
  return poses;
}

StageReport run(const StageCall& call) {
  const auto options = call.options_as<RegisterStageOptions>();
  options.registration.check();
  TriangleMesh mesh = read_mesh(*call.input("surface"), options.frame, call.context);
  if (!options.vertex_albedo) {
    mesh.colors.clear();
  } else if (mesh.colors.empty()) {
    throw UsageError("--vertex-albedo: the surface has no vertex colours");
  }
  const std::optional<fs::path> clip = clip_of(call);
  std::vector<NamedPhoto> photos;
  if (!clip) {
    photos = read_photos(call);
    complete(call, photos);
  }
  const RegisteredSurface surface(std::move(mesh), options.closed_outline
                                                       ? MeshBorders::outlines
                                                       : MeshBorders::unknown_beyond);
  const fs::path beside = call.output_folder / Stage::kBeside;
  make_folder(beside);
  StageReport report;
  const std::vector<NamedPose> poses =
      clip ? track(call, surface, *clip, options.registration, beside, report)
           : register_all(call, surface, photos, options.registration, beside);
  write_file_atomically(call.output_folder / "pose.json", pose_document(poses));
  write_cameras_for_others(posed_cameras(poses, false), options.also, beside);
  tell(poses, report);
  tell_scale(poses, call.context);
  return report;
}

}  // namespace
}  // namespace organbake

ORGANBAKE_STAGE_MODULE(organbake::run)
