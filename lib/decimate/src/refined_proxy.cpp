// SPDX-License-Identifier: GPL-3.0-or-later
// A proxy under local changes with its energy kept up to date face by face, so that a change costs
// what its patch costs and not what the mesh does.
#include "proxies.h"

#include <algorithm>
#include <numeric>

#include "organbake/core/parallel.h"
#include "organbake/decimate/mesh_measures.h"

namespace organbake {
namespace {

// Below it a face is a sliver; a patch that already has worse may keep what it has.
constexpr double kSliver = 0.15;
// The same for a face that looks away from the surface beneath it.
constexpr double kLeastFacing = 0.25;

bool contains(const std::vector<std::uint32_t>& sorted, std::uint32_t value) {
  return std::binary_search(sorted.begin(), sorted.end(), value);
}

int corner_of(const Face& f, std::uint32_t v) { return f[0] == v ? 0 : f[1] == v ? 1 : 2; }

}  // namespace

RefinedProxy::RefinedProxy(const TriangleMesh& proxy, const FitReference& reference,
                           const FitNorm& norm, bool keep_volume)
    : reference_(&reference),
      norm_(norm),
      keep_volume_(keep_volume && reference.closed()),
      alive_(proxy.faces.size()),
      points_(proxy.vertices),
      faces_(proxy.faces),
      around_(proxy.vertices.size()),
      samples_(proxy.faces.size()),
      energy_(proxy.faces.size()),
      facing_(proxy.faces.size()),
      targets_(proxy.faces.size()) {
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    for (const std::uint32_t v : faces_[f]) around_[v].push_back(f);
  }
  // Every sample to its nearest face; then each face by itself is a patch to measure.
  const RayScene scene(proxy);
  std::vector<std::uint32_t> owner(reference.samples().size());
  constexpr std::size_t kSamplesAtOnce = 64;
  parallel_each(std::size_t{0}, owner.size(), kSamplesAtOnce, [&](std::size_t s) {
    owner[s] = scene.closest_point(reference.samples()[s]).face;
  });
  for (std::uint32_t s = 0; s < owner.size(); ++s) samples_[owner[s]].push_back(s);
  parallel_for(std::size_t{0}, faces_.size(), [&](std::size_t f) {
    ProxyPatch patch;
    for (const std::uint32_t v : faces_[f]) patch.vertices.push_back(points_[v]);
    patch.faces = {{0, 1, 2}};
    patch.samples = samples_[f];
    PatchFit fit = measure_patch(patch, *reference_, norm_);
    energy_[f] = fit.face_energy[0];
    facing_[f] = fit.facing[0];
    targets_[f] = std::move(fit.targets[0]);
  });
}

// The third corner of the face that has the edge a→b, kDead when there is none.
std::uint32_t RefinedProxy::opposite(std::uint32_t a, std::uint32_t b, std::uint32_t* face) const {
  for (const std::uint32_t f : around_[a]) {
    const int c = corner_of(faces_[f], a);
    if (faces_[f][(c + 1) % 3] != b) continue;
    if (face) *face = f;
    return faces_[f][(c + 2) % 3];
  }
  return kDead;
}

bool RefinedProxy::adjacent(std::uint32_t a, std::uint32_t b) const {
  return opposite(a, b, nullptr) != kDead || opposite(b, a, nullptr) != kDead;
}

bool RefinedProxy::at_border(std::uint32_t v) const {
  return std::any_of(around_[v].begin(), around_[v].end(), [&](std::uint32_t f) {
    const int c = corner_of(faces_[f], v);
    return opposite(faces_[f][(c + 1) % 3], v, nullptr) == kDead ||
           opposite(v, faces_[f][(c + 2) % 3], nullptr) == kDead;
  });
}

std::optional<ProxyMove> RefinedProxy::flip(std::uint32_t a, std::uint32_t b) const {
  std::uint32_t left = 0, right = 0;
  const std::uint32_t c = opposite(a, b, &left), d = opposite(b, a, &right);
  if (c == kDead || d == kDead || adjacent(c, d)) return std::nullopt;
  // A vertex inside the surface keeps three faces at least.
  if (around_[a].size() <= 3 || around_[b].size() <= 3) return std::nullopt;
  return ProxyMove{{left, right}, {{a, d, c}, {d, b, c}}, {a, b, c, d}, {}};
}

std::optional<ProxyMove> RefinedProxy::collapse(std::uint32_t a, std::uint32_t b) const {
  if (at_border(a) || at_border(b)) return std::nullopt;
  std::vector<std::uint32_t> near_a, near_b, common;
  for (const auto& [v, near] : {std::pair(a, &near_a), std::pair(b, &near_b)}) {
    for (const std::uint32_t f : around_[v]) {
      near->push_back(faces_[f][(corner_of(faces_[f], v) + 1) % 3]);
    }
    std::sort(near->begin(), near->end());
  }
  // But for the two corners opposite the edge they must have no neighbour in common, or the surface
  // would be pinched there (the link condition).
  std::set_intersection(near_a.begin(), near_a.end(), near_b.begin(), near_b.end(),
                        std::back_inserter(common));
  if (common.size() != 2 || near_a.size() + near_b.size() <= 6) return std::nullopt;
  ProxyMove move{around_[b], {}, {a}, {}};
  for (const std::uint32_t f : around_[b]) {
    if (has_corner(faces_[f], a)) continue;
    Face face = faces_[f];
    face[corner_of(face, b)] = a;
    move.added.push_back(face);
  }
  return move;
}

std::optional<ProxyMove> RefinedProxy::split(std::uint32_t a, std::uint32_t b) const {
  std::uint32_t left = 0, right = 0;
  const std::uint32_t c = opposite(a, b, &left), d = opposite(b, a, &right);
  if (c == kDead || d == kDead) return std::nullopt;
  const auto m = static_cast<std::uint32_t>(points_.size());
  return ProxyMove{{left, right},
                   {{a, m, c}, {m, b, c}, {a, d, m}, {d, b, m}},
                   {a, b, c, d, m},
                   {reference_->closest(0.5 * (points_[a] + points_[b])).point}};
}

ProxyMove RefinedProxy::insert(std::uint32_t face, const Eigen::Vector3d& at) const {
  const auto [a, b, c] = faces_[face];
  const auto m = static_cast<std::uint32_t>(points_.size());
  return {{face}, {{a, b, m}, {b, c, m}, {c, a, m}}, {a, b, c, m}, {at}};
}

ProxyPatch RefinedProxy::patch_of(const ProxyMove& move,
                                  const std::vector<std::uint32_t>& kept_faces,
                                  std::vector<std::uint32_t>& global) const {
  ProxyPatch patch;
  global = move.free;
  patch.free = move.free.size();
  const auto local = [&](Face face) {
    for (std::uint32_t& v : face) {
      const auto found = std::find(global.begin(), global.end(), v);
      const auto index = static_cast<std::uint32_t>(found - global.begin());
      if (found == global.end()) global.push_back(v);
      v = index;
    }
    return face;
  };
  for (const std::uint32_t f : kept_faces) {
    patch.faces.push_back(local(faces_[f]));
    patch.targets.push_back(&targets_[f]);
  }
  for (const Face& face : move.added) patch.faces.push_back(local(face));
  for (const std::uint32_t v : global) {
    patch.vertices.push_back(v < points_.size() ? points_[v] : move.inserted[v - points_.size()]);
  }
  return patch;
}

std::optional<ProxyTrial> RefinedProxy::attempt(const ProxyMove& move, double least_gain) const {
  // What changes: the faces that go, and all faces round the vertices that may move.
  ProxyTrial trial;
  trial.move = move;
  trial.old_faces = move.removed;
  for (const std::uint32_t v : move.free) {
    if (v >= points_.size()) continue;
    trial.old_faces.insert(trial.old_faces.end(), around_[v].begin(), around_[v].end());
  }
  std::sort(trial.old_faces.begin(), trial.old_faces.end());
  trial.old_faces.erase(std::unique(trial.old_faces.begin(), trial.old_faces.end()),
                        trial.old_faces.end());
  std::vector<std::uint32_t> removed = move.removed;
  std::sort(removed.begin(), removed.end());

  // The patch may not become worse than it is in any respect, unless it is good enough after all.
  double energy = 0, volume = 0, quality = kSliver, facing = kLeastFacing;
  std::vector<std::uint32_t> samples;
  for (const std::uint32_t f : trial.old_faces) {
    energy += energy_[f];
    samples.insert(samples.end(), samples_[f].begin(), samples_[f].end());
    if (!contains(removed, f)) trial.kept_faces.push_back(f);
    const Eigen::Vector3d &a = points_[faces_[f][0]], &b = points_[faces_[f][1]],
                          &c = points_[faces_[f][2]];
    volume += a.dot(b.cross(c)) / 6;
    quality = std::min(quality, face_quality(a, b, c));
    facing = std::min(facing, facing_[f]);
  }
  std::vector<std::uint32_t> global;
  trial.patch = patch_of(move, trial.kept_faces, global);
  trial.patch.samples = std::move(samples);
  const PatchFitOptions options{.norm = norm_,
                                .give_up = energy - least_gain,
                                .keep_volume = keep_volume_,
                                .volume_mm3 = volume,
                                .least_quality = quality,
                                .least_facing = facing};
  trial.fit = fit_patch(trial.patch, *reference_, options);
  trial.gain = energy - trial.fit.energy;
  if (!(trial.gain >= least_gain)) return std::nullopt;
  return trial;
}

bool RefinedProxy::intersects(const ProxyTrial& trial,
                              const std::vector<std::uint32_t>& global) const {
  // The vertices are where the fit has put them; all faces that stay are in the way.
  std::vector<Eigen::Vector3d> points = points_;
  points.insert(points.end(), trial.move.inserted.begin(), trial.move.inserted.end());
  for (std::size_t i = 0; i < trial.patch.free; ++i) points[global[i]] = trial.patch.vertices[i];
  std::vector<Face> inserted, others;
  for (Face face : trial.patch.faces) {
    for (std::uint32_t& v : face) v = global[v];
    inserted.push_back(face);
  }
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    if (faces_[f][0] != kDead && !contains(trial.old_faces, f)) others.push_back(faces_[f]);
  }
  return faces_intersect(points, inserted, others);
}

bool RefinedProxy::make(const ProxyTrial& trial) {
  std::vector<std::uint32_t> global;
  patch_of(trial.move, trial.kept_faces, global);
  if (intersects(trial, global)) return false;
  for (const std::uint32_t f : trial.move.removed) {
    for (const std::uint32_t v : faces_[f]) std::erase(around_[v], f);
    faces_[f].fill(kDead);
  }
  points_.insert(points_.end(), trial.move.inserted.begin(), trial.move.inserted.end());
  around_.resize(points_.size());
  // New faces take the places of removed ones.
  std::vector<std::uint32_t> places = trial.kept_faces;
  for (std::size_t i = 0; i < trial.move.added.size(); ++i) {
    std::uint32_t f = static_cast<std::uint32_t>(faces_.size());
    if (i < trial.move.removed.size()) {
      f = trial.move.removed[i];
    } else {
      faces_.push_back({});
      samples_.emplace_back();
      targets_.emplace_back();
      facing_.push_back(1);
      energy_.push_back(0);
    }
    faces_[f] = trial.move.added[i];
    for (const std::uint32_t v : faces_[f]) around_[v].push_back(f);
    places.push_back(f);
  }
  alive_ = alive_ + trial.move.added.size() - trial.move.removed.size();
  // Samples go to other faces of the patch: all are taken away first, then given out anew.
  for (const std::uint32_t f : trial.old_faces) {
    samples_[f].clear();
    energy_[f] = 0;
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    energy_[places[i]] = trial.fit.face_energy[i];
    facing_[places[i]] = trial.fit.facing[i];
    targets_[places[i]] = trial.fit.targets[i];
  }
  for (std::size_t i = 0; i < trial.patch.samples.size(); ++i) {
    samples_[places[trial.fit.owner[i]]].push_back(trial.patch.samples[i]);
  }
  for (std::size_t i = 0; i < trial.patch.free; ++i) points_[global[i]] = trial.patch.vertices[i];
  return true;
}

double RefinedProxy::energy() const { return std::accumulate(energy_.begin(), energy_.end(), 0.0); }

TriangleMesh RefinedProxy::mesh() const {
  TriangleMesh result;
  std::vector<std::uint32_t> renumbered(points_.size(), kDead);
  for (std::uint32_t v = 0; v < points_.size(); ++v) {
    if (around_[v].empty()) continue;
    renumbered[v] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(points_[v]);
  }
  for (const Face& f : faces_) {
    if (f[0] == kDead) continue;
    result.faces.push_back({renumbered[f[0]], renumbered[f[1]], renumbered[f[2]]});
  }
  return result;
}

}  // namespace organbake
