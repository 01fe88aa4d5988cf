// SPDX-License-Identifier: Apache-2.0
// Reads JSON of the runtime so that every error names the document and the way to the value.
// Numbers are checked for their range where they are read, so that no other code has to doubt them.
#include "organbake/bundle/json_fields.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {

std::string json_text(const Json& json) {
  // File names need not be UTF-8; JSON must be.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json to_json(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json to_json(const RigidTransform& pose) {
  Json rotation = Json::array();
  for (int row = 0; row < 3; ++row)
    rotation.push_back(to_json(Eigen::Vector3d(pose.rotation.row(row))));
  return {{"rotation", rotation}, {"translation_mm", to_json(pose.translation)}};
}

Json intrinsics_to_json(const Intrinsics& k) {
  Json json = {{"width", k.width}, {"height", k.height}, {"fx", k.fx},
               {"fy", k.fy},       {"cx", k.cx},         {"cy", k.cy}};
  if (k.model == LensModel::fisheye) {
    json["fisheye_k1_k2_k3_k4"] = {k.k1, k.k2, k.k3, k.k4};
  } else if (k.has_distortion()) {
    json["distortion_k1_k2_p1_p2_k3"] = {k.k1, k.k2, k.p1, k.p2, k.k3};
  }
  return json;
}

Intrinsics intrinsics_from_json(const JsonField& lens, int largest_side_px) {
  constexpr double kLeastFocal_px = 1e-6, kMost_px = 1e9;
  Intrinsics k;
  k.width = static_cast<int>(lens["width"].integer(1, largest_side_px));
  k.height = static_cast<int>(lens["height"].integer(1, largest_side_px));
  k.fx = lens["fx"].number(kLeastFocal_px, kMost_px);
  k.fy = lens["fy"].number(kLeastFocal_px, kMost_px);
  k.cx = lens["cx"].number(-kMost_px, kMost_px);
  k.cy = lens["cy"].number(-kMost_px, kMost_px);
  const auto distortion = lens.find("distortion_k1_k2_p1_p2_k3");
  if (const auto fisheye = lens.find("fisheye_k1_k2_k3_k4")) {
    if (distortion)
      fisheye->fail("stands beside distortion_k1_k2_p1_p2_k3; a lens has one of them");
    if (fisheye->size() != 4) fisheye->fail("must hold four numbers: k1, k2, k3, k4");
    k.model = LensModel::fisheye;
    double* const angles[] = {&k.k1, &k.k2, &k.k3, &k.k4};
    for (std::size_t i = 0; i < 4; ++i) *angles[i] = fisheye->at(i).number();
    return k;
  }
  if (!distortion) return k;
  if (distortion->size() != 5) distortion->fail("must hold five numbers: k1, k2, p1, p2, k3");
  double* const into[] = {&k.k1, &k.k2, &k.p1, &k.p2, &k.k3};
  for (std::size_t i = 0; i < 5; ++i) *into[i] = distortion->at(i).number();
  return k;
}

namespace {

// The way to a value within another, "" to itself; nothing when it does not lie there.
std::optional<std::string> way_to(const Json& value, const Json& from) {
  if (&value == &from) return "";
  if (!from.is_structured()) return std::nullopt;
  for (const auto& [key, inner] : from.items())
    if (const auto rest = way_to(value, inner)) return "/" + key + *rest;
  return std::nullopt;
}

}  // namespace

void JsonField::fail(const std::string& message) const {
  const std::string way = way_to(*value_, *document_->root).value_or("");
  throw BadDataError(document_->name + ": " + (way.empty() ? "/" : way) + ": " + message);
}

std::optional<JsonField> JsonField::find(const std::string& key) const {
  if (!value_->is_object()) fail("must be an object");
  const auto found = value_->find(key);
  if (found == value_->end()) return std::nullopt;
  return JsonField(*found, document_);
}

JsonField JsonField::operator[](const std::string& key) const {
  const auto found = find(key);
  if (!found) fail("has no key '" + key + "'");
  return *found;
}

void JsonField::allow_only(const std::vector<std::string_view>& keys) const {
  if (!value_->is_object()) fail("must be an object");
  for (const auto& [key, ignored] : value_->items()) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    fail("has the key '" + key + "', which means nothing here; known are " + joined(keys, ", "));
  }
}

std::size_t JsonField::size() const {
  if (!value_->is_array()) fail("must be an array");
  return value_->size();
}

JsonField JsonField::at(std::size_t index) const {
  if (index >= size()) fail("has only " + std::to_string(size()) + " entries");
  return {(*value_)[index], document_};
}

double JsonField::number(double min, double max) const {
  if (!value_->is_number()) fail("must be a number");
  const double value = value_->get<double>();
  if (!std::isfinite(value) || value < min || value > max) {
    fail("is " + to_text(value) + ", must lie in " + to_text(min) + "…" + to_text(max));
  }
  return value;
}

void JsonField::read(const std::string& key, double min, double max, double& value) const {
  if (const auto given = find(key)) value = given->number(min, max);
}

std::int64_t JsonField::integer(std::int64_t min, std::int64_t max) const {
  if (!value_->is_number_integer()) fail("must be a whole number");
  // An unsigned number beyond int64 would wrap round to a negative one.
  const bool too_large =
      value_->is_number_unsigned() &&
      value_->get<std::uint64_t>() > std::uint64_t(std::numeric_limits<std::int64_t>::max());
  const std::int64_t value = value_->get<std::int64_t>();
  if (too_large || value < min || value > max) {
    fail("is " + value_->dump() + ", must lie in " + std::to_string(min) + "…" +
         std::to_string(max));
  }
  return value;
}

std::string JsonField::text() const {
  if (!value_->is_string()) fail("must be a text");
  return value_->get<std::string>();
}

Eigen::Vector3d JsonField::vector3() const {
  if (size() != 3) fail("must hold three numbers");
  return {at(0).number(), at(1).number(), at(2).number()};
}

Eigen::Matrix3d JsonField::rotation() const {
  if (size() != 3) fail("must hold three rows");
  Eigen::Matrix3d r;
  for (int row = 0; row < 3; ++row) r.row(row) = at(row).vector3().transpose();
  const auto proper = written_rotation(r);
  if (!proper) fail("is not a proper rotation (RᵀR must be I and det R = +1)");
  return *proper;
}

void JsonField::require_schema(std::initializer_list<std::string_view> any_of) const {
  const JsonField field = (*this)["schema"];
  if (std::find(any_of.begin(), any_of.end(), field.text()) != any_of.end()) return;
  field.fail("is '" + field.text() + "'; this program reads '" + joined(any_of, "' and '") + "'");
}

// Reads a JSON text, and finds on the way what a parser would not refuse: nesting deep enough to
// exhaust the stack, and keys that an object has twice.
namespace {

// Whatever walks a document calls itself once a level: a million brackets would end the stack.
constexpr std::size_t kDeepest = 100;

template <class AnyJson>
class CheckedReader final : public nlohmann::json_sax<AnyJson> {
 public:
  explicit CheckedReader(const std::string& name) : name_(name) {}

  AnyJson read(const std::string& text) {
    AnyJson::sax_parse(text, this);
    return std::move(json_);
  }

  bool start_object(std::size_t) override { return open(AnyJson::object()); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(AnyJson::array()); }
  bool end_array() override { return close(); }
  bool key(std::string& key) override {
    const std::size_t keys = open_.back()->size();
    member_ = &(*open_.back())[key];
    if (open_.back()->size() == keys)
      throw BadDataError(name_ + ": has the key '" + key + "' twice");
    return true;
  }
  bool null() override { return add(nullptr); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(std::int64_t value) override { return add(value); }
  bool number_unsigned(std::uint64_t value) override { return add(value); }
  bool number_float(double value, const std::string&) override { return add(value); }
  bool string(std::string& value) override { return add(std::move(value)); }
  bool binary(nlohmann::json::binary_t& value) override { return add(std::move(value)); }
  bool parse_error(std::size_t, const std::string&, const Json::exception& what) override {
    // "[json.exception.parse_error.101] parse error at line 3, column 7: …": keep what a user
    // needs.
    const std::string text = what.what();
    throw BadDataError(name_ + ": " + text.substr(text.find("] ") + 2));
  }

 private:
  // Where the next value goes.
  AnyJson& place() {
    if (open_.empty()) return json_;
    return open_.back()->is_object() ? *member_ : open_.back()->emplace_back();
  }
  template <class Value>
  bool add(Value&& value) {
    place() = std::forward<Value>(value);
    return true;
  }
  bool open(AnyJson&& empty) {
    if (open_.size() == kDeepest) throw BadDataError(name_ + ": is nested too deeply");
    AnyJson& opened = place();
    opened = std::move(empty);
    open_.push_back(&opened);
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  const std::string& name_;
  AnyJson json_;
  std::vector<AnyJson*> open_;  // arrays and objects, each in the one before
  AnyJson* member_ = nullptr;   // of the last, when it is an object
};

}  // namespace

Json parse_json(const std::string& text, const std::string& name) {
  return CheckedReader<Json>(name).read(text);
}

nlohmann::json parse_sorted_json(const std::string& text, const std::string& name) {
  return CheckedReader<nlohmann::json>(name).read(text);
}

}  // namespace organbake
