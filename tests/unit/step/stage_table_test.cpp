// The table of stages is complete, in the order of the paper, and the same as in sim/step/README.md.
#include "sim/step/stage_table.h"

#include <algorithm>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/support/places.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/step/world.h"

namespace duet::stage_table_test {
namespace {

// Returns the labels of the stages that run in a scene.
std::vector<std::string> stages_of(const scene::Scene& scene) {
  return Simulation(scene, test::plan(scene)).sizes().stages;
}

// Each stage has one row, whose label is its name everywhere else.
TEST(StageTable, HasOneLabelForEachStage) {
  std::set<std::string_view> labels;
  for (const StageRow& row : stage_table) {
    EXPECT_EQ(row.label, name(row.stage));
    labels.insert(row.label);
  }
  EXPECT_EQ(labels.size(), stage_count);
}

// A row of a step either does work or checks the length of the step, and the rows that run within others do
// neither.
TEST(StageTable, GivesEveryStageOfAStepWorkOrACheck) {
  for (const StageRow& row : stage_table) {
    const bool acts = row.work != nullptr, checks = row.is_too_long != nullptr;
    EXPECT_EQ(acts != checks, row.timing == Timing::by_step) << row.label;
  }
}

// The stages with numbers are those of the paper in its order, except that V.1 comes after V.3, which the
// README marks with `[~]`.
TEST(StageTable, HasTheNumbersOfThePaperInTheirOrder) {
  std::vector<std::string> numbers;
  for (const StageRow& row : stage_table) {
    const std::string number(row.label.substr(0, row.label.find(' ')));
    if (number.find('.') != std::string::npos &&
        std::find(numbers.begin(), numbers.end(), number) == numbers.end())
      numbers.push_back(number);
  }
  EXPECT_EQ(numbers, (std::vector<std::string>{"I.1", "I.2", "I.3", "II.1", "II.2", "II.3", "III.1", "III.2",
                                               "III.3", "IV.1", "IV.2", "IV.3", "V.2", "V.3", "V.1", "V.4"}));
}

// The README's table lists the stages of a step with their origin and label, in their order, with functions
// that exist.
TEST(StageTable, IsTheTableOfTheReadme) {
  const std::string page = io::read_file(test::source_folder() + "/sim/step/README.md");
  const std::regex line(R"(\| `\[(.)\]` \| [^|]+ \| `([^`]+)` \| `([a-z_]+)` \|)");
  std::vector<std::string> told, held;
  std::set<std::string> functions;
  for (std::sregex_iterator row(page.begin(), page.end(), line), end; row != end; ++row) {
    told.push_back((*row)[1].str() + " " + (*row)[2].str());
    functions.insert((*row)[3]);
  }
  for (const StageRow& row : stage_table)
    if (row.timing == Timing::by_step)
      held.push_back(std::string(1, static_cast<char>(row.origin)) + " " + std::string(row.label));
  EXPECT_EQ(told, held);
  const std::string stages = io::read_file(test::source_folder() + "/sim/step/stages.h");
  for (const std::string& function : functions)
    EXPECT_NE(stages.find(" " + function + "("), std::string::npos) << function;
  for (const StageRow& row : stage_rows) {
    if (row.timing != Timing::within_others) continue;
    EXPECT_NE(page.find("`" + std::string(row.label) + "`"), std::string::npos) << row.label;
  }
}

// Each row that needs effects runs if one of them is planned, and does not run without any.
TEST(StageTable, EntersRowsByTheirEffects) {
  World world;
  for (const StageRow& row : stage_table) {
    if (row.needs.any == 0 || row.needs.when || row.timing != Timing::by_step) continue;
    world.settings.constraints_before_solve = row.needs.order == ConstraintOrder::before_solve;
    world.plan.reset();
    EXPECT_FALSE(runs(row, world)) << row.label;
    for (int effect = 0; effect < effect_count; ++effect) {
      world.plan.reset();
      world.plan[static_cast<std::size_t>(effect)] = true;
      EXPECT_EQ(runs(row, world), (row.needs.any & mask(static_cast<Effect>(effect))) != 0) << row.label;
    }
  }
}

// A scene with one rigid ball runs the stages of rigid contact and nothing for deformable bodies.
TEST(StageTable, OfABallOverTheGroundIsShort) {
  scene::Scene scene = test::on_ground();
  test::add_ball(scene, "ball", Vec3(0, 2, 0), 1, 10);
  EXPECT_EQ(stages_of(scene),
            (std::vector<std::string>{"I.1 advance velocity", "II contact candidates", "II back to v^n",
                                      "II.1 collisions", "II.3 re-evolution", "III.1 contact graph",
                                      "III.1 warm start", "III.3 contact and pre-stabilization",
                                      "IV.1 advance position", "IV.2 interpenetration resolution",
                                      "IV.3 back to v^^n", "V.2 forces of the middle", "V.3 re-evaluation",
                                      "V.4 contacts at the end", "V.4 contact and post-stabilization"}));
}

// The two orders of step V differ only in the constraints and the solve for damping. Before these they have
// the same stages, and after them the same V.4.
TEST(StageTable, BothOrdersShareBeginningAndConstraints) {
  scene::Scene scene = test::on_ground();
  test::add_soft_box(scene, "box", Vec3(0, 1, 0), Vec3(1, 1, 1), 2).incompressible = true;
  const std::vector<std::string> after = stages_of(scene);
  scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
  const std::vector<std::string> before = stages_of(scene);
  const auto from = [](const std::vector<std::string>& all, const char* first) {
    return std::vector<std::string>(std::find(all.begin(), all.end(), first), all.end());
  };
  EXPECT_EQ(from(after, "V spin at the start"),
            (std::vector<std::string>{"V spin at the start", "V.2 constraints", "V.2 forces of the middle",
                                      "V.2 constrained solve", "V.3 re-evaluation", "V.1 make incompressible",
                                      "V spin", "V.4 contacts at the end",
                                      "V.4 contact and post-stabilization", "V.4 keep volume"}));
  EXPECT_EQ(from(before, "V spin at the start"),
            (std::vector<std::string>{"V spin at the start", "V.2 forces of the middle", "V.3 re-evaluation",
                                      "V.4 contacts at the end", "V.4 contact and post-stabilization",
                                      "V.4 damping", "V.1 make incompressible", "V spin"}));
  EXPECT_EQ(std::vector<std::string>(after.begin(), std::find(after.begin(), after.end(), "V.2 constraints")),
            std::vector<std::string>(before.begin(),
                                     std::find(before.begin(), before.end(), "V.2 forces of the middle")));
}

// Statistics list all stages by their labels, also those that a scene does not run.
TEST(StageTable, StatisticsHaveItsNamesInItsOrder) {
  const scene::Scene scene = test::on_ground();
  const std::vector<StageStats> stages = Simulation(scene, test::plan(scene)).stats().stages;
  ASSERT_EQ(stages.size(), stage_count);
  for (std::size_t i = 0; i < stages.size(); ++i) EXPECT_EQ(stages[i].name, stage_rows[i].label);
}

}  // namespace
}  // namespace duet::stage_table_test
