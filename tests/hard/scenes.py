"""Cases of the hard-case suite: reads families of cases, fills in their parameters, and changes and writes scenes.

A family is a file tests/hard/NAME.toml (README.md beside this file describes its keys). A text that begins with "=" is an
arithmetic expression of the parameters: "=0.5 * size". In the text of a file it stands in angle brackets: <=0.5 * size>.
"""
import ast
import copy
import itertools
import json
import math
import operator
import re
import tomllib

OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
             ast.Pow: operator.pow, ast.USub: operator.neg, ast.Mod: operator.mod, ast.FloorDiv: operator.floordiv}
FUNCTIONS = {"sqrt": math.sqrt, "sin": math.sin, "cos": math.cos, "tan": math.tan, "radians": math.radians, "exp": math.exp,
             "min": min, "max": max, "int": int, "log10": math.log10}


def evaluate(text, values):
    """The number of an arithmetic expression; no other Python is understood."""
    def of(node):
        if isinstance(node, ast.Expression):
            return of(node.body)
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
            return node.value
        if isinstance(node, ast.Name) and node.id in values:
            return values[node.id]
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            return OPERATORS[type(node.op)](of(node.left), of(node.right))
        if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
            return OPERATORS[type(node.op)](of(node.operand))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS:
            return FUNCTIONS[node.func.id](*(of(a) for a in node.args))
        raise ValueError(f"no arithmetic expression of {', '.join(sorted(values))}: {text!r}")
    return of(ast.parse(text, mode="eval"))


def fill(value, values):
    """A copy of a TOML value with all expressions replaced by their numbers."""
    if isinstance(value, str) and value.startswith("="):
        name = value[1:].strip()
        return values[name] if name in values else evaluate(name, values)
    if isinstance(value, dict):
        return {key: fill(item, values) for key, item in value.items()}
    if isinstance(value, list):
        return [fill(item, values) for item in value]
    return value


def written(value):
    """The value as inline TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, list):
        return "[" + ", ".join(written(v) for v in value) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(k)} = {written(v)}" for k, v in value.items()) + " }"
    return repr(value)


def scene_text(scene):
    return "".join(f"{key} = {written(value)}\n" for key, value in scene.items())


class Instance:
    """One run of a case: its parameters have values."""

    def __init__(self, family, case, parameters, knob_value):
        self.case, self.knob_value = case, knob_value
        self.values = {}
        for key, value in (family.get("parameters", {}) | case.get("parameters", {}) | parameters).items():
            self.values[key] = fill(value, self.values)
        rules = family.get("rules", {}) | case.get("rules", {})
        self.rules = {key: value for key, value in fill(rules, self.values).items() if value is not False}
        self.outcome = case.get("outcome", family.get("outcome", "done"))
        self.says = case.get("says", [])
        self.frames = fill(case.get("frames", family.get("frames", 24)), self.values)
        self.seconds = case.get("seconds", family.get("seconds", 20))
        self.files = {name: re.sub(r"<=([^>]+)>", lambda found: repr(evaluate(found[1], self.values)), text)
                      for name, text in family.get("files", {}).items()}
        self.shipped, self.changes = case.get("shipped"), fill(case.get("set", {}), self.values)
        self.scene, self.change = None, fill(case.get("change"), self.values)
        if not self.shipped:
            self.scene = fill(family["scenes"][case.get("scene", case["name"])], self.values) | {"frames": self.frames}
        self.limit = self.known_limit(case.get("known_limit"), parameters)

    @staticmethod
    def known_limit(limits, parameters):
        """The sentence of the known limit that the instance is in, or nothing."""
        for limit in [{"why": limits}] if isinstance(limits, str) else limits or []:
            wanted = {key: value if isinstance(value, list) else [value] for key, value in limit.items() if key != "why"}
            if all(parameters.get(key) in value for key, value in wanted.items()):
                return limit["why"]
        return ""


class Row:
    """A case with a value for each of its parameters but the knob: a row of the table."""

    def __init__(self, family_name, family, case, chosen):
        self.family, self.case, self.chosen = family, case, chosen
        self.name = "/".join([family_name, case["name"], *(str(v) for v in chosen.values())])
        self.knob = case.get("knob")

    def instance(self, knob_value):
        knob = {self.knob["name"]: knob_value} if self.knob else {}
        return Instance(self.family, self.case, self.chosen | knob, knob_value)

    def knob_values(self, quick):
        """The values of the knob, [None] without one; with `quick` those of the quick selection, perhaps none."""
        values = self.knob["values"] if self.knob else [None]
        if not quick:
            return values
        chosen = self.case.get("quick", False)
        return values if chosen is True else chosen or []


def read_family(path):
    family = tomllib.loads(path.read_text())
    for case in family["case"]:
        each = case.get("each", {})
        for values in itertools.product(*each.values()):
            yield Row(path.stem, family, case, dict(zip(each, values)))


# --- Changes of a whole scene ---

def times(a, b):
    """Product of two quaternions w, x, y, z."""
    return [a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]]


def quaternion(rotation):
    if not rotation:
        return [1.0, 0.0, 0.0, 0.0]
    half, length = math.radians(rotation["degrees"]) / 2, math.hypot(*rotation["axis"])
    return [math.cos(half)] + [math.sin(half) * a / length for a in rotation["axis"]]


def turned(q, v):
    return times(times(q, [0.0, *v]), [q[0], -q[1], -q[2], -q[3]])[1:]


class Change:
    """A change under which physics is the same: p' = scale * rotate(mirror(p)) + move.

    `rotate = { axis, degrees }`, `move = [x, y, z]`, `mirror = true` (x to -x), `permute = true` (bodies in reverse order),
    `scale = s`: lengths by s and times by sqrt(s), so that gravity stays (Froude); densities stay, so that moduli go with s.
    """

    def __init__(self, table):
        self.q = quaternion(table.get("rotate"))
        self.shift, self.mirror = table.get("move", [0, 0, 0]), table.get("mirror", False)
        self.permute, self.scale = table.get("permute", False), table.get("scale", 1)

    def vector(self, v, factor=1.0):
        return [factor * c for c in turned(self.q, [-v[0], *v[1:]] if self.mirror else v)]

    def point(self, p):
        return [a + b for a, b in zip(self.vector(p, self.scale), self.shift)]

    def axial(self, w, factor=1.0):
        """An angular velocity or axis, which a mirror turns the other way round."""
        return [factor * c for c in turned(self.q, [w[0], -w[1], -w[2]] if self.mirror else w)]

    def rotation(self, table):
        """The orientation of a body. The shapes of these scenes are their own mirror images."""
        q = quaternion(table)
        q = times(self.q, [q[0], q[1], -q[2], -q[3]] if self.mirror else q)
        length = math.hypot(*q[1:])
        return {"axis": q[1:] if length else [1.0, 0.0, 0.0], "degrees": math.degrees(2 * math.atan2(length, q[0]))}

    def body(self, body):
        time = math.sqrt(self.scale)
        body["position"] = self.point(body.get("position", [0, 0, 0]))
        body["rotation"] = self.rotation(body.get("rotation"))
        if "velocity" in body:
            body["velocity"] = self.vector(body["velocity"], self.scale / time)
        if "angular_velocity" in body:
            body["angular_velocity"] = self.axial(body["angular_velocity"], 1 / time)
        if "mass" in body:
            body["mass"] *= self.scale ** 3
        for key in ("sphere", "box", "spacing"):
            if key in body["shape"]:
                size = body["shape"][key]
                body["shape"][key] = [self.scale * s for s in size] if isinstance(size, list) else self.scale * size

    def apply(self, scene):
        scene, time = copy.deepcopy(scene), math.sqrt(self.scale)
        for kind in ("rigid", "deformable"):
            for body in scene.get(kind, []):
                self.body(body)
            if self.permute and kind in scene:
                scene[kind].reverse()
        for material in scene.get("materials", {}).values():
            material["youngs_modulus"] *= self.scale
            material["damping"] = material.get("damping", 0.01) * time
        scene["gravity"] = self.vector(scene.get("gravity", [0, -9.8, 0]))
        scene["fps"] = scene.get("fps", 24) / time
        solver = scene.setdefault("solver", {})
        solver["max_time_step"] = solver.get("max_time_step", 0.5 / 24) * time
        solver["cg_tolerance"] = solver.get("cg_tolerance", 0.001) * self.scale / time
        return scene
