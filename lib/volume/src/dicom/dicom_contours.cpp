// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_contours.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "dicom/contour_mask.h"
#include "dicom/contour_region.h"
#include "dicom/dicom_document.h"
#include "grid/affine_grid.h"
#include "labels/mask_labels.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/rotation_between.h"
#include "organbake/volume/label_names_file.h"
#include "organbake/volume/region.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

constexpr double kSamePlane_mm = 0.01;
constexpr double kOnEdge_mm = 0.02;  // so near to a contour a voxel's centre lies on it

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
  const Eigen::Matrix3d turn = rotation_between(own, normal).toRotationMatrix();
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

// Whether every point lies in a slice of the scan, and in it at a corner of a voxel, in the middle
// of an edge or at a centre: a program drew the contours round voxels, no hand did.
bool follow_voxels(const ContouredRegion& region, const Volume& scan) {
  constexpr double kRounded = 0.03;  // of a voxel: positions are decimal text
  for (const DrawnContour& contour : region.contours) {
    for (const Eigen::Vector3d& point : contour.points) {
      Eigen::Vector3d index = scan.index_from_world(point);
      index.head<2>() *= 2;
      if ((index - index.array().round().matrix()).cwiseAbs().maxCoeff() > kRounded) return false;
    }
  }
  return true;
}

Volume empty_grid_of(const Volume& scan) {
  Volume grid;
  grid.size = scan.size;
  grid.spacing_mm = scan.spacing_mm;
  grid.origin_mm = scan.origin_mm;
  grid.direction = scan.direction;
  return grid;
}

}  // namespace

Volume read_dicom_contours(const fs::path& file, const VolumeReadOptions& options) {
  const std::vector<ContouredRegion> regions = read_regions(DicomDocument(file), file);
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
  bool by_voxels = options.scan != nullptr;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    by_voxels = by_voxels && (!chosen[i] || follow_voxels(regions[i], *options.scan));
  }
  const Eigen::Matrix3d axes = by_voxels ? options.scan->direction : plane_axes(regions);
  std::vector<ContourPlanes> planes;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    planes.push_back(chosen[i] ? planes_of(regions[i], axes) : ContourPlanes());
  }
  std::vector<ContourPlanes> wanted;
  for (const ContourPlanes& one : planes) {
    if (!one.empty()) wanted.push_back(one);
  }
  Volume grid =
      by_voxels ? empty_grid_of(*options.scan) : grid_of_planes(wanted, axes, file.string());
  const double reach = by_voxels ? kOnEdge_mm : 0;
  grid.label_names = names;
  std::vector<std::string> told;
  Volume mask = read_layers(
      static_cast<std::int64_t>(names.size()), options, file.string(), names, [&](std::int64_t i) {
        const auto layer = static_cast<std::size_t>(i);
        Volume one = grid;
        one.voxels.assign(std::size_t(grid.size[0]) * grid.size[1] * grid.size[2], 0);
        if (names[layer].label > std::numeric_limits<std::int16_t>::max()) make_real(one);
        fill_contours(planes[layer], names[layer], reach, one);
        for (const std::string& warning : one.warnings) told.push_back(warning);
        return one;
      });
  mask.warnings = told;
  mask.ends_with_label = !options.region && !by_voxels;
  if (!options.region) return mask;
  const IndexBox box = voxels_of_region(mask, *options.region, file.string());
  return cropped(std::move(mask), box);
}

}  // namespace organbake
