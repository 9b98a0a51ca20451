"""Pulls harder and harder at a hanging weight; lets it go at 400 N, and stops when it lands."""

import duet

scene = duet.Scene(
    {
        "frames": 240,
        "ground": {"height": 0},
        "rigid": [
            {"name": "hook", "shape": {"box": [0.1, 0.1, 0.1]}, "position": [0, 3, 0], "static": True},
            {"name": "weight", "shape": {"box": [0.4, 0.4, 0.4]}, "position": [0, 2, 0], "mass": 20, "restitution": 0},
        ],
        "joints": [
            {"name": "rope", "type": "point", "parent": "hook", "child": "weight", "position": [0, 3, 0]},
        ],
    }
)

pull = speed = 0.0  # N, m/s
landed = None
simulation = scene.simulate()
for frame in simulation:
    if len(frame.contacts) > 0:
        landed = frame.time
        break
    speed = -frame["weight"].velocity[1]
    if "rope" in simulation.joints:
        pull += 20
        simulation.add_force("weight", [0, -pull, 0])
        if pull + 20 * 9.8 > 400:  # what the rope holds, N
            simulation.release("rope")
            print(f"the rope breaks at {frame.time:.3f} s under {pull:.0f} N and the weight")

print(f"the weight has {speed:.2f} m/s in the frame before {landed} s, when it lands")
