// SPDX-License-Identifier: Apache-2.0
// The breath that a clip tells: its course and its field, its document, and the script that moves
// an organ's vertices by it.
#include "organbake/bundle/breath.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/bundle/json_fields.h"

namespace organbake {
Breath::Waves Breath::waves_at(double angle_rad) {
  return {std::cos(angle_rad), std::sin(angle_rad), std::cos(2 * angle_rad),
          std::sin(2 * angle_rad)};
}

double Breath::course(double time_frames) const {
  return waves.dot(waves_at(2 * std::numbers::pi * time_frames / period_frames)) - rest;
}

// What is alike and linear as it is, for the scope can do as much; what bends levels off outside.
Breath::Terms Breath::terms_at(const Eigen::Vector3d& place) const {
  const Eigen::Vector3d away = axes * (place - middle) / reach;
  const Eigen::Vector3d bent = away / std::sqrt(1 + away.squaredNorm());
  const double x = bent.x(), y = bent.y(), z = bent.z();
  Terms terms;
  terms << 1, away, x * x, x * y, y * y, x * z, y * z, z * z;
  return terms;
}

Eigen::Vector3d Breath::push(const Eigen::Vector3d& place) const {
  constexpr int kSteps = 3;
  Eigen::Vector3d push = Eigen::Vector3d::Zero();
  for (int i = 0; i < kSteps; ++i) push = field * terms_at(place - rest * push);
  return push;
}

void Breath::move(const RigidTransform& now_from_before, double factor) {
  field = factor * now_from_before.rotation * field;
  axes *= now_from_before.rotation.transpose();
  middle = factor * (now_from_before * middle);
  reach *= factor;
}

namespace {

constexpr const char* kBreathSchema = "organbake/breath/1";
constexpr double kMost = 1e6;  // mm; beyond it places would overflow

template <class Matrix>
Json columns_json(const Matrix& columns) {
  Json json = Json::array();
  for (const Eigen::Vector3d column : columns.colwise()) json.push_back(to_json(column));
  return json;
}

std::vector<double> numbers_of(const JsonField& field, int count) {
  if (field.size() != std::size_t(count))
    field.fail("must hold " + std::to_string(count) + " entries");
  std::vector<double> numbers;
  for (std::size_t i = 0; i < field.size(); ++i)
    numbers.push_back(field.at(i).number(-kMost, kMost));
  return numbers;
}

}  // namespace

std::string breath_to_json(const Breath& breath) {
  return json_text({{"schema", kBreathSchema},
                    {"period_frames", breath.period_frames},
                    {"waves", std::vector<double>(breath.waves.begin(), breath.waves.end())},
                    {"rest", breath.rest},
                    {"field_mm", columns_json(breath.field)},
                    {"axes", columns_json(breath.axes.transpose())},
                    {"middle_mm", to_json(breath.middle)},
                    {"reach_mm", breath.reach}});
}

Breath breath_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  document.require_schema(kBreathSchema);
  document.allow_only(
      {"schema", "period_frames", "waves", "rest", "field_mm", "axes", "middle_mm", "reach_mm"});
  constexpr double kLongest_frames = 1e5, kSmallest_mm = 1e-6;
  Breath breath;
  breath.period_frames = document["period_frames"].number(1, kLongest_frames);
  breath.waves = Breath::Waves(numbers_of(document["waves"], Breath::kWaves).data());
  breath.rest = document["rest"].number(-kMost, kMost);
  const JsonField field = document["field_mm"];
  if (field.size() != Breath::kTerms) field.fail("must hold a vector for each term");
  for (int k = 0; k < Breath::kTerms; ++k)
    breath.field.col(k) = Eigen::Vector3d(numbers_of(field.at(std::size_t(k)), 3).data());
  breath.axes = document["axes"].rotation();
  breath.middle = Eigen::Vector3d(numbers_of(document["middle_mm"], 3).data());
  breath.reach = document["reach_mm"].number(kSmallest_mm, kMost);
  return breath;
}

std::string breath_script(const Breath& breath, const std::vector<Eigen::Vector3d>& vertices_mm) {
  constexpr double kFrame_s = 0.04;      // of the clip: 25 in a second
  constexpr double kSteps_per_mm = 1e4;  // finer digits tell nothing
  const int frames = std::max(1, static_cast<int>(std::lround(breath.period_frames)));
  std::vector<Eigen::Vector3d> pushes;
  for (const Eigen::Vector3d& vertex : vertices_mm) pushes.push_back(breath.push(vertex));
  Json states = Json::array();
  for (int frame = 0; frame < frames; ++frame) {
    const double course = breath.course(frame * breath.period_frames / frames);
    std::vector<double> state;
    for (std::size_t v = 0; v < vertices_mm.size(); ++v) {
      const Eigen::Vector3d place = vertices_mm[v] + course * pushes[v];
      for (const double x : place) state.push_back(std::round(x * kSteps_per_mm) / kSteps_per_mm);
    }
    states.push_back(std::move(state));
  }
  const Json key = {{"frame", 0}, {"azimuth_rad", 0}, {"elevation_rad", 0}};
  const Json script = {{"schema", "organbake/interaction/1"},
                       {"name", "one breath of the clip"},
                       {"time_step_s", kFrame_s},
                       {"frames", frames},
                       {"camera", {{"keyframes", Json::array({key})}}},
                       {"instruments", Json::array()},
                       {"vertices_mm", std::move(states)}};
  return script.dump() + "\n";
}

}  // namespace organbake
