// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What the colours of a surface are made of: colours led on to where none is known, a photograph's
// tissue, noise and vessels.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "organbake/capture/solid_noise.h"
#include "organbake/capture/surface_color.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Carries colours over a mesh from the vertices that have one (known ≠ 0) to all others: each takes
// the mean of the neighbours nearer to a known one, then the carried colours are smoothed. Pieces
// without any known vertex take the mean of all known ones. Throws BadDataError when none is known.
void flood_colors(const TriangleMesh& mesh, const std::vector<char>& known,
                  std::vector<Eigen::Vector3f>& colors);

// The exemplar anywhere on a surface: three cells of a triangle grid on each of three planes, each
// cell from a place of its own that is hashed from the cell, blended by the squares of their
// shares, the planes by the normal (Burley 2019 has the grid, the planes as usual). The same
// colours for any threads.
class ExemplarTexture {
 public:
  explicit ExemplarTexture(Exemplar exemplar);

  // point: world mm; normal: unit. Linear.
  Eigen::Vector3f at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  const Exemplar& exemplar() const { return exemplar_; }

 private:
  // Adds one plane's blend, weight · scores, and the squares of the weights.
  void add_plane(int plane, const Eigen::Vector2d& at_mm, double weight, Eigen::Vector3f& sum,
                 double& squares) const;

  static constexpr std::size_t kQuantiles = 256;

  Eigen::Vector3f blended_at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  void match_channels();

  Exemplar exemplar_;
  double side_mm_;  // of the grid's triangles
  // Of each channel: what is blended, and what the tissue has at the same quantiles.
  std::array<std::array<float, kQuantiles + 1>, 3> blended_{}, wanted_{};
};

// Vessels on a square that repeats: trees that branch and taper, grown by space colonisation
// (Runions, Lane and Prusinkiewicz 2007, "Modeling Trees with a Space Colonization Algorithm"; of
// leaves, 2005): points that want blood pull the nearest tip a step nearer, until one reaches them.
// A vessel's width follows Murray's law: the cube of a parent's is the sum of its children's.
struct VesselTreeOptions {
  double side_mm = 64;
  double spacing_mm = 6;  // between twigs, about
  double width_mm = 0.5;  // of the widest
  int trees = 3;
  std::uint64_t seed = 1;
};

// Its picture, to look up anywhere on the plane.
class VesselTile {
 public:
  explicit VesselTile(const VesselTreeOptions& options);

  // How much of the place vessels cover, 0…1; half of a vessel's border.
  float cover(const Eigen::Vector2d& place_mm) const;

 private:
  static constexpr int kSide = 1024;
  void draw(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double from_width_mm,
            double to_width_mm);

  double pixels_per_mm_;
  std::vector<float> cover_;  // kSide², rows of y
};

// The albedo of a tissue anywhere on a surface: solid noise, so that nothing repeats and no seam
// shows, hashed per cell: the same numbers for any threads.
class TissueAlbedo {
 public:
  explicit TissueAlbedo(const TissueLook& look);

  // point: world mm; normal: unit. Linear, each channel in 0…1.
  Eigen::Vector3f at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  // The size over which it hardly changes, as SurfaceColor::detail_mm().
  double detail_mm() const { return 2 * look_.grain_mm; }

 private:
  struct Vessels {
    TissueVessels look;
    SolidNoise patches;
    std::shared_ptr<const VesselTile> tile;  // none: no vessels
  };
  static Vessels make_vessels(const TissueVessels& look, std::uint64_t seed);
  static float cover_of(const Vessels& vessels, const Eigen::Vector3d& point,
                        const Eigen::Vector3d& normal);

  TissueLook look_;
  std::array<SolidNoise, 3> mottles_;
  SolidNoise tint_, grain_, fine_grain_, bend_;
  Vessels large_, small_;
};

}  // namespace organbake
