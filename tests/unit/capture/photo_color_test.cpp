// SPDX-License-Identifier: GPL-3.0-or-later

#include "baking.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/error.h"
#include "organbake/image/srgb.h"
#include "support/error_message.h"
#include "support/testing.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3f kPhotoRed{0.6f, 0.02f, 0.02f}, kPhotoGreen{0.02f, 0.5f, 0.02f};

Photo grey_photo(const PosedCamera& camera, std::uint8_t grey) {
  Photo photo{camera, Rgb8Image(camera.intrinsics.width, camera.intrinsics.height)};
  std::fill(photo.image.pixels.begin(), photo.image.pixels.end(), grey);
  return photo;
}

// What a lens does: outlines mix with what lies beside them.
Photo blurred(const Photo& sharp) {
  Photo photo = sharp;
  const Rgb8Image& from = sharp.image;
  for (int y = 1; y + 1 < from.height; ++y)
    for (int x = 1; x + 1 < from.width; ++x)
      for (int c = 0; c < 3; ++c) {
        int sum = 0;
        for (int k = 0; k < 9; ++k) sum += from.at(x - 1 + k % 3, y - 1 + k / 3)[c];
        photo.image.at(x, y)[c] = static_cast<std::uint8_t>(sum / 9);
      }
  return photo;
}

// A smooth pattern on a sphere, photographed and read back from elsewhere.
TEST(PhotoColor, GivesBackWhatThePhotosShow) {
  TriangleMesh surface = painted(sphere_mesh(30, 6), kPhotoRed);
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    const Vector3d& p = surface.vertices[v];
    surface.colors[v] = Vector3d(0.4 + 0.2 * std::sin(p.x() / 4), 0.3 + 0.2 * std::sin(p.y() / 5),
                                 0.3 + 0.2 * std::sin(p.z() / 3))
                            .cast<float>();
  }
  std::vector<Photo> photos;
  for (const Vector3d& eye : {Vector3d(110, -50, 20), Vector3d(-110, -50, 0), Vector3d(0, 120, 10),
                              Vector3d(10, 10, 120), Vector3d(5, -20, -120)})
    photos.push_back(photo_of(surface, plain_camera(eye, {0, 0, 0}, 300)));
  const auto color = make_photo_color(surface, photos);
  const auto truth = make_vertex_color(surface);
  const PosedCamera viewer = plain_camera({40, -100, 60}, {0, 0, 0}, 100);
  const auto got = shade_through(surface, *color, viewer);
  const auto expected = shade_through(surface, *truth, viewer);
  std::vector<double> errors;
  for (std::size_t i = 0; i < got.size(); ++i)
    errors.push_back((got[i].color - expected[i].color).norm());
  std::sort(errors.begin(), errors.end());
  // 8-bit sRGB: a step at 0.4 is 0.004; a photo's pixel is 0.3 mm of a 20 mm wave.
  EXPECT_LT(errors[errors.size() / 2], 0.006);
  EXPECT_LT(errors[errors.size() * 99 / 100], 0.04);
}

// A red bar before a green sphere, photographed from the front. From elsewhere the sphere shows
// places that no photo sees: they take green from around, never red or the black background.
TEST(PhotoColor, AnOccluderLeavesNoColourBehind) {
  TriangleMesh bar = painted(square_at({0, -60, 0}, {0, -1, 0}, 8, 6), kPhotoRed);
  for (Vector3d& vertex : bar.vertices) vertex.z() *= 4;
  const TriangleMesh back = [&] {  // the bar's other side, so that it is closed to all views
    TriangleMesh mesh = bar;
    for (Face& face : mesh.faces) std::swap(face[1], face[2]);
    for (Vector3d& vertex : mesh.vertices) vertex.y() += 0.5;
    return mesh;
  }();
  const TriangleMesh scene = joined(joined(painted(sphere_mesh(30, 5), kPhotoGreen), bar), back);
  const std::vector<Photo> photos = {
      blurred(photo_of(scene, plain_camera({0, -180, 0}, {0, 0, 0}, 256)))};
  const auto color = make_photo_color(scene, photos);
  int sphere = 0, front = 0;
  for (const Vector3d& eye : {Vector3d(0, -180, 0), Vector3d(150, -100, 0), Vector3d(-150, -90, 20),
                              Vector3d(0, 170, 0)}) {
    for (const auto& [point, shade] :
         shade_through(scene, *color, plain_camera(eye, {0, -20, 0}, 120))) {
      if (point.norm() < 31) {
        EXPECT_LT(shade.x(), 0.06) << "red on the sphere at " << point.transpose();
        EXPECT_NEAR(shade.y(), kPhotoGreen.y(), 0.1);
        ++sphere;
      } else if (point.y() < -59.9) {
        EXPECT_LT(shade.y(), 0.06) << "green on the bar";
        EXPECT_GT(shade.x(), 0.45);
        ++front;
      }
    }
  }
  EXPECT_GT(sphere, 5000);
  EXPECT_GT(front, 500);
}

// Two photos of different brightness: from the one's region to the other's the colour may only
// drift. Steps along great circles across all borders, outlines and fades.
TEST(PhotoColor, HasNoSeams) {
  const TriangleMesh surface = sphere_mesh(30, 6);
  const std::vector<Photo> photos = {grey_photo(plain_camera({100, -60, 0}, {0, 0, 0}, 200), 150),
                                     grey_photo(plain_camera({-60, -100, 0}, {8, 0, 3}, 200), 190),
                                     grey_photo(plain_camera({0, 40, 90}, {0, 0, 25}, 200), 110),
                                     // A close-up: its frame's border lies on the sphere.
                                     grey_photo(plain_camera({20, -70, 5}, {8, -28, 0}, 200), 60)};
  const TracedSurface traced(surface);
  const auto color = make_photo_color(traced, photos);
  constexpr int kSteps = 20000;
  constexpr double kStepMm = 2 * 3.14159265358979 * 30 / kSteps;
  for (const Vector3d& tilt : {Vector3d(0, 0, 1), Vector3d(0, 1, 1), Vector3d(1, 0.3, -0.4)}) {
    const Vector3d u = tilt.cross(Vector3d(1, 2, 3)).normalized();
    const Vector3d v = tilt.normalized().cross(u);
    std::vector<Vector3d> points, at_points;
    std::vector<RayHit> hits;
    for (int i = 0; i < kSteps; ++i) {
      const double angle = kStepMm / 30 * i;
      const ClosestPoint at =
          traced.rays.closest_point(30 * (std::cos(angle) * u + std::sin(angle) * v));
      hits.push_back(traced.normals.hit_at(at.face, at.point));
      points.push_back(at.point);
      at_points.push_back(traced.normals.at(hits.back()));
    }
    std::vector<Vector3f> colors;
    color->shade(points, at_points, hits, colors);
    double largest = 0;
    for (int i = 1; i < kSteps; ++i)
      largest = std::max<double>(largest, std::abs(colors[i].x() - colors[i - 1].x()));
    // The photos differ by 0.35, and their sharpest fade, three texels of a photo's depth map,
    // takes more than 0.6 mm. An eighth of the difference in one step would be seen as a line.
    EXPECT_LT(largest, 0.35 * kStepMm / 0.6);
  }
}

// The same point, with and without a highlight: the photo without it decides.
TEST(PhotoColor, HighlightsOfOnePhotoAreOutvoted) {
  const TriangleMesh surface = sphere_mesh(30, 5);
  const std::vector<Photo> photos = {grey_photo(plain_camera({10, -120, 0}, {0, 0, 0}, 200), 120),
                                     grey_photo(plain_camera({-10, -120, 0}, {0, 0, 0}, 200), 255)};
  const auto color = make_photo_color(surface, photos);
  const double plain = linear_from_srgb(120 / 255.0f);
  const auto samples = shade_through(surface, *color, plain_camera({0, -120, 0}, {0, 0, 0}, 21));
  const Vector3f middle = samples[samples.size() / 2].color;
  EXPECT_GT(middle.x(), plain);
  EXPECT_LT(middle.x(), plain + 0.15 * (1 - plain));
}

TEST(PhotoColor, PlacesThatNoPhotoSeesAreFilled) {
  const TriangleMesh surface = painted(sphere_mesh(30, 4), kPhotoGreen);
  const auto color =
      make_photo_color(surface, {photo_of(surface, plain_camera({0, -120, 0}, {0, 0, 0}, 150))});
  for (const auto& sample :
       shade_through(surface, *color, plain_camera({0, 120, 0}, {0, 0, 0}, 60)))
    EXPECT_LT((sample.color - kPhotoGreen).norm(), 0.03);
}

// A face whose corners all sit on its outline is seen nevertheless.
TEST(PhotoColor, TwoLargeTrianglesSuffice) {
  const TriangleMesh surface = square_at({0, 0, 0}, {0, -1, 0}, 30, 1);
  const auto color =
      make_photo_color(surface, {grey_photo(plain_camera({0, -120, 0}, {0, 0, 0}, 150), 128)});
  for (const auto& sample :
       shade_through(surface, *color, plain_camera({30, -100, 10}, {0, 0, 0}, 60)))
    EXPECT_NEAR(sample.color.x(), linear_from_srgb(128 / 255.0f), 0.01);
}

// A wrongly posed photograph may stand inside the organ, where it sees faces from behind alone.
TEST(PhotoColor, APhotographFromInsideTheOrganColoursNothing) {
  const TriangleMesh surface = painted(sphere_mesh(30, 4), kPhotoGreen);
  const TracedSurface traced(surface);
  const Photo outside = photo_of(surface, plain_camera({0, -120, 0}, {0, 0, 0}, 150));
  Photo inside = grey_photo(plain_camera({3, 4, -5}, {0, -30, 0}, 150), 255);
  const auto without = make_photo_color(traced, {outside});
  const auto with = make_photo_color(traced, {outside, inside});
  const PosedCamera viewer = plain_camera({20, -110, 10}, {0, 0, 0}, 60);
  const auto expected = shade_through(surface, *without, viewer);
  const auto got = shade_through(surface, *with, viewer);
  for (std::size_t i = 0; i < got.size(); ++i) EXPECT_EQ(got[i].color, expected[i].color);
  EXPECT_THROW(make_photo_color(traced, {inside}), BadDataError);
}

// Every face looks inward: photographs from outside see none of them from the front.
TEST(PhotoColor, AnInsideOutSurfaceIsRefused) {
  TriangleMesh surface = painted(sphere_mesh(30, 4), kPhotoGreen);
  const Photo photo = photo_of(surface, plain_camera({0, -120, 0}, {0, 0, 0}, 150));
  for (Face& face : surface.faces) std::swap(face[1], face[2]);
  EXPECT_THROW(make_photo_color(surface, {photo}), BadDataError);
}

TEST(PhotoColor, RefusesWhatCannotBe) {
  const TriangleMesh surface = sphere_mesh(30, 3);
  const TracedSurface traced(surface);
  const Photo good = grey_photo(plain_camera({0, -120, 0}, {0, 0, 0}, 50), 128);
  const auto refused = [&](std::vector<Photo> photos, const char* word) {
    EXPECT_THAT(
        message_of(ExitCode::bad_data, [&] { make_photo_color(traced, std::move(photos)); }),
        testing::HasSubstr(word));
  };
  EXPECT_NO_THROW(make_photo_color(traced, {good}));
  refused({}, "photos");
  Photo other_size = good;
  other_size.image = Rgb8Image(49, 50);
  refused({other_size}, "49");
  Photo away = good;
  away.camera = plain_camera({0, -120, 0}, {0, -300, 0}, 50);
  refused({away}, "no photograph sees");
  Photo bent = good;
  bent.camera.camera_from_world.rotation *= 1.1;
  refused({bent}, "pose");
  Photo thread = good;
  thread.camera.intrinsics.width = 1;
  thread.image = Rgb8Image(1, 50);
  refused({thread}, "narrower");
}

TEST(ColorFlood, KeepsKnownColoursAndFillsTheRestBetweenThem) {
  // A strip from red (left) to blue (right): between them the flood is a blend.
  const TriangleMesh mesh = square_at(Vector3d::Zero(), Vector3d::UnitZ(), 10, 10);
  const Vector3d across = (mesh.vertices[10] - mesh.vertices[0]).normalized();
  std::vector<char> known(mesh.vertices.size(), 0);
  std::vector<Vector3f> colors(mesh.vertices.size(), Vector3f(0, 9, 0));
  for (std::size_t v = 0; v < known.size(); ++v) {
    const double side = mesh.vertices[v].dot(across);
    if (std::abs(side) < 9.9) continue;
    known[v] = 1;
    colors[v] = side < 0 ? Vector3f(1, 0, 0) : Vector3f(0, 0, 1);
  }
  const std::vector<Vector3f> given = colors;
  flood_colors(mesh, known, colors);
  for (std::size_t v = 0; v < known.size(); ++v) {
    if (known[v]) {
      EXPECT_EQ(colors[v], given[v]);
    } else {
      EXPECT_EQ(colors[v].y(), 0) << "the colour of an unknown vertex must not be used";
      EXPECT_NEAR(colors[v].sum(), 1, 1e-5);
      const double along = mesh.vertices[v].dot(across) / 20 + 0.5;
      EXPECT_NEAR(colors[v].z(), along, 0.2);
    }
  }
}

TEST(ColorFlood, PiecesThatNobodySawTakeTheMean) {
  const TriangleMesh mesh = joined(sphere_mesh(5, 1), moved(sphere_mesh(5, 1), {50, 0, 0}));
  std::vector<char> known(mesh.vertices.size(), 0);
  std::vector<Vector3f> colors(mesh.vertices.size(), Vector3f::Zero());
  known[0] = known[1] = 1;
  colors[0] = {0.2f, 0, 0};
  colors[1] = {0.4f, 0, 0};
  flood_colors(mesh, known, colors);
  EXPECT_NEAR(colors.back().x(), 0.3, 1e-6);
  EXPECT_GE(colors[5].x(), 0.2f);
  EXPECT_LE(colors[5].x(), 0.4f);
}

TEST(ColorFlood, NothingKnownIsAnError) {
  const TriangleMesh mesh = sphere_mesh(5, 0);
  std::vector<Vector3f> colors(mesh.vertices.size(), Vector3f::Zero());
  EXPECT_THROW(flood_colors(mesh, std::vector<char>(mesh.vertices.size(), 0), colors),
               BadDataError);
}

}  // namespace
}  // namespace organbake
