// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "core/text.h"
#include "volume/dicom_document.h"
#include "volume/dicom_masks.h"
#include "volume/grid.h"
#include "volume/label_names_file.h"
#include "volume/mask_labels.h"
#include "volume/region.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// In the plane: small against any CT's pixels, so that bringing the mask onto a CT costs nothing.
constexpr double kFinest_mm = 0.25, kCoarsest_mm = 1;
constexpr double kAcross = 600;  // voxels over the largest region of interest
constexpr double kSamePlane_mm = 0.01;
// Contours further apart than this many usual gaps leave a gap in the organ; one plane may be
// missing.
constexpr double kWidestGap = 2.2;

struct Contour {
  std::vector<Eigen::Vector3d> points;
};

struct ContouredRegion {
  int number = 0;
  std::string name;
  std::vector<Contour> contours;
};

// Axes of the planes that the contours lie in: columns u, v, normal.
Eigen::Matrix3d plane_axes(const std::vector<ContouredRegion>& regions) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const ContouredRegion& region : regions) {
    for (const Contour& contour : region.contours) {
      Eigen::Vector3d area = Eigen::Vector3d::Zero();
      const Eigen::Vector3d& origin = contour.points.front();
      for (std::size_t i = 1; i + 1 < contour.points.size(); ++i) {
        area += (contour.points[i] - origin).cross(contour.points[i + 1] - origin);
      }
      normal += normal.dot(area) < 0 ? Eigen::Vector3d(-area) : area;
    }
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
  const Eigen::Matrix3d turn = Eigen::Quaterniond::FromTwoVectors(own, normal).toRotationMatrix();
  axes.col(0) = turn.col((along + 1) % 3);
  axes.col(1) = turn.col((along + 2) % 3);
  axes.col(2) = normal;
  return axes;
}

std::vector<ContouredRegion> read_regions(const DicomDocument& document, const fs::path& file) {
  vtkDICOMMetaData& data = document.data();
  std::map<int, std::string> names;
  const vtkDICOMValue& listed = data.Get(DC::StructureSetROISequence);
  for (std::size_t i = 0; i < listed.GetNumberOfValues(); ++i) {
    names[listed.GetItem(i).Get(DC::ROINumber).AsInt()] =
        dicom_text(listed.GetItem(i).Get(DC::ROIName));
  }
  std::vector<ContouredRegion> regions;
  const vtkDICOMValue& drawn = data.Get(DC::ROIContourSequence);
  for (std::size_t i = 0; i < drawn.GetNumberOfValues(); ++i) {
    ContouredRegion region;
    region.number = drawn.GetItem(i).Get(DC::ReferencedROINumber).AsInt();
    region.name = names[region.number];
    const vtkDICOMValue& contours = drawn.GetItem(i).Get(DC::ContourSequence);
    for (std::size_t c = 0; c < contours.GetNumberOfValues(); ++c) {
      const vtkDICOMItem& item = contours.GetItem(c);
      if (dicom_text(item.Get(DC::ContourGeometricType)).rfind("CLOSED", 0) != 0) continue;
      const vtkDICOMValue& numbers = item.Get(DC::ContourData);
      const std::size_t count = numbers.GetNumberOfValues();
      if (count % 3 != 0) throw BadDataError(file, "a contour of " + region.name + " is cut off");
      Contour contour;
      for (std::size_t n = 0; n < count; n += 3) {
        contour.points.emplace_back(numbers.GetDouble(n), numbers.GetDouble(n + 1),
                                    numbers.GetDouble(n + 2));
        if (!contour.points.back().allFinite()) {
          throw BadDataError(file, "a contour of " + region.name + " holds no number");
        }
      }
      if (contour.points.size() > 2) region.contours.push_back(std::move(contour));
    }
    if (region.name.empty()) region.name = "region " + std::to_string(region.number);
    if (!region.contours.empty()) regions.push_back(std::move(region));
  }
  if (regions.empty()) throw BadDataError(file, "holds no closed contour");
  return regions;
}

using Polygon2 = std::vector<Eigen::Vector2d>;
using Planes = std::map<double, std::vector<Polygon2>>;  // by place along the normal

// In coordinates of the axes.
Planes planes_of(const ContouredRegion& region, const Eigen::Matrix3d& axes) {
  Planes planes;
  for (const Contour& contour : region.contours) {
    Polygon2 polygon;
    double along = 0;
    for (const Eigen::Vector3d& point : contour.points) {
      const Eigen::Vector3d local = axes.transpose() * point;
      polygon.push_back(local.head<2>());
      along += local.z();
    }
    along /= static_cast<double>(contour.points.size());
    auto plane = planes.lower_bound(along - kSamePlane_mm);
    if (plane == planes.end() || plane->first > along + kSamePlane_mm) {
      plane = planes.emplace(along, std::vector<Polygon2>()).first;
    }
    plane->second.push_back(std::move(polygon));
  }
  return planes;
}

double usual_gap(const Planes& planes) {
  std::vector<double> gaps;
  for (auto next = planes.begin(); next != planes.end() && std::next(next) != planes.end();) {
    const double from = next->first;
    gaps.push_back((++next)->first - from);
  }
  if (gaps.empty()) return 0;
  std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2),
                   gaps.end());
  return gaps[gaps.size() / 2];
}

// Pixels (mm) of a grid that takes no more memory than its contours' points are a reason for: a few
// triangles over a torso do not ask for a gigabyte.
double finest_for(std::size_t points, const Eigen::Vector2d& across_mm, double slices) {
  constexpr double kAlwaysVoxels = 1.5e7, kVoxelsPerPoint = 3000;
  const double most = kAlwaysVoxels + kVoxelsPerPoint * static_cast<double>(points);
  return std::sqrt(across_mm.prod() * (slices + 1) / most);
}

// The region that is wanted, or all of them, on a grid of the planes of the one with most.
Volume grid_for(const std::vector<Planes>& wanted, const Eigen::Matrix3d& axes,
                const std::string& name) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(HUGE_VAL), high = -low;
  double gap = HUGE_VAL;
  std::size_t plane_count = 0, point_count = 0;
  for (const Planes& planes : wanted) {
    plane_count += planes.size();
    if (usual_gap(planes) > 0) gap = std::min(gap, usual_gap(planes));
    for (const auto& [along, polygons] : planes) {
      for (const Polygon2& polygon : polygons) {
        point_count += polygon.size();
        for (const Eigen::Vector2d& p : polygon) {
          low = low.cwiseMin(Eigen::Vector3d(p.x(), p.y(), along));
          high = high.cwiseMax(Eigen::Vector3d(p.x(), p.y(), along));
        }
      }
    }
  }
  if (!std::isfinite(gap)) gap = 1;  // one plane: as thick as that
  // Where one pair of planes lies close together and all others far apart, the gaps are wrong. Two
  // lumps of one region may well lie a torso apart.
  constexpr double kMostSlicesPerPlane = 8, kAlwaysFit = 1000;
  const double slices = (high.z() - low.z()) / gap;
  if (slices > kMostSlicesPerPlane * static_cast<double>(plane_count) + kAlwaysFit)
    throw BadDataError(name + ": its planes lie at too uneven gaps, of " + to_text(gap, 2) +
                       " mm and more");
  const Eigen::Vector2d across = (high - low).head<2>();
  const double fine = std::max(std::clamp(across.maxCoeff() / kAcross, kFinest_mm, kCoarsest_mm),
                               finest_for(point_count, across, slices));
  Volume grid;
  grid.spacing_mm = {fine, fine, gap};
  grid.direction = axes;
  const Eigen::Vector3d margin(2 * fine, 2 * fine, 0);
  const Eigen::Vector3d count =
      ((high - low + 2 * margin).cwiseQuotient(grid.spacing_mm).array() + 1.5).floor();
  checked_grid_size(count, name);
  for (int axis = 0; axis < 3; ++axis) grid.size[axis] = static_cast<int>(count[axis]);
  grid.origin_mm = axes * (low - margin);
  return grid;
}

// Where a row crosses the polygons' edges, in increasing order; inside lies between odd and even.
std::vector<double> crossings(const std::vector<Polygon2>& polygons, double y) {
  std::vector<double> at;
  for (const Polygon2& polygon : polygons) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      if ((a.y() <= y) == (b.y() <= y)) continue;
      at.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
  }
  std::sort(at.begin(), at.end());
  return at;
}

// The contours of the nearest plane, unless the region has a gap there.
const std::vector<Polygon2>* polygons_at(const Planes& planes, double along, double usual_mm) {
  constexpr double kHalf = 0.51;  // with the positions' rounding
  const auto above = planes.lower_bound(along);
  const auto below = above == planes.begin() ? above : std::prev(above);
  if (above == planes.end()) {
    return along - below->first <= kHalf * usual_mm ? &below->second : nullptr;
  }
  const double up = above->first - along, down = std::abs(along - below->first);
  const bool within = above->first - below->first <= kWidestGap * usual_mm;
  if (!within && std::min(up, down) > kHalf * usual_mm) return nullptr;
  return down < up ? &below->second : &above->second;
}

void fill(const Planes& planes, int label, Volume& mask) {
  const Eigen::Vector3d first = mask.direction.transpose() * mask.origin_mm;
  const double usual_mm = std::max(mask.spacing_mm.z(), usual_gap(planes));
  tbb::parallel_for(0, mask.size[2], [&](int k) {
    const auto* polygons = polygons_at(planes, first.z() + k * mask.spacing_mm.z(), usual_mm);
    if (!polygons) return;
    for (int j = 0; j < mask.size[1]; ++j) {
      std::int16_t* row = &mask.voxels[(std::size_t(k) * mask.size[1] + j) * mask.size[0]];
      const std::vector<double> at = crossings(*polygons, first.y() + j * mask.spacing_mm.y());
      for (std::size_t pair = 0; pair + 1 < at.size(); pair += 2) {
        const int begin = static_cast<int>(std::ceil((at[pair] - first.x()) / mask.spacing_mm.x()));
        const int end =
            static_cast<int>(std::ceil((at[pair + 1] - first.x()) / mask.spacing_mm.x()));
        for (int i = std::max(begin, 0); i < std::min(end, mask.size[0]); ++i) {
          row[i] = static_cast<std::int16_t>(label);
        }
      }
    }
  });
}

}  // namespace

Volume read_dicom_contours(const fs::path& file, const VolumeReadOptions& options) {
  const std::vector<ContouredRegion> regions = read_regions(DicomDocument(file), file);
  const Eigen::Matrix3d axes = plane_axes(regions);
  std::vector<LabelName> names;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    names.push_back({regions[i].number, regions[i].name, static_cast<int>(i)});
  }
  std::vector<bool> chosen(regions.size(), options.label.empty());
  if (!options.label.empty()) {
    for (const ChosenLabel& one : chosen_labels(options.label, names, file.string())) {
      if (one.layer == 0 && one.label != names.front().label) {
        throw BadDataError(file, "the mask has no " + one.name + "; it holds " + label_list(names));
      }
      chosen[static_cast<std::size_t>(one.layer)] = true;
    }
  }
  std::vector<Planes> planes;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    planes.push_back(chosen[i] ? planes_of(regions[i], axes) : Planes());
  }
  std::vector<Planes> wanted;
  for (const Planes& one : planes) {
    if (!one.empty()) wanted.push_back(one);
  }
  Volume grid = grid_for(wanted, axes, file.string());
  grid.label_names = names;
  Volume mask = read_layers(
      static_cast<std::int64_t>(names.size()), options, file.string(), names, [&](std::int64_t i) {
        const auto layer = static_cast<std::size_t>(i);
        Volume one = grid;
        one.voxels.assign(std::size_t(grid.size[0]) * grid.size[1] * grid.size[2], 0);
        fill(planes[layer], names[layer].label, one);
        return one;
      });
  if (!options.region) return mask;
  const IndexBox box = voxels_of_region(mask, *options.region, file.string());
  return cropped(std::move(mask), box);
}

}  // namespace organbake
