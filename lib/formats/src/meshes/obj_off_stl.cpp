// SPDX-License-Identifier: GPL-3.0-or-later
// Wavefront OBJ, OFF (Geomview's, as CGAL and MeshLab write it) and STL (text and binary): from the
// bytes of a file to its triangles, with every fault named by its line.
#include "meshes/mesh_readers.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

// Lines and words of a text mesh file, whatever its line ends; a byte-order mark is skipped.
class TextScanner {
 public:
  // `name` is put before each error. The text must outlive the scanner.
  TextScanner(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
  }

  // Goes to the next line with words, without what follows `comment`; false at the end.
  bool next_line(char comment = '#') {
    constexpr std::string_view kBlank = " \t\f\v";
    words_.clear();
    while (words_.empty()) {
      if (rest_.empty()) return false;
      const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
      std::string_view line = rest_.substr(0, end);
      line = line.substr(0, line.find(comment));
      const bool both = rest_.substr(end).starts_with("\r\n");
      rest_.remove_prefix(std::min(end + (both ? 2 : 1), rest_.size()));
      ++line_;
      for (std::size_t at = 0; (at = line.find_first_not_of(kBlank, at)) != line.npos;) {
        const std::size_t word_end = std::min(line.find_first_of(kBlank, at), line.size());
        words_.push_back(line.substr(at, word_end - at));
        at = word_end;
      }
    }
    return true;
  }

  const std::vector<std::string_view>& words() const { return words_; }

  // The number that word `at` of the line is. Throws BadDataError with the line's number.
  double number(std::size_t at) const {
    if (at >= words_.size()) fail("a number is missing");
    std::string_view word = words_[at];
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto value = number_in<double>(word);
    if (!value) fail("\"" + std::string(word.substr(0, 40)) + "\" is not a number");
    return *value;
  }
  Eigen::Vector3d vector(std::size_t at) const {  // of three words
    return {number(at), number(at + 1), number(at + 2)};
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw BadDataError(name_ + ": line " + std::to_string(line_) + ": " + message);
  }

 private:
  std::string_view rest_;
  std::string name_;
  std::size_t line_ = 0;
  std::vector<std::string_view> words_;
};

std::string joined_lines(std::string_view text) {
  std::string joined(text);
  for (std::size_t at = joined.find('\\'); at != std::string::npos;
       at = joined.find('\\', at + 1)) {
    std::size_t end = at + 1;
    if (end < joined.size() && joined[end] == '\r') ++end;
    if (end >= joined.size() || joined[end] != '\n') continue;
    for (std::size_t i = at; i <= end; ++i) joined[i] = ' ';
  }
  return joined;
}

// The first index of 7, 7/1, 7//2 or 7/1/2, from 0; negative ones count back from the last vertex.
std::uint32_t vertex_of(const TextScanner& line, std::size_t word, std::size_t vertex_count) {
  const std::string_view text = line.words()[word].substr(0, line.words()[word].find('/'));
  const auto index = number_in<long long>(text);
  if (!index || *index == 0)
    line.fail("\"" + std::string(line.words()[word].substr(0, 40)) + "\" names no vertex");
  const long long at = *index > 0 ? *index - 1 : static_cast<long long>(vertex_count) + *index;
  if (at < 0 || at > 0xFFFFFFFELL)
    line.fail("vertex " + std::to_string(*index) + " does not exist");
  return static_cast<std::uint32_t>(at);
}

std::size_t whole(const TextScanner& line, std::size_t word, double most) {
  const double value = line.number(word);
  if (!(value >= 0 && value <= most) || value != static_cast<double>(std::size_t(value)))
    line.fail("\"" + std::string(line.words()[word]) + "\" is not a count or index in range");
  return static_cast<std::size_t>(value);
}

static_assert(std::endian::native == std::endian::little, "binary STL is read as memory lies");

constexpr std::size_t kHeader = 84, kTriangle = 50, kNormal = 12;

void append(TriangleMesh& mesh, const Eigen::Vector3d& corner) {
  mesh.vertices.push_back(corner);
  if (mesh.vertices.size() % 3 != 0) return;
  const auto end = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.faces.push_back({end - 3, end - 2, end - 1});
}

// The triangles that a binary file says to hold.
std::uint64_t claimed(std::string_view bytes) {
  return bytes.size() >= kHeader ? whole_at(bytes, kHeader - 4, 4, false) : 0;
}

// Binary files may begin with "solid" as well: the text must have a facet, too.
bool is_text(std::string_view bytes, const std::string& name) {
  if (bytes.size() >= kHeader && bytes.size() == kHeader + kTriangle * claimed(bytes)) return false;
  TextScanner line(bytes.substr(0, 4096), name);
  if (!line.next_line('\0') || lower_case(line.words()[0]) != "solid") return false;
  if (!line.next_line('\0')) return false;
  const std::string next = lower_case(line.words()[0]);
  return next == "facet" || next == "endsolid";
}

TriangleMesh from_text(std::string_view bytes, const std::string& name) {
  TextScanner line(bytes, name);
  TriangleMesh mesh;
  std::size_t loop_begin = 0;
  bool ended = false;
  while (line.next_line('\0')) {
    const std::string word = lower_case(line.words()[0]);
    ended = word == "endsolid";
    if (word == "facet") loop_begin = mesh.vertices.size();
    if (word == "vertex") append(mesh, line.vector(1));
    if (word == "endloop" && mesh.vertices.size() != loop_begin + 3)
      line.fail("a facet has not three vertices");
  }
  if (!ended) line.fail("the text ends without \"endsolid\": truncated");
  return mesh;
}

TriangleMesh from_binary(std::string_view bytes, const std::string& name) {
  const std::uint64_t faces = claimed(bytes);
  if (bytes.size() < kHeader + kTriangle * faces || faces == 0)
    throw BadDataError(name + ": claims " + std::to_string(faces) + " triangles but holds " +
                       std::to_string(bytes.size()) + " bytes: truncated or not an STL");
  TriangleMesh mesh;
  for (std::uint64_t f = 0; f < faces; ++f) {
    float corners[9];
    std::memcpy(corners, bytes.data() + kHeader + kTriangle * f + kNormal, sizeof(corners));
    for (int c = 0; c < 3; ++c) append(mesh, Eigen::Vector3f(corners + 3 * c).cast<double>());
  }
  return mesh;
}

}  // namespace

TriangleMesh parse_obj(std::string_view text, const std::string& name) {
  const std::string joined = joined_lines(text);
  TextScanner line(joined, name);
  TriangleMesh mesh;
  std::vector<Eigen::Vector3d> colors;
  std::vector<std::uint32_t> corners;
  std::vector<std::size_t> ends;
  while (line.next_line()) {
    const auto& words = line.words();
    if (words[0] == "v") {
      mesh.vertices.push_back(line.vector(1));
      if (words.size() >= 7) colors.push_back(line.vector(4));
    } else if (words[0] == "f") {
      for (std::size_t w = 1; w < words.size(); ++w)
        corners.push_back(vertex_of(line, w, mesh.vertices.size()));
      ends.push_back(corners.size());
    }
  }
  std::size_t begin = 0;
  for (const std::size_t end : ends) {
    cut_polygon(mesh.vertices, std::span(corners).subspan(begin, end - begin), mesh.faces);
    begin = end;
  }
  if (colors.size() == mesh.vertices.size())
    mesh.colors = linear_colors(colors, ColorScale::number);
  return mesh;
}

TriangleMesh parse_off(std::string_view text, const std::string& name) {
  TextScanner line(text, name);
  if (!line.next_line()) line.fail("is empty");
  const std::string kind(line.words()[0]);
  if (!kind.ends_with("OFF")) line.fail("is not an OFF file");
  if (kind.find('4') != std::string::npos || kind.find('n') != std::string::npos)
    line.fail("points of " + kind + " are not of three dimensions");
  if (line.words().size() > 1 && line.words()[1] == "BINARY")
    line.fail("binary OFF is not read; save it as text");
  std::size_t first = 1;  // the counts may stand beside the keyword
  if (line.words().size() < 3) {
    first = 0;
    if (!line.next_line()) line.fail("ends before its counts");
  }
  // Every row takes bytes, so a count beyond the file's size is a lie.
  const auto most = static_cast<double>(text.size());
  const std::size_t vertices = whole(line, first, most), faces = whole(line, first + 1, most);
  const bool has_normals = kind.find('N') != std::string::npos;
  const bool has_colors = kind.find('C') != std::string::npos;
  const std::size_t color_at = has_normals ? 6 : 3;

  TriangleMesh mesh;
  std::vector<Eigen::Vector3d> colors;
  for (std::size_t v = 0; v < vertices; ++v) {
    if (!line.next_line()) line.fail("ends after " + std::to_string(v) + " vertices");
    mesh.vertices.push_back(line.vector(0));
    if (has_colors) colors.push_back(line.vector(color_at));
  }
  for (std::size_t f = 0; f < faces; ++f) {
    if (!line.next_line()) line.fail("ends after " + std::to_string(f) + " faces");
    const std::size_t count = whole(line, 0, most);
    std::vector<std::uint32_t> polygon;
    for (std::size_t c = 1; c <= count; ++c)
      polygon.push_back(static_cast<std::uint32_t>(whole(line, c, double(vertices) - 1)));
    cut_polygon(mesh.vertices, polygon, mesh.faces);
  }
  mesh.colors = linear_colors(colors, ColorScale::number);
  return mesh;
}

TriangleMesh parse_stl(std::string_view bytes, const std::string& name) {
  return is_text(bytes, name) ? from_text(bytes, name) : from_binary(bytes, name);
}

}  // namespace organbake
