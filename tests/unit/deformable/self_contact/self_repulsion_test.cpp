#include "sim/deformable/self_contact/self_repulsion.h"

#include <algorithm>

#include "tests/support/sheets.h"
#include <gtest/gtest.h>

namespace duet::self_repulsion_test {
namespace {

using test::Sheets;

constexpr double thickness = 0.02, dt = 1e-3;

// Returns two sheets, one over the other at a distance of `gap` (m), whose diagonals cross.
Sheets layers(double gap, double friction = 0) {
  Sheets sheets;
  sheets.add(4, 0.1, Vec3(0, 0, 0), thickness, friction);
  sheets.add(3, 0.1, Vec3(0.04, gap, 0.03), thickness, friction);
  return sheets;
}

// Finds the repulsion pairs of the sheets as they lie.
SelfRepulsion pairs_of(const Sheets& sheets) {
  CollisionCandidates candidates;
  candidates.update(sheets.surface, sheets.x, sheets.x);
  SelfRepulsion repulsion;
  repulsion.find(candidates, sheets.x, sheets.inverse_mass, {}, {});
  return repulsion;
}

// Returns velocities of the particles such that each sheet moves as a whole.
std::vector<Vec3> velocities(const Sheets& sheets, const Vec3& lower, const Vec3& upper) {
  std::vector<Vec3> v(sheets.x.size(), upper);
  std::fill(v.begin(), v.begin() + 25, lower);
  return v;
}

// Applies the inelastic impulses to the velocities of the sheets.
void apply_once(SelfRepulsion& repulsion, const Sheets& sheets, std::vector<Vec3>& v) {
  std::vector<Vec3> friction;
  repulsion.apply(dt, sheets.x, sheets.inverse_mass, v, friction);
}

// Pairs nearer than 1.1 thicknesses are found, each with its distance. Elements of one sheet that are as near
// as that at rest are not: they would be blown apart.
TEST(SelfRepulsion, FindsPairsInRangeExceptNeighborsAtRest) {
  EXPECT_TRUE(pairs_of(layers(1.11 * thickness)).pairs().empty());
  const Sheets near = layers(1.09 * thickness);
  const SelfRepulsion repulsion = pairs_of(near);
  // All 16 particles of the upper sheet are over the lower one, and 9 of the lower sheet are under the upper
  // one.
  const auto points =
      std::count_if(repulsion.pairs().begin(), repulsion.pairs().end(),
                    [](const RepulsionPair& p) { return p.weight[0] == 1 && p.weight[1] < 0; });
  EXPECT_EQ(points, 16 + 9);
  for (const RepulsionPair& pair : repulsion.pairs()) EXPECT_NEAR(pair.distance, 1.09 * thickness, 1e-15);
  Sheets fine;  // its thickness is more than the size of its triangles
  fine.add(4, 0.1, Vec3::Zero(), 0.15);
  EXPECT_TRUE(pairs_of(fine).pairs().empty());
}

// The fastest approach that repulsions leave is min(0, (h - gap) / dt): sheets nearer than the thickness h
// come no nearer, and others come as near as h within the step.
TEST(SelfRepulsion, StopsApproachAtTheThickness) {
  for (const double gap : {0.5 * thickness, 1.05 * thickness}) {
    const Sheets sheets = layers(gap);
    SelfRepulsion repulsion = pairs_of(sheets);
    std::vector<Vec3> v = velocities(sheets, Vec3::Zero(), Vec3(0.3, -2, 0));
    for (int i = 0; i < 200; ++i) apply_once(repulsion, sheets, v);
    const double least = std::min(0.0, (thickness - gap) / dt);
    double nearest = 1;
    for (const RepulsionPair& pair : repulsion.pairs())
      nearest = std::min(nearest, relative_velocity(pair, v).dot(pair.normal));
    EXPECT_NEAR(nearest, least, 1e-9);
    // Pairs that separate already are left alone.
    const std::vector<Vec3> parting = velocities(sheets, Vec3::Zero(), Vec3(1, 2, 0));
    std::vector<Vec3> after = parting;
    apply_once(repulsion, sheets, after);
    EXPECT_EQ(after, parting);
  }
}

// The rows of a solve are pairs about as near as h that would come nearer than h in the step. Their target
// lets them go a tenth of the distance.
TEST(SelfRepulsion, RowsAreThoseThatWouldComeTooNear) {
  struct Case {
    double gap, mean;  // in thicknesses; in speeds that lead to the thickness within the step
    bool is_row;
  };
  for (const Case& c : {Case{0.5, 0.1, true}, Case{1.0005, 1.1, true}, Case{1.0005, 0.4, false},
                        Case{1.01, 1.1, false}, Case{1.0005, -1, false}}) {
    const double gap = c.gap * thickness, way = std::abs(thickness - gap) / dt;
    const Sheets sheets = layers(gap);
    SelfRepulsion repulsion = pairs_of(sheets);
    const std::vector<Vec3> start(sheets.x.size(), Vec3::Zero());
    const std::vector<Vec3> mean = velocities(sheets, Vec3::Zero(), Vec3(0, -c.mean * way, 0));
    repulsion.activate_rows(dt, 0.5, start, mean);
    for (const RepulsionPair& pair : repulsion.pairs()) {
      EXPECT_EQ(pair.active, c.is_row);
      if (c.is_row) {
        EXPECT_NEAR(pair.target, c.gap < 1 ? 0 : -0.05 * way, 1e-12 * way);
      }
    }
    std::vector<Vec3> end = velocities(sheets, Vec3::Zero(), Vec3(0, -2 * way, 0));
    for (int i = 0; i < 200; ++i) apply_once(repulsion, sheets, end);
    double nearest = 1;
    for (const RepulsionPair& pair : repulsion.pairs())
      nearest = std::min(nearest, relative_velocity(pair, end).dot(pair.normal));
    EXPECT_NEAR(nearest, c.gap < 1 ? 0 : c.is_row ? -0.1 * way : -way, 1e-9 * way);
  }
}

// The elastic part separates sheets at a tenth of what is missing to the thickness in each step.
TEST(SelfRepulsion, ElasticPartRecoversATenthOfWhatIsMissing) {
  const double gap = 0.6 * thickness;
  const Sheets sheets = layers(gap);
  SelfRepulsion repulsion = pairs_of(sheets);
  std::vector<Vec3> v(sheets.x.size(), Vec3::Zero());
  for (int i = 0; i < 5000; ++i) repulsion.apply_elastic(dt, sheets.inverse_mass, v);  // until it converges
  double slowest = 1e9;
  for (const RepulsionPair& pair : repulsion.pairs())
    slowest = std::min(slowest, relative_velocity(pair, v).dot(pair.normal));
  EXPECT_NEAR(slowest, 0.1 * (thickness - gap) / dt, 1e-6);
}

// Returns the kinetic energy (J) of velocities.
double kinetic(const Sheets& sheets, const std::vector<Vec3>& v) {
  double sum = 0;
  for (std::size_t p = 0; p < v.size(); ++p) sum += 0.5 * v[p].squaredNorm() / sheets.inverse_mass[p];
  return sum;
}

// The inelastic impulses of surfaces that press each other change velocities the least that they can: they
// take as much energy as the change of velocities has. Where meshes coincide, several pairs have the same
// particles; when no visit took back what earlier ones had given, these sheets had 3 to 23 % of their energy
// too much. What is left is the error at which sweeps end.
TEST(SelfRepulsion, PressedSurfacesDoNotRebound) {
  std::mt19937 random(5);
  for (const double offset : {0.0, 0.003, 0.04}) {
    Sheets sheets;
    sheets.add(4, 0.1, Vec3(0, 0, 0), thickness);
    sheets.add(4, 0.1, Vec3(offset, 0.9 * thickness, 0.7 * offset), thickness);
    SelfRepulsion repulsion = pairs_of(sheets);
    for (int trial = 0; trial < 20; ++trial) {
      std::vector<Vec3> v = velocities(sheets, Vec3::Zero(), Vec3(0, -1, 0)), start, change;
      for (Vec3& velocity : v) velocity += 0.5 * test::random_vector(random);
      start = change = v;
      apply_once(repulsion, sheets, v);
      for (std::size_t p = 0; p < v.size(); ++p) change[p] = v[p] - start[p];
      EXPECT_GT(kinetic(sheets, change), 0.1 * kinetic(sheets, start));
      EXPECT_NEAR((kinetic(sheets, v) + kinetic(sheets, change)) / kinetic(sheets, start), 1, 0.015);
    }
  }
}

// Friction of a repulsion follows Coulomb's law: slow slip nearly stops, fast slip loses the friction
// coefficient times the change of normal velocity.
TEST(SelfRepulsion, FrictionStopsSlowSlipAndOnlySlowsFastSlip) {
  const Sheets sheets = layers(0.5 * thickness, 0.5);
  SelfRepulsion repulsion = pairs_of(sheets);
  const auto slip_after = [&](double slip) {
    std::vector<Vec3> v = velocities(sheets, Vec3::Zero(), Vec3(slip, -1, 0));
    apply_once(repulsion, sheets, v);
    Vec3 upper = Vec3::Zero(), lower = Vec3::Zero();
    double upper_mass = 0, lower_mass = 0;
    for (std::size_t p = 0; p < v.size(); ++p) {
      const double mass = 1 / sheets.inverse_mass[p];
      (p < 25 ? lower : upper) += mass * v[p];
      (p < 25 ? lower_mass : upper_mass) += mass;
    }
    return std::array{upper.x() / upper_mass - lower.x() / lower_mass, 1 + upper.y() / upper_mass};
  };
  EXPECT_LT(std::abs(slip_after(0.1)[0]), 0.03);  // within the cone, sweeps take nearly all of it
  // A fast slip decreases, by Coulomb's law, by the friction coefficient times the change of the normal
  // velocity. The lower sheet has the same fractions of both, so the ratio of the upper sheet's impulses is
  // exact.
  std::vector<Vec3> v = velocities(sheets, Vec3::Zero(), Vec3(100, -1, 0));
  apply_once(repulsion, sheets, v);
  Vec3 impulse = Vec3::Zero();
  for (std::size_t p = 25; p < v.size(); ++p) impulse += (v[p] - Vec3(100, -1, 0)) / sheets.inverse_mass[p];
  // Pairs whose points are not above the center of mass of the other element also exchange normal momentum
  // when their angular momentum is kept: a fraction of the order of (gap / edge)^2.
  EXPECT_NEAR(-impulse.x() / impulse.y(), 0.5, 0.005);
}

// Adds a triangle of three particles of 1 kg as a surface of its own.
void add_triangle(Sheets& sheets, double friction, const Vec3& a, const Vec3& b, const Vec3& c) {
  const int first = static_cast<int>(sheets.x.size());
  for (const Vec3& x : {a, b, c}) sheets.x.push_back(x);
  sheets.inverse_mass.resize(sheets.x.size(), 1);
  const std::vector<Triangle> triangles{{first, first + 1, first + 2}};
  sheets.surface.add({true, thickness, friction}, triangles, {});
  sheets.surface.finish(sheets.x);
}

// The two impulses of friction act on two surfaces at a distance from each other. To keep the angular
// momentum, the particles of the pair are turned back, which took 0.5 to 6 % of the friction here. Friction
// makes up for it, so that the impulses of a pair are on the edge of the cone: to rounding for a point over a
// face. Edges that cross at 60 degrees also turn the direction of the slip between two sweeps.
TEST(SelfRepulsion, FrictionOfAPairIsTheWholeOfCoulombs) {
  constexpr double friction = 0.4, side = 0.1, deep = 0.2;
  for (const double gap : {0.3 * thickness, 0.9 * thickness})
    for (const double degrees :
         {0.0, 90.0, 60.0}) {  // angle between edges that cross; 0: a point over a face
      SCOPED_TRACE(testing::Message() << "gap " << gap << ", " << degrees << " degrees");
      Sheets sheets;
      const Vec3 up = gap * Vec3::UnitY(), far = deep * Vec3::UnitY();
      const auto corner = [&](double angle) {
        return Vec3(side * Vec3(std::cos(angle), 0, std::sin(angle)) / std::sqrt(3.0));
      };
      const double third = 2 * EIGEN_PI / 3, turn = degrees * EIGEN_PI / 180;
      if (degrees == 0) {
        add_triangle(sheets, friction, corner(0.2), corner(0.2 - third), corner(0.2 + third));
        add_triangle(sheets, friction, up, up + far + side * Vec3::UnitX(), up + far - side * Vec3::UnitX());
      } else {
        const Vec3 half = side / 2 * Vec3(std::cos(turn), 0, std::sin(turn));
        add_triangle(sheets, friction, side / 2 * Vec3::UnitX(), -side / 2 * Vec3::UnitX(), -far);
        add_triangle(sheets, friction, up + half, up - half, up + far);
      }
      SelfRepulsion repulsion = pairs_of(sheets);
      ASSERT_EQ(repulsion.pairs().size(), 1U);
      const Vec3 before(30, -1, 40);
      std::vector<Vec3> v(sheets.x.size(), Vec3::Zero());
      std::fill(v.begin() + 3, v.end(), before);
      apply_once(repulsion, sheets, v);
      Vec3 impulse = Vec3::Zero();
      for (std::size_t p = 3; p < v.size(); ++p) impulse += v[p] - before;
      EXPECT_GT(impulse.y(), 0.1);
      EXPECT_NEAR(Vec3(impulse.x(), 0, impulse.z()).norm() / impulse.y(), friction,
                  degrees == 60 ? 1e-5 : 1e-12);
    }
}

// Impulses and the elastic part keep linear and angular momentum.
TEST(SelfRepulsion, KeepsMomentum) {
  std::mt19937 random(3);
  const Sheets sheets = layers(0.5 * thickness, 0.5);
  SelfRepulsion repulsion = pairs_of(sheets);
  std::vector<Vec3> v(sheets.x.size());
  for (Vec3& velocity : v) velocity = test::random_vector(random);
  const auto momentum = [&] {
    std::vector<Vec3> end = sheets.x;
    for (std::size_t p = 0; p < end.size(); ++p) end[p] += v[p];
    return test::momentum_of(sheets.x, end, sheets.inverse_mass);
  };
  const auto before = momentum();
  const std::vector<Vec3> start = v;
  apply_once(repulsion, sheets, v);
  repulsion.apply_elastic(dt, sheets.inverse_mass, v);
  EXPECT_NE(v, start);
  const auto after = momentum();
  EXPECT_LE((after.first - before.first).norm(), 1e-12);
  EXPECT_LE((after.second - before.second).norm(), 1e-12);
}

// A sweep over the rows is self-adjoint in the mass inner product and adds no energy, as the projection of a
// solve has to be; repeated sweeps reach the targets.
TEST(SelfRepulsion, RowsProjectSelfAdjointly) {
  std::mt19937 random(4);
  const Sheets sheets = layers(0.5 * thickness);
  SelfRepulsion repulsion = pairs_of(sheets);
  const auto random_field = [&] {
    std::vector<Vec3> v(sheets.x.size());
    for (Vec3& velocity : v) velocity = test::random_vector(random);
    return v;
  };
  const auto inner = [&](const std::vector<Vec3>& u, const std::vector<Vec3>& v) {
    double sum = 0;
    for (std::size_t p = 0; p < u.size(); ++p) sum += u[p].dot(v[p]) / sheets.inverse_mass[p];
    return sum;
  };
  const std::vector<Vec3> start = velocities(sheets, Vec3::Zero(), Vec3(0.1, -1, 0));
  std::vector<Vec3> velocity = velocities(sheets, Vec3::Zero(), Vec3(0, -2, 0));
  repulsion.activate_rows(1, 0.5, start, velocity);
  for (const RepulsionPair& pair : repulsion.pairs()) {
    EXPECT_TRUE(pair.active);
    EXPECT_NEAR(pair.target, -0.5, 1e-14);
  }
  const std::vector<Vec3> u = random_field(), v = random_field();
  std::vector<Vec3> Pu = u, Pv = v;
  repulsion.sweep(ProjectTo::zero, sheets.inverse_mass, Pu);
  repulsion.sweep(ProjectTo::zero, sheets.inverse_mass, Pv);
  EXPECT_NEAR(inner(Pu, v), inner(u, Pv), 1e-12 * std::sqrt(inner(u, u) * inner(v, v)));
  EXPECT_LT(inner(Pu, Pu), inner(u, u));
  for (int i = 0; i < 5000; ++i) repulsion.sweep(ProjectTo::targets, sheets.inverse_mass, velocity);
  for (const RepulsionPair& pair : repulsion.pairs())
    EXPECT_NEAR(relative_velocity(pair, velocity).dot(pair.normal), -0.5, 1e-6);
}

}  // namespace
}  // namespace duet::self_repulsion_test
