// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/register/pose_document.h"

#include <nlohmann/json.hpp>

namespace organbake {
namespace {

using Json = nlohmann::ordered_json;

Json verdict_json(const RegisteredPhoto& registered) {
  const PoseQuality& q = registered.quality;
  Json json = {{"verdict", name_of(q.verdict)}};
  if (!q.reason.empty()) json["reason"] = q.reason;
  json["light"] = name_of(registered.light);
  const std::pair<const char*, double> figures[] = {
      {"correlation", q.correlation},       {"inlier_share", q.inlier_share},
      {"visible_share", q.visible_share},   {"outline_share", q.outline_share},
      {"position_sd_mm", q.position_sd_mm}, {"rotation_sd_deg", q.rotation_sd_deg},
      {"surface_sd_mm", q.surface_sd_mm},   {"runner_up_margin", q.runner_up_margin},
      {"focal_scale", q.focal_scale}};
  for (const auto& [name, value] : figures) json[name] = value;
  if (q.depth)
    json["depth"] = {{"agreeing_share", q.depth->share},
                     {"pierced_share", q.depth->pierced_share},
                     {"noise_mm", q.depth->noise_mm},
                     {"scale", q.depth->scale},
                     {"runner_up_margin", q.depth->runner_up_margin}};
  return json;
}

bool is_ok(const NamedPose& pose) { return pose.registered.quality.verdict == Verdict::ok; }

}  // namespace

CameraSet posed_cameras(const std::vector<NamedPose>& poses, bool all) {
  CameraSet set;
  for (const NamedPose& pose : poses) {
    if (!all && !is_ok(pose)) continue;
    set.cameras.push_back(pose.registered.camera);
    set.cameras.back().name = pose.image;
    set.images.push_back(pose.image);
  }
  return set;
}

std::string pose_document(const std::vector<NamedPose>& poses) {
  Json document = Json::parse(cameras_to_json(posed_cameras(poses, true)));
  const Json all = document["cameras"];
  document["cameras"] = Json::array();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Json camera = all[i];
    camera["registration"] = verdict_json(poses[i].registered);
    if (is_ok(poses[i])) {
      document["cameras"].push_back(camera);
    } else {
      document["left_out"].push_back(camera);
    }
  }
  return document.dump(2) + "\n";
}

}  // namespace organbake
