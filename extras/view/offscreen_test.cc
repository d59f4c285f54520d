#include "extras/view/offscreen.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <thread>
#include <vector>

#include "base/error.h"
#include "extras/view/egl.h"
#include "extras/view/painter.h"
#include "pendulum/testing.h"

namespace upswing {
namespace {

using Pixels = std::vector<uint8_t>;
using Angles = std::array<double, 2>;

/// Fixture of picture tests. Skips them if this machine cannot draw, unless
/// UPSWING_REQUIRE_PICTURES is set.
class OffscreenTest : public testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "graphics drivers are not made for sanitizers";
#endif
    try {
      const EglContext probe;
    } catch (const Error& error) {
      if (std::getenv("UPSWING_REQUIRE_PICTURES") != nullptr) throw;
      GTEST_SKIP() << error.what();
    }
  }
};

/// Draws pictures of one pendulum.
class Artist {
 public:
  explicit Artist(PictureSize size, const Plant& plant = {}, const Camera& camera = {})
      : offscreen_(size), scene_(plant, "") {
    scene_.SetCamera(camera, static_cast<double>(size.width) / size.height);
  }
  Pixels Draw(Angles q, double torque = 0) {
    scene_.Update({q[0], q[1], 0, 0}, {.torque = torque});
    const ScenePanel panel{&scene_, "", {}};
    const auto pixels = offscreen_.Render({&panel, 1});
    return {pixels.begin(), pixels.end()};
  }

 private:
  Offscreen offscreen_;
  PendulumScene scene_;
};

/// The mean position of the pixels in a colour: column and row in [-1, 1], right and up. Nothing if
/// there are hardly any.
template <typename Wanted>
std::optional<std::array<double, 2>> MiddleOf(const Pixels& pixels, PictureSize size,
                                              const Wanted& wanted) {
  double x = 0, y = 0;
  int count = 0;
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const uint8_t* rgb = pixels.data() + 3 * (row * size.width + column);
      if (!wanted(rgb[0], rgb[1], rgb[2])) continue;
      x += 2.0 * column / size.width - 1;
      y += 1 - 2.0 * row / size.height;
      ++count;
    }
  }
  if (count < 20) return std::nullopt;
  return std::array{x / count, y / count};
}

bool IsBlue(int r, int g, int b) { return b > 30 && 5 * b > 9 * r && 5 * b > 6 * g; }
bool IsOrange(int r, int g, int b) { return r > 150 && g > b + 40 && r > g + 40; }
bool IsGreen(int r, int g, int b) { return g > r + 50 && g > b + 40; }

TEST_F(OffscreenTest, LinksAreWhereTheAnglesSay) {
  const PictureSize size{240, 240};
  Camera camera;
  camera.azimuth = 90;  // along +y
  camera.elevation = 0;
  Artist artist(size, Plant(), camera);
  for (const Angles q : {Angles{0, 0}, Angles{kPi, 0}, Angles{kPi / 2, 0}, Angles{-kPi / 2, 0},
                         Angles{kPi / 2, kPi / 2}, Angles{kPi / 2, -kPi / 2}}) {
    SCOPED_TRACE(testing::Message() << "q = " << q[0] << ", " << q[1]);
    const auto middle = MiddleOf(artist.Draw(q), size, IsBlue);
    ASSERT_TRUE(middle);
    // Centre of both links (m) divided by half of the picture's height (m), 1.16 times their reach
    // of 1 m.
    const double x = -(0.375 * std::sin(q[0]) + 0.125 * std::sin(q[0] + q[1])) / 1.16;
    const double z = -(0.375 * std::cos(q[0]) + 0.125 * std::cos(q[0] + q[1])) / 1.16;
    EXPECT_NEAR((*middle)[0], x, 0.04);
    EXPECT_NEAR((*middle)[1], z, 0.04);
  }
}

TEST_F(OffscreenTest, TorqueAndGoalAreShown) {
  const PictureSize size{240, 240};
  Artist artist(size);
  EXPECT_FALSE(MiddleOf(artist.Draw({0, 0}), size, IsOrange));
  // A positive torque turns clockwise: from the top to the right.
  const auto right = MiddleOf(artist.Draw({0, 0}, 3), size, IsOrange);
  const auto left = MiddleOf(artist.Draw({0, 0}, -3), size, IsOrange);
  ASSERT_TRUE(right && left);
  EXPECT_GT((*right)[0], 0.05);
  EXPECT_LT((*left)[0], -0.05);
  // The goal turns green when both links are upright.
  EXPECT_FALSE(MiddleOf(artist.Draw({0, 0}), size, IsGreen));
  const auto goal = MiddleOf(artist.Draw({kPi + 0.2, 0}), size, IsGreen);
  ASSERT_TRUE(goal);
  EXPECT_GT((*goal)[1], 0.6);
}

TEST_F(OffscreenTest, APictureDependsOnlyOnItsArguments) {
  Artist one({160, 120}), other({96, 200});
  const Pixels first = one.Draw({1, 2}, 1);
  EXPECT_EQ(first.size(), 160U * 120 * 3);
  const Pixels of_other = other.Draw({1, 2}, 1);
  EXPECT_EQ(of_other.size(), 96U * 200 * 3);
  EXPECT_NE(one.Draw({1, 2.2}, 1), first);
  EXPECT_EQ(one.Draw({1, 2}, 1), first);
  EXPECT_EQ(other.Draw({1, 2}, 1), of_other);
}

TEST_F(OffscreenTest, AnyThreadMayDraw) {
  Artist artist({96, 96});
  const Pixels here = artist.Draw({1, 2});
  Pixels there;
  std::thread([&] { there = artist.Draw({1, 2}); }).join();
  EXPECT_EQ(there, here);
  // Two threads draw at the same time, each with its own Offscreen.
  std::array<Pixels, 2> both;
  std::vector<std::thread> threads;
  for (Pixels& pixels : both) {
    threads.emplace_back([&pixels] {
      Artist own({96, 96});
      for (int i = 0; i < 5; ++i) pixels = own.Draw({1, 2});
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(both[0], here);
  EXPECT_EQ(both[1], here);
  EXPECT_EQ(artist.Draw({1, 2}), here);
}

TEST_F(OffscreenTest, ShowsThePlant) {
  Plant small;
  small.length2 = 0.2;
  const PictureSize size{200, 200};
  Camera camera;
  camera.distance = 4;
  Artist usual(size, Plant(), camera), shorter(size, small, camera);
  const auto a = MiddleOf(usual.Draw({kPi, 0}), size, IsBlue);
  const auto b = MiddleOf(shorter.Draw({kPi, 0}), size, IsBlue);
  ASSERT_TRUE(a && b);
  EXPECT_GT((*a)[1], (*b)[1] + 0.05);
}

TEST(Offscreen, RefusesSizesAndModels) {
  for (const PictureSize size :
       {PictureSize{0, 10}, PictureSize{100, -1}, PictureSize{100, 9000}}) {
    EXPECT_THROW(Offscreen{size}, Error);
  }
  EXPECT_THROW((PendulumScene{Plant(), "<mujoco/>"}), Error);
}

TEST(Panels, FillThePicture) {
  for (const auto [width, height] : {std::array{640, 480}, std::array{301, 997}}) {
    for (int count = 1; count <= 9; ++count) {
      int area = 0;
      for (int i = 0; i < count; ++i) {
        const mjrRect place = PanelPlace(i, count, width, height);
        EXPECT_GE(place.left, 0);
        EXPECT_GE(place.bottom, 0);
        EXPECT_LE(place.left + place.width, width);
        EXPECT_LE(place.bottom + place.height, height);
        area += place.width * place.height;
      }
      EXPECT_EQ(area, width * height) << count;
    }
  }
  EXPECT_EQ(PanelColumns(2, 800, 400), 2);
  EXPECT_EQ(PanelColumns(2, 400, 800), 1);
  EXPECT_EQ(PanelColumns(4, 800, 600), 2);
}

}  // namespace
}  // namespace upswing
