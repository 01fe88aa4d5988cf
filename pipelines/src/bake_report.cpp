// SPDX-License-Identifier: GPL-3.0-or-later
// What a bake says of itself: options in its own words, what gives reason to look at a result, and
// a bundle's report, read back and checked.
#include "organbake/pipelines/bake_report.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>

#include "organbake/core/text.h"
#include "organbake/pipelines/documents.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/stage.h"
#include "recipe_inputs.h"

namespace organbake {
namespace {

bool is_flag_letter(char c) { return std::islower(static_cast<unsigned char>(c)) || c == '-'; }

// What follows a flag: "2", a word that the option knows, an input's path, or a placeholder such as
// FILE.
bool is_value(const Option* option, const std::string& word) {
  if (word.empty()) return false;
  const auto upper = [](unsigned char c) { return std::isupper(c) != 0; };
  if (std::isdigit(static_cast<unsigned char>(word[0]))) return true;
  if (std::all_of(word.begin(), word.end(), upper)) return true;
  if (!option) return word.find_first_of("./") != word.npos;
  const auto& choices = option->traits.choices;
  return std::find(choices.begin(), choices.end(), word) != choices.end();
}

struct Meant {
  std::string key;  // of --set; empty: nothing of the stage
  const Option* option = nullptr;
  bool off = false;  // --no-…
};

Meant meant_by(const Stage& stage, const OptionList& options, const std::string& flag) {
  const bool off = flag.starts_with("no-");
  const std::string name = off ? flag.substr(3) : flag;
  if (is_input_frame_key(name)) return {};  // bakes have that flag, too
  if (const Option* option = options.find(name))
    return {stage.name + "." + option->name, option, off};
  for (const StageInput& input : stage.inputs)
    if (flag == (input.flag.empty() ? input.name : input.flag) && is_recipe_input(input.name))
      return {input.name};
  return {};
}

std::string setting(const Meant& meant, const std::string& value) {
  const bool toggle = meant.option && meant.option->kind == OptionKind::boolean;
  return "--set " + meant.key + "=" +
         (!value.empty() ? value
          : !toggle      ? "…"
          : meant.off    ? "false"
                         : "true");
}

}  // namespace

std::string in_bake_words(const std::string& stage_name, const std::string& text) {
  const Stage* stage = find_stage(stage_name);
  if (!stage || text.find("--") == text.npos) return text;
  const StageOptions options = stage->make_options();
  std::string told;
  std::size_t at = 0;
  while (at < text.size()) {
    const bool begins =
        text.compare(at, 2, "--") == 0 && (at == 0 || !is_flag_letter(text[at - 1]));
    const auto end = std::find_if_not(text.begin() + static_cast<std::ptrdiff_t>(at), text.end(),
                                      is_flag_letter) -
                     text.begin();
    const std::string flag =
        begins ? text.substr(at + 2, static_cast<std::size_t>(end) - at - 2) : "";
    const Meant meant = flag.empty() ? Meant() : meant_by(*stage, options.list, flag);
    if (meant.key.empty()) {
      told += text[at++];
      continue;
    }
    at = static_cast<std::size_t>(end);
    std::string value;
    if (at < text.size() && (text[at] == ' ' || text[at] == '=')) {
      value = text.substr(at + 1, text.find_first_of(" ,;:)", at + 1) - at - 1);
      if (value.ends_with('.')) value.pop_back();
      if (!is_value(meant.option, value)) value.clear();
    }
    if (!value.empty()) at += 1 + value.size();
    told += setting(meant, value);
  }
  return told;
}

namespace {

using Json = nlohmann::json;

std::optional<double> figure(const Json& stage, const char* name) {
  const auto found = stage.at("figures").find(name);
  if (found == stage.at("figures").end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::string on_page(double share) { return page_number(100 * share) + " %"; }

// Of a mask that lies badly the stage itself says why, when it runs.
void check_isosurface(const Json& stage, const std::vector<std::string>& said,
                      std::vector<std::string>& warnings) {
  const bool explained = std::any_of(
      said.begin(), said.end(), [](const std::string& one) { return one.starts_with("mask: "); });
  const auto plausible = stage.at("figures").find("mask_plausible");
  if (plausible != stage.at("figures").end() && *plausible == false && !explained)
    warnings.push_back("the mask does not seem to lie on the organ of its CT");
}

// A proxy that lies off by much of the thickness is of another shape there, and a vessel may be
// gone.
void check_shape(const Json& stage, std::vector<std::string>& warnings) {
  constexpr double kServesNot = 0.5;
  const auto share = figure(stage, "worst_share_of_thickness"), mm = figure(stage, "worst_mm"),
             thickness = figure(stage, "worst_thickness_mm"),
             asked = figure(stage, "share_of_thickness_asked");
  if (!share || !mm || !thickness || *share <= asked.value_or(kServesNot)) return;
  const std::string what = "the proxy lies up to " + page_number(*mm, 3) +
                           " mm off where the organ is " + page_number(*thickness, 3) +
                           " mm thick (2 · volume / area), " + page_number(100 * *share, 2) +
                           " % of it; ";
  warnings.push_back(
      what + (asked ? page_number(100 * *asked) + " % is what serves, and even " +
                          page_number(figure(stage, "faces").value_or(0), 6) +
                          " faces do not reach it: leave thin vessels out of the surface, or look "
                          "whether it will do"
                    : "it does not serve there: take more faces, or faces = auto, which finds how "
                      "many are needed"));
}

void check_decimate(const Json& stage, std::vector<std::string>& warnings) {
  check_shape(stage, warnings);
  constexpr double kVolumeChange = 0.02;
  const bool open = figure(stage, "boundary_loops").value_or(0) > 0;  // and has no volume
  if (const auto change = figure(stage, "volume_change");
      change && !open && std::abs(*change) > kVolumeChange)
    warnings.push_back("the proxy's volume is off by " + on_page(*change) +
                       "; it moves as another organ would");
  if (const auto crossing = figure(stage, "self_intersecting_faces"); crossing && *crossing > 0)
    warnings.push_back(page_number(*crossing) +
                       " faces of the proxy cross others; allow another number of faces");
}

void check_place(const Json& stage, std::vector<std::string>& warnings) {
  constexpr double kSeen = 0.99, kMissed = 0.01;
  if (const auto reached = figure(stage, "coverage_reached"))
    warnings.push_back("cameras see only " + percent(*reached, 2) +
                       " of the reachable surface as often as asked for");
  if (const auto seen = figure(stage, "seen_by_1_share"); seen && *seen < kSeen)
    warnings.push_back(on_page(1 - *seen) +
                       " of the area that a view can reach is seen by no camera; more cameras, or "
                       "--coverage, show it");
  if (const auto gap = figure(stage, "view_gap_mean"); gap && *gap > kMissed)
    warnings.push_back("views miss " + on_page(*gap) + " of their picture on average");
}

void check_capture(const Json& stage, std::vector<std::string>& warnings) {
  constexpr double kOdd = 0.001;
  if (!figure(stage, "bound_in_prism")) return;
  const double in_prism = *figure(stage, "bound_in_prism");
  const double fallback = figure(stage, "bound_by_fallback").value_or(0);
  const double backs = figure(stage, "back_face_texels").value_or(0);
  const double unbound = figure(stage, "unbound_texels").value_or(0);
  const double all = in_prism + fallback + backs + unbound;
  if (all == 0) warnings.push_back("no camera shows anything of the organ");
  if (fallback > kOdd * all)
    warnings.push_back(
        on_page(fallback / all) +
        " of the texels lie outside the proxy's shell; they follow its nearest face");
  if (unbound > kOdd * all)
    warnings.push_back(on_page(unbound / all) +
                       " of the texels lie where no face of the proxy can carry them, and were "
                       "left out; check that the proxy has the surface's shape");
  if (backs > kOdd * all)
    warnings.push_back(on_page(backs / all) +
                       " of the texels saw the surface from behind; it is open or inside out");
}

void check_register(const Json& stage, std::vector<std::string>& warnings) {
  const auto photos = figure(stage, "photos"), good = figure(stage, "registered");
  if (photos && good && *good < *photos)
    warnings.push_back("" + page_number(*photos - *good) + " of " + page_number(*photos) +
                       " photographs have no pose that can be trusted");
}

// What a stage said itself begins alike, and may tell more.
bool said_already(const std::vector<std::string>& said, const std::string& warning) {
  return std::any_of(said.begin(), said.end(),
                     [&](const std::string& one) { return one.starts_with(warning); });
}

}  // namespace

std::vector<std::string> stage_warnings(const Json& stage_report,
                                        const std::vector<std::string>& said, bool in_bake) {
  std::vector<std::string> told;
  for (const char* own : {"bad_data", "quality_gate"})
    if (stage_report.contains(own)) told.push_back(stage_report.at(own));
  const std::string name = stage_report.at("stage");
  if (name == "isosurface") check_isosurface(stage_report, said, told);
  if (name == "decimate") check_decimate(stage_report, told);
  if (name == "place") check_place(stage_report, told);
  if (name == "register") check_register(stage_report, told);
  if (name == "capture") check_capture(stage_report, told);
  std::vector<std::string> warnings;
  for (const auto& list : {said, told})
    for (const std::string& text : list) {
      const std::string one = in_bake ? in_bake_words(name, text) : text;
      if (!said_already(warnings, one)) warnings.push_back(one);
    }
  return warnings;
}

std::vector<std::string> bake_warnings(const Json& bake_report) {
  std::vector<std::string> warnings;
  for (const Json& stage : bake_report.at("stages"))
    for (const std::string& warning : stage_warnings(stage))
      warnings.push_back(stage.at("stage").get<std::string>() + ": " + warning);
  return warnings;
}

nlohmann::json read_bake_report(const BundleReader& reader) {
  const std::vector<std::byte> bytes = reader.read("report.json");
  const std::string name = (reader.folder() / "report.json").string();
  const auto check = [&](const std::string& text, const char* schema) {
    const Document document = Document::parse_json(text, name);
    check_document(document, schema);
    return document.json();
  };
  const nlohmann::json report =
      check({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "bake-report");
  for (const nlohmann::json& stage : report.at("stages")) check(stage.dump(), "stage-report");
  return report;
}

}  // namespace organbake
