// SPDX-License-Identifier: Apache-2.0
// Writes and reads manifest.json. It lists the SHA-256 of every other file, and as its last key its
// own, taken with zeros in the place of that value, so that a change of the manifest is noticed,
// too.
#include "organbake/bundle/bundle.h"

#include <algorithm>
#include <span>
#include <string_view>

#include "organbake/bundle/json_fields.h"
#include "organbake/bundle/skin_image.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/sha256.h"

namespace organbake {
namespace {

constexpr std::size_t kSha256Digits = 64;

// A manifest may come from anywhere: a path must stay inside the bundle, whatever it says.
void check_path(const JsonField& field, const std::string& text) {
  const std::filesystem::path path(text);
  bool inside = !text.empty() && path.is_relative() && text.find('\\') == std::string::npos &&
                text.find('\0') == std::string::npos;
  for (const auto& part : path) inside = inside && part != ".." && part != "." && !part.empty();
  if (!inside) field.fail("'" + text + "' does not stay inside the bundle");
}

BundleFile file_from(const JsonField& field) {
  BundleFile file;
  file.path = field["path"].text();
  check_path(field["path"], file.path);
  file.bytes = static_cast<std::uint64_t>(field["bytes"].integer(0, std::int64_t{1} << 40));
  file.sha256 = field["sha256"].text();
  const bool hex = std::all_of(file.sha256.begin(), file.sha256.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
  });
  if (file.sha256.size() != kSha256Digits || !hex)
    field["sha256"].fail("must be 64 hexadecimal digits");
  return file;
}

// The manifest guards every other file; its last key guards the manifest: the SHA-256 of the whole
// document with zeros in the place of that very value.
constexpr std::string_view kSealKey = "manifest_sha256";

// Where the seal's digits begin; npos when the text has none.
std::size_t seal_position(const std::string& text) {
  const std::string start = "\"" + std::string(kSealKey) + "\": \"";
  const std::size_t at = text.rfind(start);
  const bool whole = at != std::string::npos && at + start.size() + kSha256Digits <= text.size();
  return whole ? at + start.size() : std::string::npos;
}

std::string seal_of(std::string text, std::size_t position) {
  text.replace(position, kSha256Digits, kSha256Digits, '0');
  return sha256_hex(std::as_bytes(std::span(text)));
}

void check_seal(const std::string& text, const JsonField& document) {
  const std::size_t position = seal_position(text);
  if (position != std::string::npos &&
      text.compare(position, kSha256Digits, seal_of(text, position)) == 0) {
    return;
  }
  document.fail("does not match its own checksum; bake the bundle anew");
}

bool has_skin(const Manifest& manifest) {
  return std::any_of(manifest.files.begin(), manifest.files.end(),
                     [](const BundleFile& file) { return file.path == kSkinFile; });
}

}  // namespace

std::string manifest_to_json(const Manifest& manifest) {
  Json inputs = Json::object(), seeds = Json::object(), files = Json::array();
  for (const auto& [role, hash] : manifest.input_hashes) inputs[role] = hash;
  for (const auto& [stage, seed] : manifest.seeds) seeds[stage] = seed;
  for (const BundleFile& file : manifest.files) {
    files.push_back({{"path", file.path}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  }
  Json json = {{"schema", has_skin(manifest) ? kSkinnedBundleSchema : kBundleSchema},
               {"name", manifest.name},
               {"generator", manifest.generator},
               {"units", {{"length", "mm"}, {"axes", "LPS"}, {"depth", "planar z"}}}};
  json["recipe"] =
      manifest.recipe_json.empty() ? Json::object() : Json::parse(manifest.recipe_json);
  json["inputs_sha256"] = inputs;
  json["seeds"] = seeds;
  json["files"] = files;
  if (!manifest.edited.empty()) json["edited"] = manifest.edited;
  json[std::string(kSealKey)] = std::string(kSha256Digits, '0');
  std::string text = json_text(json);
  const std::size_t position = seal_position(text);
  return text.replace(position, kSha256Digits, seal_of(text, position));
}

Manifest manifest_from_json(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  const JsonField document(json, name);
  document.require_schema({kBundleSchema, kSkinnedBundleSchema});
  Manifest manifest;
  manifest.name = document["name"].text();
  manifest.generator = document["generator"].text();
  manifest.recipe_json = document["recipe"].json().dump();
  const JsonField inputs = document["inputs_sha256"];
  for (const auto& [role, hash] : inputs.json().items()) {
    manifest.input_hashes.emplace_back(role, inputs[role].text());
  }
  const JsonField seeds = document["seeds"];
  for (const auto& [stage, seed] : seeds.json().items()) {
    if (!seed.is_number_unsigned()) seeds[stage].fail("must be a seed, a whole number");
    manifest.seeds.emplace_back(stage, seed.get<std::uint64_t>());
  }
  const JsonField files = document["files"];
  for (std::size_t i = 0; i < files.size(); ++i) {
    manifest.files.push_back(file_from(files.at(i)));
    if (i > 0 && manifest.files[i - 1].path >= manifest.files[i].path) {
      files.at(i).fail("files must be listed once, in byte order of their paths");
    }
  }
  if (const auto edited = document.find("edited")) {
    for (std::size_t i = 0; i < edited->size(); ++i)
      manifest.edited.push_back(edited->at(i).text());
  }
  check_seal(text, document);
  return manifest;
}

void write_manifest(const std::filesystem::path& folder, Manifest manifest) {
  manifest.files.clear();
  for (const auto& path : list_files(folder)) {
    if (path == "manifest.json") continue;
    const std::vector<std::byte> bytes = read_file(folder / path);
    manifest.files.push_back({path.generic_string(), bytes.size(), sha256_hex(bytes)});
  }
  write_file_atomically(folder / "manifest.json", manifest_to_json(manifest));
}

}  // namespace organbake
