// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers of a glTF 2.0 document (Khronos' specification, 3.6): its buffers, in the .glb, in the
// text itself or in files beside it, and their views and accessors, sparse ones too. Every reach is
// held against its buffer before memory is taken.
#include "meshes/mesh_readers.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <type_traits>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

constexpr std::int64_t kMost = std::int64_t{1} << 40;

// A whole number that may be left out.
std::size_t whole(const JsonField& object, const char* key, std::size_t otherwise) {
  const auto field = object.find(key);
  return field ? static_cast<std::size_t>(field->integer(0, kMost)) : otherwise;
}

template <class Number>
double read_as(const char* at, bool normalized) {
  const double number = static_cast<double>(bytes_as<Number>(at));
  const bool shares = normalized && std::is_integral_v<Number>;
  return shares ? std::max(-1.0, number / std::numeric_limits<Number>::max()) : number;
}

ScalarType component_type(const JsonField& object) {
  static const std::map<int, ScalarType> kTypes = {
      {5120, ScalarType::int8},   {5121, ScalarType::uint8},  {5122, ScalarType::int16},
      {5123, ScalarType::uint16}, {5125, ScalarType::uint32}, {5126, ScalarType::float32}};
  const JsonField field = object["componentType"];
  const auto found = kTypes.find(static_cast<int>(field.integer(0, 1 << 16)));
  if (found == kTypes.end()) field.fail("is no type of numbers that glTF has");
  return found->second;
}

std::size_t components_of(const JsonField& accessor) {
  static const std::map<std::string, std::size_t> kComponents = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
  const JsonField field = accessor["type"];
  const auto found = kComponents.find(field.text());
  if (found == kComponents.end()) field.fail("must be SCALAR, VEC2, VEC3, VEC4 or MAT4");
  return found->second;
}

// "%20" → " ".
std::string unescaped(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const auto hex = [](char c) {
      return c >= '0' && c <= '9'                 ? c - '0'
             : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10
                                                  : -1;
    };
    if (uri[i] == '%' && i + 2 < uri.size() && hex(uri[i + 1]) >= 0 && hex(uri[i + 2]) >= 0) {
      text += static_cast<char>(16 * hex(uri[i + 1]) + hex(uri[i + 2]));
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

}  // namespace

GltfDocument::GltfDocument(const std::filesystem::path& path) : path_(path) {
  const std::string bytes = read_text_file(path, std::size_t{1} << 34);
  total_bytes_ = bytes.size();
  open(bytes);
  read_buffers();
}

// A .glb has a header and chunks (glTF 2.0, 4.4); anything else is the document itself.
void GltfDocument::open(const std::string& bytes) {
  constexpr std::size_t kHeader = 12, kChunkHead = 8;
  constexpr std::uint32_t kJson = 0x4E4F534A, kBinary = 0x004E4942;
  if (!bytes.starts_with("glTF")) {
    json_ = parse_json(bytes, path_.string());
    return;
  }
  if (bytes.size() < kHeader + kChunkHead || whole_at(bytes, 4, 4, false) != 2)
    throw BadDataError(path_, "is no glTF of version 2");
  std::optional<std::string> text;
  for (std::size_t at = kHeader; at + kChunkHead <= bytes.size();) {
    const std::size_t length = whole_at(bytes, at, 4, false);
    const std::uint32_t kind = whole_at(bytes, at + 4, 4, false);
    at += kChunkHead;
    if (length > bytes.size() - at) throw BadDataError(path_, "truncated: a chunk is cut off");
    if (kind == kJson && !text) text = bytes.substr(at, length);
    if (kind == kBinary && binary_.empty()) binary_ = bytes.substr(at, length);
    at += length;
  }
  if (!text) throw BadDataError(path_, "is a .glb without a document in it");
  json_ = parse_json(*text, path_.string());
}

void GltfDocument::read_buffers() {
  const auto list = root().find("buffers");
  if (!list) return;
  constexpr std::size_t kMostBuffers = 1000;
  if (list->size() > kMostBuffers) list->fail("are more than a thousand");
  for (std::size_t i = 0; i < list->size(); ++i) {
    const JsonField buffer = list->at(i);
    const auto uri = buffer.find("uri");
    const std::size_t length = whole(buffer, "byteLength", 0);
    buffers_.push_back(uri ? buffer_from(uri->text(), *uri) : i == 0 ? binary_ : std::string());
    if (uri) total_bytes_ += buffers_.back().size();
    if (buffers_.back().size() < length)
      buffer["byteLength"].fail("is more than the " + std::to_string(buffers_.back().size()) +
                                " bytes that there are");
  }
}

std::string GltfDocument::buffer_from(const std::string& uri, const JsonField& field) const {
  constexpr std::string_view kBase64 = ";base64,";
  if (uri.starts_with("data:")) {
    const std::size_t mark = uri.find(kBase64);
    if (mark == uri.npos) field.fail("holds no base64");
    std::string bytes;
    for (std::string_view rest = std::string_view(uri).substr(mark + kBase64.size());
         take_base64_group(rest, bytes);) {
    }
    return bytes;
  }
  const std::filesystem::path file = unescaped(uri);
  const bool inside = file.is_relative() && !file.empty() && uri.find('\0') == uri.npos &&
                      std::find(file.begin(), file.end(), "..") == file.end();
  if (!inside) field.fail("names a file that does not lie beside or below this one");
  return read_text_file(path_.parent_path() / file, std::size_t{1} << 34);
}

void GltfDocument::read_view(const JsonField& at, std::size_t items, ScalarType type,
                             bool normalized, std::size_t components,
                             std::vector<double>& values) const {
  const JsonField view = root()["bufferViews"].at(whole(at, "bufferView", kMost));
  const JsonField which = view["buffer"];
  const auto index = static_cast<std::size_t>(which.integer(0, kMost));
  if (index >= buffers_.size()) which.fail("there is no such buffer");
  const std::string& buffer = buffers_[index];
  const std::size_t first = whole(view, "byteOffset", 0), length = whole(view, "byteLength", 0);
  if (first > buffer.size() || length > buffer.size() - first)
    view.fail("reaches beyond its buffer of " + std::to_string(buffer.size()) + " bytes");
  const std::size_t width = bytes_of(type), item = width * components;
  const std::size_t stride = whole(view, "byteStride", item), offset = whole(at, "byteOffset", 0);
  if (stride < item) view.fail("has a byteStride in which its items do not fit");
  if (items == 0) return;
  if (offset > length || items > (length - offset) / stride + 1 ||
      offset + (items - 1) * stride + item > length)
    at.fail("reaches beyond its bufferView of " + std::to_string(length) + " bytes");
  values.reserve(values.size() + items * components);
  for (std::size_t i = 0; i < items; ++i)
    for (std::size_t c = 0; c < components; ++c)
      values.push_back(with_scalar_type(type, [&](auto zero) {
        return read_as<decltype(zero)>(&buffer[first + offset + i * stride + c * width],
                                       normalized);
      }));
}

GltfNumbers GltfDocument::numbers(std::size_t index) const {
  const JsonField accessor = root()["accessors"].at(index);
  GltfNumbers found;
  found.items = static_cast<std::size_t>(accessor["count"].integer(0, kMost));
  found.components = components_of(accessor);
  const ScalarType type = component_type(accessor);
  const auto flag = accessor.find("normalized");
  const bool normalized = flag && flag->json().is_boolean() && flag->json().get<bool>();
  const auto sparse = accessor.find("sparse");
  found.written = accessor.find("bufferView") || sparse;
  if (accessor.find("bufferView")) {
    read_view(accessor, found.items, type, normalized, found.components, found.values);
  } else {  // zeros (glTF 2.0, 3.6.2.3)
    constexpr std::size_t kAlwaysFits = 10'000;
    if (found.items > std::max(kAlwaysFits, total_bytes()))
      accessor["count"].fail("is much more than the file can hold");
    found.values.resize(found.items * found.components);
  }
  if (!sparse) return found;
  // Some items in place of those above.
  const auto count = static_cast<std::size_t>((*sparse)["count"].integer(0, kMost));
  const JsonField where = (*sparse)["indices"];
  std::vector<double> places, values;
  read_view(where, count, component_type(where), false, 1, places);
  read_view((*sparse)["values"], count, type, normalized, found.components, values);
  for (std::size_t i = 0; i < count; ++i) {
    if (!(places[i] >= 0 && places[i] < static_cast<double>(found.items)))
      where.fail("names an item that there is not");
    std::copy_n(&values[i * found.components], found.components,
                &found.values[static_cast<std::size_t>(places[i]) * found.components]);
  }
  return found;
}

}  // namespace organbake
