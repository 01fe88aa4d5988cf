// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/error.h"
#include "core/text.h"
#include "volume/contour_region.h"
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

struct DrawnContour {
  std::vector<Eigen::Vector3d> points;
  bool even_odd = false;  // together with all others that say so (CLOSEDPLANAR_XOR)
};

struct ContouredRegion {
  int number = 0;
  std::string name;
  std::vector<DrawnContour> contours;
};

// Axes of the planes that the contours lie in: columns u, v, normal.
Eigen::Matrix3d plane_axes(const std::vector<ContouredRegion>& regions) {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const ContouredRegion& region : regions) {
    for (const DrawnContour& contour : region.contours) {
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
      const std::string kind = dicom_text(item.Get(DC::ContourGeometricType));
      if (kind.rfind("CLOSED", 0) != 0) continue;
      const vtkDICOMValue& numbers = item.Get(DC::ContourData);
      const std::size_t count = numbers.GetNumberOfValues();
      if (count % 3 != 0) throw BadDataError(file, "a contour of " + region.name + " is cut off");
      DrawnContour contour;
      contour.even_odd = kind.find("XOR") != std::string::npos;
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

using Planes = std::map<double, std::vector<ContourRegion::Contour>>;  // by place on the normal

// In coordinates of the axes.
Planes planes_of(const ContouredRegion& region, const Eigen::Matrix3d& axes) {
  Planes planes;
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
    auto plane = planes.lower_bound(along - kSamePlane_mm);
    if (plane == planes.end() || plane->first > along + kSamePlane_mm) {
      plane = planes.emplace(along, std::vector<ContourRegion::Contour>()).first;
    }
    std::size_t which = plane->second.size();
    if (contour.even_odd) which = even_odd.emplace(plane->first, which).first->second;
    if (which == plane->second.size()) plane->second.emplace_back();
    plane->second[which].push_back(std::move(polygon));
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

struct ContourBox {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(HUGE_VAL), high = -low;
  std::size_t planes = 0, points = 0;
  double gap_mm = HUGE_VAL;  // the smallest that is usual in a region

  void add(const Planes& region) {
    planes += region.size();
    if (usual_gap(region) > 0) gap_mm = std::min(gap_mm, usual_gap(region));
    for (const auto& [along, contours] : region) {
      for (const ContourRegion::Contour& contour : contours) {
        for (const Polygon2& polygon : contour) {
          points += polygon.size();
          for (const Eigen::Vector2d& p : polygon) {
            low = low.cwiseMin(Eigen::Vector3d(p.x(), p.y(), along));
            high = high.cwiseMax(Eigen::Vector3d(p.x(), p.y(), along));
          }
        }
      }
    }
  }
};

// Into how many slices of the mask a usual gap is parted, so that every plane has its own place:
// contours between the planes of the others keep theirs.
int slices_per_gap(const std::vector<Planes>& wanted, const ContourBox& box) {
  constexpr int kMost = 8;
  constexpr double kOffPlane = 0.05;  // of a slice
  for (int parts = 1; parts < kMost; ++parts) {
    bool fit = true;
    for (const Planes& planes : wanted) {
      for (const auto& [along, contours] : planes) {
        const double at = parts * (along - box.low.z()) / box.gap_mm;
        fit &= std::abs(at - std::round(at)) <= kOffPlane * parts;
      }
    }
    if (fit) return parts;
  }
  return kMost;
}

// The region that is wanted, or all of them, on a grid of the planes of the one with most.
Volume grid_for(const std::vector<Planes>& wanted, const Eigen::Matrix3d& axes,
                const std::string& name) {
  ContourBox box;
  for (const Planes& planes : wanted) box.add(planes);
  if (!std::isfinite(box.gap_mm)) box.gap_mm = 1;  // one plane: as thick as that
  // Where one pair of planes lies close together and all others far apart, the gaps are wrong. Two
  // lumps of one region may well lie a torso apart.
  constexpr double kMostSlicesPerPlane = 8, kAlwaysFit = 1000;
  const double gaps = (box.high.z() - box.low.z()) / box.gap_mm;
  if (gaps > kMostSlicesPerPlane * static_cast<double>(box.planes) + kAlwaysFit)
    throw BadDataError(name + ": its planes lie at too uneven gaps, of " + to_text(box.gap_mm, 2) +
                       " mm and more");
  const int parts = slices_per_gap(wanted, box);
  const Eigen::Vector2d across = (box.high - box.low).head<2>();
  const double fine = std::max(std::clamp(across.maxCoeff() / kAcross, kFinest_mm, kCoarsest_mm),
                               finest_for(box.points, across, gaps * parts));
  Volume grid;
  grid.spacing_mm = {fine, fine, box.gap_mm / parts};
  grid.direction = axes;
  // The outermost planes stand for half a gap on either side, like all others.
  const Eigen::Vector3d margin(2 * fine, 2 * fine, (box.gap_mm - grid.spacing_mm.z()) / 2);
  Eigen::Vector3d count =
      ((box.high - box.low + 2 * margin).cwiseQuotient(grid.spacing_mm).array() + 1.5).floor();
  checked_grid_size(count, name);
  for (int axis = 0; axis < 3; ++axis) grid.size[axis] = static_cast<int>(count[axis]);
  grid.origin_mm = axes * (box.low - margin);
  return grid;
}

// What the contours of each plane enclose, by the plane's place.
using Regions = std::map<double, ContourRegion>;

// Says what was not simply taken as it is drawn.
Regions regions_of(const Planes& planes, const std::string& name, Volume& mask) {
  Regions regions;
  std::size_t holes = 0, repeated = 0;
  for (const auto& [along, contours] : planes) {
    const ContourRegion& region = regions.emplace(along, ContourRegion(contours)).first->second;
    holes += region.holes();
    repeated += region.repeated();
  }
  const auto tell = [&](std::size_t count, const char* one, const char* several) {
    if (count == 0) return;
    mask.warnings.push_back(name + ": " + std::to_string(count) + (count == 1 ? one : several));
  };
  tell(holes, " contour lies inside another and is taken as a hole",
       " contours lie inside others and are taken as holes");
  tell(repeated, " contour is there twice and counts once",
       " contours are there twice and count once");
  return regions;
}

// The contours of the nearest plane, unless the region has a gap there.
const ContourRegion* region_at(const Regions& planes, double along, double usual_mm) {
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

void fill(const Planes& planes, const LabelName& label, Volume& mask) {
  const Eigen::Vector3d first = mask.direction.transpose() * mask.origin_mm;
  const Eigen::Vector3d& step = mask.spacing_mm;
  const double usual_mm = std::max(step.z(), usual_gap(planes));
  const Regions regions = regions_of(planes, label.name, mask);
  tbb::parallel_for(0, mask.size[2], [&](int k) {
    const ContourRegion* region = region_at(regions, first.z() + k * step.z(), usual_mm);
    if (!region) return;
    for (int j = 0; j < mask.size[1]; ++j) {
      const std::size_t row = (std::size_t(k) * mask.size[1] + j) * mask.size[0];
      for (const auto& [from, to] : region->row(first.y() + j * step.y())) {
        const int begin = std::max(static_cast<int>(std::ceil((from - first.x()) / step.x())), 0);
        const int end =
            std::min(static_cast<int>(std::ceil((to - first.x()) / step.x())), mask.size[0]);
        for (int i = begin; i < end; ++i) set_value(mask, row + std::size_t(i), label.label);
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
  std::vector<std::string> told;
  Volume mask = read_layers(
      static_cast<std::int64_t>(names.size()), options, file.string(), names, [&](std::int64_t i) {
        const auto layer = static_cast<std::size_t>(i);
        Volume one = grid;
        one.voxels.assign(std::size_t(grid.size[0]) * grid.size[1] * grid.size[2], 0);
        if (names[layer].label > std::numeric_limits<std::int16_t>::max()) make_real(one);
        fill(planes[layer], names[layer], one);
        for (const std::string& warning : one.warnings) told.push_back(warning);
        return one;
      });
  mask.warnings = told;
  mask.ends_with_label = !options.region;
  if (!options.region) return mask;
  const IndexBox box = voxels_of_region(mask, *options.region, file.string());
  return cropped(std::move(mask), box);
}

}  // namespace organbake
