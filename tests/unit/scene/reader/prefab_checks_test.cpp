// Mistakes in [parameters], [prefabs] and [[instances]] are refused at their place, in the file and by --set.
#include "sim/scene/reader/prefab_checks.h"

#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/scene/reader/reader.h"

namespace duet::scene::prefab_checks_test {
namespace {

const std::string body = "[[rigid]]\nname = \"a\"\nshape = { box = [1, 1, 1] }\ndensity = 100\n";
const std::string prefab = "[[prefabs.p.rigid]]\nname = \"b\"\nshape = { sphere = 0.1 }\ndensity = 1\n";
const std::string instance = "[[instances]]\nname = \"i\"\nprefab = \"p\"\nposition = [3, 0, 0]\n";

// Returns the texts of all problems, one in each line; empty if the scene is accepted.
std::string problems_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  std::string texts;
  try {
    read_text(text, "s.toml", overrides);
  } catch (const SceneError& error) {
    EXPECT_EQ(error.status(), ExitStatus::usage);
    for (const SceneProblem& problem : error.problems()) texts += problem.text() + "\n";
  }
  return texts;
}

TEST(PrefabChecks, AcceptAnInstanceOfAPrefab) { EXPECT_EQ(problems_of(body + prefab + instance), ""); }

TEST(PrefabChecks, FindListsInSingleBrackets) {
  EXPECT_EQ(problems_of(body + "[prefabs.p.rigid]\nname = \"b\"\n" + instance),
            "s.toml:5:1: prefabs.p.rigid: must be a list of tables [[prefabs.p.rigid]], is a table (write "
            "[[prefabs.p.rigid]] with two brackets above the keys of each element)\n");
  EXPECT_EQ(problems_of(body + prefab + "[instances]\nname = \"i\"\nprefab = \"p\"\n"),
            "s.toml:9:1: instances: must be a list of tables [[instances]], is a table (write [[instances]] "
            "with two brackets above the keys of each element)\n");
  EXPECT_EQ(
      problems_of("[[parameters]]\nsize = 1\n" + body),
      "s.toml:1:1: parameters: must be a table [parameters], is an array of 1 value (write [parameters] "
      "with one bracket above its keys)\n");
}

TEST(PrefabChecks, FindUnknownKeysOfPrefabs) {
  EXPECT_NE(problems_of(body + prefab + "[[prefabs.p.rigit]]\nname = \"c\"\n" + instance)
                .find("s.toml:9:13: prefabs.p.rigit: unknown key (did you mean `rigid`?)"),
            std::string::npos);
  EXPECT_NE(
      problems_of(body + "[prefabs.p]\nfoo = 3\n" + prefab + instance)
          .find("s.toml:6:1: prefabs.p.foo: unknown key (known: parameters, rigid, deformable, joints)"),
      std::string::npos);
  EXPECT_NE(problems_of(body + "[prefabs.p.paramters]\nsize = 3\n" + prefab + instance)
                .find("prefabs.p.paramters: unknown key (did you mean `parameters`?)"),
            std::string::npos);
  EXPECT_NE(problems_of(body + prefab + "[[prefabs.p.instances]]\nname = \"n\"\nprefab = \"q\"\n" + instance)
                .find("s.toml:9:13: prefabs.p.instances: a prefab cannot hold instances of prefabs"),
            std::string::npos);
}

TEST(PrefabChecks, FindValuesInPlaceOfTables) {
  EXPECT_NE(problems_of("prefabs = 3\n" + body).find("s.toml:1:11: prefabs: must be a table"),
            std::string::npos);
  EXPECT_NE(problems_of("instances = 3\n" + body).find("s.toml:1:13: instances: must be a list of tables"),
            std::string::npos);
  // The prefab is not called unknown in addition.
  EXPECT_EQ(problems_of(body + "[prefabs]\np = 3\n" + instance),
            "s.toml:6:5: prefabs.p: must be a table [prefabs.p], is the number 3 (write [prefabs.p] with one "
            "bracket above its keys)\n");
  EXPECT_NE(problems_of(body + "[prefabs.p]\nparameters = 3\n" + prefab + instance)
                .find("prefabs.p.parameters: must be a table [prefabs.p.parameters], is the number 3"),
            std::string::npos);
  EXPECT_NE(problems_of(body + "[prefabs.p.parameters]\nsize = 3\n" + instance)
                .find("prefabs.p: the prefab holds no bodies"),
            std::string::npos);
  EXPECT_NE(problems_of(body + prefab + instance + "set = 3\n")
                .find("s.toml:13:7: instances.i.set: must be a table of parameters, is the number 3"),
            std::string::npos);
  EXPECT_NE(problems_of(body + prefab + instance + "vary = 3\n")
                .find("s.toml:13:8: instances.i.vary: must be a table of parameters, is the number 3"),
            std::string::npos);
  EXPECT_NE(problems_of(body + "repeat = { count = 2, step = [2, 0, 0], advance = 3 }\n")
                .find("rigid.a.repeat.advance: must be a table of numbers, is the number 3"),
            std::string::npos);
}

TEST(PrefabChecks, FindAGridThatScatterWouldReplace) {
  const std::string text =
      problems_of(body + prefab + instance +
                  "grid = [2, 2, 1]\nstep = [1, 1, 1]\n"
                  "scatter = { count = 3, size = [1, 1, 1], lower = [5, 5, 5], upper = [9, 9, 9] }\n");
  EXPECT_NE(text.find("s.toml:13:8: instances.i.grid: has no effect together with `scatter`"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("s.toml:14:8: instances.i.step: has no effect"), std::string::npos) << text;
}

// A misspelled parameter would otherwise be added, and nothing would use it.
TEST(PrefabChecks, FindMisspelledParametersOfOverrides) {
  const std::string text =
      "[parameters]\neach = 3\n" + body + prefab + "[prefabs.p.parameters]\nsize = 1\n" + instance;
  EXPECT_EQ(problems_of(text, {"parameters.each=4", "prefabs.p.parameters.size=2",
                               "prefabs.p.parameters={size=4}", "parameters={each=5}"}),
            "");
  EXPECT_EQ(problems_of(text, {"parameters.eech=4"}),
            "--set: parameters.eech: the scene has no parameter `eech` (did you mean `each`?)\n");
  EXPECT_EQ(problems_of(text, {"parameters={eech=4}"}),
            "--set: parameters: the scene has no parameter `eech` (did you mean `each`?)\n");
  EXPECT_EQ(problems_of(body, {"parameters.each=4"}),
            "--set: parameters.each: the scene has no parameter `each` (it declares none)\n");
  EXPECT_EQ(problems_of(text, {"prefabs.q.parameters.size=4"}),
            "--set: prefabs.q.parameters.size: the scene has no prefab `q` (known: p)\n");
  EXPECT_EQ(
      problems_of(text, {"prefabs.p.parameters.sice=4"}),
      "--set: prefabs.p.parameters.sice: the prefab `p` has no parameter `sice` (did you mean `size`?)\n");
  EXPECT_EQ(problems_of(text, {"prefabs.p.paramters.size=4"}),
            "--set: prefabs.p.paramters: unknown key (did you mean `parameters`?)\n");
  EXPECT_NE(problems_of(text, {"instances.i.set.sice=4"}).find("the prefab has no such parameter"),
            std::string::npos);
  EXPECT_NE(problems_of(text, {"parameters=4"}).find("--set: parameters: must be a table [parameters]"),
            std::string::npos);
}

}  // namespace
}  // namespace duet::scene::prefab_checks_test
