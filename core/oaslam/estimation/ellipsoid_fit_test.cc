#include "oaslam/estimation/ellipsoid_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "cameras.h"
#include "oaslam/estimation/ellipsoid_residuals.h"
#include "oaslam/estimation/object_score.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

using synthetic::kUp;

Ellipsoid TrueObject() {
  return {{0.1, -0.2, 0.15},
          {0.12, 0.06, 0.15},
          Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()))};
}

// Boxes of an object seen from a quarter of a circle at 1.5 m, cut where they leave the image.
std::vector<BoxView> ViewsOf(const Ellipsoid& object, int count, double noise_px, Rng& rng,
                             const Eigen::Vector3d& looked_at = Eigen::Vector3d(0.1, -0.2, 0.15)) {
  std::vector<BoxView> views;
  for (int i = 0; i < count; ++i) {
    const double angle = 1.6 * i / count;
    const Rigid3 pose = synthetic::LookAt(
        {1.5 * std::cos(angle), 1.5 * std::sin(angle), 0.6 + 0.3 * std::sin(5 * angle)}, looked_at);
    Box box = *ProjectToBox(object, pose, synthetic::kCamera);
    for (double* edge : {&box.x1, &box.y1, &box.x2, &box.y2}) *edge += rng.Gaussian(noise_px);
    box = Intersection(box, {0, 0, 640, 480});
    views.push_back({pose, &synthetic::kCamera, box, 0.8, TruncatedEdges(synthetic::kCamera, box)});
  }
  return views;
}

Ellipsoid SphereOf(const std::vector<BoxView>& views) {
  const SphereEstimate estimate = EstimateSphere(views, 10);
  EXPECT_TRUE(estimate.success);
  return estimate.sphere;
}

TEST(EllipsoidFit, SphereIsNearTheObject) {
  Rng rng(1);
  const auto views = ViewsOf(TrueObject(), 20, 1, rng);
  const SphereEstimate estimate = EstimateSphere(views, 10);
  ASSERT_TRUE(estimate.success);
  EXPECT_LT((estimate.sphere.center - TrueObject().center).norm(), 0.02);
  EXPECT_GT(estimate.sphere.half_axes[0], 0.06);
  EXPECT_LT(estimate.sphere.half_axes[0], 0.15);
  EXPECT_GT(estimate.parallax_deg, 60);
  EXPECT_FALSE(EstimateSphere(std::span(views).first(2), 10).success);  // too little parallax
}

// Five views within two degrees, of which a depth camera measures the surface.
TEST(EllipsoidFit, MeasuredSurfacesTellThePlaceWithoutParallax) {
  Rng rng(5);
  const auto all = ViewsOf(TrueObject(), 200, 1, rng);
  std::vector<BoxView> views(all.begin(), all.begin() + 5);
  ASSERT_FALSE(EstimateSphere(views, 10).success);
  for (BoxView& view : views) {
    const Eigen::Vector3d along = view.cam_from_world.rotation.toRotationMatrix().row(2),
                          on_axes = TrueObject().rotation.conjugate() * along;
    view.surface = (view.cam_from_world * TrueObject().center).z() -
                   .7 * on_axes.cwiseProduct(TrueObject().half_axes).norm() + rng.Gaussian(.01);
  }
  const SphereEstimate sphere = EstimateSphere(views, 10);
  ASSERT_TRUE(sphere.success);
  EXPECT_LT((sphere.sphere.center - TrueObject().center).norm(), .06);
  const EllipsoidFit fit = FitFromSphere(views, sphere.sphere, {.up = kUp});
  ASSERT_TRUE(fit.success);
  EXPECT_LT((fit.ellipsoid.center - TrueObject().center).norm(), .04);
  EXPECT_GT(MeasureOverlap(fit.ellipsoid, views, .3).mean_iou, .85);
  const double sigma =
      std::sqrt(EstimateCovariance(fit.ellipsoid, views).topLeftCorner<3, 3>().trace());
  for (BoxView& view : views) view.surface = 0;
  EXPECT_LT(sigma,
            .8 * std::sqrt(EstimateCovariance(fit.ellipsoid, views).topLeftCorner<3, 3>().trace()));
  EXPECT_FALSE(EstimateSphere(std::span(views).first(2), 10).success);
}

TEST(EllipsoidFit, TheDerivativesOfASurfaceAreRight) {
  Rng rng(6);
  BoxView view = ViewsOf(TrueObject(), 1, 0, rng).front();
  view.surface = 1.2;
  const SurfaceResidual at = *SurfaceResidualOf(view, TrueObject());
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 6; ++i) {
    Ellipsoid moved = TrueObject();
    if (i < 3)
      moved.center[i] += kStep;
    else
      moved.half_axes[i - 3] *= std::exp(kStep);
    const auto z_front = [&](const Ellipsoid& e) {
      const Eigen::Vector3d along = view.cam_from_world.rotation.toRotationMatrix().row(2);
      const Eigen::Vector3d on_axes = e.rotation.conjugate() * along;
      return (view.cam_from_world * e.center).z() - .7 * on_axes.cwiseProduct(e.half_axes).norm();
    };
    const double scale =
        at.value / (z_front(TrueObject()) - view.surface);  // the weight is taken to be constant
    EXPECT_NEAR(at.by_shape[i], scale * (z_front(moved) - z_front(TrueObject())) / kStep,
                1e-3 * std::abs(scale));
  }
}

TEST(EllipsoidFit, RecoversTheTruthFromCleanBoxes) {
  Rng rng(2);
  const auto views = ViewsOf(TrueObject(), 40, 0, rng);
  for (const EllipsoidResidual residual :
       {EllipsoidResidual::kEdges, EllipsoidResidual::kWasserstein}) {
    EllipsoidFitOptions options{.residual = residual, .max_iterations = 60};
    if (residual == EllipsoidResidual::kEdges) options.up = kUp;
    const EllipsoidFit fit = FitFromSphere(views, SphereOf(views), options);
    ASSERT_TRUE(fit.success);
    EXPECT_LT((fit.ellipsoid.center - TrueObject().center).norm(),
              residual == EllipsoidResidual::kEdges ? 0.01 : 0.02);
    const ViewOverlap overlap = MeasureOverlap(fit.ellipsoid, views, 0.3);
    // The prior pulls this flat object a little towards a sphere; W2 fits an inscribed ellipse,
    // whose box is not that of a slanted outline.
    EXPECT_GT(overlap.mean_iou, residual == EllipsoidResidual::kEdges ? 0.93 : 0.85);
    EXPECT_EQ(overlap.accept_share, 1);
  }
}

TEST(EllipsoidFit, RobustFitStandsOutliers) {
  Rng rng(3);
  auto views = ViewsOf(TrueObject(), 40, 2, rng);
  for (size_t i = 0; i < views.size();
       i += 4) {  // a quarter of the boxes includes the neighbouring object, too
    views[i].box.x2 += 90;
    views[i].box.y1 -= 40;
  }
  const EllipsoidFit robust =
      FitFromSphere(views, SphereOf(views), {.up = kUp, .max_iterations = 40});
  const EllipsoidFit plain = FitFromSphere(
      views, SphereOf(views), {.residual = EllipsoidResidual::kWasserstein, .max_iterations = 40});
  EXPECT_LT((robust.ellipsoid.center - TrueObject().center).norm(), 0.02);
  EXPECT_GT((plain.ellipsoid.center - TrueObject().center).norm(), 0.02);
}

TEST(EllipsoidFit, TruncatedEdgesDoNotShrinkTheObject) {
  Rng rng(4);
  const Ellipsoid big{{0.1, -0.2, 0.15}, {0.5, 0.45, 0.35}, Eigen::Quaterniond::Identity()};
  auto views = ViewsOf(big, 40, 1, rng, {0.25, -0.1, 0.6});  // its lower parts leave the image
  int cut = 0;
  for (const BoxView& view : views) cut += view.truncated != 0;
  ASSERT_GT(cut, 20);
  const EllipsoidFit one_sided =
      FitFromSphere(views, SphereOf(views), {.up = kUp, .max_iterations = 40});
  for (BoxView& view : views) view.truncated = 0;
  const EllipsoidFit naive =
      FitFromSphere(views, SphereOf(views), {.up = kUp, .max_iterations = 40});
  const auto error = [&](const EllipsoidFit& fit) {
    return std::abs(std::log(fit.ellipsoid.half_axes.prod() / big.half_axes.prod()));
  };
  EXPECT_LT(error(one_sided), 0.2);
  EXPECT_LT(error(one_sided), 0.6 * error(naive));
}

TEST(EllipsoidFit, UnobservedAxisStaysBounded) {
  // Seen from nearly one side only, where the prior keeps the extent in depth plausible.
  Rng rng(5);
  auto views = ViewsOf(TrueObject(), 200, 1, rng);
  views.resize(25);
  const EllipsoidFit fit = FitFromSphere(views, SphereOf(views), {.up = kUp, .max_iterations = 40});
  ASSERT_TRUE(fit.success);
  EXPECT_GT(fit.ellipsoid.half_axes.minCoeff(), 0.02);
  EXPECT_LT(fit.ellipsoid.half_axes.maxCoeff(), 0.4);
}

TEST(EllipsoidFit, CostIsThatOfTheNormalEquations) {
  Rng rng(6);
  const auto views = ViewsOf(TrueObject(), 10, 8, rng);
  for (const EllipsoidResidual residual :
       {EllipsoidResidual::kEdges, EllipsoidResidual::kWasserstein}) {
    const EllipsoidFitOptions options{.residual = residual};
    Ellipsoid e = TrueObject();
    e.half_axes *= 1.1;
    const EllipsoidEquations normal = Linearize(views, e, options);
    EXPECT_NEAR(normal.cost, EvaluateCost(views, e, options), 1e-6 * normal.cost);
    // The gradient: half the derivative of the cost (exact also with a robust loss).
    for (int k = 0; k < kShapeParameters; ++k) {
      const double h = 1e-6;
      const double numeric = (EvaluateCost(views, Moved(e, h * ShapeVector::Unit(k)), options) -
                              EvaluateCost(views, Moved(e, -h * ShapeVector::Unit(k)), options)) /
                             (4 * h);
      EXPECT_NEAR(normal.gradient[k], numeric, 1e-4 * (1 + std::abs(numeric))) << k;
    }
  }
}

TEST(Wasserstein, SquaresOfTheResidualSumToTheDistance) {
  Rng rng(7);
  for (int trial = 0; trial < 100; ++trial) {
    const Ellipse a = InscribedEllipse({0, 0, rng.Uniform(5, 100), rng.Uniform(5, 100)});
    Ellipse b;
    b.mean = {rng.Uniform(0, 100), rng.Uniform(0, 100)};
    Eigen::Matrix2d root;
    root << rng.Uniform(5, 40), rng.Uniform(-20, 20), rng.Uniform(-20, 20), rng.Uniform(5, 40);
    b.covariance = root * root.transpose() + 4 * Eigen::Matrix2d::Identity();
    const double expected = SquaredWasserstein(a, b);
    EXPECT_NEAR(ComputeWasserstein(a, b).value.squaredNorm(), expected, 1e-8 * (1 + expected));
  }
}

TEST(MakeUpright, KeepsAnUprightEllipsoid) {
  const Ellipsoid e = TrueObject();
  const Ellipsoid same = MakeUpright(e, kUp);
  EXPECT_LT((same.half_axes - e.half_axes).norm(), 1e-12);
  EXPECT_LT(same.rotation.angularDistance(e.rotation), 1e-12);
  // An object that lies on its side: the axes are relabelled, its body stays the same.
  const Eigen::Quaterniond tip(Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitX()));
  const Ellipsoid tipped{e.center, e.half_axes, tip};
  EXPECT_LT((MakeUpright(tipped, kUp).half_axes.cwiseProduct(Eigen::Vector3d(1, 1, 1)) -
             Eigen::Vector3d(0.15, 0.12, 0.06))
                .norm(),
            1e-9);
  EXPECT_LT((BoundingBox(MakeUpright(tipped, kUp)).max - BoundingBox(tipped).max).norm(), 1e-9);
}

TEST(Covariance, PredictsTheSpreadOfFits) {
  // Noise of 4 px that stays the same over 6 successive views, as the covariance assumes.
  Rng rng(8);
  double squared = 0, predicted = 0;
  const int trials = 60;
  for (int trial = 0; trial < trials; ++trial) {
    auto views = ViewsOf(TrueObject(), 60, 0, rng);
    for (size_t i = 0; i < views.size(); i += 6) {
      const Eigen::Vector4d noise(rng.Gaussian(4), rng.Gaussian(4), rng.Gaussian(4),
                                  rng.Gaussian(4));
      for (size_t k = i; k < i + 6; ++k) {
        Box& b = views[k].box;
        b = {b.x1 + noise[0], b.y1 + noise[1], b.x2 + noise[2], b.y2 + noise[3]};
      }
    }
    const EllipsoidFit fit = FitEllipsoid(views, TrueObject(), {.up = kUp, .max_iterations = 40});
    squared += (fit.ellipsoid.center - TrueObject().center).squaredNorm();
    predicted += EstimateCovariance(fit.ellipsoid, views).topLeftCorner<3, 3>().trace();
  }
  EXPECT_GT(predicted, 0.4 * squared);
  EXPECT_LT(predicted, 2.5 * squared);
}

TEST(ObjectScore, RewardsFitAndKnowsTruncation) {
  const ObjectScore score(synthetic::kCamera);
  const Box box{200, 200, 260, 280};
  const Eigen::Vector4d certain = Eigen::Vector4d::Zero();
  EXPECT_GT(score(box, 0, box, certain), 8);
  EXPECT_LT(score(box, 0, {203, 200, 260, 280}, certain), score(box, 0, box, certain));
  EXPECT_EQ(score(box, 0, {400, 10, 440, 40}, certain), 0);
  // An uncertain model scores less where it fits, and more where it does not.
  EXPECT_LT(score(box, 0, box, Eigen::Vector4d::Constant(400)), score(box, 0, box, certain));
  EXPECT_GT(score(box, 0, {230, 200, 290, 280}, Eigen::Vector4d::Constant(400)),
            score(box, 0, {230, 200, 290, 280}, certain));
  const Box cut{0, 200, 60, 280};
  EXPECT_NEAR(score(cut, kLeft, {-50, 200, 60, 280}, certain), score(cut, kLeft, cut, certain),
              1e-12);
  EXPECT_LT(score(cut, kLeft, {25, 200, 60, 280}, certain), score(cut, kLeft, cut, certain));
  EXPECT_NEAR(score.WithCommonVariance(box, 0, {203, 200, 260, 280}, 9),
              score(box, 0, {203, 200, 260, 280}, Eigen::Vector4d::Constant(9)), 1e-12);
}

TEST(ObjectScore, DoesNotDependOnTheResolution) {
  Camera twice = synthetic::kCamera;
  twice.width *= 2;
  twice.height *= 2;
  const Box a{200, 200, 260, 280}, b{205, 203, 258, 290};
  const auto doubled = [](const Box& x) { return Box{2 * x.x1, 2 * x.y1, 2 * x.x2, 2 * x.y2}; };
  EXPECT_NEAR(ObjectScore(synthetic::kCamera)(a, 0, b, Eigen::Vector4d::Constant(4)),
              ObjectScore(twice)(doubled(a), 0, doubled(b), Eigen::Vector4d::Constant(16)), 1e-9);
}

}  // namespace
}  // namespace oaslam
