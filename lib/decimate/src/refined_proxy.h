// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fit_reference.h"
#include "fit_term.h"
#include "organbake/geometry/triangle_mesh.h"
#include "patch_fit.h"

namespace organbake {

// A local change of a proxy: faces that go, faces that come, and the vertices round them that are
// fitted anew.
struct ProxyMove {
  std::vector<std::uint32_t> removed;
  std::vector<Face> added;
  std::vector<std::uint32_t> free;
  std::vector<Eigen::Vector3d> inserted;  // new vertices, numbered on from the last there is
};

// What a move would lead to, ready to be made.
struct ProxyTrial {
  ProxyMove move;
  double gain = 0;  // energy that it takes off; negative when it adds
  std::vector<std::uint32_t> old_faces, kept_faces;  // of the patch, before; those not removed
  ProxyPatch patch;
  PatchFit fit;
};

// A proxy under local changes, with the distance energy of every face kept up to date. Vertices and
// faces keep their numbers; dead ones are dropped by mesh(). Proxy and reference must be manifold.
class RefinedProxy {
 public:
  RefinedProxy(const TriangleMesh& proxy, const FitReference& reference, const FitNorm& norm,
               bool keep_volume);

  std::size_t face_count() const { return alive_; }
  double energy() const;
  const std::vector<Face>& faces() const { return faces_; }  // dead: all corners kDead
  const std::vector<std::uint32_t>& faces_round(std::uint32_t vertex) const {
    return around_[vertex];
  }
  bool has_edge(std::uint32_t a, std::uint32_t b) const { return adjacent(a, b); }
  static constexpr std::uint32_t kDead = 0xFFFFFFFFu;

  // Moves that keep the topology; nothing where there is none. Edge a→b as a face has it.
  std::optional<ProxyMove> flip(std::uint32_t a, std::uint32_t b) const;
  std::optional<ProxyMove> collapse(std::uint32_t a, std::uint32_t b) const;
  std::optional<ProxyMove> split(std::uint32_t a, std::uint32_t b) const;
  // A new vertex within a face.
  ProxyMove insert(std::uint32_t face, const Eigen::Vector3d& at) const;

  // Nothing when the refitted move leads to no good proxy, or to less than least_gain.
  std::optional<ProxyTrial> attempt(const ProxyMove& move, double least_gain) const;
  // False, and nothing done, when the surface would come to intersect itself.
  [[nodiscard]] bool make(const ProxyTrial& trial);

  TriangleMesh mesh() const;

 private:
  std::uint32_t opposite(std::uint32_t a, std::uint32_t b, std::uint32_t* face) const;
  bool adjacent(std::uint32_t a, std::uint32_t b) const;
  bool at_border(std::uint32_t v) const;
  ProxyPatch patch_of(const ProxyMove& move, const std::vector<std::uint32_t>& kept_faces,
                      std::vector<std::uint32_t>& global) const;
  bool intersects(const ProxyTrial& trial, const std::vector<std::uint32_t>& global) const;

  const FitReference* reference_;
  FitNorm norm_;
  bool keep_volume_;
  std::size_t alive_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Face> faces_;
  std::vector<std::vector<std::uint32_t>> around_;   // faces of each vertex
  std::vector<std::vector<std::uint32_t>> samples_;  // of each face
  std::vector<double> energy_;                       // of each face
  std::vector<double> facing_;                       // of each face, see PatchFit
  std::vector<FaceTargets> targets_;                 // of each face
};

}  // namespace organbake
