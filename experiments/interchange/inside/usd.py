"""UsdSkel: a skeleton and its animation into a .usdc file, and what UsdSkel computes from the file."""

from given import FOLDER, WAY, numbers, see
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

clip = numbers()
stage = Usd.Stage.CreateNew(str(FOLDER / "clip.usdc"))
UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
UsdGeom.SetStageMetersPerUnit(stage, 1.0)
stage.SetTimeCodesPerSecond(clip["fps"])
paths = []
for name, parent in zip(clip["names"], clip["parents"], strict=True):
    paths.append(f"{paths[parent]}/{name}" if parent >= 0 else name)
still = [Gf.Matrix4d().SetTranslate(Gf.Vec3d(offset)) for offset in clip["offsets"]]
there = []
for matrix, parent in zip(still, clip["parents"], strict=True):
    there.append(matrix * there[parent] if parent >= 0 else matrix)
UsdSkel.Root.Define(stage, "/Body")
skeleton = UsdSkel.Skeleton.Define(stage, "/Body/Skeleton")
skeleton.CreateJointsAttr(paths)
skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray(still))
skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray(there))
motion = UsdSkel.Animation.Define(stage, "/Body/Motion")
motion.CreateJointsAttr(paths)
places, turns = motion.CreateTranslationsAttr(), motion.CreateRotationsAttr()
for frame, (root, rotations) in enumerate(zip(clip["root"], clip["rotations"], strict=True)):
    places.Set([Gf.Vec3f(*offset) for offset in [root, *clip["offsets"][1:]]], frame)
    turns.Set(Vt.QuatfArray([Gf.Quatf(w, x, y, z) for x, y, z, w in rotations]), frame)
if WAY == "with scales":
    motion.CreateScalesAttr([Gf.Vec3h(1, 1, 1)] * len(paths))
UsdSkel.BindingAPI.Apply(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets(
    [motion.GetPath()]
)
stage.SetStartTimeCode(0)
stage.SetEndTimeCode(len(clip["root"]) - 1)
stage.Save()

stage = Usd.Stage.Open(str(FOLDER / "clip.usdc"))
query = UsdSkel.Cache().GetSkelQuery(UsdSkel.Skeleton.Get(stage, "/Body/Skeleton"))
positions, rotations = [], []
for frame in range(int(stage.GetStartTimeCode()), int(stage.GetEndTimeCode()) + 1):
    places = query.ComputeJointSkelTransforms(frame)
    positions.append([list(place.ExtractTranslation()) for place in places])
    turned = [place.ExtractRotationQuat() for place in places]
    rotations.append([[*each.GetImaginary(), each.GetReal()] for each in turned])
names = [str(path).split("/")[-1] for path in query.GetJointOrder()]
see(names=names, fps=stage.GetTimeCodesPerSecond(), positions=positions, rotations=rotations)
