// SPDX-License-Identifier: Apache-2.0
// Writes and reads mechanics.json: masses, springs, anchors and, where there are some, the
// tetrahedra. Indices and numbers are checked here, so that the solver never meets a spring without
// length or a vertex that does not exist.
#include "organbake/bundle/mechanics_model.h"

#include "organbake/bundle/json_fields.h"
#include "tetrahedral_body_json.h"

namespace organbake {
namespace {

constexpr const char* kMechanicsSchema = "organbake/mechanics/1";
constexpr double kTiny = 1e-300, kHuge = 1e12;  // positive, and far from overflow when multiplied

Spring spring_from(const JsonField& field, std::int64_t vertex_count) {
  Spring spring;
  spring.a = static_cast<std::uint32_t>(field["a"].integer(0, vertex_count - 1));
  spring.b = static_cast<std::uint32_t>(field["b"].integer(0, vertex_count - 1));
  if (spring.a == spring.b) field.fail("joins a vertex with itself");
  spring.rest_length_mm = field["rest_length_mm"].number(kTiny, kHuge);
  spring.stiffness_n_per_mm = field["stiffness_n_per_mm"].number(kTiny, kHuge);
  spring.damping_n_s_per_mm = field["damping_n_s_per_mm"].number(0, kHuge);
  return spring;
}

// Each vertex that is no anchor, once.
std::vector<std::uint32_t> order_from(const JsonField& field, const MechanicsModel& model) {
  std::vector<bool> waits(model.mass_kg.size(), true);
  for (const std::uint32_t anchor : model.anchors) waits[anchor] = false;
  const std::size_t free = waits.size() - model.anchors.size();
  if (field.size() != free) {
    field.fail("holds " + std::to_string(field.size()) + " vertices of the " +
               std::to_string(free) + " that are no anchors");
  }
  std::vector<std::uint32_t> order;
  for (std::size_t i = 0; i < free; ++i) {
    const JsonField entry = field.at(i);
    const auto v =
        static_cast<std::uint32_t>(entry.integer(0, static_cast<std::int64_t>(waits.size()) - 1));
    if (!waits[v]) entry.fail("names an anchor, or a vertex for the second time");
    waits[v] = false;
    order.push_back(v);
  }
  return order;
}

}  // namespace

std::string mechanics_to_json(const MechanicsModel& model) {
  Json springs = Json::array();
  for (const Spring& s : model.springs) {
    springs.push_back({{"a", s.a},
                       {"b", s.b},
                       {"rest_length_mm", s.rest_length_mm},
                       {"stiffness_n_per_mm", s.stiffness_n_per_mm},
                       {"damping_n_s_per_mm", s.damping_n_s_per_mm}});
  }
  Json json = {{"schema", kMechanicsSchema},
               {"tissue",
                {{"young_modulus_kpa", model.young_modulus_kpa},
                 {"density_kg_per_m3", model.density_kg_per_m3},
                 {"thickness_mm", model.thickness_mm},
                 {"volume_stiffness", model.volume_stiffness}}},
               {"instrument_radius_mm", model.instrument_radius_mm},
               {"mass_kg", model.mass_kg},
               {"anchors", model.anchors},
               {"springs", springs}};
  json["tissue"]["cut_gape_mm"] = model.cut_gape_mm;
  if (model.grasp_slip_n > 0) json["tissue"]["grasp_slip_n"] = model.grasp_slip_n;
  if (model.drag_per_s > 0) json["tissue"]["drag_per_s"] = model.drag_per_s;
  if (!model.elimination_order.empty()) json["elimination_order"] = model.elimination_order;
  if (model.body) json["tetrahedra"] = tetrahedral_body_to_json(*model.body);
  return json_text(json);
}

MechanicsModel mechanics_from_json(const std::string& text, const std::string& name,
                                   std::size_t vertex_count) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  document.require_schema(kMechanicsSchema);
  const auto vertices = static_cast<std::int64_t>(vertex_count);
  MechanicsModel model;
  const JsonField tissue = document["tissue"];
  model.young_modulus_kpa = tissue["young_modulus_kpa"].number(kTiny, kHuge);
  model.density_kg_per_m3 = tissue["density_kg_per_m3"].number(kTiny, kHuge);
  model.thickness_mm = tissue["thickness_mm"].number(kTiny, kHuge);
  model.volume_stiffness = tissue["volume_stiffness"].number(0, 1);
  if (const auto gape = tissue.find("cut_gape_mm")) model.cut_gape_mm = gape->number(0, kHuge);
  if (const auto slip = tissue.find("grasp_slip_n")) model.grasp_slip_n = slip->number(0, kHuge);
  if (const auto drag = tissue.find("drag_per_s")) model.drag_per_s = drag->number(0, kHuge);
  model.instrument_radius_mm = document["instrument_radius_mm"].number(kTiny, kHuge);
  const JsonField masses = document["mass_kg"];
  if (masses.size() != vertex_count) {
    masses.fail("holds " + std::to_string(masses.size()) + " masses for " +
                std::to_string(vertex_count) + " proxy vertices");
  }
  for (std::size_t i = 0; i < masses.size(); ++i) {
    model.mass_kg.push_back(masses.at(i).number(kTiny, kHuge));
  }
  const JsonField anchors = document["anchors"];
  std::int64_t last = -1;
  for (std::size_t i = 0; i < anchors.size(); ++i) {
    last = anchors.at(i).integer(last + 1, vertices - 1);  // increasing, so each once
    model.anchors.push_back(static_cast<std::uint32_t>(last));
  }
  const JsonField springs = document["springs"];
  for (std::size_t i = 0; i < springs.size(); ++i) {
    model.springs.push_back(spring_from(springs.at(i), vertices));
  }
  if (const auto order = document.find("elimination_order")) {
    model.elimination_order = order_from(*order, model);
  }
  if (const auto body = document.find("tetrahedra")) {
    model.body = tetrahedral_body_from_json(*body, vertex_count);
  }
  return model;
}

}  // namespace organbake
