"""Pass rules of the hard-case suite: each compares a measured number of a run with a bound, and gives the margin.

The margin of an upper bound is 1 - measured / bound, that of an interval the distance to its nearer end, relative to its
half width: 1 is the best, a negative one fails, and one that is not a number fails.
"""
import ast
import json
import math
import struct


class Finding:
    """What a rule found: passes if the margin is at least 0."""

    def __init__(self, rule, measured, bound, margin):
        self.rule, self.measured, self.bound, self.margin = rule, measured, bound, margin

    @property
    def passes(self):
        return self.margin >= 0  # false for a margin that is not a number


def below(rule, measured, bound):
    if bound == 0:  # counts
        return Finding(rule, measured, "0", 1.0 if measured == 0 else -math.inf)
    return Finding(rule, measured, f"{bound:.3g}", 1 - measured / bound)


def between(rule, measured, ends):
    low, high = ends
    return Finding(rule, measured, f"{low:.4g} to {high:.4g}", min(measured - low, high - measured) / ((high - low) / 2))


def read_statistics(path):
    """The lines of stats.jsonl; a number that is not finite raises ValueError (JSON has none, the program writes null)."""
    def refuse(text):
        raise ValueError(f"stats.jsonl has {text}")

    def visit(value, key):
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            raise ValueError(f"{key} is not finite in stats.jsonl")
        for name, item in value.items() if isinstance(value, dict) else ((key, i) for i in value) if isinstance(value, list) else ():
            visit(item, name)

    lines = [json.loads(line, parse_constant=refuse) for line in path.read_text().splitlines()]
    for line in lines:
        visit(line, "line")
    return lines


class State:
    """Where bodies are at the end of a run: the center of mass of rigid ones, the mean of the points of deformable ones."""

    def __init__(self, run, frame):
        fields = self.read_record(run / "values" / f"{frame:04}.npy")
        bad = [name for name, rows in fields.items() if not all(map(math.isfinite, rows))]
        if bad:
            raise ValueError(f"{bad[0]} is not finite at the end")
        self.position, self.speed, self.points = {}, {}, {}
        rigid = point = 0
        for body in json.loads((run / "manifest.json").read_text())["bodies"]:
            if body["kind"] == "deformable":
                count = body["vertices"]
                flat = fields["point"][3 * point:3 * (point + count)]
                speeds = fields["point_velocity"][3 * point:3 * (point + count)]
                self.position[body["name"]] = [sum(flat[i::3]) / count for i in range(3)]
                self.points[body["name"]] = [flat[i::3] for i in range(3)]
                self.speed[body["name"]] = max(math.hypot(*speeds[i:i + 3]) for i in range(0, 3 * count, 3))
                point += count
            else:
                self.position[body["name"]] = list(fields["position"][3 * rigid:3 * rigid + 3])
                if body["kind"] == "rigid":
                    self.speed[body["name"]] = math.hypot(*fields["velocity"][3 * rigid:3 * rigid + 3])
                rigid += 1

    @staticmethod
    def read_record(path):
        """The fields of a NumPy record as flat tuples of numbers."""
        data = path.read_bytes()
        length = struct.unpack_from("<H", data, 8)[0]
        types, fields, place = ast.literal_eval(data[10:10 + length].decode())["descr"], {}, 10 + length
        for name, code, *shape in types:
            count = math.prod(shape[0]) if shape else 1
            layout = f"<{count}" + {"<f8": "d", "<f4": "f", "<i8": "q"}[code]
            fields[name] = struct.unpack_from(layout, data, place)
            place += struct.calcsize(layout)
        return fields

    def coordinate(self, rule):
        """What a rule of `ends` measures: x, y or z of a body's middle, `bottom` or `top` of its points, or a distance."""
        where = self.position[rule["body"]]
        if "distance" in rule:
            other = rule["from"]
            return math.dist(where, self.position[other] if isinstance(other, str) else other), rule["distance"]
        for axis, letter in enumerate("xyz"):
            if letter in rule:
                return where[axis], rule[letter]
        if "bottom" in rule:
            return min(self.points[rule["body"]][1]), rule["bottom"]
        return max(self.points[rule["body"]][1]), rule["top"]


def energy_rise(lines, first):
    """The largest rise of the energy above an earlier minimum, and the energy that moves: the largest of the kinetic energy,
    the range of the potential and the range of the elastic energy, J."""
    lines = [line for line in lines if line["frame"] >= first]
    rise, least = 0.0, math.inf
    for line in lines:
        energy = line["kinetic"] + line["potential"] + line["elastic"]
        least = min(least, energy)
        rise = max(rise, energy - least)

    def spread(key):
        return max(line[key] for line in lines) - min(line[key] for line in lines)
    return rise, max(max(line["kinetic"] for line in lines), spread("potential"), spread("elastic"))


def momentum_change(lines):
    start = lines[0]["momentum"]
    return max(math.dist(line["momentum"], start) for line in lines)


def judge(rules, lines, state, overlap, plain):
    """The findings of all rules; `plain` is the distance from the unchanged scene, relative to its size."""
    findings, last, first = [], lines[-1], rules.get("from_frame", 0)
    late = [line for line in lines if line["frame"] >= first]
    thickness = rules.get("thickness", 1)
    if "energy" in rules:
        rise, moved = energy_rise(lines, first)
        moved = max(moved, rules.get("energy_scale", 0))
        findings.append(below("energy rise / energy that moves", rise / moved if moved > 0 else 0.0, rules["energy"]))
    if "energy_loss" in rules:
        energies = [line["kinetic"] + line["potential"] + line["elastic"] for line in late]
        findings.append(below("energy loss / energy that moves", (energies[0] - min(energies)) / energy_rise(lines, first)[1], rules["energy_loss"]))
    if "penetration" in rules:
        deepest = max(line["max_penetration"] for line in late)
        findings.append(below("penetration / thickness", deepest / thickness, rules["penetration"]))
    if "overlap" in rules:
        findings.append(below("overlap of surfaces / thickness", overlap / thickness, rules["overlap"]))
    if "kinetic_ever" in rules:
        findings.append(below("kinetic energy, J", max(line["kinetic"] for line in late), rules["kinetic_ever"]))
    if "momentum" in rules:
        findings.append(below("change of momentum, kg m/s", momentum_change(lines), rules["momentum"]))
    if "substeps" in rules:
        findings.append(below("substeps of a frame", max(line["substeps"] for line in lines), rules["substeps"]))
    for key, name in (("kinetic", "kinetic energy at the end, J"), ("inverted", "inverted elements at the end"),
                      ("volume_error", "error of volume at the end"), ("self_intersections", "intersecting triangles at the end")):
        if key in rules:
            findings.append(below(name, last.get(key, 0), rules[key]))
    if "speed" in rules:
        findings.append(below("speed at the end, m/s", max(state.speed.values()), rules["speed"]))
    for rule in rules.get("ends", []):
        measured, ends = state.coordinate(rule)
        what = next(key for key in ("distance", "x", "y", "z", "bottom", "top") if key in rule)
        findings.append(between(f"{what} of {rule['body']}, m", measured, ends))
    if "same" in rules:
        findings.append(below("distance from the plain scene / size", plain, rules["same"]))
    return findings
