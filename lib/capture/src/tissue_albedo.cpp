// SPDX-License-Identifier: GPL-3.0-or-later
// The albedo of a tissue by its look: solid noise of several sizes, with vessels at two depths
// below. The vessels' trees, grown by space colonisation (Runions, Lane and Prusinkiewicz 2007),
// lie on the planes of the axes: each place sees those of the planes that it faces. And the
// exemplar on a surface: a triangle grid of cells on three planes (Burley 2019; planes blended by
// the normal), each cell from a place of its own by a hash. Blended channels are matched to the
// tissue's quantiles.
#include "baking.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/random.h"

namespace organbake {
namespace {

using Eigen::Vector2d;

struct Twig {
  Vector2d at;       // not yet brought back onto the square
  int parent;        // −1: a root
  double cubes = 0;  // of widths, of all that it feeds
};

// From one place of the square to the nearest picture of another.
Vector2d shortest(const Vector2d& from, const Vector2d& to, double side) {
  Vector2d way = to - from;
  for (int k = 0; k < 2; ++k) way[k] -= side * std::round(way[k] / side);
  return way;
}

class Growth {
 public:
  explicit Growth(const VesselTreeOptions& options) : o_(options), random_(options.seed) {
    const auto anywhere = [&] {
      const double x = random_.uniform(0, o_.side_mm), y = random_.uniform(0, o_.side_mm);
      return Vector2d(x, y);
    };
    const double per_side = o_.side_mm / o_.spacing_mm;
    const int wanting = static_cast<int>(2.2 * per_side * per_side);
    for (int k = 0; k < wanting; ++k) hungry_.push_back(anywhere());
    for (int k = 0; k < o_.trees; ++k) twigs_.push_back({anywhere(), -1});
  }

  std::vector<Twig> grown() {
    constexpr int kMostRounds = 600;
    for (int round = 0; round < kMostRounds && !hungry_.empty() && grow(); ++round) feed();
    widen();
    return twigs_;
  }

 private:
  // Every hungry point pulls its nearest twig; those that are pulled put out a bud. Whether any
  // did.
  bool grow() {
    const double step = 0.16 * o_.spacing_mm;
    std::vector<Vector2d> pull(twigs_.size(), Vector2d::Zero());
    for (const Vector2d& point : hungry_) {
      const std::size_t nearest = nearest_twig(point);
      pull[nearest] += shortest(twigs_[nearest].at, point, o_.side_mm).normalized();
    }
    const std::size_t count = twigs_.size();
    for (std::size_t t = 0; t < count; ++t) {
      if (!(pull[t].norm() > 1e-6)) continue;
      // Vessels wind a little, and keep some of their way.
      const double turn = random_.uniform(-0.45, 0.45);
      const Vector2d toward = pull[t].normalized() + 0.5 * way_of(t);
      const Vector2d wound = toward + turn * Vector2d(-toward.y(), toward.x());
      twigs_.push_back({twigs_[t].at + step * wound.normalized(), static_cast<int>(t)});
    }
    return twigs_.size() > count;
  }
  Vector2d way_of(std::size_t twig) const {
    const int parent = twigs_[twig].parent;
    return parent < 0 ? Vector2d::Zero() : (twigs_[twig].at - twigs_[parent].at).normalized();
  }
  std::size_t nearest_twig(const Vector2d& point) const {
    std::size_t best = 0;
    double least = 1e300;
    for (std::size_t t = 0; t < twigs_.size(); ++t) {
      const double away = shortest(twigs_[t].at, point, o_.side_mm).squaredNorm();
      if (away < least) least = away, best = t;
    }
    return best;
  }
  void feed() {
    const double reached = 0.4 * o_.spacing_mm;
    std::erase_if(hungry_, [&](const Vector2d& point) {
      return shortest(twigs_[nearest_twig(point)].at, point, o_.side_mm).norm() < reached;
    });
  }
  // Children come after their parents.
  void widen() {
    for (std::size_t t = twigs_.size(); t-- > 0;) {
      Twig& twig = twigs_[t];
      twig.cubes = std::max(twig.cubes, 1.0);
      if (twig.parent >= 0) twigs_[twig.parent].cubes += twig.cubes;
    }
  }

  VesselTreeOptions o_;
  RandomStream random_;
  std::vector<Vector2d> hungry_;
  std::vector<Twig> twigs_;
};

}  // namespace

VesselTile::VesselTile(const VesselTreeOptions& options)
    : pixels_per_mm_(kSide / options.side_mm), cover_(std::size_t(kSide) * kSide, 0.0f) {
  const std::vector<Twig> twigs = Growth(options).grown();
  double most = 1;
  for (const Twig& twig : twigs) most = std::max(most, twig.cubes);
  // The least twig keeps a fifth of the width, whatever Murray's law says.
  const auto width = [&](const Twig& twig) {
    return options.width_mm * std::max(0.2, std::cbrt(twig.cubes / most));
  };
  for (const Twig& twig : twigs) {
    if (twig.parent < 0) continue;
    const Twig& parent = twigs[twig.parent];
    draw(parent.at, twig.at, std::min(width(parent), 1.3 * width(twig)), width(twig));
  }
}

// A piece of a vessel with round ends, on the square and its repetitions. Its border is as soft as
// half of a map's texel; one that is narrower covers less, as wide as that: sharp, it would fall
// into dots where texels hit it.
void VesselTile::draw(const Vector2d& from, const Vector2d& to, double from_width_mm,
                      double to_width_mm) {
  constexpr double kSoft_mm = 0.15;
  constexpr double kSoft = 0.35;  // of half a wide one's width
  const double widest = 0.5 * std::max(from_width_mm, to_width_mm);
  const double reach = (1 + kSoft) * widest + 2 / pixels_per_mm_ + 2 * kSoft_mm;
  const Vector2d low = from.cwiseMin(to).array() - reach, high = from.cwiseMax(to).array() + reach;
  const Vector2d along = to - from;
  const double length2 = std::max(along.squaredNorm(), 1e-12);
  const auto pixel = [&](double mm) { return static_cast<int>(std::floor(mm * pixels_per_mm_)); };
  for (int y = pixel(low.y()); y <= pixel(high.y()); ++y)
    for (int x = pixel(low.x()); x <= pixel(high.x()); ++x) {
      const Vector2d at = Vector2d(x + 0.5, y + 0.5) / pixels_per_mm_;
      const double share = std::clamp((at - from).dot(along) / length2, 0.0, 1.0);
      const double half = 0.5 * (from_width_mm + share * (to_width_mm - from_width_mm));
      const double away = (at - from - share * along).norm();
      const double soft = std::max({kSoft * half, 0.7 / pixels_per_mm_, kSoft_mm});
      const double drawn = std::max(half, soft);
      const auto cover =
          static_cast<float>(half / drawn * (1 - smooth_step(drawn - soft, drawn + soft, away)));
      float& kept = cover_[std::size_t(y & (kSide - 1)) * kSide + std::size_t(x & (kSide - 1))];
      kept = std::max(kept, cover);
    }
}

float VesselTile::cover(const Vector2d& place_mm) const {
  const double x = place_mm.x() * pixels_per_mm_ - 0.5, y = place_mm.y() * pixels_per_mm_ - 0.5;
  if (!(std::abs(x) < 1e9 && std::abs(y) < 1e9)) return 0;
  const double x0 = std::floor(x), y0 = std::floor(y);
  const auto at = [&](int i, int j) {
    const int column = (static_cast<int>(x0) + i) & (kSide - 1);
    const int row = (static_cast<int>(y0) + j) & (kSide - 1);
    return cover_[std::size_t(row) * kSide + std::size_t(column)];
  };
  const auto u = static_cast<float>(x - x0), v = static_cast<float>(y - y0);
  return (1 - v) * ((1 - u) * at(0, 0) + u * at(1, 0)) + v * ((1 - u) * at(0, 1) + u * at(1, 1));
}

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr std::uint64_t kSeed = 40;       // one look for all bakes
constexpr double kNoiseDeviation = 0.19;  // of SolidNoise

// The value that noise stays below on all but `share` of a surface, if it were normal.
double level_of(double share) {
  // The logistic distribution of the same deviation: within 3 % of the normal one's shares.
  const double kept = std::clamp(share, 1e-3, 1 - 1e-3);
  return kNoiseDeviation * 0.5513 * std::log((1 - kept) / kept);
}

const Vector3f kBetweenLobules(0.45f, 0.75f, 0.85f);  // what is missing of RGB amid the widest

// Pale grains on a darker ground, as lobules and fibres are, rather than dark stains: of deviation
// and mean like the noise's own.
double skewed(double grain) {
  constexpr double kSkew = 0.8, kMean = 1.377, kDeviation = 1.629;  // of exp(kSkew · grain)
  return (std::exp(kSkew * std::min(grain, 3.0)) - kMean) / (kSkew * kDeviation);
}

// 0 where two lobules meet, 1 well within one: by how much farther the second nearest of points
// lies than the nearest, one of them strewn in each unit cube (Worley 1996).
double within_lobule(const Vector3d& place) {
  constexpr double kSoft = 0.22;
  const Vector3d cube = place.array().floor();
  double least = 9, next = 9;
  for (int k = 0; k < 27; ++k) {
    const Vector3d other = cube + Vector3d(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
    const double item = other.dot(Vector3d(1, 8191, 67092481));
    RandomStream random(kSeed, static_cast<std::uint64_t>(static_cast<std::int64_t>(item)));
    Vector3d point = other;
    for (int c = 0; c < 3; ++c) point[c] += random.uniform();
    const double away = (place - point).norm();
    next = std::min(next, std::max(least, away)), least = std::min(least, away);
  }
  return smooth_step(0, kSoft, next - least);
}

}  // namespace

TissueAlbedo::TissueAlbedo(const TissueLook& look)
    : look_(look),
      mottles_{SolidNoise(kSeed, look.mottle_mm), SolidNoise(kSeed + 1, look.mottle_mm / 2.3),
               SolidNoise(kSeed + 9, look.mottle_mm / 5.3)},
      tint_(kSeed + 2, 1.7 * look.mottle_mm),
      grain_(kSeed + 3, look.grain_mm),
      fine_grain_(kSeed + 4, look.grain_mm / 1.9),
      bend_(kSeed + 5, 3),
      large_(make_vessels(look.large, kSeed + 6)),
      small_(make_vessels(look.small, kSeed + 8)) {}

TissueAlbedo::Vessels TissueAlbedo::make_vessels(const TissueVessels& look, std::uint64_t seed) {
  constexpr double kSpacings = 9;  // of a tile's side
  Vessels vessels{look, {seed + 1, 2.2 * look.spacing_mm}, nullptr};
  if (look.share > 0)
    vessels.tile =
        std::make_shared<VesselTile>(VesselTreeOptions{.side_mm = kSpacings * look.spacing_mm,
                                                       .spacing_mm = look.spacing_mm,
                                                       .width_mm = look.width_mm,
                                                       .seed = seed});
  return vessels;
}

// Between the planes of two axes vessels fade out, as where they dive.
float TissueAlbedo::cover_of(const Vessels& vessels, const Vector3d& point,
                             const Vector3d& normal) {
  if (!vessels.tile) return 0;
  const double level = level_of(vessels.look.share);
  const double shows = smooth_step(level - 0.3 * kNoiseDeviation, level + 0.5 * kNoiseDeviation,
                                   vessels.patches.value(point));
  if (!(shows > 0)) return 0;
  double sum = 0, weights = 0;
  for (int plane = 0; plane < 3; ++plane) {
    const double facing = normal[plane] * normal[plane], weight = facing * facing * facing;
    weights += weight;
    if (weight < 0.02) continue;
    sum += weight *
           vessels.tile->cover(Eigen::Vector2d(point[(plane + 1) % 3], point[(plane + 2) % 3]));
  }
  return static_cast<float>(vessels.look.cover * shows * sum / std::max(weights, 1e-6));
}

Vector3f TissueAlbedo::at(const Vector3d& point, const Vector3d& normal) const {
  constexpr double kUnit = 1 / kNoiseDeviation, kPatchy = 0.35;
  // Vessels wind: their place is bent by a noise of a few millimetres.
  const Vector3d wind = bend_.value(point) * Vector3d(1.3, -0.9, 1.1), bent = point + 1.2 * wind;
  const double tone = look_.mottle * kUnit *
                      (0.35 * mottles_[0].value(point) + 0.45 * mottles_[1].value(point) +
                       0.6 * mottles_[2].value(point));
  const double tint = kUnit * tint_.value(bent);
  // Grains stand out in patches, with smooth tissue between: by so much, of mean square 1.
  const double patchy = std::exp(kPatchy * (std::min(tint, 3.0) - kPatchy));
  const double grain = kUnit * (0.8 * grain_.value(point) + 0.4 * fine_grain_.value(point));
  const auto share = static_cast<float>(std::exp(tone));
  Vector3f color = look_.albedo * share;
  color = color.cwiseProduct(Vector3f::Ones() + static_cast<float>(tint) * look_.tint);
  color += static_cast<float>(0.5 * skewed(grain) * patchy) * look_.grain;
  if (look_.seams > 0) {  // light that comes out between lobules is redder
    const double seam = look_.seams * (1 - within_lobule((point + 2.5 * wind) / look_.mottle_mm));
    color = color.cwiseProduct(Vector3f::Ones() - static_cast<float>(seam) * kBetweenLobules);
  }
  for (const Vessels* vessels : {&small_, &large_}) {
    const float cover = cover_of(*vessels, bent, normal);
    color += cover * (vessels->look.color - color);
  }
  return color.cwiseMax(0.1f * look_.albedo).cwiseMin(1);
}

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

std::uint32_t hashed(std::int64_t i, std::int64_t j, int plane) {
  auto h = static_cast<std::uint32_t>(i) * 0x8da6b343u ^
           static_cast<std::uint32_t>(j) * 0xd8163841u ^
           static_cast<std::uint32_t>(plane + 1) * 0xcb1ab31fu;
  h = (h ^ (h >> 16)) * 0x85ebca6bu;  // MurmurHash3's finaliser
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return h ^ (h >> 16);
}

}  // namespace

// A cell's points lie up to one side from its vertex.
ExemplarTexture::ExemplarTexture(Exemplar exemplar)
    : exemplar_(std::move(exemplar)), side_mm_(exemplar_.reach_mm()) {
  match_channels();
}

// Principal components are uncorrelated, but seldom independent: what is blended of them has
// channels of a little other values than the tissue has. Their quantiles, over many points of a
// plane, tell by how much.
void ExemplarTexture::match_channels() {
  constexpr int kSide = 192;
  constexpr double kStep = 0.37;  // of a cell: 71 cells to each side, at ever other places in them
  std::vector<Vector3f> blended;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      blended.push_back(blended_at(kStep * side_mm_ * Vector3d(x, y, 0), Vector3d::UnitZ()));
  for (int c = 0; c < 3; ++c) {
    const auto quantiles = [&](const std::vector<Vector3f>& colors) {
      std::vector<float> values;
      for (const Vector3f& color : colors) values.push_back(color[c]);
      std::sort(values.begin(), values.end());
      std::array<float, kQuantiles + 1> found;
      for (std::size_t k = 0; k <= kQuantiles; ++k)
        found[k] = values[k * (values.size() - 1) / kQuantiles];
      return found;
    };
    blended_[c] = quantiles(blended), wanted_[c] = quantiles(exemplar_.tissue());
  }
}

void ExemplarTexture::add_plane(int plane, const Vector2d& at_mm, double weight, Vector3f& sum,
                                double& squares) const {
  // Skewed so that the triangles of the grid are halves of unit squares.
  const double v = at_mm.y() / (side_mm_ * std::sqrt(0.75)), u = at_mm.x() / side_mm_ - 0.5 * v;
  const double i = std::floor(u), j = std::floor(v), a = u - i, b = v - j;
  const bool upper = a + b > 1;
  const std::array<Vector2d, 3> corners = {upper ? Vector2d(i + 1, j + 1) : Vector2d(i, j),
                                           Vector2d(i + 1, j), Vector2d(i, j + 1)};
  const std::array<double, 3> shares = {upper ? a + b - 1 : 1 - a - b, upper ? 1 - b : a,
                                        upper ? 1 - a : b};
  double own = 0;
  for (const double share : shares) own += share * share * share * share;
  for (int k = 0; k < 3; ++k) {
    const Vector2d& corner = corners[k];
    const Vector2d vertex_mm =
        side_mm_ * Vector2d(corner.x() + 0.5 * corner.y(), std::sqrt(0.75) * corner.y());
    const std::uint32_t hash =
        hashed(static_cast<std::int64_t>(corner.x()), static_cast<std::int64_t>(corner.y()), plane);
    // Mirrored and turned by quarters: eight pieces from each place.
    Vector2d off = at_mm - vertex_mm;
    if (hash & 1u) off.x() = -off.x();
    if (hash & 2u) off.y() = -off.y();
    if (hash & 4u) std::swap(off.x(), off.y());
    const std::size_t place = (hash >> 3) % exemplar_.place_count();
    const double w = weight * shares[k] * shares[k] / std::sqrt(own);
    sum += static_cast<float>(w) * exemplar_.scores(place, off);
  }
  squares += weight * weight;
}

Vector3f ExemplarTexture::blended_at(const Vector3d& point, const Vector3d& normal) const {
  constexpr double kUnseen = 0.25;  // planes nearer to edge-on add nothing
  Vector3f sum = Vector3f::Zero();
  double squares = 0;
  for (int plane = 0; plane < 3; ++plane) {
    const double facing = std::max(0.0, std::abs(normal[plane]) - kUnseen);
    if (!(facing > 0)) continue;
    const Vector2d at_mm(point[(plane + 1) % 3], point[(plane + 2) % 3]);
    add_plane(plane, at_mm, facing * facing * facing, sum, squares);
  }
  return exemplar_.color(sum / static_cast<float>(std::sqrt(squares)));
}

Vector3f ExemplarTexture::at(const Vector3d& point, const Vector3d& normal) const {
  Vector3f color = blended_at(point, normal);
  for (int c = 0; c < 3; ++c) {
    const auto& from = blended_[c];
    const auto& to = wanted_[c];
    const auto above = std::upper_bound(from.begin() + 1, from.end() - 1, color[c]);
    const auto k = static_cast<std::size_t>(above - from.begin());
    const float width = from[k] - from[k - 1];
    const float share = width > 0 ? std::clamp((color[c] - from[k - 1]) / width, 0.0f, 1.0f) : 0.5f;
    color[c] = to[k - 1] + share * (to[k] - to[k - 1]);
  }
  return color;
}

}  // namespace organbake
