// What is measured of finite elements: strain, stress, energy and the rate of deformation.
#include <algorithm>
#include <cmath>

#include "tests/support/elastic_block.h"
#include <gtest/gtest.h>

namespace duet::finite_element_measures_test {
namespace {

using Block = test::ElasticBlock;

// The rate is the largest rate of a length, or half of the relative rate of the volume if that is more. A
// motion along z at 1/s changes lengths by 1/s; in a block that is stretched by four along x and y it changes
// the volume by 16 times the volume at rest per second.
TEST(FiniteElementMeasures, DeformationRateCountsLengthsAndVolumes) {
  const Block block(2);
  std::vector<Vec3> x = block.x, v = block.x;
  for (Vec3& rate : v) rate = Vec3(0, 0, rate.z());
  EXPECT_NEAR(block.elements.max_deformation_rate(x, v), 1, 1e-14);
  for (Vec3& p : x) p = Vec3(4 * p.x(), 4 * p.y(), p.z());
  EXPECT_NEAR(block.elements.max_deformation_rate(x, v), 8, 1e-13);
}

// The statistics have the smallest determinant, the largest stretch and the number of inverted tetrahedra.
TEST(FiniteElementMeasures, StrainStatisticsFindTheWorstTet) {
  Block block(1);
  std::vector<Vec3> x = block.x;
  for (Vec3& p : x) p.y() *= 0.5;
  EXPECT_NEAR(block.elements.strain(x).min_det, 0.5, 1e-14);
  EXPECT_EQ(block.elements.strain(x).inverted, 0);
  EXPECT_EQ(block.elements.strain(x).max_stretch, 1);
  for (Vec3& p : x) p.y() = -p.y();
  EXPECT_EQ(block.elements.strain(x).inverted, 5);
  // The block is stretched along a diagonal, which is no axis of any element.
  const Vec3 axis = Vec3(1, 2, 3).normalized();
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = block.x[i] + 1.5 * axis.dot(block.x[i]) * axis;
  EXPECT_NEAR(block.elements.strain(x).max_stretch, 2.5, 1e-14);
}

// All particles of a block that is stretched, sheared and turned get the largest difference of a principal
// stretch from 1. The stretches are those of diag(1.5, 0.7, 1), and for a simple shear s they are sqrt(1 +
// s^2/4) +- s/2. The bound of 1e-6 is that of floats.
TEST(FiniteElementMeasures, StrainIsTheLargestPrincipalStretch) {
  Block block(2);
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const auto strain_of = [&](const Mat3& F) {
    std::vector<Vec3> x = block.x;
    for (Vec3& p : x) p = turn * F * p;
    std::vector<float> strain(x.size(), 0);
    block.elements.add_strain(x, strain);
    for (float s : strain) EXPECT_NEAR(s, strain.front(), 1e-6);
    return strain.front();
  };
  EXPECT_NEAR(strain_of(Mat3::Identity()), 0, 1e-6);
  EXPECT_NEAR(strain_of(Vec3(1.5, 0.7, 1).asDiagonal()), 0.5, 1e-6);
  EXPECT_NEAR(strain_of(Vec3(1.1, 0.7, 1).asDiagonal()), 0.3, 1e-6);
  Mat3 shear = Mat3::Identity();
  shear(0, 1) = 0.6;
  EXPECT_NEAR(strain_of(shear), std::sqrt(1.09) + 0.3 - 1, 1e-6);
  EXPECT_EQ(strain_of(Vec3(1, 1, -0.9).asDiagonal()), FiniteElements::inverted);
}

// A block that is stretched by e along one axis and contracts by nu e across it has the stress E e and the
// energy E e^2 / 2, one that is sheared by s has sqrt(3) mu s and mu s^2 / 2, however it is turned; a change
// of volume alone has no stress of von Mises. The bounds are the terms of the next order, a few times e, and
// the rounding of floats.
TEST(FiniteElementMeasures, StressIsThatOfLinearElasticityAtSmallStrains) {
  const double E = 1e5, nu = 0.45, mu = E / (2 * (1 + nu)), e = 1e-4;
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (const MaterialModel model :
       {MaterialModel::neo_hookean, MaterialModel::corotated, MaterialModel::st_venant_kirchhoff}) {
    const Block block(2, model);
    const auto expect = [&](const Mat3& F, double stress, double energy, double bound) {
      std::vector<Vec3> x = block.x;
      for (Vec3& p : x) p = turn * F * p;
      std::vector<float> stresses, energies;
      block.elements.measure_stress(x, stresses, energies);
      ASSERT_EQ(stresses.size(), x.size());
      for (std::size_t p = 0; p < x.size(); ++p) {
        EXPECT_NEAR(stresses[p], stress, bound * E * e);
        EXPECT_NEAR(energies[p], energy, bound * E * e * e);
      }
    };
    expect(Mat3::Identity(), 0, 0, 1e-6);
    expect(Vec3(1 - nu * e, 1 + e, 1 - nu * e).asDiagonal(), E * e, E * e * e / 2, 10 * e);
    Mat3 shear = Mat3::Identity();
    shear(0, 2) = e;
    expect(shear, std::sqrt(3.0) * mu * e, mu * e * e / 2, 10 * e);
    expect((1 + e) * Mat3::Identity(), 0, 4.5 * E / (3 * (1 - 2 * nu)) * e * e, 50 * e);
  }
}

// The stress of an inverted element is left out, and everything stays finite.
TEST(FiniteElementMeasures, StressOfInvertedElementsIsLeftOut) {
  const Block block(2);
  std::vector<Vec3> x = block.x;
  for (Vec3& p : x) p.y() *= -1;
  std::vector<float> stress, energy;
  block.elements.measure_stress(x, stress, energy);
  for (std::size_t p = 0; p < x.size(); ++p) {
    EXPECT_EQ(stress[p], 0);
    EXPECT_GT(energy[p], 0);
    EXPECT_TRUE(std::isfinite(energy[p]));
  }
}

// The particles of an inverted element are marked, and others are not.
TEST(FiniteElementMeasures, OneInvertedElementMarksItsParticles) {
  Block block(2);
  std::vector<Vec3> x = block.x;
  const Tet& tet = block.elements.tets()[7];
  const auto at = [&](std::size_t i) -> Vec3& { return x[static_cast<std::size_t>(tet[i])]; };
  const Vec3 middle = (at(1) + at(2) + at(3)) / 3;
  at(0) += 1.1 * (middle - at(0));  // moves one particle through the opposite face
  std::vector<float> strain(x.size(), 0);
  block.elements.add_strain(x, strain);
  const int marked = static_cast<int>(std::count(strain.begin(), strain.end(), FiniteElements::inverted));
  EXPECT_GE(marked, 4);
  EXPECT_LT(marked, static_cast<int>(strain.size()));
  for (int p : tet) EXPECT_EQ(strain[static_cast<std::size_t>(p)], FiniteElements::inverted);
}

}  // namespace
}  // namespace duet::finite_element_measures_test
