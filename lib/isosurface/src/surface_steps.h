// SPDX-License-Identifier: GPL-3.0-or-later
// The steps from voxels to a surface, in their order: what is contoured, the contour, a level for
// it, where its crossings lie, how wide a mask is blurred, what the volume's end cuts, and which
// pieces are kept, smooth.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/isosurface/isosurface.h"
#include "organbake/volume/read_volume.h"
#include "organbake/volume/volume.h"

namespace organbake {

// What is contoured, a few slices at a time: the volume's own voxels, or a copy of those slices
// where they must differ. With `cap`, a volume that the surface would leave through its border gets
// one voxel of air around it, each the mirror image of its neighbour at the level: the crossing
// then falls half-way, on the outer side of the last voxel, so the cap is flat and the voxels keep
// their whole thickness. What is NaN is air. The values must outlive the field.
template <typename Value>
class CappedField {
 public:
  // `level` is a half-integer when the values are whole numbers.
  CappedField(std::span<const Value> values, const std::array<int, 3>& size,
              const ValueRange& range, double level, bool cap);

  const std::array<int, 3>& size() const { return size_; }
  double level() const { return level_; }
  int margin() const { return margin_; }  // voxels added on every side
  // The values of slices [first, first + count) of the field; they may lie in `copy`.
  std::span<const Value> slices(int first, int count, std::vector<Value>& copy) const;

 private:
  bool reaches_border() const;
  void fill_row(int j, int k, Value* out) const;
  Value keep_away(Value value) const;
  Value mirrored(Value value) const;

  std::span<const Value> values_;
  std::array<int, 3> volume_size_;
  std::array<int, 3> size_{};
  double level_;
  int margin_ = 0;
  Value above_ = 0, below_ = 0;  // the nearest values to the level that are allowed
  bool as_they_are_ = false;     // inside the volume no value is too near to the level
  Value air_ = 0;
  Value not_measured_ = 0;  // what stands for NaN
};

// The contour of a whole field in its index coordinates, slab by slab: what VTK needs beside its
// input (half the volume again, and three times the mesh) is only needed for one slab at a time.
// The slabs share a slice; their vertices on it are made one. Same result for any number of
// threads. slices_per_slab 0 = as many as make about 4 million voxels. Throws CancelledError
// between slabs.
template <typename Value>
TriangleMesh contour_in_slabs(const CappedField<Value>& field, const RunContext& context,
                              int slices_per_slab = 0);

struct ProposedLevel {
  double level_hu = 0;
  double low_peak_hu = 0, high_peak_hu = 0;  // the commonest values of the two classes

  std::string reason() const;  // "half-way between the peaks at −1000 and 60"
};

// Splits the histogram in two classes (Otsu 1979) and goes half-way between their peaks: where a
// voxel is half one and half the other. In a CT with air around the patient that is the skin, or
// the one organ of a phantom. Throws BadDataError when all voxels have one value.
ProposedLevel propose_level(const Volume& ct);

// The same by more than two voxels. A CT's voxel holds the mean over its own length; where an edge
// of tissue cuts one voxel of a thick slice, the straight line between two values is up to 0.09
// slices off. The sum of the voxels across the edge has no such error (the height functions of
// volume-of-fluid methods, Cummins, Francois, Kothe 2005): the values are followed outward to where
// they stop rising and falling, and the edge lies where that many voxels of the one plateau and of
// the other give the same sum; a level that is not half-way lies a share of a voxel from there.
// Where the plateaus are not reached (edges seen under a grazing angle, thin walls) the straight
// line counts. Vertices never leave their edges.
void refine_crossings(TriangleMesh& mesh, const Volume& ct, double level);

// Separable Gaussian over a grid (x fastest), kernel cut at 3 σ and normalised; σ in voxels for
// each axis, 0 = none. Beyond the grid its outermost values go on. Same result for any number of
// threads.
void gaussian_blur(std::vector<float>& values, const std::array<int, 3>& size,
                   const Eigen::Vector3d& sigma_voxels);

// Number of voxels on each side that the kernel reaches.
int gaussian_reach(double sigma_voxels);

// A face in the world on which an organ is cut: a volume's last layer of voxels, seen from outside,
// or a scan's. Its pixels lie in rows; what is cut may get a dome.
struct CutSide {
  int axis = 0;              // of the volume, where the face is its own
  bool high = false;         // the end of the axis, not its beginning
  bool flat = false;         // a mask's end that only its flatness tells
  Eigen::Vector3d first_mm;  // centre of the first pixel, on the face
  Eigen::Matrix3d axes;      // unit columns: along the columns, along the rows, outward
  Eigen::Vector2d pixel_mm;
  double step_mm = 0;  // from layer to layer of voxels
  int columns = 0, rows = 0;
  std::vector<std::uint8_t> cut;
  std::vector<double> dome_mm;  // heights over the face
  double area_mm2 = 0;
};

using InsideTest = std::function<bool(double value)>;

// The sides of a volume where voxels that are inside are the last ones.
std::vector<CutSide> cut_sides(const Volume& volume, const InsideTest& inside);

// The sides on which a label is cut: where its mask ends (unless its grid was made round it), or,
// of a mask on a `scan`, where the scan ends; and wherever its outermost layer is flat, whatever
// the scan does. `stairs` as stair_height_voxels() tells them.
std::vector<CutSide> label_cut_sides(const Volume& mask, int label, const LabelBox& box,
                                     const Eigen::Vector3d& stairs, const Volume* scan);

// Says that the organ is cut, over which area, and what was made of it. Returns the area.
double tell_cut(const std::vector<CutSide>& sides, SurfaceCap cap, const std::string& whose,
                const RunContext& context);

// Gives each side the heights of a dome, a paraboloid over the section's distance to its own edge,
// half as high as a hemisphere would be, but all of them at most a twentieth of the organ's volume.
void raise_domes(std::vector<CutSide>& sides, double organ_mm3);

// A label's box and field (1 inside, 0 outside, of the box's voxels) with the domes in them, to the
// share of each voxel.
void grow_over_domes(LabelBox& box, const Volume& grid, const std::vector<CutSide>& sides);
void fill_domes(std::vector<float>& field, LabelBox& box, const Volume& grid,
                const std::vector<CutSide>& sides);

// The volume with slices behind its cut sides, for their domes. `value` gives a voxel its value by
// how many voxels it lies below the dome (negative: above it).
Volume with_domes(const Volume& volume, const std::vector<CutSide>& sides,
                  const std::function<double(double depth)>& value);

// What becomes of the walls of cavities, the pieces of negative volume, which are no pieces of
// their own: the lungs' walls in a body can have more area than its skin. They go (unless all is
// kept), or each stays with the piece that it lies in, unless it is a mere gap. Open surfaces have
// none.
enum class Cavities { filled, kept, none };

struct ComponentFilter {
  std::size_t largest = 1;  // pieces of largest area that are kept; 0 = all
  double min_size_mm = 0;   // pieces, and cavities, whose box is nowhere longer go; 0 = none
  Cavities cavities = Cavities::filled;
};

struct KeptComponents {
  TriangleMesh mesh;
  std::size_t found = 0;
  std::size_t kept = 0;
  double left_out_share = 0;  // of the pieces' volume; of the area of open ones
};

// Keeps the connected pieces that pass the filter, in their order; the mesh is empty when none
// does.
KeptComponents keep_components(TriangleMesh mesh, const ComponentFilter& filter);

// Index coordinates → world. A left-handed grid turns the faces round so that they stay outward.
void move_to_world(TriangleMesh& mesh, const Volume& grid, const Eigen::Vector3d& first_index);

// What CT and mask surfaces share once they lie in the world: the pieces' filter.
// What is said begins with `whose`, "liver: ". Throws BadDataError when no piece is left.
Isosurface finished(TriangleMesh mesh, const IsosurfaceOptions& options, Cavities cavities,
                    const std::string& whose, const RunContext& context);

}  // namespace organbake
