"""What a scale of a UsdSkel animation is once it is stored: half precision."""

import json

from pxr import Gf

asked = (1.0005, 1.01, 1.1, 0.9)
stored = [float(Gf.Vec3h(each, each, each)[0]) for each in asked]
worst = max(abs(a - b) / a for a, b in zip(asked, stored, strict=True))
print(json.dumps({"asked": asked, "stored": stored, "largest relative error": worst}))
