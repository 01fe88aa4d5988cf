// SPDX-License-Identifier: Apache-2.0
#pragma once

// A viewer on its orbit about an organ, and why it may see nothing: the eye is inside, or too near.

#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "organbake/bundle/cameras_json.h"
#include "organbake/warp/view.h"

namespace organbake {

class Player;
struct DrawReport;

// A viewer on an orbit about the organ's centre, relative to virtual camera 0.
struct OrbitPose {
  // About the organ's vertical axis: world +z (superior), or what up_from() says where camera 0
  // looks along that.
  double azimuth_rad = 0;
  double elevation_rad = 0;  // towards the axis
  double distance = 1;       // multiples of the virtual cameras' distance
  double roll_rad = 0;       // about the view axis
  // The whole picture moved: the eye and what it looks at shift across the view, in multiples of
  // the virtual cameras' distance.
  double right = 0, up = 0;
};

// Beyond these an angle that somebody wrote is no radians, but degrees by mistake. Both are counted
// from camera 0, which may stand at a pole.
inline bool can_be_azimuth(double rad) { return std::abs(rad) <= 2 * std::numbers::pi; }
inline bool can_be_elevation(double rad) { return std::abs(rad) <= std::numbers::pi; }
inline constexpr const char* kAnglesAreRadians =
    "angles are in radians, at most a turn of azimuth and half a turn of elevation; 45 degrees are "
    "0.785";
inline constexpr double kFarthestDistance = 1e6;  // multiples of the virtual cameras'

// The view of a pose, with virtual camera 0's angle of view across the picture's smaller side.
// Throws UsageError for a picture without pixels or a pose that is not finite or not outside.
View orbit_view(const CameraSet& cameras, const OrbitPose& pose, int width, int height);

// Whether a pose leads past a pole of the orbit, where the eye stops.
bool leads_past_pole(const CameraSet& cameras, const OrbitPose& pose);

// The pose of the front view from which all of a player's organs are seen whole at rest, with a
// margin, in a picture of any shape. Of one organ the orbit's own: its cameras frame it already.
OrbitPose framing_pose(const Player& player);

// Whether the eye lies inside an organ as it is posed now: by the winding number of its proxy
// (van Oosterom & Strackee 1983, solid angles). An open surface has no inside.
bool eye_is_inside(const Player& player, const View& view);

// Of a picture that shows no skin at all: a sentence when that is so because the eye is inside an
// organ or too near to one. Nothing where it looks past all of them.
std::optional<std::string> why_empty(const Player& player, const View& view,
                                     const DrawReport& report);

}  // namespace organbake
