// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/bake_warnings.h"

#include <nlohmann/json.hpp>
#include <optional>

#include "pipelines/html_page.h"

namespace organbake {
namespace {

using Json = nlohmann::json;

std::optional<double> figure(const Json& stage, const char* name) {
  const auto found = stage.at("figures").find(name);
  if (found == stage.at("figures").end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::string percent(double share) { return page_number(100 * share) + " %"; }

void check_isosurface(const Json& stage, std::vector<std::string>& warnings) {
  const auto plausible = stage.at("figures").find("mask_plausible");
  if (plausible != stage.at("figures").end() && *plausible == false)
    warnings.push_back("isosurface: the mask does not seem to lie on the organ of its CT");
}

void check_decimate(const Json& stage, std::vector<std::string>& warnings) {
  constexpr double kVolumeChange = 0.02;
  if (const auto change = figure(stage, "volume_change");
      change && std::abs(*change) > kVolumeChange)
    warnings.push_back("decimate: the proxy's volume is off by " + percent(*change) +
                       "; it moves as another organ would");
  if (const auto crossing = figure(stage, "self_intersecting_faces"); crossing && *crossing > 0)
    warnings.push_back("decimate: " + page_number(*crossing) +
                       " faces of the proxy cross each other; try another number of faces");
}

void check_place(const Json& stage, std::vector<std::string>& warnings) {
  constexpr double kSeen = 0.99, kMissed = 0.01;
  if (const auto reached = figure(stage, "coverage_reached"))
    warnings.push_back("place: the coverage asked for was not reached, only " + percent(*reached));
  if (const auto seen = figure(stage, "seen_by_1_share"); seen && *seen < kSeen)
    warnings.push_back("place: " + percent(1 - *seen) +
                       " of the area that a view can reach is seen by no camera; more cameras, or "
                       "--coverage, show it");
  if (const auto gap = figure(stage, "view_gap_mean"); gap && *gap > kMissed)
    warnings.push_back("place: views miss " + percent(*gap) + " of their picture on average");
}

void check_capture(const Json& stage, std::vector<std::string>& warnings) {
  constexpr double kOdd = 0.001;
  const double in_prism = figure(stage, "bound_in_prism").value_or(0);
  const double fallback = figure(stage, "bound_by_fallback").value_or(0);
  const double backs = figure(stage, "back_face_texels").value_or(0);
  const double unbound = figure(stage, "unbound_texels").value_or(0);
  const double all = in_prism + fallback + backs + unbound;
  if (all == 0) warnings.push_back("capture: no camera shows anything of the organ");
  if (fallback > kOdd * all)
    warnings.push_back(
        "capture: " + percent(fallback / all) +
        " of the texels lie outside the proxy's shell; they follow its nearest face");
  if (unbound > kOdd * all)
    warnings.push_back("capture: " + percent(unbound / all) +
                       " of the texels lie where no face of the proxy can carry them, and were "
                       "left out; check that the proxy has the surface's shape");
  if (backs > kOdd * all)
    warnings.push_back("capture: " + percent(backs / all) +
                       " of the texels saw the surface from behind; it is open or inside out");
}

void check_register(const Json& stage, std::vector<std::string>& warnings) {
  const auto photos = figure(stage, "photos"), good = figure(stage, "registered");
  if (photos && good && *good < *photos)
    warnings.push_back("register: " + page_number(*photos - *good) + " of " + page_number(*photos) +
                       " photographs have no pose that can be trusted");
}

}  // namespace

std::vector<std::string> bake_warnings(const Json& bake_report) {
  std::vector<std::string> warnings;
  for (const Json& stage : bake_report.at("stages")) {
    const std::string name = stage.at("stage");
    for (const char* own : {"bad_data", "quality_gate"})
      if (stage.contains(own)) warnings.push_back(name + ": " + stage.at(own).get<std::string>());
    if (name == "isosurface") check_isosurface(stage, warnings);
    if (name == "decimate") check_decimate(stage, warnings);
    if (name == "place") check_place(stage, warnings);
    if (name == "register") check_register(stage, warnings);
    if (name == "capture") check_capture(stage, warnings);
  }
  return warnings;
}

}  // namespace organbake
