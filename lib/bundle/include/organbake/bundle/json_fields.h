// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/geometry/camera.h"

namespace organbake {

using Json = nlohmann::ordered_json;

// Throws BadDataError naming the document, and what is wrong: line and column of text that is no
// JSON, a key that an object has twice, of which other readers silently take the last, or nesting
// deeper than any that makes sense.
Json parse_json(const std::string& text, const std::string& name);
nlohmann::json parse_sorted_json(const std::string& text, const std::string& name);
// Two-space indentation and a final newline, the form of every JSON file the project writes.
std::string json_text(const Json& json);
Json to_json(const Eigen::Vector3d& v);
Json to_json(const RigidTransform& pose);  // its rotation by rows, and translation_mm
// Width, height, fx, fy, cx, cy, and distortion_k1_k2_p1_p2_k3 where there is some, or of a fisheye
// fisheye_k1_k2_k3_k4, among other keys. Neither side may be larger than `largest_side_px`.
Json intrinsics_to_json(const Intrinsics& intrinsics);
class JsonField;
Intrinsics intrinsics_from_json(const JsonField& lens, int largest_side_px);

// One value of a document with the way that leads to it, so that every error names both:
// "cameras.json: /cameras/2/fx: needs a number > 0". Reading for the .cpp files of the runtime.
class JsonField {
 public:
  JsonField(const Json& value, std::string document)
      : value_(&value),
        document_(std::make_shared<const Document>(Document{&value, std::move(document)})) {}

  JsonField operator[](const std::string& key) const;  // throws when missing
  std::optional<JsonField> find(const std::string& key) const;
  JsonField at(std::size_t index) const;
  // Throws for a key that is none of these: a mistyped one would be as if it were not there.
  void allow_only(const std::vector<std::string_view>& keys) const;
  std::size_t size() const;  // of an array; throws for anything else

  double number(double min = -std::numeric_limits<double>::max(),
                double max = std::numeric_limits<double>::max()) const;
  // The number under a key, where there is one.
  void read(const std::string& key, double min, double max, double& value) const;
  std::int64_t integer(std::int64_t min, std::int64_t max) const;
  std::string text() const;
  Eigen::Vector3d vector3() const;
  Eigen::Matrix3d rotation() const;  // three rows; proper to 1e-6
  // The document's "schema" key must be one of these.
  void require_schema(std::initializer_list<std::string_view> any_of) const;
  void require_schema(std::string_view schema) const { require_schema({schema}); }

  [[noreturn]] void fail(const std::string& message) const;
  const Json& json() const { return *value_; }

 private:
  struct Document {
    const Json* root;
    std::string name;
  };
  JsonField(const Json& value, std::shared_ptr<const Document> document)
      : value_(&value), document_(std::move(document)) {}

  const Json* value_;
  std::shared_ptr<const Document> document_;
};

}  // namespace organbake
