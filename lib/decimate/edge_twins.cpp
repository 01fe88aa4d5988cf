// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimate/edge_twins.h"

namespace organbake {
namespace {

// Half-edges by the vertex they leave.
struct Departures {
  std::vector<std::uint32_t> start, half_edges;

  Departures(const std::vector<Face>& faces, std::size_t vertices)
      : start(vertices + 1, 0), half_edges(3 * faces.size()) {
    for (const Face& f : faces) {
      for (const std::uint32_t v : f) ++start[v + 1];
    }
    for (std::size_t v = 0; v < vertices; ++v) start[v + 1] += start[v];
    std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
      for (std::uint32_t c = 0; c < 3; ++c) half_edges[next[faces[f][c]]++] = 3 * f + c;
    }
  }
};

std::uint32_t target(const std::vector<Face>& faces, std::uint32_t h) {
  return faces[h / 3][next_in_face(h) % 3];
}

// Half-edges from v to `to`: how many, and the last of them.
struct Found {
  int count = 0;
  std::uint32_t half_edge = kNoTwin;
};
Found find(const std::vector<Face>& faces, const Departures& from, std::uint32_t v,
           std::uint32_t to) {
  Found found;
  for (std::uint32_t i = from.start[v]; i < from.start[v + 1]; ++i) {
    if (target(faces, from.half_edges[i]) != to) continue;
    ++found.count;
    found.half_edge = from.half_edges[i];
  }
  return found;
}

// Faces that one meets when turning about a vertex from any of its half-edges.
std::uint32_t fan_size(const std::vector<std::uint32_t>& twins, std::uint32_t h) {
  std::uint32_t count = 0, at = h;
  do {
    ++count;
    at = twins[previous_in_face(at)];
  } while (at != h && at != kNoTwin);
  if (at == h) return count;
  for (at = twins[h]; at != kNoTwin; at = twins[next_in_face(at)]) ++count;
  return count;
}

}  // namespace

std::optional<std::vector<std::uint32_t>> edge_twins(const std::vector<Face>& faces,
                                                     std::size_t vertices) {
  const Departures departures(faces, vertices);
  std::vector<std::uint32_t> twins(3 * faces.size(), kNoTwin);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    for (std::uint32_t i = departures.start[v]; i < departures.start[v + 1]; ++i) {
      const std::uint32_t h = departures.half_edges[i], to = target(faces, h);
      if (to == v || find(faces, departures, v, to).count != 1) return std::nullopt;
      const Found back = find(faces, departures, to, v);
      if (back.count > 1) return std::nullopt;
      twins[h] = back.half_edge;
    }
  }
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const std::uint32_t valence = departures.start[v + 1] - departures.start[v];
    if (valence > 0 && fan_size(twins, departures.half_edges[departures.start[v]]) != valence) {
      return std::nullopt;
    }
  }
  return twins;
}

}  // namespace organbake
