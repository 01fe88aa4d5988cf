// SPDX-License-Identifier: Apache-2.0
// What a data set shall hold, from JSON, and the plan that follows from it: which organ, seed and
// frames each shard has.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "dataset_shard.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/core/text.h"
#include "organbake/dataset/dataset.h"
#include "organbake/deform/deformer.h"
#include "organbake/truth/truth_recorder.h"
#include "organbake/warp/view.h"

namespace organbake {
namespace {

constexpr const char* kDatasetSchema = "organbake/dataset/1";
constexpr int kMostFramesOfSet = 10'000'000;
constexpr double kHalfTurn_rad = std::numbers::pi;
constexpr double kDegree_rad = std::numbers::pi / 180;

// Reads optional keys of an object.
class Keys {
 public:
  explicit Keys(const JsonField& object) : object_(object) {}

  void number(const char* key, double low, double high, double& value) const {
    object_.read(key, low, high, value);
  }
  // NAME_deg, or NAME_rad, as it was written once.
  void angle(const std::string& name, double& rad) const {
    const std::string degrees = name + "_deg", radians = name + "_rad";
    if (object_.find(degrees) && object_.find(radians))
      object_[radians].fail("is another unit of " + degrees + ": write one of them");
    if (const auto field = object_.find(degrees)) rad = field->number(0, 180) * kDegree_rad;
    number(radians.c_str(), 0, kHalfTurn_rad, rad);
  }
  void whole(const char* key, int low, int high, int& value) const {
    if (const auto field = object_.find(key)) value = static_cast<int>(field->integer(low, high));
  }
  // [low, high], or one number for both.
  void range(const char* key, double low, double high, SampledRange& value) const {
    const auto field = object_.find(key);
    if (!field) return;
    if (field->json().is_number()) {
      value.low = value.high = field->number(low, high);
      return;
    }
    const auto refuse = [&](const std::string& rule) {
      field->fail("is " + field->json().dump() + ", " + rule);
    };
    if (!field->json().is_array() || field->size() != 2)
      refuse("must hold two numbers, the lowest and the highest, or be one for both");
    value = {field->at(0).number(low, high), field->at(1).number(low, high)};
    if (value.high < value.low) refuse("must not end below its beginning");
  }

 private:
  const JsonField& object_;
};

void read_views(const JsonField& views, DatasetSpec& spec) {
  views.allow_only(
      {"cone_deg", "cone_rad", "distance", "roll_deg", "roll_rad", "motion_deg", "motion_rad"});
  const Keys keys(views);
  keys.angle("cone", spec.cone_rad);
  keys.range("distance", 0.05, 100, spec.distance);
  keys.angle("roll", spec.roll_rad);
  keys.angle("motion", spec.motion_rad);
}

void read_tools(const JsonField& tools, DatasetSpec& spec) {
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const auto kind = kind_of_mode(tools.at(i).text());
    if (!kind || kind->index() > kind_of_mode("cut")->index())
      tools.at(i).fail("'" + tools.at(i).text() +
                       "' is no tool of a data set: take poke, grab or "
                       "cut");
    spec.tools.push_back(*kind);
  }
}

// A tenth of a millimetre shows nothing; 0.002 to 0.01 are lengths in metres.
void refuse_metres(const JsonField& object, const char* key, const SampledRange& lengths_mm) {
  const double most = std::max(std::abs(lengths_mm.low), std::abs(lengths_mm.high));
  if (most == 0 || most >= 0.1) return;
  object[key].fail("is " + object[key].json().dump() +
                   ", less than a tenth of a millimetre; it is "
                   "in mm: " +
                   to_text(1000 * lengths_mm.low) + " to " + to_text(1000 * lengths_mm.high) + "?");
}

void read_pokes(const JsonField& pokes, DatasetSpec& spec) {
  pokes.allow_only({"count", "depth_mm", "radius_mm", "cone_deg", "cone_rad", "tools"});
  const Keys keys(pokes);
  constexpr double kMostPokes = 16, kDeepest_mm = 1000;
  SampledRange count{double(spec.fewest_pokes), double(spec.most_pokes)};
  keys.range("count", 0, kMostPokes, count);
  spec.fewest_pokes = static_cast<int>(count.low), spec.most_pokes = static_cast<int>(count.high);
  if (spec.fewest_pokes != count.low || spec.most_pokes != count.high)
    pokes["count"].fail("is " + pokes["count"].json().dump() + ", must be whole numbers");
  keys.range("depth_mm", -kDeepest_mm, kDeepest_mm, spec.depth_mm);
  refuse_metres(pokes, "depth_mm", spec.depth_mm);
  keys.range("radius_mm", kThinnestTip_mm, kDeepest_mm, spec.radius_mm);
  refuse_metres(pokes, "radius_mm", spec.radius_mm);
  keys.angle("cone", spec.poke_cone_rad);
  if (const auto tools = pokes.find("tools")) read_tools(*tools, spec);
}

void read_layers(const JsonField& layers, DatasetSpec& spec) {
  std::string names;
  for (std::size_t i = 0; i < layers.size(); ++i) names += (i > 0 ? "," : "") + layers.at(i).text();
  if (names.empty()) return;
  try {
    spec.layers = layers_from(names);
  } catch (const UsageError& error) {
    layers.fail(error.what());
  }
}

void read_lights(const JsonField& lights, DatasetSpec& spec) {
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const auto light = drawn_light(lights.at(i).text());
    if (!light)
      lights.at(i).fail("'" + lights.at(i).text() + "' is no light: take " + all_lights());
    spec.lights.push_back(*light);
  }
}

// The pictures have the lens's size, unless another is asked for.
void read_scope(const JsonField& scope, const std::string& name, bool size_asked,
                DatasetSpec& spec) {
  spec.lens = scope_lens_from_json(scope.json().dump(), name);
  const Intrinsics& given = spec.lens->intrinsics;
  if (!size_asked) spec.width = given.width, spec.height = given.height;
  spec.lens = spec.lens->in_size(spec.width, spec.height);
}

// In degrees, where those are read back to the bit.
void add_angle(Json& json, const std::string& name, double rad) {
  const double degrees = rad / kDegree_rad;
  for (const double exact : {degrees, std::nextafter(degrees, 0), std::nextafter(degrees, 360)})
    if (exact * kDegree_rad == rad) {
      json[name + "_deg"] = exact;
      return;
    }
  json[name + "_rad"] = rad;
}

Json range_json(const SampledRange& range) { return Json::array({range.low, range.high}); }

}  // namespace

DatasetSpec dataset_spec_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  document.require_schema(kDatasetSchema);
  document.allow_only({"schema",       "name",   "seed",       "frames",      "clip_frames",
                       "shard_frames", "size",   "layers",     "tracks",      "stereo_mm",
                       "scope",        "lens",   "test_share", "time_step_s", "views",
                       "pokes",        "lights", "gain",       "noise",       "stiffness"});
  DatasetSpec spec;
  const Keys keys(document);
  if (const auto named = document.find("name")) spec.name = named->text();
  if (const auto seed = document.find("seed"))
    spec.seed =
        static_cast<std::uint64_t>(seed->integer(0, std::numeric_limits<std::int64_t>::max()));
  spec.frames = static_cast<int>(document["frames"].integer(1, kMostFramesOfSet));
  keys.whole("clip_frames", 1, 100000, spec.clip_frames);
  keys.whole("shard_frames", 1, 100000, spec.shard_frames);
  if (spec.shard_frames < spec.clip_frames)
    (document.find("shard_frames") ? document["shard_frames"] : document["clip_frames"])
        .fail("shard_frames " + std::to_string(spec.shard_frames) + " is less than clip_frames " +
              std::to_string(spec.clip_frames) + "; a shard holds whole clips");
  if (const auto size = document.find("size")) {
    if (size->size() != 2) size->fail("must hold two numbers, width and height");
    spec.width = static_cast<int>(size->at(0).integer(1, kLargestSide_px));
    spec.height = static_cast<int>(size->at(1).integer(1, kLargestSide_px));
  }
  // "lens" is what scope was called once.
  if (document.find("scope") && document.find("lens"))
    document["lens"].fail("is another name of scope: write one of them");
  for (const char* const key : {"scope", "lens"})
    if (const auto scope = document.find(key))
      read_scope(*scope, name + ": /" + key, document.find("size").has_value(), spec);
  if (const auto layers = document.find("layers")) read_layers(*layers, spec);
  keys.whole("tracks", 0, 100000, spec.tracks);
  if (const auto stereo = document.find("stereo_mm"))
    spec.baseline_mm = stereo->number(kNarrowestBaseline_mm, kWidestBaseline_mm);
  keys.number("test_share", 0, 1, spec.test_share);
  keys.number("time_step_s", 1e-5, 0.1, spec.time_step_s);
  if (const auto views = document.find("views")) read_views(*views, spec);
  if (const auto pokes = document.find("pokes")) read_pokes(*pokes, spec);
  if (const auto lights = document.find("lights")) read_lights(*lights, spec);
  keys.range("gain", 0.01, 100, spec.gain);
  keys.range("noise", 0, 255, spec.noise);
  keys.range("stiffness", DeformOptions::kSoftest, DeformOptions::kStiffest, spec.stiffness);
  return spec;
}

std::string dataset_spec_to_json(const DatasetSpec& s) {
  Json layers = Json::array(), lights = Json::array();
  const bool in[] = {s.layers.depth, s.layers.flow, s.layers.normals,
                     s.layers.mask,  s.layers.id,   s.layers.weight};
  for (std::size_t i = 0; i < layer_names().size(); ++i)
    if (in[i]) layers.push_back(layer_names()[i]);
  for (const DrawnLight light : s.lights) lights.push_back(to_string(light));
  Json views = {{"distance", range_json(s.distance)}};
  add_angle(views, "cone", s.cone_rad);
  add_angle(views, "roll", s.roll_rad);
  add_angle(views, "motion", s.motion_rad);
  Json pokes = {{"count", {s.fewest_pokes, s.most_pokes}},
                {"depth_mm", range_json(s.depth_mm)},
                {"radius_mm", range_json(s.radius_mm)}};
  add_angle(pokes, "cone", s.poke_cone_rad);
  for (const InstrumentKind& tool : s.tools) pokes["tools"].push_back(mode_of(tool));
  Json json = {{"schema", kDatasetSchema},
               {"name", s.name},
               {"seed", s.seed},
               {"frames", s.frames},
               {"clip_frames", s.clip_frames},
               {"shard_frames", s.shard_frames},
               {"size", {s.width, s.height}},
               {"layers", layers},
               {"test_share", s.test_share},
               {"time_step_s", s.time_step_s},
               {"views", views},
               {"pokes", pokes},
               {"lights", lights},
               {"gain", range_json(s.gain)},
               {"noise", range_json(s.noise)}};
  if (s.tracks > 0) json["tracks"] = s.tracks;
  if (s.stiffness.low != 1 || s.stiffness.high != 1) json["stiffness"] = range_json(s.stiffness);
  if (s.baseline_mm) json["stereo_mm"] = *s.baseline_mm;
  if (s.lens) json["lens"] = parse_json(scope_lens_to_json(*s.lens), "lens");
  return json_text(json);
}

namespace {

std::string name_of(std::filesystem::path bundle, std::size_t number) {
  bundle = bundle.lexically_normal();
  if (!bundle.has_filename()) bundle = bundle.parent_path();
  std::string name = bundle.filename().string();
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '_';
  return padded(number, 2) + "_" + name;
}

void choose_tests(const DatasetSpec& spec, std::vector<DatasetOrgan>& organs) {
  const std::size_t count = organs.size();
  if (count < 2 || spec.test_share == 0) return;
  const auto wanted = static_cast<std::size_t>(std::lround(spec.test_share * double(count)));
  const std::size_t tests = std::clamp<std::size_t>(wanted, 1, count - 1);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  RandomStream random(spec.seed, ~std::uint64_t{0});
  for (std::size_t i = count - 1; i > 0; --i) std::swap(order[i], order[random.below(i + 1)]);
  for (std::size_t i = 0; i < tests; ++i) organs[order[i]].test = true;
}

}  // namespace

DatasetPlan plan_dataset(const DatasetSpec& spec,
                         const std::vector<std::filesystem::path>& bundles) {
  DatasetPlan plan;
  for (const auto& bundle : bundles)
    plan.organs.push_back({bundle, name_of(bundle, plan.organs.size()), false});
  choose_tests(spec, plan.organs);
  const int organs = static_cast<int>(bundles.size());
  const int clips = (spec.frames + spec.clip_frames - 1) / spec.clip_frames;
  const int clips_of_shard = spec.shard_frames / spec.clip_frames;
  plan.frames = clips * spec.clip_frames;
  int before = 0;
  for (int o = 0; o < organs; ++o) {
    const int own = clips / organs + (o < clips % organs ? 1 : 0);
    for (int first = 0, shard = 0; first < own; first += clips_of_shard, ++shard) {
      const DatasetOrgan& organ = plan.organs[o];
      const int in_shard = std::min(clips_of_shard, own - first);
      plan.shards.push_back({std::size_t(o), first, in_shard,
                             std::string(organ.test ? "test/" : "train/") + organ.name + "_" +
                                 padded(std::size_t(shard), 4),
                             double(before) / clips, double(before + in_shard) / clips});
      before += in_shard;
    }
  }
  return plan;
}

}  // namespace organbake
