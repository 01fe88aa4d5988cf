// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the closed contours of an RTSTRUCT (PS3.3, C.8.8.6) as a mask: what each plane's contours
// enclose is filled from half-way to the plane below to half-way to the one above, on a grid that
// is fine against any CT's pixels, or on the scan's own where a program drew round its voxels.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <ranges>

#include "dicom/dicom.h"
#include "dicom/dicom_document.h"
#include "files/volume_files.h"
#include "grid/grids.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/rigid_transform.h"
#include "organbake/volume/read_volume.h"
#include "organbake/volume/volume.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr double kSamePlane_mm = 0.01;
constexpr double kOnEdge_mm = 0.02;  // so near to a contour a voxel's centre lies on it

struct DrawnContour {
  std::vector<Eigen::Vector3d> points;
  bool even_odd = false;  // together with all others that say so (CLOSEDPLANAR_XOR)
};

// The contours of one region by the place of their plane on the normal (mm), in coordinates of the
// planes' own axes.
using ContourPlanes = std::map<double, std::vector<ContourRegion::Contour>>;

struct ContouredRegion {
  int number = 0;
  std::string name, frame_of_reference_uid;
  double slab_mm = 0;  // that a contour stands for; 0 = not told
  std::vector<DrawnContour> contours;
  ContourPlanes planes = {};
  std::vector<Slab> slabs = {};  // of each plane; none of a region that is not asked for
};

// Axes of the planes that the contours lie in: columns u, v, normal.
Eigen::Matrix3d plane_axes(const std::vector<ContouredRegion>& regions) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const ContouredRegion& region : regions)
    for (const DrawnContour& contour : region.contours) {
      Eigen::Vector3d area = Eigen::Vector3d::Zero();
      const Eigen::Vector3d& origin = contour.points.front();
      for (std::size_t i = 1; i + 1 < contour.points.size(); ++i)
        area += (contour.points[i] - origin).cross(contour.points[i + 1] - origin);
      normal += normal.dot(area) < 0 ? Eigen::Vector3d(-area) : area;
    }
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  if (normal.norm() == 0) return axes;
  normal.normalize();
  Eigen::Index along = 0;
  normal.cwiseAbs().maxCoeff(&along);
  if (normal[along] < 0) normal = -normal;
  // The patient's own axes, turned by as little as the planes are oblique.
  constexpr double kRounding = 1e-6;
  const Eigen::Vector3d own = Eigen::Vector3d::Unit(along);
  if ((normal - own).norm() < kRounding) normal = own;
  const Eigen::Matrix3d turn = rotation_between(own, normal).toRotationMatrix();
  axes.col(0) = turn.col((along + 1) % 3);
  axes.col(1) = turn.col((along + 2) % 3);
  axes.col(2) = normal;
  return axes;
}

std::vector<ContouredRegion> read_regions(const DicomDocument& document, const fs::path& file) {
  vtkDICOMMetaData& data = document.data();
  std::map<int, const vtkDICOMItem*> listed;
  const vtkDICOMValue& all = data.Get(DC::StructureSetROISequence);
  for (std::size_t i = 0; i < all.GetNumberOfValues(); ++i)
    listed[all.GetItem(i).Get(DC::ROINumber).AsInt()] = &all.GetItem(i);
  std::vector<ContouredRegion> regions;
  const vtkDICOMValue& drawn = data.Get(DC::ROIContourSequence);
  for (std::size_t i = 0; i < drawn.GetNumberOfValues(); ++i) {
    ContouredRegion region;
    region.number = drawn.GetItem(i).Get(DC::ReferencedROINumber).AsInt();
    if (const vtkDICOMItem* item = listed[region.number]) {
      region.name = dicom_text(item->Get(DC::ROIName));
      region.frame_of_reference_uid = dicom_text(item->Get(DC::ReferencedFrameOfReferenceUID));
    }
    const vtkDICOMValue& contours = drawn.GetItem(i).Get(DC::ContourSequence);
    for (std::size_t c = 0; c < contours.GetNumberOfValues(); ++c) {
      const vtkDICOMItem& item = contours.GetItem(c);
      const std::string kind = dicom_text(item.Get(DC::ContourGeometricType));
      if (kind.rfind("CLOSED", 0) != 0) continue;
      const vtkDICOMValue& slab = item.Get(DC::ContourSlabThickness);
      if (slab.IsValid() && std::isfinite(slab.AsDouble()))
        region.slab_mm = std::max(region.slab_mm, slab.AsDouble());
      const vtkDICOMValue& numbers = item.Get(DC::ContourData);
      const std::size_t count = numbers.GetNumberOfValues();
      if (count % 3 != 0) throw BadDataError(file, "a contour of " + region.name + " is cut off");
      DrawnContour contour;
      contour.even_odd = kind.find("XOR") != std::string::npos;
      for (std::size_t n = 0; n < count; n += 3) {
        contour.points.emplace_back(numbers.GetDouble(n), numbers.GetDouble(n + 1),
                                    numbers.GetDouble(n + 2));
        if (!contour.points.back().allFinite())
          throw BadDataError(file, "a contour of " + region.name + " holds no number");
      }
      if (contour.points.size() > 2) region.contours.push_back(std::move(contour));
    }
    if (region.name.empty()) region.name = "region " + std::to_string(region.number);
    if (!region.contours.empty()) regions.push_back(std::move(region));
  }
  if (regions.empty()) throw BadDataError(file, "holds no closed contour");
  return regions;
}

// The plane that lies there already, or a new one.
ContourPlanes::iterator plane_at(double along, ContourPlanes& planes) {
  const auto plane = planes.lower_bound(along - kSamePlane_mm);
  if (plane != planes.end() && plane->first <= along + kSamePlane_mm) return plane;
  return planes.emplace(along, std::vector<ContourRegion::Contour>()).first;
}

// In coordinates of the axes.
ContourPlanes planes_of(const ContouredRegion& region, const Eigen::Matrix3d& axes) {
  ContourPlanes planes;
  std::map<double, std::size_t> even_odd;  // which contour of a plane gathers them
  for (const DrawnContour& contour : region.contours) {
    Polygon2 polygon;
    double along = 0;
    for (const Eigen::Vector3d& point : contour.points) {
      const Eigen::Vector3d local = axes.transpose() * point;
      polygon.push_back(local.head<2>());
      along += local.z();
    }
    along /= static_cast<double>(contour.points.size());
    const auto plane = plane_at(along, planes);
    std::size_t which = plane->second.size();
    if (contour.even_odd) which = even_odd.emplace(plane->first, which).first->second;
    if (which == plane->second.size()) plane->second.emplace_back();
    plane->second[which].push_back(std::move(polygon));
  }
  return planes;
}

// Whether the scan's grid is that of the slices as they were taken, in which contours lie.
bool has_own_slices(const Volume& scan) {
  constexpr double kOffSlice = 0.05;
  for (const double gap : slice_gaps_mm(scan))
    if (std::abs(gap / scan.spacing_mm.z() - 1) > kOffSlice) return false;
  return scan.gantry_tilt_degrees == 0;
}

// The corner of the slice, as it was taken, that lies nearest to a point.
const Eigen::Vector3d& slice_at(const Volume& scan, const Eigen::Vector3d& point) {
  return *std::ranges::min_element(scan.slices.corners_mm, {}, [&](const Eigen::Vector3d& corner) {
    return std::abs((corner - point).dot(scan.direction.col(2)));
  });
}

// Whether every point lies in a slice of the scan, and in it at a corner of a voxel, in the middle
// of an edge or at a centre: a program drew the contours round voxels, no hand did.
bool follow_voxels(const ContouredRegion& region, const Volume& scan, bool own_slices) {
  constexpr double kRounded = 0.03;  // of a voxel: positions are decimal text
  for (const DrawnContour& contour : region.contours) {
    const Eigen::Vector3d first =
        own_slices ? scan.origin_mm : slice_at(scan, contour.points.front());
    for (const Eigen::Vector3d& point : contour.points) {
      Eigen::Vector3d index =
          (scan.direction.transpose() * (point - first)).cwiseQuotient(scan.spacing_mm);
      index.head<2>() *= 2;
      if ((index - index.array().round().matrix()).cwiseAbs().maxCoeff() > kRounded) return false;
    }
  }
  return true;
}

// For contours round voxels: the scan's grid where that is of the slices as they were taken. Where
// its reader resampled them, they are placed as frames of a segmentation are, and the contours move
// with them.
Volume grid_of_slices(std::vector<ContouredRegion>& regions, const Volume& scan, bool own_slices,
                      const std::string& name) {
  if (own_slices) {
    Volume grid;
    grid.size = scan.size;
    grid.spacing_mm = scan.spacing_mm;
    grid.origin_mm = scan.origin_mm;
    grid.direction = scan.direction;
    return grid;
  }
  std::vector<Eigen::Vector3d> corners;
  std::vector<Slab> slabs;
  std::vector<std::vector<ContourRegion::Contour>*> contours;
  for (ContouredRegion& region : regions) {
    if (region.slabs.empty()) continue;
    slabs.insert(slabs.end(), region.slabs.begin(), region.slabs.end());
    for (auto& [along, plane] : region.planes) {
      corners.push_back(slice_at(scan, along * scan.direction.col(2)));
      contours.push_back(&plane);
    }
  }
  const Eigen::Vector2d pixel_mm = scan.spacing_mm.head<2>();
  const PlacedPlanes planes = placed({scan.direction, pixel_mm, corners}, slabs,
                                     scan.slices.columns, scan.slices.rows, name);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3d from = scan.direction.transpose() * (planes.grid.origin_mm - corners[i]);
    const PlacedPlanes::Place& place = planes.places[i];
    const Eigen::Vector2d moved =
        from.head<2>() + pixel_mm.cwiseProduct(Eigen::Vector2d(place.column, place.row));
    for (ContourRegion::Contour& contour : *contours[i])
      for (Polygon2& polygon : contour)
        for (Eigen::Vector2d& point : polygon) point += moved;
  }
  return planes.grid;
}

// What the contours of each plane enclose. Says what was not simply taken as it is drawn.
std::vector<ContourRegion> enclosed(const ContouredRegion& region, Volume& mask) {
  std::vector<ContourRegion> planes;
  std::size_t holes = 0, repeated = 0;
  for (const auto& [along, contours] : region.planes) {
    planes.emplace_back(contours);
    holes += planes.back().holes();
    repeated += planes.back().repeated();
  }
  const auto tell = [&](std::size_t count, const char* one, const char* several) {
    if (count > 0)
      mask.warnings.push_back(region.name + ": " + std::to_string(count) +
                              (count == 1 ? one : several));
  };
  tell(holes, " contour lies inside another and is taken as a hole",
       " contours lie inside others and are taken as holes");
  tell(repeated, " contour is there twice and counts once",
       " contours are there twice and count once");
  return planes;
}

// The plane that stands for a place on the normal; none where the region has a gap.
std::optional<std::size_t> plane_for(const std::vector<Slab>& slabs, double along) {
  constexpr double kBorder_mm = 1e-6;  // half-way between two the upper one counts
  along += kBorder_mm;
  const auto above = std::ranges::upper_bound(slabs, along, {}, &Slab::low_mm);
  if (above == slabs.begin() || std::prev(above)->high_mm < along) return std::nullopt;
  return static_cast<std::size_t>(above - slabs.begin() - 1);
}

// Gives the voxels inside the contours of the plane that stands for them the region's number;
// `reach`: how far (mm) outside a contour a voxel's centre still belongs to it.
void fill(const ContouredRegion& region, double reach, Volume& mask) {
  const Eigen::Vector3d first = mask.direction.transpose() * mask.origin_mm;
  const Eigen::Vector3d& step = mask.spacing_mm;
  const std::vector<ContourRegion> planes = enclosed(region, mask);
  const auto column = [&](double x) {
    return std::clamp(static_cast<int>(std::ceil((x - first.x()) / step.x())), 0, mask.size[0]);
  };
  parallel_for(0, mask.size[2], [&](int k) {
    const auto plane = plane_for(region.slabs, first.z() + k * step.z());
    if (!plane) return;
    for (int j = 0; j < mask.size[1]; ++j) {
      const std::size_t row = (std::size_t(k) * mask.size[1] + j) * mask.size[0];
      for (const auto& [from, to] : planes[*plane].row(first.y() + j * step.y(), reach))
        for (int i = column(from); i < column(to); ++i)
          set_value(mask, row + std::size_t(i), region.number);
    }
  });
}

// A grid for the regions that are wanted, in voxels that are small against any CT's pixels; axes:
// columns u, v, normal.
Volume grid_of_planes(const std::vector<ContouredRegion>& regions, const Eigen::Matrix3d& axes,
                      const std::string& name) {
  // So that bringing the mask onto a CT costs nothing.
  constexpr double kFine_mm = 0.25, kCoarsest_mm = 1;
  constexpr double kAcross = 600;  // voxels over the largest region of interest
  // Finer over a lesion, whose area would be off by a few voxels of its rim.
  constexpr double kFinest_mm = 0.1, kLeastAcross = 160;
  std::vector<Slab> slabs;
  Eigen::AlignedBox2d box;
  std::size_t points = 0;
  for (const ContouredRegion& region : regions) {
    if (region.slabs.empty()) continue;
    slabs.insert(slabs.end(), region.slabs.begin(), region.slabs.end());
    for (const auto& [along, contours] : region.planes)
      for (const ContourRegion::Contour& contour : contours)
        for (const Polygon2& polygon : contour) {
          points += polygon.size();
          for (const Eigen::Vector2d& p : polygon) box.extend(p);
        }
  }
  const EvenSlices slices = slices_for(slabs, name);
  // A grid takes no more memory than its contours' points are a reason for: a few triangles over a
  // torso do not ask for a gigabyte.
  constexpr double kAlwaysVoxels = 1.5e7, kVoxelsPerPoint = 3000;
  const double most = kAlwaysVoxels + kVoxelsPerPoint * static_cast<double>(points);
  const double across = box.sizes().maxCoeff();
  constexpr double kFarthest_mm = 1e5;
  if (!(across < kFarthest_mm)) throw BadDataError(name + ": its contours reach beyond any scan");
  Volume grid;
  grid.direction = axes;
  const double finest = std::clamp(across / kLeastAcross, kFinest_mm, kFine_mm);
  double fine = std::clamp(across / kAcross, finest, kCoarsest_mm);
  Eigen::Vector3d count;
  while (true) {
    grid.spacing_mm = {fine, fine, slices.spacing_mm};
    const Eigen::Vector2d cells = ((box.sizes().array() + 4 * fine) / fine + 1.5).floor();
    count = {cells.x(), cells.y(), static_cast<double>(slices.count)};
    if (count.prod() <= most || fine > across) break;
    fine *= 1.2;
  }
  set_calculated_size(grid, count, name);
  grid.origin_mm =
      axes * Eigen::Vector3d(box.min().x() - 2 * fine, box.min().y() - 2 * fine, slices.first_mm);
  return grid;
}

// The regions that options.label asks for.
std::vector<bool> chosen_regions(const std::vector<LabelName>& names,
                                 const VolumeReadOptions& options, const fs::path& file) {
  std::vector<bool> chosen(names.size(), options.label.empty());
  if (options.label.empty()) return chosen;
  for (const LabelName& one : chosen_labels(options.label, names, file.string())) {
    if (one.layer == 0 && one.label != names.front().label)
      throw BadDataError(file, "the mask has no " + one.name + "; it holds " + label_list(names));
    chosen[static_cast<std::size_t>(one.layer)] = true;
  }
  return chosen;
}

std::vector<double> places_of(const ContourPlanes& planes) {
  const auto places = std::views::keys(planes);
  return {places.begin(), places.end()};
}

// How thick the planes of the chosen regions are. A region of few planes lies as the others of its
// file do.
void set_slabs(std::vector<ContouredRegion>& regions, const std::vector<bool>& chosen,
               const Eigen::Matrix3d& axes, const VolumeReadOptions& options,
               const std::string& name, std::vector<std::string>& warnings) {
  ContourPlanes all;
  for (ContouredRegion& region : regions) {
    region.planes = planes_of(region, axes);
    for (const auto& [along, contours] : region.planes) plane_at(along, all);
  }
  const double gap_of_file = shown_gap(places_of(all));
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (!chosen[i]) continue;
    const GapClues clues{.scan = options.scan,
                         .told_mm = regions[i].slab_mm,
                         .thickness_mm = gap_of_file,
                         .by_hand = true};
    std::vector<std::string> said;
    regions[i].slabs = slabs_of(places_of(regions[i].planes), axes.col(2), clues, name, said);
    for (const std::string& one : said) warnings.push_back(regions[i].name + ": " + one);
    warn_of_other_space(regions[i].frame_of_reference_uid, options, warnings);
  }
}

}  // namespace

Volume read_dicom_contours(const fs::path& file, const VolumeReadOptions& options) {
  const DicomDocument document(file);
  document.check();
  std::vector<ContouredRegion> regions = read_regions(document, file);
  std::vector<LabelName> names;
  for (const ContouredRegion& region : regions)
    names.push_back({region.number, region.name, static_cast<int>(names.size())});
  const std::vector<bool> chosen = chosen_regions(names, options, file);
  Eigen::Matrix3d axes = plane_axes(regions);
  constexpr double kParallel = 2e-3;
  bool by_voxels =
      options.scan && options.scan->direction.col(2).cross(axes.col(2)).norm() < kParallel;
  const bool own_slices = by_voxels && has_own_slices(*options.scan);
  for (std::size_t i = 0; i < regions.size(); ++i)
    by_voxels = by_voxels && (!chosen[i] || follow_voxels(regions[i], *options.scan, own_slices));
  if (by_voxels) axes = options.scan->direction;
  std::vector<std::string> told;
  set_slabs(regions, chosen, axes, options, file.string(), told);
  Volume grid = !by_voxels ? grid_of_planes(regions, axes, file.string())
                           : grid_of_slices(regions, *options.scan, own_slices, file.string());
  const double reach = by_voxels ? kOnEdge_mm : 0;
  grid.label_names = names;
  Volume mask = read_layers(static_cast<std::int64_t>(names.size()), options, file.string(), names,
                            [&](std::int64_t i) {
                              Volume one = grid;
                              one.voxels.assign(IndexBox::whole(grid).voxels(), 0);
                              const ContouredRegion& region = regions[static_cast<std::size_t>(i)];
                              if (region.number > std::numeric_limits<std::int16_t>::max())
                                make_real(one);
                              fill(region, reach, one);
                              told.insert(told.end(), one.warnings.begin(), one.warnings.end());
                              return one;
                            });
  mask.warnings = told;
  mask.ends_with_label = !options.region && !(by_voxels && own_slices);
  return within_region(std::move(mask), options, file.string());
}

}  // namespace organbake
