// SPDX-License-Identifier: Apache-2.0
#include "option_values.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "organbake/core/error.h"
#include "organbake/options/options.h"
#include "organbake/warp/view.h"

namespace organbake {
namespace {

// The whole text as one number: "1x" and "4294967297" are none.
std::optional<int> whole_number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// Finite numbers with commas between them; nothing when one is missing or something else is there.
std::optional<std::vector<double>> number_list(const std::string& text) {
  std::vector<double> values;
  for (const char* at = text.c_str();; ++at) {
    char* end = nullptr;
    values.push_back(std::strtod(at, &end));
    if (end == at || !std::isfinite(values.back())) return std::nullopt;
    if (*end == '\0') return values;
    if (*end != ',') return std::nullopt;
    at = end;
  }
}

double radians_of(const AngleOption& option, double angle) {
  return option.in_degrees ? radians(angle) : angle;
}

std::string limits_of(const AngleOption& option) {
  return option.in_degrees ? "azimuths are at most 360 degrees, elevations 180" : kAnglesAreRadians;
}

[[noreturn]] void refuse(const AngleOption& option, const std::string& text,
                         const std::string& why) {
  throw UsageError(option.flag + " " + text + why);
}

}  // namespace

PictureSize size_from(const std::string& text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string::npos)
    throw UsageError("--size " + text + " is no size; write WIDTHxHEIGHT, for example 1280x720");
  const auto width = whole_number(std::string_view(text).substr(0, cross)),
             height = whole_number(std::string_view(text).substr(cross + 1));
  const auto can_be_drawn = [](const std::optional<int>& side) {
    return side && *side >= 1 && *side <= kLargestSide_px;
  };
  if (!can_be_drawn(width) || !can_be_drawn(height))
    throw UsageError("--size " + text + ": each side needs a whole number of pixels in 1…" +
                     std::to_string(kLargestSide_px) + ", for example 1280x720");
  return {*width, *height};
}

OrbitPose pose_from(const AngleOption& option, const std::string& text) {
  const auto values = number_list(text);
  if (!values || values->size() < 2 || values->size() > 3)
    refuse(option, text, " is no view; write AZIMUTH,ELEVATION or AZIMUTH,ELEVATION,DISTANCE");
  OrbitPose pose;
  pose.azimuth_rad = radians_of(option, (*values)[0]);
  pose.elevation_rad = radians_of(option, (*values)[1]);
  if (values->size() == 3) pose.distance = (*values)[2];
  if (!can_be_azimuth(pose.azimuth_rad) || !can_be_elevation(pose.elevation_rad))
    refuse(option, text, ": " + limits_of(option));
  if (!(pose.distance > 0 && pose.distance < kFarthestDistance))
    refuse(option, text,
           ": the distance must lie above 0 and below a million; 1 is the virtual cameras' own");
  return pose;
}

std::vector<double> angles_from(const AngleOption& option, const std::string& text) {
  auto angles = number_list(text);
  if (!angles) refuse(option, text, " are no angles; write A,B,C, for example 0,45,90");
  for (double& angle : *angles) {
    angle = radians_of(option, angle);
    if (!can_be_azimuth(angle)) refuse(option, text, ": " + limits_of(option));
  }
  return *angles;
}

}  // namespace organbake
