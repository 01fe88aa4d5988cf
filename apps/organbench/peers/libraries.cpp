// SPDX-License-Identifier: GPL-3.0-or-later
// What other libraries make of the same input as ours: contours and fewer faces (VTK,
// meshoptimizer), depth maps and frames (Embree), packed images (OpenEXR), each as one calls it
// with the settings that serve it best.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>  // Debian 13
#else
#include <embree3/rtcore.h>
#endif
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <meshoptimizer.h>
#include <vtkCellArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkMarchingCubes.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkQuadricDecimation.h>
#include <vtkShortArray.h>
#include <vtkSmartPointer.h>
#include <algorithm>
#include <deque>
#include <vector>

#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "peers/peers.h"

namespace organbake {
namespace {

vtkSmartPointer<vtkPolyData> to_polydata(const TriangleMesh& mesh) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Eigen::Vector3d& v : mesh.vertices) points->InsertNextPoint(v.data());
  vtkNew<vtkCellArray> polys;
  for (const Face& f : mesh.faces) {
    const vtkIdType corners[3] = {f[0], f[1], f[2]};
    polys->InsertNextCell(3, corners);
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(polys);
  return data;
}

TriangleMesh from_polydata(vtkPolyData& data) {
  TriangleMesh mesh;
  for (vtkIdType v = 0; v < data.GetNumberOfPoints(); ++v) {
    mesh.vertices.push_back(Eigen::Vector3d::Map(data.GetPoint(v)));
  }
  vtkNew<vtkIdList> ids;
  for (vtkIdType f = 0; f < data.GetNumberOfPolys(); ++f) {
    data.GetPolys()->GetCellAtId(f, ids);
    const auto corner = [&](vtkIdType c) { return static_cast<std::uint32_t>(ids->GetId(c)); };
    mesh.faces.push_back({corner(0), corner(1), corner(2)});
  }
  return mesh;
}

vtkSmartPointer<vtkImageData> image_of(const Volume& ct) {
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(ct.size[0], ct.size[1], ct.size[2]);
  image->SetSpacing(ct.spacing_mm.data());
  image->SetOrigin(ct.origin_mm.data());
  vtkNew<vtkShortArray> values;
  values->SetArray(const_cast<short*>(ct.voxels.data()), vtkIdType(ct.voxels.size()), /*save=*/1);
  image->GetPointData()->SetScalars(values);
  return image;
}

// Both filters have the same setters but no common base that declares them.
template <class Filter>
vtkSmartPointer<vtkPolyData> contour_by(const Volume& ct, double level) {
  vtkNew<Filter> filter;
  filter->SetInputData(image_of(ct));
  filter->SetValue(0, level);
  filter->ComputeNormalsOff();
  filter->ComputeGradientsOff();
  filter->ComputeScalarsOff();
  filter->Update();
  return filter->GetOutput();
}

}  // namespace

std::size_t vtk_flying_edges_faces(const Volume& ct, double level) {
  return contour_by<vtkFlyingEdges3D>(ct, level)->GetNumberOfPolys();
}

TriangleMesh vtk_marching_cubes(const Volume& ct, double level) {
  return from_polydata(*contour_by<vtkMarchingCubes>(ct, level));
}

TriangleMesh vtk_quadric_decimation(const TriangleMesh& surface, std::size_t faces) {
  vtkNew<vtkQuadricDecimation> filter;
  filter->SetInputData(to_polydata(surface));
  filter->SetTargetReduction(1 - double(faces) / double(surface.faces.size()));
  filter->VolumePreservationOn();
  filter->Update();
  return from_polydata(*filter->GetOutput());
}

TriangleMesh meshoptimizer_simplify(const TriangleMesh& surface, std::size_t faces) {
  std::vector<float> positions;
  positions.reserve(3 * surface.vertices.size());
  for (const Eigen::Vector3d& v : surface.vertices) {
    for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(v[axis]));
  }
  std::vector<unsigned> indices;
  indices.reserve(3 * surface.faces.size());
  for (const Face& f : surface.faces) indices.insert(indices.end(), f.begin(), f.end());
  constexpr float kAnyError = 1;  // the face budget alone decides
  indices.resize(meshopt_simplify(indices.data(), indices.data(), indices.size(), positions.data(),
                                  surface.vertices.size(), 3 * sizeof(float), 3 * faces,
                                  kAnyError));
  TriangleMesh mesh;
  std::vector<std::uint32_t> renamed(surface.vertices.size(), ~std::uint32_t{0});
  for (std::size_t i = 0; i < indices.size(); ++i) {
    std::uint32_t& name = renamed[indices[i]];
    if (name == ~std::uint32_t{0}) {
      name = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(surface.vertices[indices[i]]);
    }
    if (i % 3 == 0) mesh.faces.push_back({});
    mesh.faces.back()[i % 3] = name;
  }
  return mesh;
}

std::string embree_version() { return RTC_VERSION_STRING; }

// One mesh as Embree has it, whose vertices may be rewritten.
struct EmbreeScene {
  explicit EmbreeScene(const TriangleMesh& mesh);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  void write_vertices(const std::vector<Eigen::Vector3d>& positions);

  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  float* vertices = nullptr;
};

EmbreeScene::EmbreeScene(const TriangleMesh& mesh) {
  vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                         RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                         mesh.vertices.size()));
  auto* faces = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), mesh.faces.size()));
  write_vertices(mesh.vertices);
  for (const Face& face : mesh.faces) faces = std::copy(face.begin(), face.end(), faces);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcCommitScene(scene);
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseGeometry(geometry);
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}

void EmbreeScene::write_vertices(const std::vector<Eigen::Vector3d>& positions) {
  for (std::size_t v = 0; v < positions.size(); ++v)
    for (int k = 0; k < 3; ++k) vertices[3 * v + k] = static_cast<float>(positions[v][k]);
}

namespace {

constexpr int kPacketSide = 4;  // 4 × 4 pixels: the most coherent packet of 16
constexpr int kPacketRays = kPacketSide * kPacketSide;

// Rays that run together; Embree 3 and 4 differ in how they are told so.
void intersect_coherent(const int* valid, RTCScene scene, RTCRayHit16& rays) {
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments mode;
  rtcInitIntersectArguments(&mode);
  mode.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &rays, &mode);
#else
  RTCIntersectContext mode;
  rtcInitIntersectContext(&mode);
  mode.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene, &mode, &rays);
#endif
}

// One ray through the middle of each pixel of a camera that is free of distortion, planar depth 1 a
// unit of its length, rows of packets spread over TBB. `take` gets the pixel, the packet and the
// ray's number in it.
void trace(const EmbreeScene& scene, const PosedCamera& camera, const auto& take) {
  const Intrinsics& lens = camera.intrinsics;
  const Eigen::Vector3f eye = camera.center_world_mm().cast<float>();
  const Eigen::Matrix3f world_from_camera =
      camera.camera_from_world.rotation.transpose().cast<float>();
  const auto trace_packet = [&](int left, int top) {
    alignas(64) int valid[kPacketRays];
    RTCRayHit16 packet;
    for (int i = 0; i < kPacketRays; ++i) {
      const int x = left + i % kPacketSide, y = top + i / kPacketSide;
      valid[i] = x < lens.width && y < lens.height ? -1 : 0;
      const Eigen::Vector3f direction =
          world_from_camera * Eigen::Vector3f(static_cast<float>((x + 0.5 - lens.cx) / lens.fx),
                                              static_cast<float>((y + 0.5 - lens.cy) / lens.fy), 1);
      packet.ray.org_x[i] = eye.x(), packet.ray.org_y[i] = eye.y(), packet.ray.org_z[i] = eye.z();
      packet.ray.dir_x[i] = direction.x(), packet.ray.dir_y[i] = direction.y();
      packet.ray.dir_z[i] = direction.z();
      packet.ray.tnear[i] = 0, packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
      packet.ray.time[i] = 0, packet.ray.mask[i] = 0xFFFFFFFFu, packet.ray.flags[i] = 0;
      packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    intersect_coherent(valid, scene.scene, packet);
    for (int i = 0; i < kPacketRays; ++i) {
      const std::size_t row = std::size_t(top) + i / kPacketSide;
      if (valid[i]) take(row * lens.width + left + i % kPacketSide, packet, i);
    }
  };
  parallel_for(0, (lens.height + kPacketSide - 1) / kPacketSide, [&](int row) {
    for (int left = 0; left < lens.width; left += kPacketSide)
      trace_packet(left, row * kPacketSide);
  });
}

}  // namespace

EmbreeTracer::EmbreeTracer(const TriangleMesh& mesh) : scene_(std::make_unique<EmbreeScene>(mesh)) {
  for (const Face& face : mesh.faces) {
    auto& corners = colors_.emplace_back();
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 3; ++c) corners[k][c] = srgb8_from_linear(mesh.colors.at(face[k])[c]);
  }
}

EmbreeTracer::~EmbreeTracer() = default;

void EmbreeTracer::trace_depths(const std::vector<PosedCamera>& cameras,
                                std::vector<std::vector<float>>& depths_mm) const {
  depths_mm.resize(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    std::vector<float>& depth = depths_mm[c];
    const Intrinsics& size = cameras[c].intrinsics;
    depth.resize(std::size_t(size.width) * size.height);
    trace(*scene_, cameras[c], [&](std::size_t pixel, const RTCRayHit16& packet, int i) {
      depth[pixel] = packet.ray.tfar[i];  // stays infinite where nothing is hit
    });
  }
}

void EmbreeTracer::draw(const std::vector<Eigen::Vector3d>& positions, const View& view,
                        Rgb8Image& picture) {
  scene_->write_vertices(positions);
  // Its tree is refitted.
  rtcSetGeometryBuildQuality(scene_->geometry, RTC_BUILD_QUALITY_REFIT);
  rtcUpdateGeometryBuffer(scene_->geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(scene_->geometry);
  rtcCommitScene(scene_->scene);
  picture = Rgb8Image(view.camera.intrinsics.width, view.camera.intrinsics.height);
  trace(*scene_, view.camera, [&](std::size_t pixel, const RTCRayHit16& packet, int i) {
    if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) return;
    const auto& corner = colors_[packet.hit.primID[i]];
    const float u = packet.hit.u[i], v = packet.hit.v[i];
    for (int c = 0; c < 3; ++c)
      picture.pixels[3 * pixel + c] = static_cast<std::uint8_t>(
          (1 - u - v) * corner[0][c] + u * corner[1][c] + v * corner[2][c] + 0.5F);
  });
}

void write_by_openexr(const std::filesystem::path& file, const ChannelImage& image) {
  Imf::Header header(image.width, image.height);
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer frame;
  std::deque<std::vector<half>> halves;
  const auto add = [&](const Channel& channel, Imf::PixelType type, const void* values,
                       std::size_t bytes) {
    header.channels().insert(channel.name, Imf::Channel(type));
    char* const base = const_cast<char*>(static_cast<const char*>(values));
    frame.insert(channel.name, Imf::Slice(type, base, bytes, bytes * image.width));
  };
  for (const Channel& channel : image.channels) {
    if (const auto* whole = std::get_if<std::vector<std::uint32_t>>(&channel.values)) {
      add(channel, Imf::UINT, whole->data(), sizeof(std::uint32_t));
    } else if (channel.half) {
      halves.emplace_back(channel.floats().begin(), channel.floats().end());
      add(channel, Imf::HALF, halves.back().data(), sizeof(half));
    } else {
      add(channel, Imf::FLOAT, channel.floats().data(), sizeof(float));
    }
  }
  Imf::OutputFile output(file.c_str(), header, 0);
  output.setFrameBuffer(frame);
  output.writePixels(image.height);
}

}  // namespace organbake
