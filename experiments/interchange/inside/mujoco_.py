"""MuJoCo: the body as a model of ball joints, the motion as its qpos, and where it puts the bodies."""

import mujoco
import numpy as np
from given import numbers, see

clip = numbers()
children = {}
for joint, parent in enumerate(clip["parents"]):
    children.setdefault(parent, []).append(joint)


def body(joint):
    """A joint and all below it; balls of a centimetre, since what moves must have a mass."""
    place = " ".join(
        map(repr, clip["offsets"][joint] if clip["parents"][joint] >= 0 else [0, 0, 0])
    )
    kind = '<joint type="ball"/>' if clip["parents"][joint] >= 0 else "<freejoint/>"
    inner = "".join(map(body, children.get(joint, [])))
    return (
        f'<body name="{clip["names"][joint]}" pos="{place}">{kind}<geom size=".01"/>{inner}</body>'
    )


model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body(0)}</worldbody></mujoco>")
data = mujoco.MjData(model)
bodies = [model.body(i).name for i in range(1, model.nbody)]
order = [clip["names"].index(name) for name in bodies]
positions, rotations = [], []
for root, turns in zip(clip["root"], np.array(clip["rotations"]), strict=True):
    data.qpos = np.concatenate([root, turns[order][:, [3, 0, 1, 2]].ravel()])
    mujoco.mj_kinematics(model, data)
    positions.append(data.xpos[1:].tolist())
    rotations.append(data.xquat[1:, [1, 2, 3, 0]].tolist())
see(names=bodies, fps=clip["fps"], positions=positions, rotations=rotations)
