// SPDX-License-Identifier: Apache-2.0
#include "scene_record.h"

#include "organbake/bundle/json_fields.h"
#include "organbake/truth/pixel_truth.h"

namespace organbake {
namespace {

Json camera_json(const PosedCamera& camera) {
  Json pose = Json::array();
  for (int row = 0; row < 3; ++row) {
    const auto& r = camera.camera_from_world.rotation;
    pose.push_back({r(row, 0), r(row, 1), r(row, 2), camera.camera_from_world.translation[row]});
  }
  Json json = intrinsics_to_json(camera.intrinsics);
  json["camera_from_world"] = pose;
  return json;
}

Json instruments_json(const PlayedScene& scene, const std::vector<std::string>& names) {
  Json all = Json::array();
  for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
    const Instrument& tip = scene.instruments[i];
    Json json = Json::object();
    json["name"] = i < names.size() ? names[i] : "instrument " + std::to_string(i);
    json["label"] = kFirstToolLabel + i;
    json["active"] = tip.active;
    json["mode"] = mode_of(tip.kind);
    json["position_mm"] = to_json(tip.position_mm);
    json["axis_mm"] = to_json(tip.axis_mm);
    json["radius_mm"] = tip.radius_mm;
    if (const Scissors* scissors = std::get_if<Scissors>(&tip.kind))
      json["opening_mm"] = to_json(scissors->opening_mm);
    json["force_n"] = to_json(scene.step.tip_force_n.at(i));
    all.push_back(json);
  }
  return all;
}

Json contacts_json(const StepReport& step) {
  Json all = Json::array();
  for (const ContactPoint& point : step.contact_points)
    all.push_back({{"instrument", point.instrument},
                   {"organ", point.organ},
                   {"position_mm", to_json(point.position_mm)},
                   {"normal", to_json(point.normal)},
                   {"force_n", to_json(point.force_n)},
                   {"depth_mm", point.depth_mm},
                   {"carried", point.carried}});
  return all;
}

Json proxies_json(const Player& player) {
  Json organs = Json::array();
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    Json vertices = Json::array();
    for (const Eigen::Vector3d& v : player.proxy_positions(o)) vertices.push_back(to_json(v));
    organs.push_back(std::move(vertices));
  }
  return organs;
}

}  // namespace

std::string scene_line(int frame, const PosedCamera& camera, const PlayedScene& scene,
                       const Player& player, const std::vector<std::string>& instrument_names) {
  const Json json = {{"frame", frame},
                     {"time_s", scene.time_s},
                     {"camera", camera_json(camera)},
                     {"instruments", instruments_json(scene, instrument_names)},
                     {"contacts", scene.step.contacts},
                     {"contact_points", contacts_json(scene.step)},
                     {"tissue_contacts", scene.step.tissue_contacts},
                     {"tool_contacts", scene.step.tool_contacts},
                     {"penetration_mm", scene.step.penetration_mm},
                     {"proxy_mm", proxies_json(player)}};
  return json.dump() + "\n";
}

}  // namespace organbake
