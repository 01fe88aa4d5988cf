// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/pipelines/stage.h"
#include "organbake/registration/register_photo.h"
#include "organbake/registration/registered_surface.h"
#include "stages/shared/posed_depth.h"

namespace organbake {

// The lens of a file for a photograph, checked against its size; of a fisheye it is said what is
// used. Throws NoInputError, BadDataError.
Intrinsics lens_of_photo(const std::filesystem::path& file, const std::string& name,
                         const Rgb8Image& image, const RunContext& context);

// The photograph as it is registered: a fisheye's straightened to a pinhole, with its mask (what
// the fisheye does not show does not count) and the pixels of its point pairs. Others stay as they
// are.
PhotoToRegister straight_photo(PhotoToRegister photo);

// The registered camera with the lens that took the photograph in the place of the straightened
// one's; a focal length that was sought goes along.
PosedCamera camera_as_taken(const RegisteredPhoto& registered, const Intrinsics& lens);

// What a depth map shows, in the axes of the camera that took the photograph.
struct DepthPoints {
  std::vector<Eigen::Vector3d> places;
  std::vector<float> trust;
  bool relative = false;
};
// `lens` is the photograph's, as it was taken. A map that says its own camera is turned as that
// says (a rectified eye), unless the photograph is the rectified one. Throws BadDataError for a map
// that is another lens's, holds no depth, or has lengths that no scope has.
DepthPoints read_depth_points(const DepthFile& file, const Intrinsics& lens,
                              const RunContext& context);

// The depth of a photograph: the map of its name in a folder, the only one there is, or a surface
// that was fused, seen from the camera of the photograph's name in the cameras.json beside it; else
// the surface is taken to be in the camera's own axes. Nothing, which is said, where a folder of
// several has none of the photograph's name.
SeenDepth read_seen_depth(const std::filesystem::path& given, const std::string& photo,
                          const Intrinsics& lens, const RunContext& context);

// A photograph by its file name, and what registration made of it.
struct NamedPose {
  std::string image;
  RegisteredPhoto registered;
};

// cameras.json with a verdict at every camera. Cameras whose verdict is not ok stand under
// left_out, with their reason, so that nothing that reads cameras takes them for posed.
std::string pose_document(const std::vector<NamedPose>& poses);

// The cameras that are ok, or all of them.
CameraSet posed_cameras(const std::vector<NamedPose>& poses, bool all);

bool is_video(const std::filesystem::path& path);

inline constexpr std::size_t kOverlayEach = 25;  // frames: one a second

struct ClipToTrack {
  std::filesystem::path video, intrinsics;
  Rgb8Image mask;                       // of all frames; empty = all counts
  std::optional<RigidTransform> start;  // of the first frame: camera_from_world
};

// What a recorder has laid over the video counts no longer; its share of the frames. The clip's
// motion, which is found before, has said it.
double leave_insets_out(const RunContext& context, ClipToTrack& clip);

// The poses of a video's frames, in their order. Overlays of one frame in 25 go into the folder. A
// video that is damaged ends there: `damage` then says where.
std::vector<NamedPose> track_clip(const RegisteredSurface& surface, const ClipToTrack& clip,
                                  const RegistrationOptions& options,
                                  const std::filesystem::path& overlay_folder,
                                  const RunContext& context, std::string& damage);

// The poses of a video's frames whose motion the stage `motion` found: `motion` is its folder. The
// scene is rigid, so that one pose of the surface in it serves all: it is told by photograph and
// depth of the surest of three key frames. How far the poses that the others tell by themselves lie
// from it (drift) and how unsteady the motion is from frame to frame (jitter) come into the report.
// Throws BadDataError for a folder that is not of this video.
std::vector<NamedPose> follow_motion(const RegisteredSurface& surface, const ClipToTrack& clip,
                                     const std::filesystem::path& motion,
                                     const RegistrationOptions& options,
                                     const std::filesystem::path& overlay_folder,
                                     const RunContext& context, StageReport& report);

// The first frame of which a motion's folder has a pose. Throws as above.
std::size_t first_frame_of_motion(const std::filesystem::path& motion);

// Runs the stage `motion` with its defaults on a clip that came without depth, and leaves what it
// makes in `folder`. Returns why the clip tells no motion (the scope stands still, turns or zooms;
// frames that no lens has taken); nothing where it does.
std::string find_motion_of_clip(const ClipToTrack& clip, const std::filesystem::path& folder,
                                const RunContext& context);

}  // namespace organbake
