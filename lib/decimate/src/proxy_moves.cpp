// SPDX-License-Identifier: GPL-3.0-or-later
// Local changes of a proxy in the order of what they gain: edge flips, and vertices taken from
// where they matter least to where they help most, as mesh optimization does (Hoppe et al. 1993),
// by the fitted energy of the patch.
#include "proxies.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "organbake/core/parallel.h"
#include "organbake/decimate/mesh_measures.h"

namespace organbake {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // lower vertex first

Edge edge_of(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

std::set<Edge> all_edges(const RefinedProxy& proxy) {
  std::set<Edge> edges;
  for (const Face& f : proxy.faces()) {
    if (f[0] == RefinedProxy::kDead) continue;
    for (int c = 0; c < 3; ++c) edges.insert(edge_of(f[c], f[(c + 1) % 3]));
  }
  return edges;
}

// Edges of the faces round the vertices that a move has fitted.
std::set<Edge> edges_near(const RefinedProxy& proxy, const std::vector<std::uint32_t>& vertices) {
  std::set<Edge> edges;
  for (const std::uint32_t v : vertices) {
    for (const std::uint32_t f : proxy.faces_round(v)) {
      const Face& face = proxy.faces()[f];
      for (int c = 0; c < 3; ++c) edges.insert(edge_of(face[c], face[(c + 1) % 3]));
    }
  }
  return edges;
}

using Propose = std::optional<ProxyMove> (RefinedProxy::*)(std::uint32_t, std::uint32_t) const;

// The gain of one kind of move at every edge where it is at least so large, kept up to date as the
// proxy changes.
class RankedMoves {
 public:
  RankedMoves(const RefinedProxy& proxy, Propose propose, double least_gain)
      : proxy_(&proxy), propose_(propose), least_gain_(least_gain) {
    rank(all_edges(proxy));
  }

  // Best first.
  const std::set<std::pair<double, Edge>>& queue() const { return queue_; }

  std::optional<ProxyTrial> trial(const Edge& edge) const {
    const auto move = (proxy_->*propose_)(edge.first, edge.second);
    if (!move) return std::nullopt;
    return proxy_->attempt(*move, least_gain_);
  }

  void drop(const Edge& edge) {
    const auto known = gain_.find(edge);
    if (known == gain_.end()) return;
    queue_.erase({-known->second, edge});
    gain_.erase(known);
  }

  // After a move that fitted these vertices.
  void update(const std::vector<std::uint32_t>& moved) {
    std::vector<Edge> gone;
    for (const auto& [edge, gain] : gain_) {
      if (!proxy_->has_edge(edge.first, edge.second)) gone.push_back(edge);
    }
    for (const Edge& edge : gone) drop(edge);
    rank(edges_near(*proxy_, moved));
  }

 private:
  void rank(const std::set<Edge>& changed) {
    const std::vector<Edge> edges(changed.begin(), changed.end());
    std::vector<std::optional<double>> gains(edges.size());
    parallel_for(std::size_t{0}, edges.size(), [&](std::size_t i) {
      if (const auto found = trial(edges[i])) gains[i] = found->gain;
    });
    for (std::size_t i = 0; i < edges.size(); ++i) {
      drop(edges[i]);
      if (!gains[i]) continue;
      gain_[edges[i]] = *gains[i];
      queue_.insert({-*gains[i], edges[i]});
    }
  }

  const RefinedProxy* proxy_;
  Propose propose_;
  double least_gain_;
  std::map<Edge, double> gain_;
  std::set<std::pair<double, Edge>> queue_;
};

// Flips every edge whose flip, its four vertices refitted, takes off energy: round by round the
// best ones that have no face in common, whose trials hold together, until there are none.
std::size_t flip_edges(RefinedProxy& proxy, std::set<Edge> waiting, const RunContext& context) {
  constexpr double kLeastGain = 3e-4;  // of the whole energy: flips that hardly matter cost time
  constexpr int kMostRounds = 16;
  const double least_gain = kLeastGain * proxy.energy();
  std::size_t flips = 0;
  for (int round = 0; round < kMostRounds && !waiting.empty(); ++round) {
    context.throw_if_cancelled();
    const std::vector<Edge> edges(waiting.begin(), waiting.end());
    std::vector<std::optional<ProxyTrial>> trials(edges.size());
    parallel_for(std::size_t{0}, edges.size(), [&](std::size_t i) {
      const auto move = proxy.flip(edges[i].first, edges[i].second);
      if (move) trials[i] = proxy.attempt(*move, least_gain);
    });
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < edges.size(); ++i)
      if (trials[i]) order.push_back(i);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t one, std::size_t other) {
      return trials[one]->gain > trials[other]->gain;
    });
    waiting.clear();
    std::vector<char> changed(proxy.faces().size(), 0);
    for (const std::size_t i : order) {
      const ProxyTrial& trial = *trials[i];
      const auto& patch = trial.old_faces;
      if (std::any_of(patch.begin(), patch.end(), [&](auto face) { return changed[face]; })) {
        waiting.insert(edges[i]);
      } else if (proxy.make(trial)) {
        ++flips;
        for (const std::uint32_t face : patch) changed[face] = 1;
        waiting.merge(edges_near(proxy, trial.move.free));
      }
    }
  }
  return flips;
}

// Takes vertices from where they matter least to where one more helps most: an edge is split and
// another collapsed, each refitted, as long as both together take off energy. Returns the vertices
// that were fitted, for each time that it was done.
std::vector<std::vector<std::uint32_t>> relocate_vertices(RefinedProxy& proxy,
                                                          const RunContext& context) {
  constexpr double kLeastGain = 2e-3;  // of the whole energy
  constexpr std::size_t kMost = 20;
  // A collapse must not cost more than a split gains, which is more than the least.
  RankedMoves splits(proxy, &RefinedProxy::split, kLeastGain * proxy.energy());
  if (splits.queue().empty()) return {};
  RankedMoves collapses(proxy, &RefinedProxy::collapse, splits.queue().begin()->first);
  std::vector<std::vector<std::uint32_t>> made;
  int failed = 0;
  while (made.size() < kMost && failed < 8) {
    context.throw_if_cancelled();
    if (splits.queue().empty() || collapses.queue().empty()) break;
    const auto [loss, split] = *splits.queue().begin();
    const auto [cost, collapse] = *collapses.queue().begin();
    if (loss + cost > -kLeastGain * proxy.energy()) break;
    const RefinedProxy before = proxy;
    const double energy = proxy.energy();
    const auto add = splits.trial(split);
    if (!add || !proxy.make(*add)) {
      splits.drop(split);
      ++failed;
      continue;
    }
    const auto take = collapses.trial(collapse);
    if (!take || !proxy.make(*take) || proxy.energy() > (1 - kLeastGain) * energy) {
      proxy = before;
      splits.drop(split);
      ++failed;
      continue;
    }
    std::vector<std::uint32_t> moved = add->move.free;
    moved.insert(moved.end(), take->move.free.begin(), take->move.free.end());
    splits.update(moved);
    collapses.update(moved);
    made.push_back(std::move(moved));
  }
  return made;
}

}  // namespace

bool improve_by_moves(RefinedProxy& proxy, const RunContext& context) {
  std::size_t flips = flip_edges(proxy, all_edges(proxy), context);
  const auto relocated = relocate_vertices(proxy, context);
  std::set<Edge> near;
  for (const auto& fitted : relocated) near.merge(edges_near(proxy, fitted));
  flips += flip_edges(proxy, std::move(near), context);
  context.debug("fitted: " + std::to_string(relocated.size()) + " vertices relocated, " +
                std::to_string(flips) + " edges flipped");
  return flips > 0 || !relocated.empty();
}

TriangleMesh keep_apart(const TriangleMesh& before, TriangleMesh after) {
  constexpr int kHalvings = 4, kAttempts = 8;
  std::vector<std::uint32_t> bad = self_intersecting_faces(after);
  if (bad.empty()) return after;
  const std::size_t allowed = self_intersecting_faces(before).size();
  for (int attempt = 0; attempt < kAttempts && bad.size() > allowed; ++attempt) {
    std::vector<bool> draw(after.vertices.size(), false);
    for (const std::uint32_t f : bad) {
      for (const std::uint32_t v : after.faces[f]) draw[v] = true;
    }
    const double share = attempt < kHalvings ? 0.5 : 1.0;
    for (std::size_t v = 0; v < draw.size(); ++v) {
      if (draw[v]) after.vertices[v] += share * (before.vertices[v] - after.vertices[v]);
    }
    bad = self_intersecting_faces(after);
  }
  return bad.size() > allowed ? before : after;
}

}  // namespace organbake
